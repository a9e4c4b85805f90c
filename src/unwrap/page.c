/* All columns of a row are asked at once: bit x of `forbidden` says that the mask meets a taken texel if it
 * stands at x. A run of n texels from b on is in the way of x where any of the n texels from x + b on is
 * taken, which is the row's bits or-ed over n shifts, by doubling. */
#include "unwrap/place.h"

#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>

static const char what[] = "a page of the atlas";

enum {
    NEEDS = 16,
    STEP = 96 /* rows of a chart for which it may miss a row that it would fit in */
};

double vshi_page_bytes(int32_t width, int32_t height) {
    return ((double)width / 64.0 + 2.0) * 8.0 * ((double)height + 2.0) + 4.0 * height;
}

vsh_result vshi_page_make(int32_t width, int32_t height, int32_t padding, vshi_page *page, vsh_error *error) {
    *page =
        (vshi_page){.width = width, .height = height, .padding = padding, .words = ((size_t)width + 63) / 64};
    VSHI_TRY(
        vshi_allocate((void **)&page->taken, page->words * (size_t)height, sizeof *page->taken, what, error));
    VSHI_TRY(vshi_allocate((void **)&page->free_run, (size_t)height, sizeof *page->free_run, what, error));
    VSHI_TRY(vshi_allocate((void **)&page->forbidden, page->words + 1, sizeof *page->forbidden, what, error));
    VSHI_TRY(vshi_allocate((void **)&page->grown, page->words + 1, sizeof *page->grown, what, error));
    vshi_page_clear(page);
    return VSH_OK;
}

void vshi_page_free(vshi_page *page) {
    free(page->grown);
    free(page->forbidden);
    free(page->free_run);
    free(page->taken);
    *page = (vshi_page){0};
}

void vshi_page_clear(vshi_page *page) {
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

bool vshi_page_find(vshi_page *page, const vshi_mask *mask, int32_t row, int32_t limit, int32_t *x,
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

void vshi_atlas_page_put(vshi_page *page, const vshi_mask *mask, int32_t x, int32_t y) {
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
