/* A page of an atlas: which texels are taken, and where a chart finds room. */
#ifndef VSHI_UNWRAP_PAGE_H
#define VSHI_UNWRAP_PAGE_H

#include "unwrap/mask.h"

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

#endif
