/* The density at which charts just fit is found by attempts: the first from their areas and borders, then up
 * or down by steps until one fits and the next does not, then between the two. */
#include "unwrap/pack.h"

#include "base/memory.h"
#include "base/try.h"
#include "unwrap/place.h"

#include <stdlib.h>

static const double EXPECTED = 0.93; /* share of the pages that padded charts are expected to fill */
static const double STEP = 1.03;     /* of the density between attempts before one fits and one does not */
static const double CLOSE = 1.002;   /* between the best that fits and the least that does not: near enough */
enum { MOST_STEPS = 400 };

double vshi_pack_bytes(const vshi_packing *packing, size_t count) {
    return vshi_page_bytes(packing->width, packing->height) + (double)count * (sizeof(vshi_mask) + 200.0);
}

/* Places of the best attempt. */
typedef struct kept {
    uint32_t page;
    int32_t x, y, quarters;
    vshi_fit fit;
    uint64_t touched;
} kept;

typedef struct search {
    vshi_packing *packing;
    vshi_item *items;
    size_t count;
    vshi_placing placing;
    kept *best;
    double best_density; /* 0: none yet */
    uint32_t best_pages;
    int attempts;
} search;

static void keep(search *s, double density, uint32_t pages) {
    for (size_t i = 0; i < s->count; ++i) {
        const vshi_item *item = &s->items[i];
        s->best[i] = (kept){item->page, item->x, item->y, item->quarters, item->fit, item->touched};
    }
    s->best_density = density;
    s->best_pages = pages;
}

static void give(search *s) {
    for (size_t i = 0; i < s->count; ++i) {
        vshi_item *item = &s->items[i];
        item->page = s->best[i].page;
        item->x = s->best[i].x;
        item->y = s->best[i].y;
        item->quarters = s->best[i].quarters;
        item->fit = s->best[i].fit;
        item->touched = s->best[i].touched;
    }
    s->packing->density = s->best_density;
    s->packing->pages = s->best_pages;
}

static vsh_result attempt(search *s, double density, int by, bool *fits, vsh_error *error) {
    uint32_t pages = 0;
    VSHI_TRY(vshi_placing_set(&s->placing, density, by, error));
    VSHI_TRY(vshi_placing_run(&s->placing, &pages, error));
    ++s->attempts;
    *fits = pages <= s->packing->max_pages;
    if (*fits && density > s->best_density) {
        keep(s, density, pages);
    }
    return VSH_OK;
}

/* Texels that the charts take at a density, with the padding between them. */
static double expected_area(const search *s, double density) {
    double sum = 0.0;
    for (size_t i = 0; i < s->count; ++i) {
        const vshi_item *item = &s->items[i];
        const double k = density * item->factor, width = item->size[0] * k, height = item->size[1] * k,
                     gap = s->packing->padding + 1.0,
                     share = item->patch->area / (item->size[0] * item->size[1]);
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

/* The greatest density that fits, as far as `most` attempts between find it. */
static vsh_result find_density(search *s, int most, vsh_error *error) {
    double low = 0.0, high = 0.0, step = STEP, density = first_guess(s);
    bool fits = false;
    for (int i = 0; i < MOST_STEPS && (low == 0.0 || high == 0.0); ++i) {
        VSHI_TRY(attempt(s, density, VSHI_BY_SIDES, &fits, error));
        if (fits) {
            low = density;
            density *= step;
        } else {
            high = density;
            density /= step;
        }
        step = i < 3 ? STEP : step * 1.2 < 2.0 ? step * 1.2 : 2.0;
    }
    if (low == 0.0) {
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "%zu charts do not fit into %u page%s of %d × %d texels at any density, with %d "
                         "texels of padding",
                         s->count, s->packing->max_pages, s->packing->max_pages == 1 ? "" : "s",
                         s->packing->width, s->packing->height, s->packing->padding);
    }
    for (int i = 0; i < most && high / low > CLOSE; ++i) {
        density = sqrt(low * high);
        fits = false;
        for (int by = 0; by < VSHI_ORDERS && !fits; ++by) {
            VSHI_TRY(attempt(s, density, by, &fits, error));
        }
        if (fits) {
            low = density;
        } else {
            high = density;
        }
    }
    return VSH_OK;
}

vsh_result vshi_pack(vshi_packing *packing, vshi_item *items, size_t count, vshi_job *job, size_t units,
                     vsh_error *error) {
    search s = {.packing = packing, .items = items, .count = count};
    const double asked = packing->density;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&s.best, count, sizeof *s.best, "packing charts", error));
    VSHI_TRY_DONE(vshi_placing_begin(packing, items, count, job, &s.placing, error));
    const int refine = count < 300 ? 5 : count < 3000 ? 4 : count < 20000 ? 3 : 2;
    if (asked > 0.0) {
        bool fits = false;
        for (int by = 0; by < VSHI_ORDERS && !fits; ++by) {
            VSHI_TRY_DONE(attempt(&s, asked, by, &fits, error));
        }
        if (!fits) {
            VSHI_TRY_DONE(find_density(&s, 1, error));
            result = vshi_fail(
                error, VSH_ERROR_LIMIT,
                "charts do not fit into %u page%s of %d × %d texels at %g texels a unit: %.4g would fit",
                packing->max_pages, packing->max_pages == 1 ? "" : "s", packing->width, packing->height,
                asked, s.best_density);
            goto done;
        }
    } else {
        VSHI_TRY_DONE(find_density(&s, refine, error));
    }
    give(&s);
    vshi_job_advance(job, units);
done:
    vshi_placing_free(&s.placing);
    free(s.best);
    return result;
}
