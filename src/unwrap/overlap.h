/* Whether a chart lies over itself. */
#ifndef VSHI_UNWRAP_OVERLAP_H
#define VSHI_UNWRAP_OVERLAP_H

#include "unwrap/patch.h"

/* No triangle of the patch flips. Borders that touch are none that cross. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_patch_overlaps(const vshi_patch *patch, bool *overlaps, vsh_error *error);

#endif
