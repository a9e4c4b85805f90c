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

/* --- one attempt at one density */

/* A page of an atlas: which texels are taken. */
typedef struct vshi_page {
    int32_t width, height, padding;
    size_t words;      /* of a row */
    uint64_t *taken;   /* [height][words]: texels that no other chart may touch; those past the width are */
    int32_t *free_run; /* [height]: longest run of free texels */
    int32_t used;      /* rows up to the last that a chart touches */
    int32_t patience;  /* rows that a search looks at closely before it begins to leave some out; 0: all */
    uint64_t *forbidden, *grown; /* [words + 1]: room of the search */
} vshi_page;

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

/* Places all items on one page or, where that has no room, on as many as it takes: max_pages + 1 where they
 * do not fit. *rows is how many rows they take of one page, or more than it has. Errors: VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED. */
vsh_result vshi_placing_place(vshi_placing *placing, uint32_t *pages, int32_t *rows, vsh_error *error);

/* --- the pages of an atlas: what lies on each, and how large each is */

typedef struct vshi_pages {
    vsh_atlas_page *list; /* [count]: without what is counted of charts; to be freed */
    size_t count;
} vshi_pages;

/* Gives each item its place, as the options have it: items are those of the meshes in their order, which are
 * instances of shapes. The stage is "pack". Errors: as vshi_pack(), with the object's name where it has a
 * page of its own; VSH_ERROR_LIMIT (run->memory_limit). */
vsh_result vshi_pages_pack(const vsh_unwrap_options *options, const vshi_shapes *shapes, vshi_item *items,
                           size_t item_count, const vsh_run *run, vshi_pages *pages, vsh_error *error);

/* --- the atlas */

/* Makes an atlas of charts that have their places: `items` [item_count] are those of the meshes in their
 * order, and of each mesh of its shape's patches in theirs. The atlas takes the pages' list. Errors:
 * VSH_ERROR_MEMORY. */
vsh_result vshi_atlas_make(const vshi_shapes *shapes, vshi_pages *pages, const vshi_item *items,
                           size_t item_count, vsh_atlas **atlas, vsh_error *error);

#endif
