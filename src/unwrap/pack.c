/* Charts packed into pages. The density at which they just fit is found by attempts: first a guess from their
 * areas and borders, then steps up or down until one fits and the next does not, then densities between. */
#include "unwrap/charts.h"

#include "base/memory.h"
#include "base/parallel.h"

#include <stdlib.h>

static const char what[] = "packing charts";

/* --- Bottom-left: the largest chart first, each where its upper end is lowest, over all turns that differ.
 * Meshes stay whole: a page gets as many as its area has room for, and drops one after the other until the
 * rest fit. */

/* Which texels of a page are taken. */
typedef struct atlas_page {
    int32_t width, height, padding;
    size_t words;      /* of a row */
    uint64_t *taken;   /* [height][words]: texels that no other chart may touch; set past the width */
    int32_t *free_run; /* [height]: longest run of free texels */
    int32_t used;      /* rows up to the last that a chart touches */
    int32_t patience;  /* rows that a search tries before it begins to skip some; 0: all */
    uint64_t *forbidden, *grown; /* [words + 1]: scratch of the search */
} atlas_page;

typedef struct placing {
    const vshi_packing *packing;
    vshi_job *job;
    vshi_pack_item *items; /* [count] */
    size_t count;
    double density;
    vshi_mask **masks; /* [count][angles × VSHI_QUARTERS]; runs are NULL for turns not yet made; one
                          block with all arrays, those of the page too */
    int *angles;       /* [count]: how many are tried of each */
    vshi_fit (*fits)[VSHI_ANGLES]; /* [count] */
    uint32_t *order;               /* [count]: items in the order in which they are placed */
    atlas_page page;
    int32_t *hints; /* row where the last chart of a size was placed */
} placing;

enum { LEAST_TURNED = 40 };               /* texels: shorter charts are turned by quarters only */
enum { IMPATIENT = 3000, PATIENCE = 24 }; /* charts; rows */
enum { HINT_SIDE = 128 }; /* texels: larger charts are few, and search from the first row on */

/* Largest share of a page's texels that padded charts may have: with more, a page is not even tried. */
static const double HOPE = 0.95;

/* --- pages. All columns of a row are tested at once: bit x of `forbidden` says that a mask at x meets a
 * taken texel. A run of n texels from b on forbids x if any of the n texels from x + b on is taken. Those
 * bits are the row's bits or-ed over n shifts, by doubling. */

enum {
    NEEDS = 16,
    STEP = 96 /* rows of a chart for each row that its search skips */
};

static void page_clear(atlas_page *page) {
    memset(page->taken, 0, page->words * (size_t)page->height * sizeof *page->taken);
    for (int32_t y = 0; y < page->height; ++y) {
        if (page->width % 64 != 0) {
            page->taken[page->words * ((size_t)y + 1) - 1] = ~(uint64_t)0 << (page->width % 64);
        }
        page->free_run[y] = page->width;
    }
    page->used = 0;
}

/* to |= from moved down by `shift` bits. Both have one more word; bits beyond it count as taken. */
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

static void forbid(atlas_page *page, int32_t row, vshi_run run) {
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

static bool all_forbidden(const atlas_page *page) {
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
    int32_t least; /* free run that every row needs */
    bool boxy;     /* `least` is over half of the mask's width */
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

static bool may_fit(const atlas_page *page, const needs *n, int32_t y) {
    for (int32_t i = 0; i < n->count; ++i) {
        if (page->free_run[y + n->row[i]] < n->length[i]) {
            return false;
        }
    }
    return true;
}

/* The first row from y on at which the mask's rows may find free runs that are long enough. */
static int32_t find_next_row(const atlas_page *page, const vshi_mask *mask, const needs *n, int32_t y,
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

static bool forbid_row(atlas_page *page, const vshi_mask *mask, int32_t y, int32_t r) {
    for (uint32_t i = mask->row[r]; i < mask->row[r + 1]; ++i) {
        forbid(page, y + r, mask->runs[i]);
    }
    return all_forbidden(page);
}

/* Whether the mask fits with its first row in row y, and the first column for it. Rows far from each other
 * come first: they decide most cases. */
static bool fits_row(atlas_page *page, const vshi_mask *mask, int32_t y, int32_t *x) {
    const int32_t last = page->width - mask->width; /* the last column for the mask */
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

/* The lowest place from `row` on, and there the leftmost, where a mask touches no taken texel and ends at row
 * `limit` at most; false if there is none. */
static bool find_place(atlas_page *page, const vshi_mask *mask, int32_t row, int32_t limit, int32_t *x,
                       int32_t *y) {
    if (mask->width > page->width) {
        return false;
    }
    limit = limit < page->height ? limit : page->height;
    const needs n = needs_of(mask);
    int32_t step = 1 + mask->height / STEP, patience = page->patience;
    for (int32_t at = row; (at = find_next_row(page, mask, &n, at, limit)) + mask->height <= limit;
         at += step) {
        if (fits_row(page, mask, at, x)) {
            *y = at;
            while (*y > row && at - *y < step && may_fit(page, &n, *y - 1) &&
                   fits_row(page, mask, *y - 1, x)) {
                --*y; /* a row that was skipped */
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

static int32_t find_free_run(const atlas_page *page, int32_t y) {
    const uint64_t *row = page->taken + page->words * (size_t)y;
    int32_t longest = 0;
    for (int32_t begin = 0, end; (begin = vshi_bits_next(row, begin, page->width, false)) < page->width;
         begin = end) {
        end = vshi_bits_next(row, begin, page->width, true);
        longest = end - begin > longest ? end - begin : longest;
    }
    return longest;
}

/* Marks the mask's texels and those within the padding as taken. */
static void mark_taken(atlas_page *page, const vshi_mask *mask, int32_t x, int32_t y) {
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

/* The page is `height` texels high, at least the packing's. Free with placing_free(), after a failure too.
 * Errors: VSH_ERROR_MEMORY. */
static vsh_result placing_begin(const vshi_packing *packing, int32_t height, vshi_pack_item *items,
                                size_t count, vshi_job *job, placing *p, vsh_error *error) {
    *p = (placing){.packing = packing, .job = job, .items = items, .count = count};
    atlas_page *page = &p->page;
    *page = (atlas_page){.width = packing->width,
                         .height = height,
                         .padding = packing->padding,
                         .words = ((size_t)packing->width + 63) / 64,
                         .patience = count > IMPATIENT ? PATIENCE : 0};
    const vshi_array arrays[] = {VSHI_ARRAY(p->masks, count),
                                 VSHI_ARRAY(p->angles, count),
                                 VSHI_ARRAY(p->fits, count),
                                 VSHI_ARRAY(p->order, count),
                                 VSHI_ARRAY(p->hints, HINT_SIDE * HINT_SIDE),
                                 VSHI_ARRAY(page->taken, page->words * (size_t)height),
                                 VSHI_ARRAY(page->free_run, (size_t)height),
                                 VSHI_ARRAY(page->forbidden, page->words + 1),
                                 VSHI_ARRAY(page->grown, page->words + 1)};
    return VSHI_ALLOCATE_BLOCK(arrays, what, error);
}

static void drop_masks(placing *p) {
    for (size_t i = 0; p->masks != NULL && i < p->count; ++i) {
        for (int m = 0; p->masks[i] != NULL && m < VSHI_QUARTERS * p->angles[i]; ++m) {
            vshi_mask_free(&p->masks[i][m]);
        }
        free(p->masks[i]);
        p->masks[i] = NULL;
    }
}

static void placing_free(placing *p) {
    drop_masks(p);
    free(p->masks);
}

/* --- masks */

/* A vshi_element_fn over items. Makes an item's masks, before quarter turns: the mask of angle n is number
 * VSHI_QUARTERS n. */
static vsh_result make_masks(void *user, size_t i, vsh_error *error) {
    placing *p = user;
    const vshi_pack_item *item = &p->items[i];
    const bool plain = vshi_patch_is_box(item->patch) || p->fits[i][0].width < LEAST_TURNED;
    p->angles[i] = plain ? 1 : VSHI_ANGLES;
    VSHI_TRY(vshi_allocate((void **)&p->masks[i], (size_t)p->angles[i], VSHI_QUARTERS * sizeof(vshi_mask),
                           what, error));
    for (int a = 0; a < p->angles[i]; ++a) {
        p->fits[i][a] = vshi_mask_fit(item->patch, a, p->density * item->factor, p->packing->max_stretch);
        VSHI_TRY(vshi_mask_make(item->patch, &p->fits[i][a], &p->masks[i][VSHI_QUARTERS * a], error));
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

static vsh_result sort_items(placing *p, vsh_error *error) {
    sort_key *keys = NULL;
    VSHI_TRY(vshi_allocate((void **)&keys, p->count, sizeof *keys, what, error));
    for (size_t i = 0; i < p->count; ++i) {
        const vshi_fit *fit = &p->fits[i][0];
        keys[i] = (sort_key){(double)fit->width + fit->height, p->masks[i][0].touched, (uint32_t)i};
    }
    qsort(keys, p->count, sizeof *keys, compare_sort_keys);
    for (size_t i = 0; i < p->count; ++i) {
        p->order[i] = keys[i].item;
    }
    free(keys);
    return VSH_OK;
}

/* Fits the items to a density. *possible: none is larger than a page. Errors: VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED. */
static vsh_result set_density(placing *p, double density, bool *possible, vsh_error *error) {
    drop_masks(p);
    p->density = density;
    *possible = true;
    const int32_t longest = p->packing->width > p->packing->height ? p->packing->width : p->packing->height;
    for (size_t i = 0; i < p->count; ++i) {
        const vshi_pack_item *item = &p->items[i];
        p->fits[i][0] = vshi_mask_fit(item->patch, 0, density * item->factor, p->packing->max_stretch);
        const vshi_fit *fit = &p->fits[i][0];
        const int32_t longer = fit->width > fit->height ? fit->width : fit->height;
        *possible = *possible && longer <= longest;
    }
    return *possible ? vshi_parallel_each(p->job, p->count, 16, 0, make_masks, p, error) : VSH_OK;
}

/* --- places */

/* Turns that differ: a chart that fills its box looks the same after half a turn. */
static int count_turns(const vshi_mask *mask) {
    const bool box = mask->touched == (uint64_t)mask->width * (uint64_t)mask->height;
    return !box ? VSHI_QUARTERS : mask->width == mask->height ? 1 : 2;
}

static int32_t *find_hint(placing *p, const vshi_mask *mask) {
    return mask->width < HINT_SIDE && mask->height < HINT_SIDE
               ? &p->hints[mask->height * HINT_SIDE + mask->width]
               : NULL;
}

/* Places an item in the page; *placed tells whether there was room. Keeps the turned masks. */
static vsh_result place_item(placing *p, uint32_t index, bool *placed, vsh_error *error) {
    vshi_place *at = &p->items[index].at;
    int32_t best_end = p->page.height;
    const vshi_mask *best = NULL;
    *placed = false;
    for (int n = 0; n < p->angles[index]; ++n) {
        vshi_mask *masks = &p->masks[index][VSHI_QUARTERS * n];
        for (int t = 0; t < count_turns(masks); ++t) {
            vshi_mask *turned = &masks[t];
            int32_t x, y;
            if (turned->runs == NULL) {
                VSHI_TRY(vshi_mask_turn(masks, t, turned, error));
            }
            int32_t *hint = find_hint(p, turned);
            const bool found = find_place(&p->page, turned, hint != NULL ? *hint : 0, best_end, &x, &y);
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
            at->angle = n;
            at->quarters = t;
            *placed = true;
        }
    }
    if (*placed) {
        at->fit = p->fits[index][at->angle];
        at->touched = best->touched;
        mark_taken(&p->page, best, at->x, at->y);
    }
    return VSH_OK;
}

/* Places the items of one page: those of the wanted meshes or, with NULL, all without a place. With `stop`,
 * ends at the first item without room. *failed is its mesh, or VSHI_NONE. */
static vsh_result fill_page(placing *p, const uint8_t *wanted, uint32_t page, bool stop, uint32_t *failed,
                            vsh_error *error) {
    *failed = VSHI_NONE;
    page_clear(&p->page);
    memset(p->hints, 0, HINT_SIDE * HINT_SIDE * sizeof *p->hints);
    for (size_t i = 0; i < p->count; ++i) {
        vshi_pack_item *item = &p->items[p->order[i]];
        if (item->at.page != VSHI_NONE || (wanted != NULL && !wanted[item->mesh])) {
            continue;
        }
        bool placed = false;
        VSHI_TRY(place_item(p, p->order[i], &placed, error));
        if (placed) {
            item->at.page = page;
        } else {
            *failed = item->mesh;
            if (stop) {
                return VSH_OK;
            }
        }
        VSHI_TRY(i % 64 == 0 ? vshi_job_step(p->job, 0, error) : VSH_OK);
    }
    return VSH_OK;
}

/* Meshes with items that are still to be placed. */
typedef struct pool {
    sort_key *meshes; /* [mesh_count], the largest first; one block with `wanted` */
    uint32_t count;
    uint8_t *wanted; /* [highest mesh + 1] */
} pool;

static double padded_area(const placing *p, size_t i) {
    /* half of the padding around a chart counts as its own */
    const vshi_fit *fit = &p->fits[i][0];
    return (double)p->masks[i][0].touched + 0.5 * p->packing->padding * 2.0 * (fit->width + fit->height);
}

static vsh_result pool_make(const placing *p, pool *o, vsh_error *error) {
    uint32_t most = 0;
    for (size_t i = 0; i < p->count; ++i) {
        most = p->items[i].mesh > most ? p->items[i].mesh : most;
    }
    const vshi_array arrays[] = {VSHI_ARRAY(o->meshes, (size_t)most + 1),
                                 VSHI_ARRAY(o->wanted, (size_t)most + 1)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    for (size_t i = 0; i < p->count; ++i) { /* items are in the order of their meshes */
        if (i == 0 || p->items[i].mesh != p->items[i - 1].mesh) {
            o->meshes[o->count++] = (sort_key){0.0, 0, p->items[i].mesh};
        }
        o->meshes[o->count - 1].key += padded_area(p, i);
    }
    qsort(o->meshes, o->count, sizeof *o->meshes, compare_sort_keys);
    return VSH_OK;
}

/* Drops the meshes all of whose items have a page. */
static void drop_placed(const placing *p, pool *o) {
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

/* Removes the items of a page, or with VSHI_NONE all, from their page. */
static void clear_places(placing *p, uint32_t page) {
    for (size_t i = 0; i < p->count; ++i) {
        uint32_t *own = &p->items[i].at.page;
        *own = page == VSHI_NONE || *own == page ? VSHI_NONE : *own;
    }
}

/* Fills one of several pages with as many meshes as fit. */
static vsh_result fill_with_meshes(placing *p, pool *o, uint32_t page, vsh_error *error) {
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
            return VSH_OK; /* a mesh larger than a page continues on the next */
        }
        clear_places(p, page);
        /* drop the smallest wanted mesh: that leaves the fullest page */
        for (uint32_t m = o->count; m-- > 0;) {
            if (o->wanted[o->meshes[m].item]) {
                o->wanted[o->meshes[m].item] = 0;
                --chosen;
                break;
            }
        }
    }
}

/* Places all items on one page or, without room there, on as many as needed; max_pages + 1 if they do not
 * fit. *rows counts the rows used of one page, and is more than its height if that is too small. Errors:
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
static vsh_result place_all(placing *p, uint32_t *pages, int32_t *rows, vsh_error *error) {
    const uint32_t most = p->packing->max_pages;
    uint32_t failed = VSHI_NONE;
    *pages = 1;
    clear_places(p, VSHI_NONE);
    VSHI_TRY(fill_page(p, NULL, 0, true, &failed, error));
    *rows = failed == VSHI_NONE ? p->page.used : p->page.height + 1;
    if (failed == VSHI_NONE || most == 1) {
        return VSH_OK;
    }
    *pages = most + 1;
    clear_places(p, VSHI_NONE);
    pool o = {0};
    vsh_result result;
    VSHI_TRY_DONE(pool_make(p, &o, error));
    for (uint32_t page = 0; page < most; ++page) {
        VSHI_TRY_DONE(fill_with_meshes(p, &o, page, error));
        drop_placed(p, &o);
        if (o.count == 0) {
            *pages = page + 1;
            break;
        }
    }
done:
    free(o.meshes);
    return result;
}

/* --- attempts at densities */

static const double EXPECTED = 0.93; /* share of the pages that padded charts are expected to fill */
static const double CLOSE = 0.998;   /* of the density at which rows would just fit */
static const double SHRINK = 0.97;   /* of the density if the excess is unknown */
static const double CLIMB = 1.008, LEAST_CLIMB = 1.001; /* from one that fits to the next attempt */
static const double OVER = 100.0;                       /* an unknown excess */

enum { MOST_STEPS = 400, MANY = 500 /* charts */, ATTEMPTS = 16 };

double vshi_pack_bytes(const vshi_packing *packing, size_t count) {
    const double page =
        ((packing->width / 64.0 + 2.0) * 8.0) * (packing->height + 2.0) + 4.0 * packing->height;
    return page +
           (double)count * (VSHI_QUARTERS * sizeof(vshi_mask) + VSHI_ANGLES * sizeof(vshi_fit) + 400.0);
}

typedef struct search {
    vshi_packing *packing;
    vshi_pack_item *items;
    size_t count;
    placing placing;
    vshi_place *best;    /* [count] */
    double best_density; /* 0: none yet */
    uint32_t best_pages;
    vshi_job *job;
    size_t units, reported; /* of the job's progress: all, and so far */
} search;

static void keep_places(search *s, double density, uint32_t pages) {
    for (size_t i = 0; i < s->count; ++i) {
        s->best[i] = s->items[i].at;
    }
    s->best_density = density;
    s->best_pages = pages;
}

static void restore_best(search *s) {
    for (size_t i = 0; i < s->count; ++i) {
        s->items[i].at = s->best[i];
    }
    s->packing->density = s->best_density;
    s->packing->pages = s->best_pages;
}

/* The number of attempts is unknown: each advances by a share of a guess, and the last share is left for the
 * end. */
static void report_attempt(search *s) {
    const size_t share = s->units / ATTEMPTS;
    if (s->reported + share < s->units) {
        vshi_job_advance(s->job, share);
        s->reported += share;
    }
}

/* Attempts a density. *over is the room needed over the room there is; above 1 the charts do not fit. */
static vsh_result attempt(search *s, double density, double *over, vsh_error *error) {
    placing *p = &s->placing;
    bool possible = false;
    uint32_t pages = 0;
    int32_t rows = 0;
    *over = INFINITY;
    VSHI_TRY(set_density(p, density, &possible, error));
    if (!possible) {
        return VSH_OK;
    }
    VSHI_TRY(sort_items(p, error));
    VSHI_TRY(place_all(p, &pages, &rows, error));
    *over = s->packing->max_pages == 1       ? (double)rows / s->packing->height
            : pages <= s->packing->max_pages ? 1.0
                                             : OVER;
    report_attempt(s);
    if (*over <= 1.0 && density > s->best_density) {
        keep_places(s, density, pages);
    }
    return VSH_OK;
}

/* Texels for the charts at a density, with the padding between them. */
static double estimate_area(const search *s, double density) {
    double sum = 0.0;
    for (size_t i = 0; i < s->count; ++i) {
        const vshi_pack_item *item = &s->items[i];
        const double *size = item->patch->size[0];
        const double k = density * item->factor, width = size[0] * k, height = size[1] * k,
                     gap = s->packing->padding + 1.0, share = item->patch->area / (size[0] * size[1]);
        /* other charts use a part of the free texels of a box */
        sum += (width + gap) * (height + gap) * (share > 0.0 ? sqrt(share < 1.0 ? share : 1.0) : 1.0);
    }
    return sum;
}

static double guess_density(const search *s) {
    const double room = EXPECTED * s->packing->width * s->packing->height * s->packing->max_pages;
    double low = 0.0, high = 1.0;
    while (high < 1e150 && estimate_area(s, high) < room) {
        high *= 2.0;
    }
    while (high > 1e-150 && low == 0.0) {
        if (estimate_area(s, 0.5 * high) < room) {
            low = 0.5 * high;
        } else {
            high *= 0.5;
        }
    }
    for (int i = 0; i < 40; ++i) {
        const double middle = 0.5 * (low + high);
        if (estimate_area(s, middle) < room) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low > 0.0 ? low : high;
}

/* The greatest density that fits among some attempts. */
static vsh_result find_density(search *s, int climbs, vsh_error *error) {
    double density = guess_density(s), over = INFINITY, shrink = SHRINK;
    for (int i = 0; i < MOST_STEPS && s->best_density == 0.0; ++i) {
        VSHI_TRY(attempt(s, density, &over, error));
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
        VSHI_TRY(attempt(s, density, &over, error));
        failed = over > 1.0 ? density : failed;
    }
    return VSH_OK;
}

vsh_result vshi_pack_one(vshi_packing *packing, vshi_pack_item *items, size_t count, vshi_job *job,
                         bool *fits, vsh_error *error) {
    search s = {.packing = packing, .items = items, .count = count, .job = job};
    double over = INFINITY;
    vsh_result result;
    *fits = false;
    VSHI_TRY_DONE(vshi_allocate((void **)&s.best, count, sizeof *s.best, what, error));
    keep_places(&s, 0.0, 1);
    VSHI_TRY_DONE(placing_begin(packing, packing->height, items, count, job, &s.placing, error));
    VSHI_TRY_DONE(attempt(&s, packing->density, &over, error));
    *fits = over <= 1.0;
    s.best_density = packing->density;
    restore_best(&s);
done:
    placing_free(&s.placing);
    free(s.best);
    return result;
}

vsh_result vshi_pack(vshi_packing *packing, vshi_pack_item *items, size_t count, vshi_job *job, size_t units,
                     vsh_error *error) {
    search s = {.packing = packing, .items = items, .count = count, .job = job, .units = units};
    const double asked = packing->density;
    const int32_t height = packing->max_pages == 1 ? packing->height + packing->height / 4 : packing->height;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&s.best, count, sizeof *s.best, what, error));
    VSHI_TRY_DONE(placing_begin(packing, height, items, count, job, &s.placing, error));
    if (asked > 0.0) {
        double over = INFINITY;
        VSHI_TRY_DONE(attempt(&s, asked, &over, error));
        if (over > 1.0) {
            VSHI_TRY_DONE(find_density(&s, 1, error));
            if (isinf(over)) {
                result = vshi_fail(
                    error, VSH_ERROR_LIMIT,
                    "a chart is larger than a page of %d × %d texels at %g texels a unit: %.4g would fit",
                    packing->width, packing->height, asked, s.best_density);
                goto done;
            }
            result = vshi_fail(
                error, VSH_ERROR_LIMIT,
                "charts do not fit into %u page%s of %d × %d texels at %g texels a unit: %.4g would fit",
                packing->max_pages, packing->max_pages == 1 ? "" : "s", packing->width, packing->height,
                asked, s.best_density);
            goto done;
        }
    } else {
        VSHI_TRY_DONE(find_density(&s, count < MANY ? 4 : 2, error));
    }
    restore_best(&s);
    result = vshi_job_step(job, units - s.reported, error);
done:
    placing_free(&s.placing);
    free(s.best);
    return result;
}
