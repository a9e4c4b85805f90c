/* Bottom-left: the largest first, each where its upper end lies lowest, over the turns that make a
 * difference. Meshes stay whole: a page takes those that its area has room for, and gives up one after the
 * other until the rest fit. */
#include "unwrap/place.h"

#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"

#include <stdlib.h>

static const char what[] = "packing charts";

enum { LEAST_TURNED = 40 };          /* texels: shorter charts are turned by quarters alone */
enum { MANY = 3000, PATIENCE = 24 }; /* charts; rows */
enum { FEW = 64 };                   /* charts that are tried at every angle, others at every second */
enum { HINT_SIDE = 128 }; /* texels: larger charts are few, and look for a place from the first row on */

/* Share of a page's texels that padded charts may have for it to be tried. */
static const double HOPE = 0.95;

vsh_result vshi_placing_begin(const vshi_packing *packing, int32_t height, vshi_item *items, size_t count,
                              vshi_job *job, vshi_placing *p, vsh_error *error) {
    *p = (vshi_placing){
        .packing = packing, .job = job, .items = items, .count = count, .least_turned = LEAST_TURNED};
    VSHI_TRY(vshi_allocate((void **)&p->masks, count, sizeof *p->masks, what, error));
    VSHI_TRY(vshi_allocate((void **)&p->angles, count, sizeof *p->angles, what, error));
    VSHI_TRY(vshi_allocate((void **)&p->fits, count, sizeof *p->fits, what, error));
    VSHI_TRY(vshi_allocate((void **)&p->order, count, sizeof *p->order, what, error));
    VSHI_TRY(vshi_allocate((void **)&p->hints, HINT_SIDE * HINT_SIDE, sizeof *p->hints, what, error));
    VSHI_TRY(vshi_page_make(packing->width, height, packing->padding, &p->page, error));
    p->page.patience = count > MANY ? PATIENCE : 0;
    p->angle_step = count > FEW ? 2 : 1;
    return VSH_OK;
}

static void drop_masks(vshi_placing *p) {
    for (size_t i = 0; p->masks != NULL && i < p->count; ++i) {
        for (int m = 0; p->masks[i] != NULL && m < VSHI_QUARTERS * p->angles[i]; ++m) {
            vshi_mask_free(&p->masks[i][m]);
        }
        free(p->masks[i]);
        p->masks[i] = NULL;
    }
}

void vshi_placing_free(vshi_placing *p) {
    drop_masks(p);
    vshi_page_free(&p->page);
    free(p->hints);
    free(p->order);
    free(p->fits);
    free(p->angles);
    free(p->masks);
    *p = (vshi_placing){0};
}

/* --- masks */

typedef struct masking {
    vshi_placing *placing;
    vsh_result *results; /* [count] */
} masking;

/* The item's masks, before quarter turns: which its number in the list of angles is told by. */
static vsh_result make_item_masks(vshi_placing *p, size_t i) {
    const vshi_item *item = &p->items[i];
    const bool plain = vshi_patch_is_box(item->patch, item->boxes) || p->fits[i][0].width < p->least_turned;
    vsh_error ignored;
    p->angles[i] = plain ? 1 : VSHI_ANGLES / p->angle_step;
    VSHI_TRY(vshi_allocate((void **)&p->masks[i], (size_t)p->angles[i], VSHI_QUARTERS * sizeof(vshi_mask),
                           what, &ignored));
    for (int n = 0; n < p->angles[i]; ++n) {
        const int a = n * p->angle_step;
        p->fits[i][a] =
            vshi_mask_fit(item->patch, item->boxes, a, p->density * item->factor, p->packing->max_stretch);
        VSHI_TRY(vshi_mask_make(item->patch, &p->fits[i][a], &p->masks[i][VSHI_QUARTERS * n], &ignored));
    }
    return VSH_OK;
}

static void make_masks(void *user, size_t begin, size_t end) {
    const masking *m = user;
    for (size_t i = begin; i < end; ++i) {
        m->results[i] = make_item_masks(m->placing, i);
    }
}

typedef struct sort_key {
    double key;
    uint64_t touched;
    uint32_t item;
} sort_key;

static int compare_sort_keys(const void *a, const void *b) {
    const sort_key *x = a, *y = b;
    if (x->key != y->key) {
        return x->key > y->key ? -1 : 1;
    }
    if (x->touched != y->touched) {
        return x->touched > y->touched ? -1 : 1;
    }
    return (x->item > y->item) - (x->item < y->item);
}

vsh_result vshi_placing_sort(vshi_placing *p, int by, vsh_error *error) {
    sort_key *keys = NULL;
    VSHI_TRY(vshi_allocate((void **)&keys, p->count, sizeof *keys, what, error));
    for (size_t i = 0; i < p->count; ++i) {
        const vshi_fit *fit = &p->fits[i][0];
        const double width = fit->width, height = fit->height, padding = p->packing->padding;
        const double key = by == VSHI_BY_SIDES  ? width + height
                           : by == VSHI_BY_AREA ? (width + padding) * (height + padding)
                                                : (width > height ? width : height);
        keys[i] = (sort_key){key, p->masks[i][0].touched, (uint32_t)i};
    }
    qsort(keys, p->count, sizeof *keys, compare_sort_keys);
    for (size_t i = 0; i < p->count; ++i) {
        p->order[i] = keys[i].item;
    }
    free(keys);
    return VSH_OK;
}

vsh_result vshi_placing_set(vshi_placing *p, double density, bool *possible, vsh_error *error) {
    masking m = {.placing = p};
    vsh_result result;
    drop_masks(p);
    p->density = density;
    *possible = true;
    VSHI_TRY_DONE(vshi_allocate((void **)&m.results, p->count, sizeof *m.results, what, error));
    const int32_t longest = p->packing->width > p->packing->height ? p->packing->width : p->packing->height;
    for (size_t i = 0; i < p->count; ++i) {
        const vshi_item *item = &p->items[i];
        p->fits[i][0] =
            vshi_mask_fit(item->patch, item->boxes, 0, density * item->factor, p->packing->max_stretch);
        const vshi_fit *fit = &p->fits[i][0];
        const int32_t longer = fit->width > fit->height ? fit->width : fit->height;
        *possible = *possible && longer <= longest;
    }
    if (!*possible) {
        goto done; /* no mask is needed to tell */
    }
    VSHI_TRY_DONE(vshi_parallel_for(p->job, p->count, 16, 0, make_masks, &m, error));
    for (size_t i = 0; i < p->count; ++i) {
        if (m.results[i] != VSH_OK) {
            result = vshi_fail(error, m.results[i], "%s: the system refused memory", what);
            goto done;
        }
    }
done:
    free(m.results);
    return result;
}

/* --- places */

/* Where a chart's box is all that it is, turning it over changes nothing. */
static int turns_of(const vshi_mask *mask) {
    return vshi_mask_is_box(mask) ? (mask->width == mask->height ? 1 : 2) : VSHI_QUARTERS;
}

static int32_t *hint_of(vshi_placing *p, const vshi_mask *mask) {
    return mask->width < HINT_SIDE && mask->height < HINT_SIDE
               ? &p->hints[mask->height * HINT_SIDE + mask->width]
               : NULL;
}

/* Finds the item's place in the page and takes it; *placed tells whether there was one. Turned masks are kept
 * for the next time. */
static vsh_result place(vshi_placing *p, uint32_t index, bool *placed, vsh_error *error) {
    vshi_item *item = &p->items[index];
    int32_t best_end = p->page.height;
    const vshi_mask *best = NULL;
    *placed = false;
    for (int n = 0; n < p->angles[index]; ++n) {
        vshi_mask *masks = &p->masks[index][VSHI_QUARTERS * n];
        for (int t = 0; t < turns_of(masks); ++t) {
            vshi_mask *turned = &masks[t];
            int32_t x, y;
            if (turned->runs == NULL) {
                VSHI_TRY(vshi_mask_turn(masks, t, turned, error));
            }
            int32_t *hint = hint_of(p, turned);
            const bool found = vshi_page_find(&p->page, turned, hint != NULL ? *hint : 0, best_end, &x, &y);
            if (found && hint != NULL) {
                *hint = y;
            }
            const int32_t end = found ? y + turned->height : 0;
            if (!found || (*placed && end == best_end && y >= item->y)) {
                continue;
            }
            best = turned;
            best_end = end;
            item->x = x;
            item->y = y;
            item->angle = n * p->angle_step;
            item->quarters = t;
            *placed = true;
        }
    }
    if (*placed) {
        item->fit = p->fits[index][item->angle];
        item->touched = best->touched;
        vshi_atlas_page_put(&p->page, best, item->x, item->y);
    }
    return VSH_OK;
}

/* Places the items of one page, those of the wanted meshes or, NULL, all that have none yet. Ends at the
 * first that finds no place where `stop`; *failed is its mesh, or VSHI_NONE. */
static vsh_result fill_page(vshi_placing *p, const uint8_t *wanted, uint32_t page, bool stop,
                            uint32_t *failed, vsh_error *error) {
    *failed = VSHI_NONE;
    vshi_page_clear(&p->page);
    memset(p->hints, 0, HINT_SIDE * HINT_SIDE * sizeof *p->hints);
    for (size_t i = 0; i < p->count; ++i) {
        vshi_item *item = &p->items[p->order[i]];
        if (item->page != VSHI_NONE || (wanted != NULL && !wanted[item->mesh])) {
            continue;
        }
        bool placed = false;
        VSHI_TRY(place(p, p->order[i], &placed, error));
        if (placed) {
            item->page = page;
        } else {
            *failed = item->mesh;
            if (stop) {
                return VSH_OK;
            }
        }
        if (i % 64 == 0 && vshi_job_advance(p->job, 0)) {
            return vshi_job_fail_cancelled(p->job, error);
        }
    }
    return VSH_OK;
}

/* Meshes by the texels that they have left to place. */
typedef struct pool {
    sort_key *meshes; /* [mesh_count], the largest first */
    uint32_t count;
    uint8_t *wanted, *split; /* [most mesh + 1] */
} pool;

static double padded_area(const vshi_placing *p, size_t i) {
    /* half of the padding around it is its own */
    const vshi_fit *fit = &p->fits[i][0];
    return (double)p->masks[i][0].touched + 0.5 * p->packing->padding * 2.0 * (fit->width + fit->height);
}

static vsh_result pool_make(const vshi_placing *p, pool *o, vsh_error *error) {
    uint32_t most = 0;
    for (size_t i = 0; i < p->count; ++i) {
        most = p->items[i].mesh > most ? p->items[i].mesh : most;
    }
    VSHI_TRY(vshi_allocate((void **)&o->meshes, (size_t)most + 1, sizeof *o->meshes, what, error));
    VSHI_TRY(vshi_allocate((void **)&o->wanted, (size_t)most + 1, 1, what, error));
    VSHI_TRY(vshi_allocate((void **)&o->split, (size_t)most + 1, 1, what, error));
    for (size_t i = 0; i < p->count; ++i) { /* items are in the order of their meshes */
        if (i == 0 || p->items[i].mesh != p->items[i - 1].mesh) {
            o->meshes[o->count++] = (sort_key){0.0, 0, p->items[i].mesh};
        }
        o->meshes[o->count - 1].key += padded_area(p, i);
    }
    qsort(o->meshes, o->count, sizeof *o->meshes, compare_sort_keys);
    return VSH_OK;
}

static void pool_free(pool *o) {
    free(o->split);
    free(o->wanted);
    free(o->meshes);
}

/* Whether every item has a page, from the meshes' point of view: drops those that have. */
static void pool_drop_placed(const vshi_placing *p, pool *o) {
    for (uint32_t m = 0; m < o->count; ++m) {
        o->wanted[o->meshes[m].item] = 0;
    }
    for (size_t i = 0; i < p->count; ++i) {
        o->wanted[p->items[i].mesh] |= p->items[i].page == VSHI_NONE;
    }
    uint32_t kept = 0;
    for (uint32_t m = 0; m < o->count; ++m) {
        if (o->wanted[o->meshes[m].item]) {
            o->meshes[kept++] = o->meshes[m];
        }
    }
    o->count = kept;
}

static void take_back(vshi_placing *p, uint32_t page) {
    for (size_t i = 0; i < p->count; ++i) {
        p->items[i].page = p->items[i].page == page ? VSHI_NONE : p->items[i].page;
    }
}

/* One page of several: as many meshes as fit it. */
static vsh_result fill_with_meshes(vshi_placing *p, pool *o, uint32_t page, vsh_error *error) {
    const double room = HOPE * p->packing->width * p->packing->height;
    double sum = 0.0;
    uint32_t chosen = 0, failed = VSHI_NONE;
    for (uint32_t m = 0; m < o->count; ++m) {
        const bool fits = sum + o->meshes[m].key <= room || chosen == 0;
        o->wanted[o->meshes[m].item] = fits;
        sum += fits ? o->meshes[m].key : 0.0;
        chosen += fits;
    }
    for (;;) {
        VSHI_TRY(fill_page(p, o->wanted, page, chosen > 1, &failed, error));
        if (failed == VSHI_NONE || chosen <= 1) {
            return VSH_OK; /* the rest of a mesh that is larger than a page goes on the next */
        }
        take_back(p, page);
        /* the smallest of those that are wanted: what is left is closest to the room that there is */
        for (uint32_t m = o->count; m-- > 0;) {
            if (o->wanted[o->meshes[m].item]) {
                o->wanted[o->meshes[m].item] = 0;
                --chosen;
                break;
            }
        }
    }
}

static void take_all_back(vshi_placing *p) {
    for (size_t i = 0; i < p->count; ++i) {
        p->items[i].page = VSHI_NONE;
    }
}

vsh_result vshi_placing_one_page(vshi_placing *p, int32_t *rows, vsh_error *error) {
    uint32_t failed = VSHI_NONE;
    take_all_back(p);
    VSHI_TRY(fill_page(p, NULL, 0, true, &failed, error));
    *rows = failed == VSHI_NONE ? p->page.used : p->page.height + 1;
    return VSH_OK;
}

vsh_result vshi_placing_pages(vshi_placing *p, uint32_t *pages, vsh_error *error) {
    const uint32_t most = p->packing->max_pages;
    uint32_t failed = VSHI_NONE;
    *pages = 1;
    take_all_back(p);
    VSHI_TRY(fill_page(p, NULL, 0, true, &failed, error));
    if (failed == VSHI_NONE) {
        return VSH_OK;
    }
    *pages = most + 1;
    take_all_back(p);
    pool o = {0};
    vsh_result result;
    VSHI_TRY_DONE(pool_make(p, &o, error));
    for (uint32_t page = 0; page < most; ++page) {
        VSHI_TRY_DONE(fill_with_meshes(p, &o, page, error));
        pool_drop_placed(p, &o);
        if (o.count == 0) {
            *pages = page + 1;
            break;
        }
    }
done:
    pool_free(&o);
    return result;
}
