/* Charts packed into the pages of an atlas. */
#ifndef VSHI_UNWRAP_PACK_H
#define VSHI_UNWRAP_PACK_H

#include "base/job.h"
#include "unwrap/shapes.h"

typedef struct vshi_place {
    uint32_t page;
    int32_t x, y;     /* texel of the mask's corner */
    int32_t angle;    /* that the patch is turned by, */
    int32_t quarters; /* and its mask then */
    vshi_fit fit;
    uint64_t touched; /* texels */
} vshi_place;

/* A chart that is to have a place, and the place that it gets. */
typedef struct vshi_item {
    const vshi_patch *patch; /* straightened */
    const vshi_boxes *boxes;
    double factor; /* texels to a unit of the patch at a density of 1 */
    uint32_t mesh; /* that has the chart */
    vshi_place at;
} vshi_item;

typedef struct vshi_packing {
    int32_t width, height, padding;
    uint32_t max_pages;
    double max_stretch;
    double density; /* as asked, or 0; then as found */
    uint32_t pages; /* that are used */
} vshi_packing;

/* Bytes that packing takes beside the items. */
double vshi_pack_bytes(const vshi_packing *packing, size_t count);

/* Gives each item its place; items are in the order of their meshes. Advances the job by `units` in all.
 * Errors: VSH_ERROR_LIMIT (they do not fit at the density; or at any), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED.
 */
vsh_result vshi_pack(vshi_packing *packing, vshi_item *items, size_t count, vshi_job *job, size_t units,
                     vsh_error *error);

/* The same at the density that is asked for, on one page: *fits tells whether there was room, and where there
 * was none the items are as they were. Errors: VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_pack_one(vshi_packing *packing, vshi_item *items, size_t count, vshi_job *job, bool *fits,
                         vsh_error *error);

/* --- the pages of an atlas: what lies on each, and how large each is */

typedef struct vshi_pages {
    vsh_atlas_page *list; /* [count]: without what is counted of charts; to be freed */
    size_t count;
} vshi_pages;

/* --- the atlas */

/* Makes an atlas of charts that have their places: `items` [item_count] are those of the meshes in their
 * order, and of each mesh of its shape's patches in theirs. The atlas takes the pages' list. Errors:
 * VSH_ERROR_MEMORY. */
vsh_result vshi_atlas_make(const vshi_shapes *shapes, vshi_pages *pages, const vshi_item *items,
                           size_t item_count, vsh_atlas **atlas, vsh_error *error);

#endif
