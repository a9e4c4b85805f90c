/* Charts as meshes of their own. A chart that folds or stretches is cut by a plane, and its parts are laid
 * out anew. A single triangle always lies flat. */
#include "unwrap/charts.h"

#include "base/memory.h"
#include "geometry/edges.h"

#include <stdlib.h>

static const char what[] = "a chart";

/* After so many cuts, a chart falls into its triangles: it is no surface. */
enum { FULL_DEPTH = 64 };

static int compare_triangles(const void *a, const void *b) {
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static void find_beyond(vshi_patch *p) {
    for (uint32_t i = 0; i < 3 * p->count; ++i) {
        const uint32_t side = p->surface->partner[3 * p->triangles[i / 3] + i % 3], triangle = side / 3;
        const uint32_t *found = side != VSHI_NONE ? bsearch(&triangle, p->triangles, p->count,
                                                            sizeof *p->triangles, compare_triangles)
                                                  : NULL;
        p->beyond[i] = found != NULL ? 3 * (uint32_t)(found - p->triangles) + side % 3 : VSHI_NONE;
    }
}

static vsh_result number_vertices(vshi_patch *p, vsh_error *error) {
    uint32_t *up, *number;
    const uint32_t corners = 3 * p->count;
    const vshi_array arrays[] = {VSHI_ARRAY(up, corners), VSHI_ARRAY(number, corners)};
    vsh_result result;
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    for (uint32_t c = 0; c < corners; ++c) {
        up[c] = c;
    }
    for (uint32_t side = 0; side < corners; ++side) {
        const uint32_t other = p->beyond[side];
        if (other != VSHI_NONE && other > side) {
            vshi_set_join(up, side, vshi_next_side(other));
            vshi_set_join(up, vshi_next_side(side), other);
        }
    }
    for (uint32_t c = 0; c < corners; ++c) { /* a root is the lowest of its set */
        const uint32_t r = vshi_set_of(up, c);
        if (r == c) {
            number[c] = p->vertex_count++;
        }
        p->corner[c / 3][c % 3] = number[r];
    }
    const vshi_array own[] = {VSHI_ARRAY(p->place, p->vertex_count), VSHI_ARRAY(p->uv, p->vertex_count)};
    VSHI_TRY_DONE(VSHI_ALLOCATE_BLOCK(own, what, error));
    for (uint32_t i = 0; i < p->count; ++i) {
        vshi_vec at[3];
        vshi_cut_mesh_corners(p->surface, p->triangles[i], at);
        for (int k = 0; k < 3; ++k) {
            p->place[p->corner[i][k]] = at[k];
        }
        p->area += p->surface->area[p->triangles[i]];
    }
done:
    free(up);
    return result;
}

vsh_result vshi_patch_make(const vshi_cut_mesh *surface, uint32_t *triangles, uint32_t count, vshi_patch *p,
                           vsh_error *error) {
    *p = (vshi_patch){.surface = surface, .triangles = triangles, .count = count, .stretch = 1.0};
    const vshi_array arrays[] = {VSHI_ARRAY(p->corner, count), VSHI_ARRAY(p->beyond, 3 * (size_t)count)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    find_beyond(p);
    return number_vertices(p, error);
}

void vshi_patch_free(vshi_patch *p) {
    free(p->place);
    free(p->corner);
    free(p->triangles);
    *p = (vshi_patch){0};
}

void vshi_patch_box(const vshi_patch *p, const double along[2], double low[2], double high[2]) {
    low[0] = low[1] = INFINITY;
    high[0] = high[1] = -INFINITY;
    for (uint32_t v = 0; v < p->vertex_count; ++v) {
        const double *uv = p->uv[v];
        const double at[2] = {uv[0] * along[0] + uv[1] * along[1], uv[1] * along[0] - uv[0] * along[1]};
        for (int k = 0; k < 2; ++k) {
            low[k] = at[k] < low[k] ? at[k] : low[k];
            high[k] = at[k] > high[k] ? at[k] : high[k];
        }
    }
}

vsh_result vshi_patches_add(vshi_patches *patches, vshi_patch *patch, vsh_error *error) {
    const vsh_result result = vshi_make_room((void **)&patches->list, patches->count, &patches->capacity,
                                             sizeof *patches->list, "charts", error);
    if (result == VSH_OK) {
        patches->list[patches->count++] = *patch;
        *patch = (vshi_patch){0};
    }
    vshi_patch_free(patch);
    return result;
}

void vshi_patches_free(vshi_patches *patches) {
    for (size_t i = 0; i < patches->count; ++i) {
        vshi_patch_free(&patches->list[i]);
    }
    free(patches->list);
    *patches = (vshi_patches){0};
}

/* --- charts in parts */

vsh_result vshi_patches_split(const vshi_patch *p, const uint32_t *part, uint32_t parts, vshi_patches *to,
                              vsh_error *error) {
    uint32_t *begin, *list;
    const vshi_array arrays[] = {VSHI_ARRAY(begin, (size_t)parts + 2), VSHI_ARRAY(list, p->count)};
    vsh_result result = VSH_OK;
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    vshi_list_groups(part, p->count, parts, begin, list);
    for (uint32_t k = parts; k-- > 0;) {
        vshi_patch own = {.count = begin[k + 1] - begin[k], .depth = p->depth + 1};
        VSHI_TRY_DONE(vshi_allocate((void **)&own.triangles, own.count, sizeof *own.triangles, what, error));
        for (uint32_t i = 0; i < own.count; ++i) {
            own.triangles[i] = p->triangles[list[begin[k] + i]];
        }
        VSHI_TRY_DONE(vshi_patches_add(to, &own, error));
    }
done:
    free(begin);
    return result;
}

uint32_t vshi_patch_find_parts(const vshi_patch *p, const bool *beyond, uint32_t *part) {
    uint32_t parts = 0;
    for (uint32_t i = 0; i < p->count; ++i) {
        part[i] = i;
    }
    for (uint32_t side = 0; side < 3 * p->count; ++side) {
        const uint32_t a = side / 3, b = p->beyond[side] / 3;
        if (p->beyond[side] != VSHI_NONE && (beyond == NULL || beyond[a] == beyond[b])) {
            vshi_set_join(part, a, b);
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

/* Finds the triangles beyond a plane across the longest side of the chart's box. A unit's triangles are where
 * its first one is; with `apart`, each is where it is itself. */
static void find_beyond_plane(const vshi_patch *p, bool apart, double *place, bool *beyond) {
    const vshi_cut_mesh *s = p->surface;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, sum = 0.0;
    for (uint32_t v = 0; v < p->vertex_count; ++v) {
        vshi_grow_box(low, high, p->place[v]);
    }
    int axis = 0;
    for (int k = 1; k < 3; ++k) {
        axis = high[k] - low[k] > high[axis] - low[axis] ? k : axis;
    }
    for (uint32_t i = 0; i < p->count; ++i) {
        const uint32_t own = p->triangles[i], first = s->unit_list[s->unit_begin[s->unit[own]]];
        vshi_vec c[3];
        vshi_cut_mesh_corners(s, apart ? own : first, c);
        const vshi_vec middle = vshi_add(c[0], vshi_add(c[1], c[2]));
        place[i] = axis == 0 ? middle.x : axis == 1 ? middle.y : middle.z;
        sum += place[i];
    }
    for (uint32_t i = 0; i < p->count; ++i) {
        beyond[i] = place[i] > sum / p->count;
    }
}

/* Cuts a chart, and adds its parts to those that wait to be laid out. */
static vsh_result cut(const vshi_patch *p, vshi_patches *waiting, vsh_error *error) {
    double *place;
    bool *beyond;
    uint32_t *part, parts = 1;
    const vshi_array arrays[] = {VSHI_ARRAY(place, p->count), VSHI_ARRAY(beyond, p->count),
                                 VSHI_ARRAY(part, p->count)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    for (int apart = 0; apart < 2 && parts == 1 && p->depth < FULL_DEPTH; ++apart) {
        find_beyond_plane(p, apart, place, beyond);
        parts = vshi_patch_find_parts(p, beyond, part);
    }
    for (uint32_t i = 0; i < p->count && parts == 1; ++i) {
        part[i] = i;
    }
    const vsh_result result = vshi_patches_split(p, part, parts > 1 ? parts : p->count, waiting, error);
    free(place);
    return result;
}

vsh_result vshi_lay_out(const vshi_cut_mesh *surface, uint32_t *triangles, uint32_t count, double max_stretch,
                        vshi_patches *patches, vsh_error *error) {
    vshi_patches waiting = {0};
    vshi_patch first = {.triangles = triangles, .count = count}, p = {0};
    vsh_result result;
    VSHI_TRY_DONE(vshi_patches_add(&waiting, &first, error));
    while (waiting.count > 0) {
        const vshi_patch next = waiting.list[--waiting.count];
        bool flat = false;
        VSHI_TRY_DONE(vshi_patch_make(surface, next.triangles, next.count, &p, error));
        VSHI_TRY_DONE(vshi_flatten(&p, max_stretch, &flat, error));
        if (flat || p.count == 1) {
            VSHI_TRY_DONE(vshi_patches_add(patches, &p, error));
        } else {
            p.depth = next.depth;
            VSHI_TRY_DONE(cut(&p, &waiting, error));
            vshi_patch_free(&p);
        }
    }
done:
    vshi_patch_free(&p);
    vshi_patches_free(&waiting);
    return result;
}
