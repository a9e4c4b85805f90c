/* Shadow values that rays left noise in, smoothed along penumbrae. */
#ifndef VSHI_BAKE_SHADOW_SMOOTH_H
#define VSHI_BAKE_SHADOW_SMOOTH_H

#include "bake/origins.h"

/* Memory that it works in: which sample each texel of a tile has, and what is made of the values. */
typedef struct vshi_smooth_work {
    const vshi_origins *origins;
    const float *deviation;
    uint16_t sample[VSHI_TILE * VSHI_TILE];
    float across[VSHI_TILE * VSHI_TILE], smooth[VSHI_TILE * VSHI_TILE];
} vshi_smooth_work;

/* Smooths the values of a tile's origins by their deviations, where each texel has one sample. */
void vshi_shadow_smooth(const vshi_origins *origins, float *values, const float *deviation,
                        vshi_smooth_work *work);

#endif
