/* A mesh's own UVs: whether they can serve as charts, how dense and how stretched they are. */
#include "base/floats.h"
#include "base/memory.h"
#include "geometry/edges.h"
#include "unwrap/charts.h"

#include <stdlib.h>
#include <vdbshade/lightmap.h>

static const char what[] = "charts of UVs";

static bool in_square(const float *uvs, const uint32_t *corner) {
    for (int k = 0; k < 3; ++k) {
        const float *uv = uvs + 2 * (size_t)corner[k];
        if (!(uv[0] >= 0.0F && uv[0] <= 1.0F && uv[1] >= 0.0F && uv[1] <= 1.0F)) {
            return false;
        }
    }
    return true;
}

/* 1: the triangle runs anticlockwise, -1: clockwise, 0: it has no area. */
static int find_sense(const float *uvs, const uint32_t *corner) {
    const float *a = uvs + 2 * (size_t)corner[0], *b = uvs + 2 * (size_t)corner[1],
                *c = uvs + 2 * (size_t)corner[2];
    const double area = ((double)b[0] - (double)a[0]) * ((double)c[1] - (double)a[1]) -
                        ((double)b[1] - (double)a[1]) * ((double)c[0] - (double)a[0]);
    return area > 0.0 ? 1 : area < 0.0 ? -1 : 0;
}

/* Copies the mesh's UVs into a patch; mirrored if its triangles run clockwise. */
static void copy_uvs(vshi_patch *p, bool mirrored, double scale) {
    const vsh_mesh *mesh = p->surface->mesh;
    for (uint32_t i = 0; i < p->count; ++i) {
        for (uint32_t k = 0; k < 3; ++k) {
            const float *uv = mesh->uvs + 2 * (size_t)mesh->indices[3 * (size_t)p->triangles[i] + k];
            double *to = p->uv[p->corner[i][k]];
            to[0] = scale * (mirrored ? 1.0 - (double)uv[0] : (double)uv[0]);
            to[1] = scale * (double)uv[1];
        }
    }
}

static double sum_flat_areas(const vshi_patch *p) {
    double sum = 0.0;
    for (uint32_t i = 0; i < p->count; ++i) {
        sum += 0.5 * vshi_patch_doubled_area(p, i);
    }
    return sum;
}

/* Numbers the connected parts of a patch in the order of their first triangles: part[count]. */
static uint32_t find_parts(const vshi_patch *p, uint32_t *part) {
    uint32_t parts = 0;
    for (uint32_t i = 0; i < p->count; ++i) {
        part[i] = i;
    }
    for (uint32_t side = 0; side < 3 * p->count; ++side) {
        if (p->beyond[side] != VSHI_NONE) {
            vshi_set_join(part, side / 3, p->beyond[side] / 3);
        }
    }
    for (uint32_t i = 0; i < p->count; ++i) {
        part[i] = vshi_set_of(part, i);
    }
    for (uint32_t i = 0; i < p->count; ++i) { /* a root stands before the others of its part */
        part[i] = part[i] == i ? parts++ : part[part[i]];
    }
    return parts;
}

static vsh_result add_parts(const vshi_patch *whole, bool mirrored, vshi_patches *patches, vsh_error *error) {
    uint32_t *part = NULL;
    vshi_patches parts = {0};
    vshi_patch patch = {0};
    const double scale = sqrt(whole->area / sum_flat_areas(whole));
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&part, whole->count, sizeof *part, what, error));
    VSHI_TRY_DONE(vshi_patches_split(whole, part, find_parts(whole, part), &parts, error));
    while (parts.count > 0) {
        const vshi_patch next = parts.list[--parts.count];
        VSHI_TRY_DONE(vshi_patch_make(whole->surface, next.triangles, next.count, &patch, error));
        copy_uvs(&patch, mirrored, 1.0);
        vshi_flatten_measure(&patch); /* for the stretch: it also changes the size */
        copy_uvs(&patch, mirrored, scale);
        patch.kept = true;
        VSHI_TRY_DONE(vshi_patches_add(patches, &patch, error));
    }
done:
    vshi_patch_free(&patch);
    vshi_patches_free(&parts);
    free(part);
    return result;
}

vsh_result vshi_keep_charts(const vshi_cut_mesh *s, vshi_patches *patches, bool *usable, vsh_error *error) {
    const vsh_mesh *mesh = s->mesh;
    int senses = 0;
    uint32_t count = 0;
    *usable = false;
    for (uint32_t i = 0; i < s->count && mesh->uvs != NULL; ++i) {
        if (s->area[i] == 0.0) {
            continue;
        }
        const int own = find_sense(mesh->uvs, mesh->indices + 3 * (size_t)i);
        if (!in_square(mesh->uvs, mesh->indices + 3 * (size_t)i) || own == 0 ||
            (count > 0 && own != senses)) {
            return VSH_OK;
        }
        senses = own;
        ++count;
    }
    if (count == 0) {
        return VSH_OK;
    }
    uint32_t *triangles = NULL;
    vshi_patch whole;
    bool overlaps = true;
    VSHI_TRY(vshi_allocate((void **)&triangles, count, sizeof *triangles, what, error));
    count = 0;
    for (uint32_t i = 0; i < s->count; ++i) {
        if (s->area[i] > 0.0) {
            triangles[count++] = i;
        }
    }
    vsh_result result;
    VSHI_TRY_DONE(vshi_patch_make(s, triangles, count, &whole, error));
    copy_uvs(&whole, senses < 0, 1.0);
    whole.kept = true; /* it has many parts, each with a border of its own */
    VSHI_TRY_DONE(vshi_patch_overlaps(&whole, &overlaps, error));
    *usable = !overlaps;
    if (*usable) {
        VSHI_TRY_DONE(add_parts(&whole, senses < 0, patches, error));
    }
done:
    vshi_patch_free(&whole);
    return result;
}

/* --- how dense and how stretched UVs are */

/* Sums over triangles that have area in the world and in the UVs. */
typedef struct sums {
    double area;   /* in the world */
    double flat;   /* in texels */
    double square; /* of the L2 stretch of each, times its area */
} sums;

/* Squared L2 stretch of a triangle (Sander and others, "Texture mapping progressive meshes", 2001): half the
 * sum of the squared lengths on the surface of unit steps along u and v. */
static double square_stretch(const vshi_vec p[3], const double uv[3][2], double doubled) {
    vshi_vec along[2];
    for (int k = 0; k < 2; ++k) { /* derivatives by texel */
        const int other = 1 - k;
        const double sign = k == 0 ? 1.0 : -1.0;
        along[k] = (vshi_vec){0.0, 0.0, 0.0};
        for (int c = 0; c < 3; ++c) {
            const double weight = sign * (uv[(c + 1) % 3][other] - uv[(c + 2) % 3][other]) / doubled;
            along[k] = vshi_add(along[k], vshi_scale(p[c], weight));
        }
    }
    return 0.5 * (vshi_dot(along[0], along[0]) + vshi_dot(along[1], along[1]));
}

static void add_triangle(const vsh_mesh *mesh, size_t triangle, const double size[2], sums *s) {
    vshi_vec p[3];
    double uv[3][2];
    vshi_mesh_triangle(mesh, triangle, p);
    for (size_t c = 0; c < 3; ++c) {
        const float *at = mesh->uvs + 2 * (size_t)mesh->indices[3 * triangle + c];
        uv[c][0] = (double)at[0] * size[0];
        uv[c][1] = (double)at[1] * size[1];
    }
    const double area = 0.5 * vshi_length(vshi_cross(vshi_sub(p[1], p[0]), vshi_sub(p[2], p[0])));
    const double doubled =
        (uv[1][0] - uv[0][0]) * (uv[2][1] - uv[0][1]) - (uv[2][0] - uv[0][0]) * (uv[1][1] - uv[0][1]);
    const double square = square_stretch(p, (const double(*)[2])uv, doubled);
    if (area > 0.0 && isfinite(square)) {
        s->area += area;
        s->flat += 0.5 * fabs(doubled);
        s->square += area * square;
    }
}

vsh_result vsh_uvs_measure(const vsh_mesh *mesh, int32_t width, int32_t height, vsh_uvs_measures *measures,
                           vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_BOTH(mesh, measures);
    if (width < 1 || height < 1 || width > VSH_MAX_PAGE_SIZE || height > VSH_MAX_PAGE_SIZE) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "UVs measured at %d × %d: expected 1 … %d", width, height,
                         VSH_MAX_PAGE_SIZE);
    }
    vsh_uvs_measures found = {0.0, 0.0};
    vshi_tight_meshes tight;
    vsh_result result;
    VSHI_TRY_DONE(vshi_meshes_tighten(mesh, 1, &tight, error));
    mesh = tight.meshes;
    VSHI_TRY_DONE(vshi_mesh_check_data(mesh, VSHI_MESH_ALONE, error));
    if (mesh->uvs != NULL) {
        const double size[2] = {width, height};
        sums s = {0.0, 0.0, 0.0};
        for (size_t i = 0; i < mesh->triangle_count; ++i) {
            add_triangle(mesh, i, size, &s);
        }
        if (s.area > 0.0) {
            found.texels_per_unit = sqrt(s.flat / s.area);
            found.stretch = sqrt(s.square / s.area) * found.texels_per_unit;
        }
    }
    *measures = found;
done:
    free(tight.memory);
    return result;
}
