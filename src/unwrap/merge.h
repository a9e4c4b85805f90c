/* Charts joined to larger ones, as long as these lie as flat. Fewer charts have fewer seams, and waste less
 * of the atlas on what keeps them apart. */
#ifndef VSHI_UNWRAP_MERGE_H
#define VSHI_UNWRAP_MERGE_H

#include "unwrap/patch.h"

/* Two charts that are tried as one. */
typedef struct vshi_trial {
    uint32_t a, b;
    double perimeter; /* of both together */
    vshi_patch patch; /* both as one, where it lies flat */
    bool good;
} vshi_trial;

typedef struct vshi_merging {
    const vshi_cut_mesh *surface;
    vshi_patches *patches;
    double max_stretch, max_area;
    uint32_t *owner;   /* [triangles]: chart; VSHI_NONE: flat */
    double *perimeter; /* [charts] */
    uint32_t *version; /* [charts]: a number that no other chart had before */
    uint32_t versions;
    vshi_trial *trials; /* of this round: no chart is in two */
    uint32_t trial_count;
    uint64_t *failed; /* pairs of versions, sorted */
    size_t failed_count, failed_capacity;
} vshi_merging;

/* Begins with the charts of a surface. They must outlive it. No chart is joined to one of more than max_area,
 * surface units². Errors: VSH_ERROR_MEMORY. Free with vshi_merging_free(), after a failure too. */
vsh_result vshi_merging_begin(const vshi_cut_mesh *surface, vshi_patches *patches, double max_stretch,
                              double max_area, vshi_merging *merging, vsh_error *error);
void vshi_merging_free(vshi_merging *merging);

/* Chooses the next round's trials: none, and it is done. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_merging_plan(vshi_merging *merging, vsh_error *error);

/* Tries number `trial`. Several threads may try others. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_merging_try(vshi_merging *merging, uint32_t trial, vsh_error *error);

/* Takes those that are good. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_merging_apply(vshi_merging *merging, vsh_error *error);

#endif
