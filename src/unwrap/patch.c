/* Charts as meshes of their own. One that folds or stretches is cut in two between its triangles that are the
 * farthest from each other, along the border where regions grown from both meet; each half is laid out anew.
 * A triangle alone always lies flat. */
#include "unwrap/patch.h"

#include "base/memory.h"
#include "mesh/weld.h"
#include "unwrap/heap.h"

#include <stdlib.h>

static const char what[] = "a chart";

/* Cuts run where surfaces bend: a way between two triangles is longer by so many sizes of the chart for each
 * radian or so between their normals. */
static const double BEND = 1.0;

/* After so many triangles that were alone in their half, a chart is cut into all its triangles: what behaves
 * so is no surface. */
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
    uint32_t *up = NULL, *number = NULL;
    const uint32_t corners = 3 * p->count;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&up, corners, sizeof *up, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&number, corners, sizeof *number, what, error));
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
    for (uint32_t c = 0; c < corners; ++c) { /* roots are the lowest of theirs */
        const uint32_t r = vshi_set_of(up, c);
        if (r == c) {
            number[c] = p->vertex_count++;
        }
        p->corner[c / 3][c % 3] = number[r];
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&p->place, p->vertex_count, sizeof *p->place, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&p->uv, p->vertex_count, sizeof *p->uv, what, error));
    for (uint32_t i = 0; i < p->count; ++i) {
        vshi_vec at[3];
        vshi_cut_mesh_corners(p->surface, p->triangles[i], at);
        for (int k = 0; k < 3; ++k) {
            p->place[p->corner[i][k]] = at[k];
        }
        p->area += p->surface->area[p->triangles[i]];
    }
done:
    free(number);
    free(up);
    return result;
}

vsh_result vshi_patch_make(const vshi_cut_mesh *surface, uint32_t *triangles, uint32_t count, vshi_patch *p,
                           vsh_error *error) {
    *p = (vshi_patch){.surface = surface, .triangles = triangles, .count = count, .stretch = 1.0};
    VSHI_TRY(vshi_allocate((void **)&p->corner, count, sizeof *p->corner, what, error));
    VSHI_TRY(vshi_allocate((void **)&p->beyond, count, 3 * sizeof *p->beyond, what, error));
    find_beyond(p);
    return number_vertices(p, error);
}

void vshi_patch_free(vshi_patch *p) {
    free(p->uv);
    free(p->place);
    free(p->beyond);
    free(p->corner);
    free(p->triangles);
    *p = (vshi_patch){0};
}

void vshi_patch_box(const vshi_patch *p, double low[2], double high[2]) {
    for (int k = 0; k < 2; ++k) {
        low[k] = INFINITY;
        high[k] = -INFINITY;
        for (uint32_t v = 0; v < p->vertex_count; ++v) {
            low[k] = p->uv[v][k] < low[k] ? p->uv[v][k] : low[k];
            high[k] = p->uv[v][k] > high[k] ? p->uv[v][k] : high[k];
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
    uint32_t *begin = NULL, *list = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&begin, (size_t)parts + 2, sizeof *begin, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&list, p->count, sizeof *list, what, error));
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
    free(list);
    free(begin);
    return result;
}

typedef struct splitting {
    const vshi_patch *patch;
    vshi_heap heap;
    double *far;     /* [count]: way from the seeds */
    uint32_t *owner; /* [count]: 0, 1; VSHI_NONE: not reached */
    double bend;
    bool whole_units; /* triangles of a unit stay together */
} splitting;

static vshi_vec middle_of(const vshi_patch *p, uint32_t i) {
    return vshi_scale(
        vshi_add(p->place[p->corner[i][0]], vshi_add(p->place[p->corner[i][1]], p->place[p->corner[i][2]])),
        1.0 / 3.0);
}

static bool one_unit(const splitting *s, uint32_t a, uint32_t b) {
    const vshi_patch *p = s->patch;
    return s->whole_units && p->surface->unit[p->triangles[a]] == p->surface->unit[p->triangles[b]];
}

static double way(const splitting *s, uint32_t a, uint32_t b) {
    const vshi_patch *p = s->patch;
    const vshi_cut_mesh *surface = p->surface;
    const uint32_t ta = p->triangles[a], tb = p->triangles[b];
    if (one_unit(s, a, b)) {
        return 0.0;
    }
    return vshi_length(vshi_sub(middle_of(p, a), middle_of(p, b))) +
           s->bend * (1.0 - vshi_dot(surface->normal[ta], surface->normal[tb]));
}

/* Shortest ways over triangles (Dijkstra, 1959) from the seeds, owner i being seeds[i]. Returns the last one
 * that was reached. */
static vsh_result reach(splitting *s, const uint32_t *seeds, uint32_t seed_count, uint32_t *last,
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
            const double far = s->far[next.what] + way(s, next.what, other);
            if (one_unit(s, next.what, other)) { /* before anything else is */
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

/* Owner of each triangle in two halves; false where all are one unit, and stay together. */
static vsh_result halve(splitting *s, bool *halved, vsh_error *error) {
    const vshi_patch *p = s->patch;
    uint32_t seeds[2] = {0, 0};
    double size = 0.0;
    for (uint32_t v = 0; v < p->vertex_count; ++v) {
        size = fmax(size, vshi_length(vshi_sub(p->place[v], p->place[0])));
    }
    s->bend = BEND * size;
    VSHI_TRY(reach(s, seeds, 1, &seeds[0], error));
    VSHI_TRY(reach(s, seeds, 1, &seeds[1], error));
    const uint32_t a = p->triangles[seeds[0]], b = p->triangles[seeds[1]];
    *halved = a != b && (!s->whole_units || p->surface->unit[a] != p->surface->unit[b]);
    return *halved ? reach(s, seeds, 2, &(uint32_t){0}, error) : VSH_OK;
}

/* Adds the parts that a chart is cut into to those that wait to be laid out. */
static vsh_result cut(const vshi_patch *p, vshi_patches *waiting, vsh_error *error) {
    splitting s = {.patch = p, .whole_units = true};
    const vshi_array arrays[] = {VSHI_ARRAY(s.far, p->count), VSHI_ARRAY(s.owner, p->count)};
    bool halved = false;
    vsh_result result;
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, what, error));
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
    free(s.owner);
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
