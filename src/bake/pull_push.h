/* Fills what holds no value, however far, so that no mip level reads background. */
#ifndef VSHI_BAKE_PULL_PUSH_H
#define VSHI_BAKE_PULL_PUSH_H

#include "bake/padding.h"

/* Gives every texel whose `filled` is 0 the mean of the texels that hold a value among the 2, 4, 8 … on a
 * side that it is one of in the first mip level where there are any: a mip level that is made of means of 2 ×
 * 2 texels holds the means of values alone. Planes where no texel holds a value are left. Errors:
 * as vshi_store_take(); VSH_ERROR_CANCELLED. */
vsh_result vshi_pull_push(vshi_store *store, const vsh_run *run, int32_t width, int32_t height,
                          const uint8_t *filled, const vshi_plane *planes, size_t plane_count,
                          vsh_error *error);

#endif
