/* Charts grow one after the other, each from the largest unit that is left, as far as normals allow. The
 * costs of growth are those of variational shape approximation (Cohen-Steiner, Alliez and Desbrun, 2004), and
 * make charts round and their borders straight, as in Young's and Castaño's chart growers. */
#include "unwrap/charts.h"

#include "base/memory.h"

#include <stdlib.h>
#include <string.h>

static const char what[] = "growing charts";

/* --- a heap */

static bool comes_before(const vshi_heap_entry *a, const vshi_heap_entry *b) {
    if (a->key != b->key) {
        return a->key < b->key;
    }
    return a->what != b->what ? a->what < b->what : a->by < b->by;
}

vsh_result vshi_heap_push(vshi_heap *heap, double key, uint32_t number, uint32_t by, vsh_error *error) {
    VSHI_TRY(vshi_make_room((void **)&heap->entries, heap->count, &heap->capacity, sizeof *heap->entries,
                            what, error));
    const vshi_heap_entry entry = {key, number, by};
    size_t at = heap->count++;
    for (size_t above; at > 0 && comes_before(&entry, &heap->entries[above = (at - 1) / 2]); at = above) {
        heap->entries[at] = heap->entries[above];
    }
    heap->entries[at] = entry;
    return VSH_OK;
}

vshi_heap_entry vshi_heap_pop(vshi_heap *heap) {
    const vshi_heap_entry least = heap->entries[0], last = heap->entries[--heap->count];
    size_t at = 0;
    for (size_t below; (below = 2 * at + 1) < heap->count; at = below) {
        if (below + 1 < heap->count && comes_before(&heap->entries[below + 1], &heap->entries[below])) {
            ++below;
        }
        if (!comes_before(&heap->entries[below], &last)) {
            break;
        }
        heap->entries[at] = heap->entries[below];
    }
    heap->entries[at] = last;
    return least;
}

/* --- growing */

/* Cosine of the angle between a unit's normal and its chart's: a spherical cap of 60° has an L2 stretch
 * of 1.05 once it is flat. */
static const double WIDEST = 0.5;

/* Weights of a unit's cost, by which charts grow. NORMAL: the difference of normals, 0 … 0.5. STRAIGHT: the
 * share of the unit's border that the chart's border gains, less the share that it loses, -1 … 1. SEAM: the
 * share of seams (normals, UVs) in the lost border, 0 … 1. FAR: the distance from the chart's middle, in
 * radii of a chart of mean area. */
static const double NORMAL = 2.0, STRAIGHT = 1.0, SEAM = 2.0, FAR = 0.5;

enum {
    NORMAL_SMOOTHINGS = 2,
    MOST_SIDES = 48, /* a unit's first sides that count for straightness */
    CHUNK = 4096     /* units between checks for cancellation */
};

typedef struct unit {
    vshi_vec normal; /* smoothed over neighbours, against noise of scans */
    vshi_vec centre;
    double area;
    uint32_t number;
} unit;

typedef struct chart {
    vshi_vec axis;   /* unit */
    vshi_vec sum;    /* of normals, by area */
    vshi_vec middle; /* where growth began */
} chart;

typedef struct growing {
    const vshi_cut_mesh *surface;
    vshi_job *job;
    uint32_t count;
    unit *units;     /* [count]; one block with the arrays below */
    uint32_t *begin; /* [count + 1] in `sides` */
    uint32_t *sides; /* between units, by unit */
    unit *by_area;   /* [count]: the units, the largest first */
    uint32_t *owner; /* [count]: each unit's chart */
    chart *charts;   /* [count]: as many as there may be */
    uint32_t chart_count;
    vshi_heap heap;
    double radius;  /* of a chart, for distances from its middle */
    uint32_t added; /* units */
} growing;

/* --- units */

static int compare_areas(const void *a, const void *b) {
    const unit *x = a, *y = b;
    if (x->area != y->area) {
        return x->area > y->area ? -1 : 1;
    }
    return (x->number > y->number) - (x->number < y->number);
}

static void measure_units(growing *w) {
    const vshi_cut_mesh *s = w->surface;
    double total = 0.0;
    for (uint32_t u = 0; u < w->count; ++u) {
        unit *own = &w->units[u];
        vshi_vec normal = {0, 0, 0}, centre = {0, 0, 0};
        own->number = u;
        for (uint32_t i = s->unit_begin[u]; i < s->unit_begin[u + 1]; ++i) {
            const uint32_t triangle = s->unit_list[i];
            const double area = s->area[triangle];
            vshi_vec p[3];
            vshi_cut_mesh_corners(s, triangle, p);
            normal = vshi_add(normal, vshi_scale(s->normal[triangle], area));
            centre = vshi_add(centre, vshi_scale(vshi_add(p[0], vshi_add(p[1], p[2])), area / 3.0));
            own->area += area;
        }
        own->normal = vshi_unit(normal);
        own->centre = vshi_scale(centre, 1.0 / own->area);
        total += own->area;
    }
    if (w->count > 0) {
        memcpy(w->by_area, w->units, w->count * sizeof *w->units);
        qsort(w->by_area, w->count, sizeof *w->by_area, compare_areas);
    }
    w->radius = 0.2 * sqrt(total);
}

static void list_sides(growing *w) {
    const vshi_cut_mesh *s = w->surface;
    uint32_t count = 0;
    for (uint32_t u = 0; u < w->count; ++u) {
        for (uint32_t i = s->unit_begin[u]; i < s->unit_begin[u + 1]; ++i) {
            for (uint32_t side = 3 * s->unit_list[i]; side < 3 * s->unit_list[i] + 3; ++side) {
                if (s->partner[side] != VSHI_NONE && s->unit[s->partner[side] / 3] != u) {
                    w->sides[count++] = side;
                }
            }
        }
        w->begin[u + 1] = count;
    }
}

/* The unit beyond side growing.sides[i]. */
static uint32_t unit_beyond(const growing *w, uint32_t i) {
    return w->surface->unit[w->surface->partner[w->sides[i]] / 3];
}

static vsh_result smooth_normals(growing *w, vsh_error *error) {
    vshi_vec *before = NULL;
    VSHI_TRY(vshi_allocate((void **)&before, w->count, sizeof *before, what, error));
    for (int round = 0; round < NORMAL_SMOOTHINGS; ++round) {
        for (uint32_t u = 0; u < w->count; ++u) {
            before[u] = w->units[u].normal;
        }
        for (uint32_t u = 0; u < w->count; ++u) {
            vshi_vec sum = vshi_scale(before[u], w->units[u].area);
            for (uint32_t i = w->begin[u]; i < w->begin[u + 1]; ++i) {
                const uint32_t other = unit_beyond(w, i);
                /* a large unit counts no more than as many small ones */
                sum = vshi_add(sum, vshi_scale(before[other], fmin(w->units[other].area, w->units[u].area)));
            }
            const vshi_vec normal = vshi_unit(sum);
            if (vshi_dot(normal, normal) > 0.0) {
                w->units[u].normal = normal;
            }
        }
    }
    free(before);
    return VSH_OK;
}

/* --- charts */

/* The cost for a chart to grow by a unit. */
static double find_cost(const growing *w, uint32_t number, uint32_t by) {
    const unit *u = &w->units[number];
    const chart *c = &w->charts[by];
    double shared = 0.0, seam = 0.0, border = 0.0;
    const uint32_t begin = w->begin[number];
    uint32_t end = w->begin[number + 1];
    end = end > begin + MOST_SIDES ? begin + MOST_SIDES : end;
    for (uint32_t i = begin; i < end; ++i) {
        const double length = vshi_side_length(w->surface, w->sides[i]);
        border += length;
        if (w->owner[unit_beyond(w, i)] == by) {
            shared += length;
            seam += w->surface->soft[w->sides[i]] ? 0.0 : length;
        }
    }
    const double straight = border > 0.0 ? (border - 2.0 * shared) / border : 0.0;
    const double far = vshi_length(vshi_sub(u->centre, c->middle)) / w->radius;
    return NORMAL * (1.0 - vshi_dot(u->normal, c->axis)) + STRAIGHT * straight +
           (shared > 0.0 ? SEAM * seam / shared : 0.0) + FAR * far;
}

static vsh_result push_around(growing *w, uint32_t number, uint32_t by, vsh_error *error) {
    for (uint32_t i = w->begin[number]; i < w->begin[number + 1]; ++i) {
        const uint32_t other = unit_beyond(w, i);
        if (w->owner[other] == VSHI_NONE && vshi_dot(w->units[other].normal, w->charts[by].axis) > WIDEST) {
            VSHI_TRY(vshi_heap_push(&w->heap, find_cost(w, other, by), other, by, error));
        }
    }
    return VSH_OK;
}

static void add_to_chart(growing *w, uint32_t number, uint32_t by) {
    const unit *u = &w->units[number];
    w->owner[number] = by;
    w->charts[by].sum = vshi_add(w->charts[by].sum, vshi_scale(u->normal, u->area));
}

/* Grows the chart by the units in the heap until none fits. Its axis follows its units. */
static vsh_result grow(growing *w, vsh_error *error) {
    while (w->heap.count > 0) {
        const vshi_heap_entry next = vshi_heap_pop(&w->heap);
        if (w->owner[next.what] != VSHI_NONE) {
            continue;
        }
        chart *c = &w->charts[next.by];
        if (vshi_dot(w->units[next.what].normal, c->axis) <= WIDEST) {
            continue;
        }
        add_to_chart(w, next.what, next.by);
        c->axis = vshi_unit(c->sum);
        VSHI_TRY(push_around(w, next.what, next.by, error));
        VSHI_TRY(++w->added % CHUNK == 0 ? vshi_job_step(w->job, 0, error) : VSH_OK);
    }
    return VSH_OK;
}

/* Grows all charts, from the largest unit on. */
static vsh_result grow_all(growing *w, vsh_error *error) {
    for (uint32_t i = 0; i < w->count; ++i) {
        const uint32_t seed = w->by_area[i].number, by = w->chart_count;
        if (w->owner[seed] == VSHI_NONE) {
            w->charts[w->chart_count++] =
                (chart){.axis = w->units[seed].normal, .middle = w->units[seed].centre};
            add_to_chart(w, seed, by);
            VSHI_TRY(push_around(w, seed, by, error));
            VSHI_TRY(grow(w, error));
        }
    }
    return VSH_OK;
}

vsh_result vshi_grow_charts(const vshi_cut_mesh *surface, vshi_job *job, uint32_t *chart_of,
                            uint32_t *chart_count, vsh_error *error) {
    growing w = {.surface = surface, .job = job, .count = surface->unit_count};
    const vshi_array arrays[] = {VSHI_ARRAY(w.units, w.count),
                                 VSHI_ARRAY(w.begin, (size_t)w.count + 1),
                                 VSHI_ARRAY(w.sides, 3 * surface->count),
                                 VSHI_ARRAY(w.by_area, w.count),
                                 VSHI_ARRAY(w.owner, w.count),
                                 VSHI_ARRAY(w.charts, w.count)};
    vsh_result result;
    VSHI_TRY_DONE(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    measure_units(&w);
    list_sides(&w);
    VSHI_TRY_DONE(smooth_normals(&w, error));
    for (uint32_t u = 0; u < w.count; ++u) {
        w.owner[u] = VSHI_NONE;
    }
    VSHI_TRY_DONE(grow_all(&w, error));
    for (size_t i = 0; i < surface->count; ++i) {
        chart_of[i] = surface->unit[i] != VSHI_NONE ? w.owner[surface->unit[i]] : VSHI_NONE;
    }
    *chart_count = w.chart_count;
done:
    free(w.heap.entries);
    free(w.units);
    return result;
}
