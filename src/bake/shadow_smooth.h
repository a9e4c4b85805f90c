/* Takes noise off shadow values between texels. */
#ifndef VSHI_BAKE_SHADOW_SMOOTH_H
#define VSHI_BAKE_SHADOW_SMOOTH_H

#include "bake/origins.h"

/* Smooths values[count] of the samples whose deviation[count] is more than 0. Errors: VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED. */
vsh_result vshi_shadow_smooth(const vshi_origins *origins, const vsh_run *run, float *values,
                              const float *deviation, vsh_error *error);

#endif
