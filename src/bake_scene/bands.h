/* How many rows of a lightmap are baked at a time: all, or as many as the memory limit allows. */
#ifndef VSHI_BANDS_H
#define VSHI_BANDS_H

#include "bake_scene/channels.h"
#include "bake_scene/target.h"

typedef struct vshi_bands {
    int32_t rows;       /* of each band but the last: a multiple of VSH_BAND_STEP, or all */
    int32_t count;      /* bands */
    uint64_t bytes;     /* that the largest takes, with what is held */
    int32_t first, end; /* rows that they are of: a shard's, or all */
} vshi_bands;

/* What a lightmap's bands are planned by. */
typedef struct vshi_bands_need {
    bool picture;           /* one of texels that are not valid is made too */
    bool files;             /* image files are written */
    const vshi_ao_cut *cut; /* of rows that are baked by themselves; NULL: all are */
    int32_t threads;
    bool merge;         /* nothing is baked: rows come from parts */
    int32_t first, end; /* rows */
    int32_t rows;       /* wanted; 0: as many as go */
    uint64_t held;      /* bytes: what casts, and what else is held meanwhile */
    uint64_t limit;     /* bytes; 0: none */
} vshi_bands_need;

/* Finds the fewest bands that keep within the limit, all of about one height. Errors: VSH_ERROR_LIMIT where
 * not even the smallest bands do, with what takes how much. */
vsh_result vshi_bands_plan(const vsh_scene *scene, const vshi_target *target, const vsh_charts *charts,
                           const vshi_bands_need *need, vshi_bands *bands, vsh_error *error);

#endif
