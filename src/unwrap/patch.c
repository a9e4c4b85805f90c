/* Charts as meshes of their own. A chart that folds or stretches is cut in two: regions grow from its two
 * farthest triangles, and the cut runs where they meet. Each half is laid out anew. A single triangle always
 * lies flat. */
#include "unwrap/charts.h"

#include "base/memory.h"
#include "geometry/edges.h"
#include "unwrap/charts.h"

#include <stdlib.h>

static const char what[] = "a chart";

/* Cuts should run where surfaces bend. So about every radian between the normals of two triangles lengthens a
 * path by this many sizes of the chart. */
static const double BEND = 1.0;

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

void vshi_patch_box(const vshi_patch *p, const double turn[2], double low[2], double high[2]) {
    low[0] = low[1] = INFINITY;
    high[0] = high[1] = -INFINITY;
    for (uint32_t v = 0; v < p->vertex_count; ++v) {
        const double *uv = p->uv[v];
        const double at[2] = {turn[0] * uv[0] - turn[1] * uv[1], turn[1] * uv[0] + turn[0] * uv[1]};
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

typedef struct splitting {
    const vshi_patch *patch;
    vshi_heap heap;
    double *far;     /* [count]: length of the path from the seeds; one block with `owner` */
    uint32_t *owner; /* [count]: 0, 1; VSHI_NONE: not reached */
    double bend;
    bool whole_units; /* triangles of a unit stay together */
} splitting;

static vshi_vec find_middle(const vshi_patch *p, uint32_t i) {
    return vshi_scale(
        vshi_add(p->place[p->corner[i][0]], vshi_add(p->place[p->corner[i][1]], p->place[p->corner[i][2]])),
        1.0 / 3.0);
}

static bool share_unit(const splitting *s, uint32_t a, uint32_t b) {
    const vshi_patch *p = s->patch;
    return s->whole_units && p->surface->unit[p->triangles[a]] == p->surface->unit[p->triangles[b]];
}

static double measure_step(const splitting *s, uint32_t a, uint32_t b) {
    const vshi_patch *p = s->patch;
    const vshi_cut_mesh *surface = p->surface;
    const uint32_t ta = p->triangles[a], tb = p->triangles[b];
    if (share_unit(s, a, b)) {
        return 0.0;
    }
    return vshi_length(vshi_sub(find_middle(p, a), find_middle(p, b))) +
           s->bend * (1.0 - vshi_dot(surface->normal[ta], surface->normal[tb]));
}

/* Shortest paths over triangles (Dijkstra, 1959) from the seeds; seeds[i] is owner i. *last is the last
 * triangle reached. */
static vsh_result find_paths(splitting *s, const uint32_t *seeds, uint32_t seed_count, uint32_t *last,
                             vsh_error *error) {
    const vshi_patch *p = s->patch;
    s->heap.count = 0;
    for (uint32_t i = 0; i < p->count; ++i) {
        s->far[i] = INFINITY;
        s->owner[i] = VSHI_NONE;
    }
    for (uint32_t k = 0; k < seed_count; ++k) {
        s->far[seeds[k]] = 0.0;
        VSHI_TRY(vshi_heap_push(&s->heap, 0.0, seeds[k], k, error));
    }
    while (s->heap.count > 0) {
        const vshi_heap_entry next = vshi_heap_pop(&s->heap);
        if (s->owner[next.what] != VSHI_NONE) {
            continue;
        }
        s->owner[next.what] = next.by;
        *last = next.what;
        for (uint32_t side = 3 * next.what; side < 3 * next.what + 3; ++side) {
            const uint32_t other = p->beyond[side] != VSHI_NONE ? p->beyond[side] / 3 : next.what;
            if (s->owner[other] != VSHI_NONE) {
                continue;
            }
            const double far = s->far[next.what] + measure_step(s, next.what, other);
            if (share_unit(s, next.what, other)) { /* comes before everything else */
                s->far[other] = far;
                VSHI_TRY(vshi_heap_push(&s->heap, -1.0, other, next.by, error));
            } else if (far < s->far[other]) {
                s->far[other] = far;
                VSHI_TRY(vshi_heap_push(&s->heap, far, other, next.by, error));
            }
        }
    }
    return VSH_OK;
}

/* Finds the half of each triangle. *halved is false if all are one unit, which stays together. */
static vsh_result halve(splitting *s, bool *halved, vsh_error *error) {
    const vshi_patch *p = s->patch;
    uint32_t seeds[2] = {0, 0};
    double size = 0.0;
    for (uint32_t v = 0; v < p->vertex_count; ++v) {
        size = fmax(size, vshi_length(vshi_sub(p->place[v], p->place[0])));
    }
    s->bend = BEND * size;
    VSHI_TRY(find_paths(s, seeds, 1, &seeds[0], error));
    VSHI_TRY(find_paths(s, seeds, 1, &seeds[1], error));
    const uint32_t a = p->triangles[seeds[0]], b = p->triangles[seeds[1]];
    *halved = a != b && (!s->whole_units || p->surface->unit[a] != p->surface->unit[b]);
    return *halved ? find_paths(s, seeds, 2, &(uint32_t){0}, error) : VSH_OK;
}

/* Cuts a chart, and adds its parts to those that wait to be laid out. */
static vsh_result cut(const vshi_patch *p, vshi_patches *waiting, vsh_error *error) {
    splitting s = {.patch = p, .whole_units = true};
    const vshi_array arrays[] = {VSHI_ARRAY(s.far, p->count), VSHI_ARRAY(s.owner, p->count)};
    bool halved = false;
    vsh_result result;
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    if (p->depth < FULL_DEPTH) {
        VSHI_TRY_DONE(halve(&s, &halved, error));
        if (!halved) {
            s.whole_units = false;
            VSHI_TRY_DONE(halve(&s, &halved, error));
        }
    }
    for (uint32_t i = 0; i < p->count && !halved; ++i) {
        s.owner[i] = i;
    }
    result = vshi_patches_split(p, s.owner, halved ? 2 : p->count, waiting, error);
done:
    free(s.far);
    free(s.heap.entries);
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
