/* Charts by variational shape approximation (Cohen-Steiner, Alliez and Desbrun, 2004), with the costs of
 * chart growth that make charts round and their borders straight (as in Young's and Castaño's chart growers):
 * a first partition grows one chart after the other, from the largest unit that is left, as far as normals
 * allow; then all charts are grown again at once, from the unit in the middle of each, which evens them out.
 */
#include "unwrap/units.h"

#include "base/memory.h"
#include "base/try.h"
#include "unwrap/heap.h"

#include <stdlib.h>
#include <string.h>

/* Cosine of the angle between a unit's normal and its chart's: a spherical cap of 60° has an L2 stretch
 * of 1.05 once it is flat. */
static const double WIDEST = 0.5;

/* Weights of a unit's cost, which orders growth: the normals' difference, 0 … 0.5; the share of the unit's
 * border that would be added to the chart's less what would vanish, -1 … 1; seams of normals and UVs among
 * what vanishes, 0 … 1; the distance from the chart's middle, in radii of a chart of mean area. */
static const double NORMAL = 2.0, STRAIGHT = 1.0, SEAM = 2.0, FAR = 0.5;

enum {
    ROUNDS = 3,      /* of growing all charts again */
    SMOOTHINGS = 8,  /* of borders */
    MOST_SIDES = 48, /* of a unit that are looked at for straightness */
    CHUNK = 4096     /* units between two looks at whether to stop */
};

typedef struct chart {
    vshi_vec axis;   /* unit */
    vshi_vec sum;    /* of normals, by area */
    vshi_vec middle; /* where growth began */
    vshi_vec centre; /* by area, of what it has */
    double area;
    uint32_t seed;
} chart;

typedef struct growing {
    const vshi_units *g;
    vshi_job *job;
    uint32_t *owner;
    chart *charts; /* [units]: as many as there may be */
    uint32_t chart_count;
    vshi_heap heap;
    double radius; /* of a chart of mean area */
    uint32_t taken;
} growing;

static double cost(const growing *w, uint32_t unit, uint32_t by) {
    const vshi_units *g = w->g;
    const vshi_unit_shape *u = &g->units[unit];
    const chart *c = &w->charts[by];
    double shared = 0.0, seam = 0.0, looked = 0.0;
    const uint32_t begin = g->begin[unit];
    uint32_t end = g->begin[unit + 1];
    end = end > begin + MOST_SIDES ? begin + MOST_SIDES : end;
    for (uint32_t i = begin; i < end; ++i) {
        const double length = vshi_side_length(g->surface, g->sides[i]);
        looked += length;
        if (w->owner[vshi_units_beyond(g, g->sides[i])] == by) {
            shared += length;
            seam += g->surface->soft[g->sides[i]] ? 0.0 : length;
        }
    }
    const double straight = looked > 0.0 ? (looked - 2.0 * shared) / looked : 0.0;
    const double far = vshi_length(vshi_sub(u->centre, c->middle)) / w->radius;
    return NORMAL * (1.0 - vshi_dot(u->normal, c->axis)) + STRAIGHT * straight +
           (shared > 0.0 ? SEAM * seam / shared : 0.0) + FAR * far;
}

static vsh_result push_around(growing *w, uint32_t unit, uint32_t by, vsh_error *error) {
    const vshi_units *g = w->g;
    for (uint32_t i = g->begin[unit]; i < g->begin[unit + 1]; ++i) {
        const uint32_t other = vshi_units_beyond(g, g->sides[i]);
        if (w->owner[other] == VSHI_NONE && vshi_dot(g->units[other].normal, w->charts[by].axis) > WIDEST) {
            VSHI_TRY(vshi_heap_push(&w->heap, cost(w, other, by), other, by, error));
        }
    }
    return VSH_OK;
}

static void take(growing *w, uint32_t unit, uint32_t by) {
    const vshi_unit_shape *u = &w->g->units[unit];
    chart *c = &w->charts[by];
    w->owner[unit] = by;
    c->sum = vshi_add(c->sum, vshi_scale(u->normal, u->area));
    c->centre = vshi_add(c->centre, vshi_scale(u->centre, u->area));
    c->area += u->area;
}

static uint32_t begin_chart(growing *w, uint32_t seed) {
    const vshi_unit_shape *u = &w->g->units[seed];
    w->charts[w->chart_count] = (chart){.axis = u->normal, .middle = u->centre, .seed = seed};
    take(w, seed, w->chart_count);
    return w->chart_count++;
}

/* Grows what is in the heap until nothing fits. Axes follow what charts have where `follow`. */
static vsh_result grow(growing *w, bool follow, vsh_error *error) {
    while (w->heap.count > 0) {
        const vshi_heap_entry next = vshi_heap_pop(&w->heap);
        if (w->owner[next.what] != VSHI_NONE) {
            continue;
        }
        chart *c = &w->charts[next.by];
        if (follow && vshi_dot(w->g->units[next.what].normal, c->axis) <= WIDEST) {
            continue;
        }
        take(w, next.what, next.by);
        if (follow) {
            c->axis = vshi_unit(c->sum);
        }
        VSHI_TRY(push_around(w, next.what, next.by, error));
        if (++w->taken % CHUNK == 0 && vshi_job_advance(w->job, 0)) {
            return vshi_job_fail_cancelled(w->job, error);
        }
    }
    return VSH_OK;
}

/* Charts for what no chart has, one after the other in `order`. */
static vsh_result grow_rest(growing *w, const uint32_t *order, vsh_error *error) {
    for (uint32_t i = 0; i < w->g->count; ++i) {
        if (w->owner[order[i]] == VSHI_NONE) {
            const uint32_t by = begin_chart(w, order[i]);
            VSHI_TRY(push_around(w, order[i], by, error));
            VSHI_TRY(grow(w, true, error));
        }
    }
    return VSH_OK;
}

/* The unit in the middle of each chart, that is like it: the next seeds. */
static void find_seeds(growing *w) {
    double total = 0.0;
    for (uint32_t c = 0; c < w->chart_count; ++c) {
        chart *one = &w->charts[c];
        one->axis = vshi_unit(one->sum);
        one->middle = vshi_scale(one->centre, 1.0 / one->area);
        one->seed = VSHI_NONE;
        total += one->area;
    }
    w->radius = sqrt(total / w->chart_count / 3.0);
    for (uint32_t u = 0; u < w->g->count; ++u) {
        chart *one = &w->charts[w->owner[u]];
        const vshi_unit_shape *unit = &w->g->units[u];
        const double far = 1.0 - vshi_dot(unit->normal, one->axis) +
                           0.3 * vshi_length(vshi_sub(unit->centre, one->middle)) / w->radius;
        if (one->seed == VSHI_NONE || far < one->sum.x) {
            one->seed = u;
            one->sum.x = far; /* the least so far: the sum is not needed any more */
        }
    }
}

static vsh_result grow_again(growing *w, const uint32_t *order, vsh_error *error) {
    find_seeds(w);
    memset(w->owner, 0xff, w->g->count * sizeof *w->owner);
    for (uint32_t c = 0; c < w->chart_count; ++c) {
        chart *one = &w->charts[c];
        one->sum = one->centre = (vshi_vec){0, 0, 0};
        one->area = 0.0;
        take(w, one->seed, c);
    }
    for (uint32_t c = 0; c < w->chart_count; ++c) {
        VSHI_TRY(push_around(w, w->charts[c].seed, c, error));
    }
    VSHI_TRY(grow(w, false, error));
    return grow_rest(w, order, error);
}

/* Moves teeth of borders to the chart around them: units that hang on their own chart by one other unit, and
 * share more of their border with another. No chart falls apart by that. */
static uint32_t move_teeth(growing *w) {
    const vshi_units *g = w->g;
    uint32_t moved = 0;
    for (uint32_t u = 0; u < g->count; ++u) {
        const uint32_t own = w->owner[u], begin = g->begin[u], end = g->begin[u + 1];
        uint32_t mate = VSHI_NONE, other = VSHI_NONE;
        bool loose = end - begin <= MOST_SIDES;
        double inside = 0.0, outside = 0.0;
        for (uint32_t i = begin; i < end && loose; ++i) {
            const uint32_t beyond = vshi_units_beyond(g, g->sides[i]);
            const double length = vshi_side_length(g->surface, g->sides[i]);
            if (w->owner[beyond] == own) {
                loose = mate == VSHI_NONE || mate == beyond;
                mate = beyond;
                inside += length;
            } else if (other == VSHI_NONE || w->owner[beyond] == other) {
                other = w->owner[beyond];
                outside += g->surface->soft[g->sides[i]] ? length : 0.0;
            } else {
                loose = false; /* three charts meet here */
            }
        }
        if (loose && mate != VSHI_NONE && other != VSHI_NONE && outside > inside &&
            vshi_dot(g->units[u].normal, w->charts[other].axis) > WIDEST) {
            w->owner[u] = other;
            ++moved;
        }
    }
    return moved;
}

typedef struct by_area {
    double area;
    uint32_t unit;
} by_area;

static int compare_areas(const void *a, const void *b) {
    const by_area *x = a, *y = b;
    if (x->area != y->area) {
        return x->area > y->area ? -1 : 1;
    }
    return (x->unit > y->unit) - (x->unit < y->unit);
}

static vsh_result order_units(const vshi_units *g, uint32_t *order, double *total, vsh_error *error) {
    by_area *sorted = NULL;
    VSHI_TRY(vshi_allocate((void **)&sorted, g->count, sizeof *sorted, "growing charts", error));
    *total = 0.0;
    for (uint32_t u = 0; u < g->count; ++u) {
        sorted[u] = (by_area){g->units[u].area, u};
        *total += g->units[u].area;
    }
    qsort(sorted, g->count, sizeof *sorted, compare_areas);
    for (uint32_t u = 0; u < g->count; ++u) {
        order[u] = sorted[u].unit;
    }
    free(sorted);
    return VSH_OK;
}

vsh_result vshi_grow_charts(const vshi_units *g, vshi_job *job, uint32_t *owner, uint32_t *chart_count,
                            vsh_error *error) {
    *chart_count = 0;
    if (g->count == 0) {
        return VSH_OK;
    }
    growing w = {.g = g, .job = job, .owner = owner};
    uint32_t *order = NULL;
    double total = 0.0;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&order, g->count, sizeof *order, "growing charts", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&w.charts, g->count, sizeof *w.charts, "growing charts", error));
    VSHI_TRY_DONE(order_units(g, order, &total, error));
    memset(owner, 0xff, g->count * sizeof *owner);
    w.radius = 0.2 * sqrt(total);
    VSHI_TRY_DONE(grow_rest(&w, order, error));
    for (int round = 0; round < ROUNDS && w.chart_count < g->count; ++round) {
        VSHI_TRY_DONE(grow_again(&w, order, error));
    }
    for (int round = 0; round < SMOOTHINGS && move_teeth(&w) > 0; ++round) {
    }
    *chart_count = w.chart_count;
done:
    free(w.heap.entries);
    free(w.charts);
    free(order);
    return result;
}
