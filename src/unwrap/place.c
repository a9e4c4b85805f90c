/* Bottom-left: the largest first, each where its upper end lies lowest, over the turns that make a
 * difference. Meshes stay whole: a page takes those that its area has room for, and gives up one after the
 * other until the rest fit. */
#include "unwrap/pack.h"

#include "base/memory.h"
#include "base/parallel.h"

#include <stdlib.h>

static const char what[] = "packing charts";

enum { LEAST_TURNED = 40 };          /* texels: shorter charts are turned by quarters alone */
enum { MANY = 3000, PATIENCE = 24 }; /* charts; rows */
enum { FEW = 64 };                   /* charts that are tried at every angle, others at every second */
enum { HINT_SIDE = 128 }; /* texels: larger charts are few, and look for a place from the first row on */

/* Share of a page's texels that padded charts may have for it to be tried. */
static const double HOPE = 0.95;

/* --- pages. All columns of a row are asked at once: bit x of `forbidden` says that the mask meets a taken
 * texel if it stands at x. A run of n texels from b on is in the way of x where any of the n texels from x +
 * b on is taken, which is the row's bits or-ed over n shifts, by doubling. */

enum {
    NEEDS = 16,
    STEP = 96 /* rows of a chart for which it may miss a row that it would fit in */
};

static void page_clear(vshi_page *page) {
    memset(page->taken, 0, page->words * (size_t)page->height * sizeof *page->taken);
    for (int32_t y = 0; y < page->height; ++y) {
        if (page->width % 64 != 0) {
            page->taken[page->words * ((size_t)y + 1) - 1] = ~(uint64_t)0 << (page->width % 64);
        }
        page->free_run[y] = page->width;
    }
    page->used = 0;
}

/* to = from moved `shift` places down; both have a word behind, and what comes from beyond it is taken. */
static void or_shifted(uint64_t *to, const uint64_t *from, size_t words, uint32_t shift) {
    const size_t skip = shift / 64;
    const uint32_t bits = shift % 64;
    if (skip >= words) {
        memset(to, 0xff, words * sizeof *to);
        return;
    }
    const size_t within = words - skip; /* from[words] is all taken */
    if (bits == 0) {
        for (size_t i = 0; i < within; ++i) {
            to[i] |= from[i + skip];
        }
    } else {
        for (size_t i = 0; i < within; ++i) {
            to[i] |= from[i + skip] >> bits | from[i + skip + 1] << (64 - bits);
        }
    }
    for (size_t i = within; i < words; ++i) {
        to[i] = ~(uint64_t)0;
    }
}

static void forbid(vshi_page *page, int32_t row, vshi_run run) {
    uint64_t *grown = page->grown;
    const uint32_t length = (uint32_t)(run.end - run.begin);
    memcpy(grown, page->taken + page->words * (size_t)row, page->words * sizeof *grown);
    grown[page->words] = ~(uint64_t)0;
    uint32_t have = 1;
    for (; 2 * have <= length; have *= 2) {
        or_shifted(grown, grown, page->words, have); /* in place: words are read before they are written */
    }
    if (have < length) {
        or_shifted(grown, grown, page->words, length - have);
    }
    or_shifted(page->forbidden, grown, page->words, (uint32_t)run.begin);
}

static bool all_forbidden(const vshi_page *page) {
    uint64_t all = ~(uint64_t)0;
    for (size_t i = 0; i < page->words; ++i) {
        all &= page->forbidden[i];
    }
    return all == ~(uint64_t)0;
}

static int32_t longest_run(const vshi_mask *mask, int32_t row) {
    int32_t longest = 0;
    for (uint32_t i = mask->row[row]; i < mask->row[row + 1]; ++i) {
        const int32_t length = mask->runs[i].end - mask->runs[i].begin;
        longest = length > longest ? length : longest;
    }
    return longest;
}

/* Some rows of a mask, spread over it, and the free runs that they need. */
typedef struct needs {
    int32_t row[NEEDS], length[NEEDS];
    int32_t count;
    int32_t least; /* that every row needs */
    bool boxy;     /* which is nearly what the longest needs */
} needs;

static needs needs_of(const vshi_mask *mask) {
    needs n = {.least = mask->width};
    for (int32_t r = 0; r < mask->height; ++r) {
        const int32_t longest = longest_run(mask, r);
        n.least = longest < n.least ? longest : n.least;
    }
    n.boxy = 2 * n.least > mask->width;
    const int32_t step = mask->height > NEEDS ? mask->height / NEEDS : 1;
    for (int32_t r = step / 2; r < mask->height && n.count < NEEDS; r += step) {
        n.row[n.count] = r;
        n.length[n.count++] = longest_run(mask, r);
    }
    return n;
}

static bool may_fit(const vshi_page *page, const needs *n, int32_t y) {
    for (int32_t i = 0; i < n->count; ++i) {
        if (page->free_run[y + n->row[i]] < n->length[i]) {
            return false;
        }
    }
    return true;
}

/* The first row, y or above, at which each row of the mask may find a free run that is long enough. */
static int32_t next_row(const vshi_page *page, const vshi_mask *mask, const needs *n, int32_t y,
                        int32_t limit) {
    while (y + mask->height <= limit) {
        int32_t r = n->boxy ? mask->height - 1 : -1;
        while (r >= 0 && page->free_run[y + r] >= n->least) {
            --r;
        }
        if (r < 0 && may_fit(page, n, y)) {
            return y;
        }
        y += r < 0 ? 1 : r + 1;
    }
    return limit;
}

static bool forbid_row(vshi_page *page, const vshi_mask *mask, int32_t y, int32_t r) {
    for (uint32_t i = mask->row[r]; i < mask->row[r + 1]; ++i) {
        forbid(page, y + r, mask->runs[i]);
    }
    return all_forbidden(page);
}

/* Whether the mask fits with its first row in row y, and the first column where it does. Rows far from each
 * other are asked first: they tell most. */
static bool fits_row(vshi_page *page, const vshi_mask *mask, int32_t y, int32_t *x) {
    const int32_t last = page->width - mask->width; /* the last column that the mask may stand at */
    for (size_t i = 0; i < page->words; ++i) {
        const int32_t allowed = last + 1 - (int32_t)(64 * i);
        page->forbidden[i] = allowed >= 64 ? 0 : allowed <= 0 ? ~(uint64_t)0 : ~(uint64_t)0 << allowed;
    }
    int32_t half = 1;
    while (2 * half < mask->height) {
        half *= 2;
    }
    for (; half > 0; half /= 2) {
        for (int32_t r = half; r < mask->height; r += 2 * half) {
            if (forbid_row(page, mask, y, r)) {
                return false;
            }
        }
    }
    if (forbid_row(page, mask, y, 0)) {
        return false;
    }
    for (size_t i = 0; i < page->words; ++i) {
        if (page->forbidden[i] != ~(uint64_t)0) {
            *x = (int32_t)(64 * i) + __builtin_ctzll(~page->forbidden[i]);
            return true;
        }
    }
    return false;
}

/* The lowest place at or above `row`, and there the leftmost, at which a mask touches no taken texel and ends
 * at or below row `limit`; false where there is none. */
static bool page_find(vshi_page *page, const vshi_mask *mask, int32_t row, int32_t limit, int32_t *x,
                      int32_t *y) {
    if (mask->width > page->width) {
        return false;
    }
    limit = limit < page->height ? limit : page->height;
    const needs n = needs_of(mask);
    int32_t step = 1 + mask->height / STEP, patience = page->patience;
    for (int32_t at = row; (at = next_row(page, mask, &n, at, limit)) + mask->height <= limit; at += step) {
        if (fits_row(page, mask, at, x)) {
            *y = at;
            while (*y > row && at - *y < step && may_fit(page, &n, *y - 1) &&
                   fits_row(page, mask, *y - 1, x)) {
                --*y; /* it has stepped over it */
            }
            return true;
        }
        if (page->patience > 0 && --patience == 0) {
            patience = page->patience;
            step *= 2;
        }
    }
    return false;
}

static int32_t find_free_run(const vshi_page *page, int32_t y) {
    const uint64_t *row = page->taken + page->words * (size_t)y;
    int32_t longest = 0;
    for (int32_t begin = 0, end; (begin = vshi_bits_next(row, begin, page->width, false)) < page->width;
         begin = end) {
        end = vshi_bits_next(row, begin, page->width, true);
        longest = end - begin > longest ? end - begin : longest;
    }
    return longest;
}

/* Takes the mask's texels there, and those within the padding. */
static void page_put(vshi_page *page, const vshi_mask *mask, int32_t x, int32_t y) {
    const int32_t low = y - page->padding > 0 ? y - page->padding : 0;
    const int32_t high = y + mask->height + page->padding;
    for (int32_t r = 0; r < mask->height; ++r) {
        const int32_t from = y + r - page->padding > 0 ? y + r - page->padding : 0;
        const int32_t until =
            y + r + page->padding < page->height - 1 ? y + r + page->padding : page->height - 1;
        for (uint32_t i = mask->row[r]; i < mask->row[r + 1]; ++i) {
            const int32_t begin = x + mask->runs[i].begin - page->padding,
                          end = x + mask->runs[i].end + page->padding;
            for (int32_t to = from; to <= until; ++to) {
                vshi_bits_set(page->taken + page->words * (size_t)to, begin > 0 ? begin : 0,
                              end < page->width ? end : page->width);
            }
        }
    }
    for (int32_t to = low; to < high && to < page->height; ++to) {
        page->free_run[to] = find_free_run(page, to);
    }
    page->used = y + mask->height > page->used ? y + mask->height : page->used;
}

/* --- one attempt */

vsh_result vshi_placing_begin(const vshi_packing *packing, int32_t height, vshi_item *items, size_t count,
                              vshi_job *job, vshi_placing *p, vsh_error *error) {
    *p = (vshi_placing){
        .packing = packing, .job = job, .items = items, .count = count, .least_turned = LEAST_TURNED};
    p->angle_step = count > FEW ? 2 : 1;
    vshi_page *page = &p->page;
    *page = (vshi_page){.width = packing->width,
                        .height = height,
                        .padding = packing->padding,
                        .words = ((size_t)packing->width + 63) / 64,
                        .patience = count > MANY ? PATIENCE : 0};
    const vshi_array arrays[] = {VSHI_ARRAY(p->masks, count),
                                 VSHI_ARRAY(p->angles, count),
                                 VSHI_ARRAY(p->fits, count),
                                 VSHI_ARRAY(p->order, count),
                                 VSHI_ARRAY(p->hints, HINT_SIDE * HINT_SIDE),
                                 VSHI_ARRAY(page->taken, page->words * (size_t)height),
                                 VSHI_ARRAY(page->free_run, (size_t)height),
                                 VSHI_ARRAY(page->forbidden, page->words + 1),
                                 VSHI_ARRAY(page->grown, page->words + 1)};
    return VSHI_ALLOCATE_ALL(arrays, what, error);
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
    free(p->page.grown);
    free(p->page.forbidden);
    free(p->page.free_run);
    free(p->page.taken);
    free(p->hints);
    free(p->order);
    free(p->fits);
    free(p->angles);
    free(p->masks);
    *p = (vshi_placing){0};
}

/* --- masks */

/* A vshi_element_fn over items. Makes an item's masks, before quarter turns: those of angle number n are from
 * VSHI_QUARTERS n on. */
static vsh_result make_masks(void *user, size_t i, vsh_error *error) {
    vshi_placing *p = user;
    const vshi_item *item = &p->items[i];
    const bool plain = vshi_patch_is_box(item->patch, item->boxes) || p->fits[i][0].width < p->least_turned;
    p->angles[i] = plain ? 1 : VSHI_ANGLES / p->angle_step;
    VSHI_TRY(vshi_allocate((void **)&p->masks[i], (size_t)p->angles[i], VSHI_QUARTERS * sizeof(vshi_mask),
                           what, error));
    for (int n = 0; n < p->angles[i]; ++n) {
        const int a = n * p->angle_step;
        p->fits[i][a] =
            vshi_mask_fit(item->patch, item->boxes, a, p->density * item->factor, p->packing->max_stretch);
        VSHI_TRY(vshi_mask_make(item->patch, &p->fits[i][a], &p->masks[i][VSHI_QUARTERS * n], error));
    }
    return VSH_OK;
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
    drop_masks(p);
    p->density = density;
    *possible = true;
    const int32_t longest = p->packing->width > p->packing->height ? p->packing->width : p->packing->height;
    for (size_t i = 0; i < p->count; ++i) {
        const vshi_item *item = &p->items[i];
        p->fits[i][0] =
            vshi_mask_fit(item->patch, item->boxes, 0, density * item->factor, p->packing->max_stretch);
        const vshi_fit *fit = &p->fits[i][0];
        const int32_t longer = fit->width > fit->height ? fit->width : fit->height;
        *possible = *possible && longer <= longest;
    }
    return *possible ? vshi_parallel_each(p->job, p->count, 16, 0, make_masks, p, error) : VSH_OK;
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
    vshi_place *at = &p->items[index].at;
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
            const bool found = page_find(&p->page, turned, hint != NULL ? *hint : 0, best_end, &x, &y);
            if (found && hint != NULL) {
                *hint = y;
            }
            const int32_t end = found ? y + turned->height : 0;
            if (!found || (*placed && end == best_end && y >= at->y)) {
                continue;
            }
            best = turned;
            best_end = end;
            at->x = x;
            at->y = y;
            at->angle = n * p->angle_step;
            at->quarters = t;
            *placed = true;
        }
    }
    if (*placed) {
        at->fit = p->fits[index][at->angle];
        at->touched = best->touched;
        page_put(&p->page, best, at->x, at->y);
    }
    return VSH_OK;
}

/* Places the items of one page, those of the wanted meshes or, NULL, all that have none yet. Ends at the
 * first that finds no place where `stop`; *failed is its mesh, or VSHI_NONE. */
static vsh_result fill_page(vshi_placing *p, const uint8_t *wanted, uint32_t page, bool stop,
                            uint32_t *failed, vsh_error *error) {
    *failed = VSHI_NONE;
    page_clear(&p->page);
    memset(p->hints, 0, HINT_SIDE * HINT_SIDE * sizeof *p->hints);
    for (size_t i = 0; i < p->count; ++i) {
        vshi_item *item = &p->items[p->order[i]];
        if (item->at.page != VSHI_NONE || (wanted != NULL && !wanted[item->mesh])) {
            continue;
        }
        bool placed = false;
        VSHI_TRY(place(p, p->order[i], &placed, error));
        if (placed) {
            item->at.page = page;
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
    uint8_t *wanted; /* [most mesh + 1] */
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
    for (size_t i = 0; i < p->count; ++i) { /* items are in the order of their meshes */
        if (i == 0 || p->items[i].mesh != p->items[i - 1].mesh) {
            o->meshes[o->count++] = (sort_key){0.0, 0, p->items[i].mesh};
        }
        o->meshes[o->count - 1].key += padded_area(p, i);
    }
    qsort(o->meshes, o->count, sizeof *o->meshes, compare_sort_keys);
    return VSH_OK;
}

/* Whether every item has a page, from the meshes' point of view: drops those that have. */
static void pool_drop_placed(const vshi_placing *p, pool *o) {
    for (uint32_t m = 0; m < o->count; ++m) {
        o->wanted[o->meshes[m].item] = 0;
    }
    for (size_t i = 0; i < p->count; ++i) {
        o->wanted[p->items[i].mesh] |= p->items[i].at.page == VSHI_NONE;
    }
    uint32_t kept = 0;
    for (uint32_t m = 0; m < o->count; ++m) {
        if (o->wanted[o->meshes[m].item]) {
            o->meshes[kept++] = o->meshes[m];
        }
    }
    o->count = kept;
}

/* Takes the items of a page, or with VSHI_NONE all, off. */
static void take_back(vshi_placing *p, uint32_t page) {
    for (size_t i = 0; i < p->count; ++i) {
        uint32_t *own = &p->items[i].at.page;
        *own = page == VSHI_NONE || *own == page ? VSHI_NONE : *own;
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

vsh_result vshi_placing_place(vshi_placing *p, uint32_t *pages, int32_t *rows, vsh_error *error) {
    const uint32_t most = p->packing->max_pages;
    uint32_t failed = VSHI_NONE;
    *pages = 1;
    take_back(p, VSHI_NONE);
    VSHI_TRY(fill_page(p, NULL, 0, true, &failed, error));
    *rows = failed == VSHI_NONE ? p->page.used : p->page.height + 1;
    if (failed == VSHI_NONE || most == 1) {
        return VSH_OK;
    }
    *pages = most + 1;
    take_back(p, VSHI_NONE);
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
    free(o.wanted);
    free(o.meshes);
    return result;
}
