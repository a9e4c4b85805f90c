/* One attempt to pack charts at one density. */
#ifndef VSHI_UNWRAP_PLACE_H
#define VSHI_UNWRAP_PLACE_H

#include "unwrap/pack.h"
#include "unwrap/page.h"

/* Which chart comes first. */
enum { VSHI_BY_SIDES = 0, VSHI_BY_AREA = 1, VSHI_BY_LONGEST = 2, VSHI_ORDERS = 3 };

typedef struct vshi_placing {
    const vshi_packing *packing;
    vshi_job *job;
    vshi_item *items; /* [count] */
    size_t count;
    vshi_mask *masks; /* [count], of this density */
    uint32_t *order;  /* [count]: items, the first first */
    vshi_page page;
    int32_t *hints; /* row where the last chart of a size was placed */
} vshi_placing;

/* Errors: VSH_ERROR_MEMORY. Free with vshi_placing_free(), after a failure too. */
vsh_result vshi_placing_begin(const vshi_packing *packing, vshi_item *items, size_t count, vshi_job *job,
                              vshi_placing *placing, vsh_error *error);
void vshi_placing_free(vshi_placing *placing);

/* Fits the items to a density and sorts them. Errors: VSH_ERROR_MEMORY, VSH_ERROR_LIMIT, VSH_ERROR_CANCELLED.
 */
vsh_result vshi_placing_set(vshi_placing *placing, double density, int by, vsh_error *error);

/* Places as many pages as it takes, or max_pages + 1 where they do not fit. Errors: VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED. */
vsh_result vshi_placing_run(vshi_placing *placing, uint32_t *pages, vsh_error *error);

#endif
