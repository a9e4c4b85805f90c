/* The density at which charts just fit is found by attempts: the first from their areas and borders, then up
 * or down by steps until one fits and the next does not, then between the two. */
#include "unwrap/pack.h"

#include "base/hash.h"
#include "base/memory.h"

#include <stdlib.h>

static const double EXPECTED = 0.93; /* share of the pages that padded charts are expected to fill */
static const double CLOSE = 0.998;   /* of the density at which rows would just fit */
static const double SHRINK = 0.97;   /* of the density where it is not known by how much charts do not fit */
static const double CLIMB = 1.008, LEAST_CLIMB = 1.001; /* from one that fits to the next that is tried */
static const double OVER = 100.0;                       /* stands for: it is not known by how much */

enum {
    SMALLER = 4,
    REHEARSED = -1,
    PER_REHEARSAL = 300 /* triangles */,
    LEAST_REHEARSALS = 12,
    MOST_REHEARSALS = 200
};

enum {
    MOST_STEPS = 400,
    FEW = 300,
    MANY = 500,
    LEGION = 20000 /* charts */,
    SMALL = 10000 /* triangles */,
    ATTEMPTS = 16
};

double vshi_pack_bytes(const vshi_packing *packing, size_t count) {
    const double page =
        ((packing->width / 64.0 + 2.0) * 8.0) * (packing->height + 2.0) + 4.0 * packing->height;
    return page +
           (double)count * (VSHI_QUARTERS * sizeof(vshi_mask) + VSHI_ANGLES * sizeof(vshi_fit) + 400.0);
}

typedef struct search {
    vshi_packing *packing;
    vshi_item *items;
    size_t count;
    vshi_placing placing;
    vshi_place *best;    /* [count] */
    double best_density; /* 0: none yet */
    uint32_t best_pages;
    vshi_job *job;
    uint32_t *order; /* [count]: of rehearsals */
    bool has_order;
    size_t units, told; /* of the job: all, and what it was told of */
} search;

static void keep(search *s, double density, uint32_t pages) {
    for (size_t i = 0; i < s->count; ++i) {
        s->best[i] = s->items[i].at;
    }
    s->best_density = density;
    s->best_pages = pages;
}

static void give(search *s) {
    for (size_t i = 0; i < s->count; ++i) {
        s->items[i].at = s->best[i];
    }
    s->packing->density = s->best_density;
    s->packing->pages = s->best_pages;
}

/* --- an order found by rehearsals on a small page */

/* Rows that the order takes, and less than one for how low its charts end: the lower, the better. */
static vsh_result rehearse(vshi_placing *p, double *result_rows, vsh_error *error) {
    uint32_t pages = 0;
    int32_t rows = 0;
    double ends = 0.0;
    VSHI_TRY(vshi_placing_place(p, &pages, &rows, error));
    for (size_t i = 0; i < p->count; ++i) {
        ends += p->items[i].at.y;
    }
    *result_rows = rows + ends / ((double)p->count * p->page.height + 1.0);
    return VSH_OK;
}

static uint64_t next_random(uint64_t *state) {
    *state += UINT64_C(0x9e3779b97f4a7c15);
    return vshi_mix(*state);
}

/* Moves a chart to another place in the order, mostly a near one. */
static void move_one(uint32_t *order, size_t count, uint64_t *state) {
    const size_t from = (size_t)(next_random(state) % count),
                 reach = 1 + (size_t)(next_random(state) % count);
    const size_t far = 1 + (size_t)(next_random(state) % reach);
    const size_t to = (next_random(state) & 1) != 0 ? (from + far < count ? from + far : count - 1)
                                                    : (from > far ? from - far : 0);
    const uint32_t moved = order[from];
    if (to > from) {
        memmove(order + from, order + from + 1, (to - from) * sizeof *order);
    } else {
        memmove(order + to + 1, order + to, (from - to) * sizeof *order);
    }
    order[to] = moved;
}

/* Fills s->order: charts in the order in which some hundred attempts on a page of a quarter of the size went
 * best. */
static vsh_result find_order(search *s, double density, int tries, vsh_error *error) {
    vshi_packing small = *s->packing;
    small.width = (small.width + SMALLER - 1) / SMALLER;
    small.height = (small.height + SMALLER - 1) / SMALLER;
    small.padding = (small.padding + SMALLER - 1) / SMALLER;
    vshi_placing p;
    const size_t bytes = s->count * sizeof *s->order;
    uint64_t state = s->count;
    double best = INFINITY, rows = 0.0;
    vsh_result result;
    VSHI_TRY_DONE(vshi_placing_begin(&small, 2 * small.height, s->items, s->count, s->job, &p, error));
    p.least_turned = (p.least_turned + SMALLER - 1) / SMALLER;
    VSHI_TRY_DONE(vshi_placing_set(&p, density / SMALLER, &s->has_order, error));
    for (int by = 0; by < VSHI_ORDERS && s->has_order; ++by) {
        VSHI_TRY_DONE(vshi_placing_sort(&p, by, error));
        VSHI_TRY_DONE(rehearse(&p, &rows, error));
        if (rows < best) {
            best = rows;
            memcpy(s->order, p.order, bytes);
        }
    }
    for (int i = 0; i < tries && s->has_order; ++i) {
        memcpy(p.order, s->order, bytes);
        for (uint64_t moves = 1 + next_random(&state) % 3; moves > 0; --moves) {
            move_one(p.order, s->count, &state);
        }
        VSHI_TRY_DONE(rehearse(&p, &rows, error));
        if (rows <= best) {
            best = rows;
            memcpy(s->order, p.order, bytes);
        }
    }
done:
    vshi_placing_free(&p);
    return result;
}

/* How many attempts there will be is not known: each is some share of a guess, and the end is kept for the
 * end. */
static void tell_attempt(search *s) {
    const size_t share = s->units / ATTEMPTS;
    if (s->told + share < s->units) {
        vshi_job_advance(s->job, share);
        s->told += share;
    }
}

/* Attempts at a density in the first `orders` orders, until one fits. *over is the least that one takes of
 * the room there is; above 1 none fits. */
static vsh_result attempt(search *s, double density, int orders, double *over, vsh_error *error) {
    vshi_placing *p = &s->placing;
    bool possible = false;
    *over = INFINITY;
    VSHI_TRY(vshi_placing_set(p, density, &possible, error));
    for (int order = s->has_order ? REHEARSED : 0; order < orders && possible && *over > 1.0; ++order) {
        uint32_t pages = 0;
        int32_t rows = 0;
        if (order == REHEARSED) {
            memcpy(p->order, s->order, s->count * sizeof *s->order);
        } else {
            VSHI_TRY(vshi_placing_sort(p, order, error));
        }
        VSHI_TRY(vshi_placing_place(p, &pages, &rows, error));
        *over = fmin(*over, s->packing->max_pages == 1       ? (double)rows / s->packing->height
                            : pages <= s->packing->max_pages ? 1.0
                                                             : OVER);
        tell_attempt(s);
        if (*over <= 1.0 && density > s->best_density) {
            keep(s, density, pages);
        }
    }
    return VSH_OK;
}

/* Texels that the charts take at a density, with the padding between them. */
static double expected_area(const search *s, double density) {
    double sum = 0.0;
    for (size_t i = 0; i < s->count; ++i) {
        const vshi_item *item = &s->items[i];
        const double k = density * item->factor, width = item->boxes->size[0][0] * k,
                     height = item->boxes->size[0][1] * k, gap = s->packing->padding + 1.0,
                     share = item->patch->area / (item->boxes->size[0][0] * item->boxes->size[0][1]);
        /* what is left free of a box is of use to others in part */
        sum += (width + gap) * (height + gap) * (share > 0.0 ? sqrt(share < 1.0 ? share : 1.0) : 1.0);
    }
    return sum;
}

static double first_guess(const search *s) {
    const double room = EXPECTED * s->packing->width * s->packing->height * s->packing->max_pages;
    double low = 0.0, high = 1.0;
    while (high < 1e150 && expected_area(s, high) < room) {
        high *= 2.0;
    }
    while (high > 1e-150 && low == 0.0) {
        if (expected_area(s, 0.5 * high) < room) {
            low = 0.5 * high;
        } else {
            high *= 0.5;
        }
    }
    for (int i = 0; i < 40; ++i) {
        const double middle = 0.5 * (low + high);
        if (expected_area(s, middle) < room) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low > 0.0 ? low : high;
}

static size_t count_triangles(const search *s) {
    size_t triangles = 0;
    for (size_t i = 0; i < s->count; ++i) {
        triangles += s->items[i].patch->count;
    }
    return triangles;
}

/* How many rehearsals a packing is worth: in step with what making the charts has taken. */
static int rehearsals(const search *s) {
    const size_t tries = count_triangles(s) / PER_REHEARSAL;
    return s->packing->max_pages > 1 || s->count < 2 || s->count > FEW ? 0
           : tries < LEAST_REHEARSALS                                  ? LEAST_REHEARSALS
           : tries > MOST_REHEARSALS                                   ? MOST_REHEARSALS
                                                                       : (int)tries;
}

/* The greatest density that fits, as far as some attempts find it. */
static vsh_result find_density(search *s, int orders, int climbs, vsh_error *error) {
    double density = first_guess(s), over = INFINITY, shrink = SHRINK;
    const int tries = rehearsals(s);
    if (tries > 0) {
        VSHI_TRY(find_order(s, density, tries, error));
        orders = 1;
    }
    for (int i = 0; i < MOST_STEPS && s->best_density == 0.0; ++i) {
        VSHI_TRY(attempt(s, density, orders, &over, error));
        if (s->best_density > 0.0) {
            break;
        }
        if (over > 1.0 && over < OVER) { /* rows grow with the square of the density */
            density *= sqrt(1.0 / over) * CLOSE;
        } else {
            density *= shrink;
            shrink = shrink * shrink > 0.5 ? shrink * shrink : 0.5;
        }
    }
    if (s->best_density == 0.0) {
        return vshi_fail(
            error, VSH_ERROR_LIMIT,
            "%zu charts do not fit into %u page%s of %d × %d texels at any density, with %d texels "
            "of padding",
            s->count, s->packing->max_pages, s->packing->max_pages == 1 ? "" : "s", s->packing->width,
            s->packing->height, s->packing->padding);
    }
    double failed = INFINITY;
    for (int i = 0; i < climbs; ++i) {
        const double loose = over < 1.0 ? sqrt(1.0 / over) : 1.0;
        density = s->best_density * (loose > CLIMB ? loose : CLIMB);
        density = density < failed ? density : sqrt(s->best_density * failed);
        if (density < s->best_density * LEAST_CLIMB) {
            break;
        }
        VSHI_TRY(attempt(s, density, orders, &over, error));
        failed = over > 1.0 ? density : failed;
    }
    return VSH_OK;
}

vsh_result vshi_pack_one(vshi_packing *packing, vshi_item *items, size_t count, vshi_job *job, bool *fits,
                         vsh_error *error) {
    search s = {.packing = packing, .items = items, .count = count, .job = job};
    double over = INFINITY;
    vsh_result result;
    *fits = false;
    VSHI_TRY_DONE(vshi_allocate((void **)&s.best, count, sizeof *s.best, "packing charts", error));
    keep(&s, 0.0, 1);
    VSHI_TRY_DONE(vshi_placing_begin(packing, packing->height, items, count, job, &s.placing, error));
    VSHI_TRY_DONE(attempt(&s, packing->density, VSHI_ORDERS, &over, error));
    *fits = over <= 1.0;
    s.best_density = packing->density;
    give(&s);
done:
    vshi_placing_free(&s.placing);
    free(s.best);
    return result;
}

vsh_result vshi_pack(vshi_packing *packing, vshi_item *items, size_t count, vshi_job *job, size_t units,
                     vsh_error *error) {
    search s = {.packing = packing, .items = items, .count = count, .job = job, .units = units};
    const double asked = packing->density;
    const int32_t height = packing->max_pages == 1 ? packing->height + packing->height / 4 : packing->height;
    const int orders = count < MANY ? VSHI_ORDERS : 1;
    const int climbs = count < FEW && count_triangles(&s) > SMALL ? 8
                       : count < MANY                             ? 4
                       : count < LEGION                           ? 2
                                                                  : 1;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&s.best, count, sizeof *s.best, "packing charts", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&s.order, count, sizeof *s.order, "packing charts", error));
    VSHI_TRY_DONE(vshi_placing_begin(packing, height, items, count, job, &s.placing, error));
    if (asked > 0.0) {
        double over = INFINITY;
        VSHI_TRY_DONE(attempt(&s, asked, VSHI_ORDERS, &over, error));
        if (over > 1.0) {
            VSHI_TRY_DONE(find_density(&s, 1, 1, error));
            result = vshi_fail(
                error, VSH_ERROR_LIMIT,
                "charts do not fit into %u page%s of %d × %d texels at %g texels a unit: %.4g would fit",
                packing->max_pages, packing->max_pages == 1 ? "" : "s", packing->width, packing->height,
                asked, s.best_density);
            goto done;
        }
    } else {
        VSHI_TRY_DONE(find_density(&s, orders, climbs, error));
    }
    give(&s);
    if (vshi_job_advance(job, units - s.told)) {
        result = vshi_job_fail_cancelled(job, error);
    }
done:
    vshi_placing_free(&s.placing);
    free(s.order);
    free(s.best);
    return result;
}
