/* Averages of samples over texels. */
#ifndef VSHI_BAKE_AVERAGE_H
#define VSHI_BAKE_AVERAGE_H

#include "bake/origins.h"
#include "bake/padding.h"

typedef struct vshi_average {
    const vsh_texels *texels;
    const vshi_origins *origins;
    const float *values; /* [origins->count][channels], those whose first is NaN left out; NULL: only the
                            state is found */
    size_t channels;     /* 1 … 3 */
    bool deviation;      /* says nothing of whether a texel is valid; what is not known is 0 */
    float *plane;        /* [texels held][channels] */
    uint8_t *state;      /* [texels held]: VSHI_TEXEL_…, INVALID where no sample has a value */
} vshi_average;

/* What the average of one sample is. */
static inline float vshi_average_of_one(float value) {
    return (float)(0.0 + (double)value); /* -0 becomes 0 */
}

/* Errors: VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_average_run(const vshi_average *average, const vsh_run *run, vsh_error *error);

#endif
