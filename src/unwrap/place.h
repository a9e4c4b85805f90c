/* One attempt to pack charts at one density. */
#ifndef VSHI_UNWRAP_PLACE_H
#define VSHI_UNWRAP_PLACE_H

#include "unwrap/mask.h"
#include "unwrap/pack.h"

/* --- a page of an atlas: which texels are taken, and where a chart finds room */

typedef struct vshi_page {
    int32_t width, height, padding;
    size_t words;      /* of a row */
    uint64_t *taken;   /* [height][words]: texels that no other chart may touch; those past the width are */
    int32_t *free_run; /* [height]: longest run of free texels */
    int32_t used;      /* rows up to the last that a chart touches */
    int32_t patience;  /* rows that a search looks at closely before it begins to leave some out; 0: all */
    uint64_t *forbidden, *grown; /* [words + 1]: room of the search */
} vshi_page;

double vshi_page_bytes(int32_t width, int32_t height);

/* Errors: VSH_ERROR_MEMORY. Free with vshi_page_free(), after a failure too. */
vsh_result vshi_page_make(int32_t width, int32_t height, int32_t padding, vshi_page *page, vsh_error *error);
void vshi_page_free(vshi_page *page);
void vshi_page_clear(vshi_page *page);

/* The lowest place at or above `row`, and there the leftmost, at which a mask touches no taken texel and ends
 * at or below row `limit`; false where there is none. */
bool vshi_page_find(vshi_page *page, const vshi_mask *mask, int32_t row, int32_t limit, int32_t *x,
                    int32_t *y);

/* Takes the mask's texels there, and those within the padding. */
void vshi_atlas_page_put(vshi_page *page, const vshi_mask *mask, int32_t x, int32_t y);

/* --- one attempt */

/* Which chart comes first. */
enum { VSHI_BY_SIDES = 0, VSHI_BY_AREA = 1, VSHI_BY_LONGEST = 2, VSHI_ORDERS = 3 };

typedef struct vshi_placing {
    const vshi_packing *packing;
    vshi_job *job;
    vshi_item *items; /* [count] */
    size_t count;
    double density;
    int angle_step;                /* 1 or 2: which of the angles are tried */
    int32_t least_turned;          /* texels: shorter charts are turned by quarters alone */
    vshi_mask **masks;             /* [count][angles × VSHI_QUARTERS]; runs are NULL of turns not yet made */
    int *angles;                   /* [count]: how many are tried of each */
    vshi_fit (*fits)[VSHI_ANGLES]; /* [count] */
    uint32_t *order;               /* [count]: items, the first first */
    vshi_page page;
    int32_t *hints; /* row where the last chart of a size was placed */
} vshi_placing;

/* The page is `height` texels high, the packing's or more. Errors: VSH_ERROR_MEMORY. Free with
 * vshi_placing_free(), after a failure too. */
vsh_result vshi_placing_begin(const vshi_packing *packing, int32_t height, vshi_item *items, size_t count,
                              vshi_job *job, vshi_placing *placing, vsh_error *error);
void vshi_placing_free(vshi_placing *placing);

/* Fits the items to a density. *possible: none is larger than a page. Errors: VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED. */
vsh_result vshi_placing_set(vshi_placing *placing, double density, bool *possible, vsh_error *error);

/* Sorts them. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_placing_sort(vshi_placing *placing, int by, vsh_error *error);

/* Places all items on one page; *rows is how many rows they take, or more than the page has. Errors:
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_placing_one_page(vshi_placing *placing, int32_t *rows, vsh_error *error);

/* Places them on as many pages as it takes, or max_pages + 1 where they do not fit. Errors: as the last. */
vsh_result vshi_placing_pages(vshi_placing *placing, uint32_t *pages, vsh_error *error);

#endif
