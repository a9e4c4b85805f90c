/* Places in 32-bit UVs. */
#ifndef VSHI_UNWRAP_SETTLE_H
#define VSHI_UNWRAP_SETTLE_H

#include "unwrap/patch.h"

/* Triangles that rounding has flipped or flattened, slivers all of them, are turned right by moving a corner
 * by some last places: uvs[vertex_count] of the patch, 0 … 1. What cannot be helped so stays. Errors:
 * VSH_ERROR_MEMORY. */
vsh_result vshi_settle(const vshi_patch *patch, float (*uvs)[2], vsh_error *error);

#endif
