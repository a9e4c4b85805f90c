#include "unwrap/charts.h"

#include "base/memory.h"
#include "geometry/edges.h"

#include <stdlib.h>
#include <string.h>

/* Cosines of angles between normals. CREASE, 50°: cuts a chart; the sides of a column of eight faces are 45°
 * apart. SMOOTH, 127°: the same where shading normals continue over the edge, as of a bar of three sides.
 * PLANE, 0.06°: one plane, whose projection is stretched by 1 + 5e-7. QUAD, 26°: halves of a bent quad, found
 * by shape. SEAM, 10° between shading normals of a vertex: modelled as an edge. */
static const double CREASE = 0.64, SMOOTH = -0.6, PLANE = 0.9999995, QUAD = 0.9, SEAM = 0.985;

double vshi_cut_mesh_bytes(const vsh_mesh *mesh) {
    /* 170 a triangle, of which geometry/edges.c gives 130 back; then patches, trials and their equations */
    return (170.0 + 420.0) * (double)mesh->triangle_count + 40.0 * (double)mesh->vertex_count;
}

static void measure(vshi_cut_mesh *s) {
    const vsh_mesh *mesh = s->mesh;
    double m[12];
    if (mesh->transform != NULL) {
        memcpy(m, mesh->transform, sizeof m);
        m[3] = m[7] = m[11] = 0.0;
    }
    double most = 0.0;
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        const vshi_vec p =
            vshi_transform_point(mesh->transform != NULL ? m : NULL, vshi_vec_off(mesh->positions + 3 * v));
        most = fmax(most, fmax(fabs(p.x), fmax(fabs(p.y), fabs(p.z))));
        s->place[v] = p;
    }
    int exponent = 0;
    frexp(most, &exponent);
    s->scale = ldexp(1.0, exponent);
    for (size_t v = 0; v < mesh->vertex_count; ++v) { /* so that no square leaves the range of doubles */
        s->place[v] = (vshi_vec){ldexp(s->place[v].x, -exponent), ldexp(s->place[v].y, -exponent),
                                 ldexp(s->place[v].z, -exponent)};
    }
    for (size_t i = 0; i < s->count; ++i) {
        vshi_vec p[3];
        vshi_cut_mesh_corners(s, i, p);
        const vshi_vec cross = vshi_cross(vshi_sub(p[1], p[0]), vshi_sub(p[2], p[0]));
        const double area = 0.5 * vshi_length(cross);
        s->normal[i] = vshi_unit(cross);
        /* triangles flattened by a transform or by the range of doubles have no place either */
        s->area[i] = vshi_mesh_degenerate(mesh, i) || !(area > 0.0) || !isfinite(area) ? 0.0 : area;
    }
}

static bool same_uv(const float *uvs, uint32_t a, uint32_t b) {
    return uvs == NULL || a == b ||
           (uvs[2 * (size_t)a] == uvs[2 * (size_t)b] && uvs[2 * (size_t)a + 1] == uvs[2 * (size_t)b + 1]);
}

static bool same_normal(const float *normals, uint32_t a, uint32_t b) {
    return normals == NULL || a == b ||
           vshi_dot(vshi_unit(vshi_vec_off(normals + 3 * (size_t)a)),
                    vshi_unit(vshi_vec_off(normals + 3 * (size_t)b))) > SEAM;
}

/* Fills `partner` and `soft`: edges are of the mesh's own order, also where it is mirrored. */
static void cut_sides(vshi_cut_mesh *s, const vshi_edges *edges, bool by_uvs) {
    const vsh_mesh *mesh = s->mesh;
    for (uint32_t side = 0; side < 3 * (uint32_t)s->count; ++side) {
        const uint32_t other = edges->partner[side];
        s->partner[side] = VSHI_NONE;
        if (other == VSHI_NO_PARTNER) {
            continue;
        }
        const uint32_t a = mesh->indices[side], b = mesh->indices[vshi_next_side(side)],
                       c = mesh->indices[vshi_next_side(other)], d = mesh->indices[other];
        const bool one_uv = same_uv(mesh->uvs, a, c) && same_uv(mesh->uvs, b, d);
        const bool one_normal = same_normal(mesh->normals, a, c) && same_normal(mesh->normals, b, d);
        const double crease = mesh->normals != NULL && one_normal ? SMOOTH : CREASE;
        const bool opposite = edges->weld[a] == edges->weld[c] && edges->weld[b] == edges->weld[d];
        const bool through = by_uvs ? one_uv : vshi_dot(s->normal[side / 3], s->normal[other / 3]) >= crease;
        if (opposite && through && s->area[side / 3] > 0.0 && s->area[other / 3] > 0.0) {
            s->partner[side] = other;
            s->soft[side] = one_uv && one_normal;
        }
    }
}

/* The only side of a triangle whose neighbour shares both vertices, or VSHI_NONE. */
static uint32_t find_shared_side(const vshi_cut_mesh *s, uint32_t triangle) {
    const uint32_t *indices = s->mesh->indices;
    uint32_t shared = VSHI_NONE;
    for (uint32_t side = 3 * triangle; side < 3 * triangle + 3; ++side) {
        const uint32_t other = s->partner[side];
        if (other != VSHI_NONE && indices[side] == indices[vshi_next_side(other)] &&
            indices[vshi_next_side(side)] == indices[other]) {
            if (shared != VSHI_NONE) {
                return VSHI_NONE;
            }
            shared = side;
        }
    }
    return shared;
}

/* The other half of a quad in a mesh whose faces share no vertices; else VSHI_NONE. */
static uint32_t find_quad_half(const vshi_cut_mesh *s, uint32_t triangle) {
    const uint32_t side = find_shared_side(s, triangle);
    const uint32_t half = side != VSHI_NONE ? s->partner[side] / 3 : VSHI_NONE;
    return half != VSHI_NONE && find_shared_side(s, half) == s->partner[side] ? half : VSHI_NONE;
}

static bool is_flat(const vshi_cut_mesh *s, uint32_t a, uint32_t b) {
    return vshi_dot(s->normal[a], s->normal[b]) > PLANE;
}

/* Triangles that lie in the plane of the first, and the halves of their quads; `queue` holds `count`. */
static uint32_t gather_plane(vshi_cut_mesh *s, uint32_t first, uint32_t unit, uint32_t *queue) {
    uint32_t waiting = 1;
    queue[0] = first;
    s->unit[first] = unit;
    for (uint32_t at = 0; at < waiting; ++at) {
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t side = s->partner[3 * queue[at] + k];
            if (side != VSHI_NONE && s->unit[side / 3] == VSHI_NONE &&
                (is_flat(s, first, side / 3) || find_quad_half(s, queue[at]) == side / 3)) {
                s->unit[side / 3] = unit;
                queue[waiting++] = side / 3;
            }
        }
    }
    return waiting;
}

/* If the triangle is half of a quad, this side is the diagonal. */
static uint32_t find_longest_side(const vshi_cut_mesh *s, uint32_t triangle) {
    uint32_t best = 3 * triangle;
    double most = -1.0;
    for (uint32_t side = 3 * triangle; side < 3 * triangle + 3; ++side) {
        const double length = vshi_side_length(s, side);
        if (length > most) {
            most = length;
            best = side;
        }
    }
    return best;
}

/* The other half of a bent quad: the triangle that shares its longest side. Else VSHI_NONE. */
static uint32_t find_bent_half(const vshi_cut_mesh *s, uint32_t triangle) {
    const uint32_t diagonal = s->partner[find_longest_side(s, triangle)];
    if (diagonal != VSHI_NONE && vshi_dot(s->normal[triangle], s->normal[diagonal / 3]) > QUAD &&
        s->partner[find_longest_side(s, diagonal / 3)] / 3 == triangle) {
        return diagonal / 3;
    }
    return VSHI_NONE;
}

static vsh_result gather_units(vshi_cut_mesh *s, vsh_error *error) {
    uint32_t *queue, *size;
    const vshi_array arrays[] = {VSHI_ARRAY(queue, s->count), VSHI_ARRAY(size, s->count)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, "parts of planes", error));
    memset(s->unit, 0xff, s->count * sizeof *s->unit);
    uint32_t units = 0;
    /* bent quads come first, so that none of their halves joins the plane of a neighbour */
    for (uint32_t i = 0; i < s->count; ++i) {
        const uint32_t half = s->unit[i] == VSHI_NONE ? find_quad_half(s, i) : VSHI_NONE;
        if (half != VSHI_NONE && !is_flat(s, i, half)) {
            s->unit[i] = s->unit[half] = units;
            size[units++] = 2;
        }
    }
    for (uint32_t i = 0; i < s->count; ++i) {
        if (s->unit[i] == VSHI_NONE && s->area[i] > 0.0) {
            size[units] = gather_plane(s, i, units, queue);
            ++units;
        }
    }
    /* lone triangles join into quads; numbers are given anew, without gaps */
    uint32_t *renamed = queue;
    s->unit_count = 0;
    memset(renamed, 0xff, units * sizeof *renamed);
    for (uint32_t i = 0; i < s->count; ++i) {
        const uint32_t unit = s->unit[i];
        if (unit == VSHI_NONE || renamed[unit] != VSHI_NONE) {
            continue;
        }
        const uint32_t half = size[unit] == 1 ? find_bent_half(s, i) : VSHI_NONE;
        renamed[unit] = s->unit_count++;
        if (half != VSHI_NONE && size[s->unit[half]] == 1 && renamed[s->unit[half]] == VSHI_NONE) {
            renamed[s->unit[half]] = renamed[unit];
        }
    }
    for (uint32_t i = 0; i < s->count; ++i) {
        s->unit[i] = s->unit[i] != VSHI_NONE ? renamed[s->unit[i]] : VSHI_NONE;
    }
    free(queue);
    return VSH_OK;
}

vsh_result vshi_cut_mesh_make(const vsh_mesh *mesh, size_t index, bool by_uvs, vshi_cut_mesh *s,
                              vsh_error *error) {
    *s = (vshi_cut_mesh){.mesh = mesh, .count = mesh->triangle_count};
    VSHI_TRY(vshi_edges_check(mesh, index, error));
    const vshi_array arrays[] = {
        VSHI_ARRAY(s->place, mesh->vertex_count), VSHI_ARRAY(s->area, s->count),
        VSHI_ARRAY(s->normal, s->count),          VSHI_ARRAY(s->partner, 3 * s->count),
        VSHI_ARRAY(s->soft, 3 * s->count),        VSHI_ARRAY(s->unit, s->count),
        VSHI_ARRAY(s->unit_begin, s->count + 2),  VSHI_ARRAY(s->unit_list, s->count)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, "a mesh's charts", error));
    if (s->count == 0) {
        return VSH_OK;
    }
    measure(s);
    vsh_mesh local = *mesh;
    vshi_edges edges;
    vsh_result result;
    local.transform = NULL;
    VSHI_TRY_DONE(vshi_edges_find(&local, index, true, &edges, error));
    cut_sides(s, &edges, by_uvs);
    VSHI_TRY_DONE(gather_units(s, error));
    vshi_list_groups(s->unit, s->count, s->unit_count, s->unit_begin, s->unit_list);
done:
    vshi_edges_free(&edges);
    return result;
}

void vshi_cut_mesh_free(vshi_cut_mesh *s) {
    free(s->place);
    *s = (vshi_cut_mesh){0};
}
