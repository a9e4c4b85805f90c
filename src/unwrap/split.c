/* A chart that folds or stretches is cut in two between its triangles that are the farthest from each other,
 * along the border where regions grown from both meet; each half is laid out anew. A triangle alone always
 * lies flat. */

#include "base/memory.h"
#include "base/try.h"
#include "unwrap/heap.h"
#include "unwrap/patch.h"

#include <stdlib.h>

static const char what[] = "cutting a chart";

/* What a turn of the normal adds to the way between two triangles, in sizes of the chart for a radian or so:
 * cuts run where surfaces bend. */
static const double BEND = 1.0;

/* After so many triangles that were alone in their half, a chart is cut into all its triangles: what behaves
 * so is no surface. */
enum { FULL_DEPTH = 64 };

vsh_result vshi_patches_add(vshi_patches *patches, const vshi_patch *patch, vsh_error *error) {
    if (patches->count == patches->capacity) {
        vshi_patch *more;
        const size_t capacity = patches->capacity > 0 ? 2 * patches->capacity : 4;
        const vsh_result result = vshi_allocate((void **)&more, capacity, sizeof *more, "charts", error);
        if (result != VSH_OK) {
            vshi_patch lost = *patch;
            vshi_patch_free(&lost);
            return result;
        }
        if (patches->count > 0) {
            memcpy(more, patches->list, patches->count * sizeof *more);
        }
        free(patches->list);
        patches->list = more;
        patches->capacity = capacity;
    }
    patches->list[patches->count++] = *patch;
    return VSH_OK;
}

void vshi_patches_free(vshi_patches *patches) {
    for (size_t i = 0; i < patches->count; ++i) {
        vshi_patch_free(&patches->list[i]);
    }
    free(patches->list);
    *patches = (vshi_patches){0};
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

static vsh_result take_owned(const vshi_patch *p, const uint32_t *owner, uint32_t who, uint32_t **triangles,
                             uint32_t *count, vsh_error *error) {
    *count = 0;
    for (uint32_t i = 0; i < p->count; ++i) {
        *count += owner[i] == who;
    }
    VSHI_TRY(vshi_allocate((void **)triangles, *count, sizeof **triangles, what, error));
    *count = 0;
    for (uint32_t i = 0; i < p->count; ++i) {
        if (owner[i] == who) {
            (*triangles)[(*count)++] = p->triangles[i];
        }
    }
    return VSH_OK;
}

/* Lists of triangles that wait to be laid out. */
typedef struct waiting_list {
    struct {
        uint32_t *triangles;
        uint32_t count, depth;
    } * items;
    size_t count, capacity;
} waiting_list;

static vsh_result wait(waiting_list *w, uint32_t *triangles, uint32_t count, uint32_t depth,
                       vsh_error *error) {
    if (w->count == w->capacity) {
        void *more;
        const size_t capacity = w->capacity > 0 ? 2 * w->capacity : 16;
        const vsh_result result = vshi_allocate(&more, capacity, sizeof *w->items, what, error);
        if (result != VSH_OK) {
            free(triangles);
            return result;
        }
        if (w->count > 0) {
            memcpy(more, w->items, w->count * sizeof *w->items);
        }
        free(w->items);
        w->items = more;
        w->capacity = capacity;
    }
    w->items[w->count].triangles = triangles;
    w->items[w->count].count = count;
    w->items[w->count++].depth = depth;
    return VSH_OK;
}

static vsh_result cut(const vshi_patch *p, uint32_t depth, waiting_list *w, vsh_error *error) {
    splitting s = {.patch = p, .whole_units = true};
    bool halved = false;
    uint32_t parts = 2;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&s.far, p->count, sizeof *s.far, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&s.owner, p->count, sizeof *s.owner, what, error));
    if (depth < FULL_DEPTH) {
        VSHI_TRY_DONE(halve(&s, &halved, error));
        if (!halved) {
            s.whole_units = false;
            VSHI_TRY_DONE(halve(&s, &halved, error));
        }
    }
    if (!halved) {
        parts = p->count;
        for (uint32_t i = 0; i < p->count; ++i) {
            s.owner[i] = i;
        }
    }
    for (uint32_t k = parts; k-- > 0;) {
        uint32_t *triangles = NULL, count = 0;
        if (!halved) {
            VSHI_TRY_DONE(vshi_allocate((void **)&triangles, 1, sizeof *triangles, what, error));
            triangles[0] = p->triangles[k];
            count = 1;
        } else {
            VSHI_TRY_DONE(take_owned(p, s.owner, k, &triangles, &count, error));
        }
        VSHI_TRY_DONE(wait(w, triangles, count, depth + 1, error));
    }
done:
    free(s.owner);
    free(s.far);
    free(s.heap.entries);
    return result;
}

static vsh_result lay_out_next(const vshi_cut_mesh *surface, waiting_list *w, double max_stretch,
                               vshi_patches *patches, vsh_error *error) {
    uint32_t *triangles = w->items[--w->count].triangles;
    const uint32_t count = w->items[w->count].count, depth = w->items[w->count].depth;
    vshi_patch patch;
    int came_to = VSHI_FOLDED;
    vsh_result result;
    VSHI_TRY_DONE(vshi_patch_make(surface, triangles, count, &patch, error));
    VSHI_TRY_DONE(vshi_flatten(&patch, max_stretch, &came_to, error));
    if (came_to == VSHI_FLAT || count == 1) {
        return vshi_patches_add(patches, &patch, error);
    }
    VSHI_TRY_DONE(cut(&patch, depth, w, error));
done:
    vshi_patch_free(&patch);
    return result;
}

vsh_result vshi_lay_out(const vshi_cut_mesh *surface, uint32_t *triangles, uint32_t count, double max_stretch,
                        vshi_patches *patches, vsh_error *error) {
    waiting_list w = {0};
    vsh_result result = wait(&w, triangles, count, 0, error);
    while (result == VSH_OK && w.count > 0) {
        result = lay_out_next(surface, &w, max_stretch, patches, error);
    }
    while (w.count > 0) {
        free(w.items[--w.count].triangles);
    }
    free(w.items);
    return result;
}
