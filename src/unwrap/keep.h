/* Charts of the UVs that a mesh has. */
#ifndef VSHI_UNWRAP_KEEP_H
#define VSHI_UNWRAP_KEEP_H

#include "unwrap/split.h"

/* Whether the UVs of a surface that was cut along them are of use (vsh_uvs_usable()), and if so, and
 * `patches` is not NULL, a patch for each part of it that hangs together. All are scaled alike, so that they
 * have the surface's area together. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_keep_charts(const vshi_cut_mesh *surface, vshi_patches *patches, bool *usable,
                            vsh_error *error);

#endif
