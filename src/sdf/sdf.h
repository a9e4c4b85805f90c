/* What voxelising needs to know of a tree of shapes. */
#ifndef VSHI_SDF_H
#define VSHI_SDF_H

#include "base/shared.h"

#include <stdbool.h>
#include <vdbshade/sdf.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Deepest tree that vsh_sdf_check() lets through: distance and bounds recurse. */
enum { VSHI_SDF_DEPTH = 2048 };

/* True where the tree is a true distance outside: shapes and unions only. */
VSHI_SHARED bool vshi_sdf_exact(const vsh_sdf *sdf);

#ifdef __cplusplus
}
#endif
#endif
