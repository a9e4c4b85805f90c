/* Trees of shapes, for voxelising and tracing. */
#ifndef VSHI_SDF_H
#define VSHI_SDF_H

#include "base/error.h"
#include "base/vec.h"

#include <stdbool.h>
#include <vdbshade/sdf.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Deepest tree that vsh_sdf_check() lets through: distance and bounds recurse. */
enum { VSHI_SDF_DEPTH = 2048 };

/* Finds which operands decide within `radius` of a position, in `keep` [node_count]. The tree was checked,
 * the position is finite. Thread safe. */
VSHI_SHARED void vshi_sdf_narrow(const vsh_sdf *sdf, const double position[3], double radius, uint8_t *keep);

/* vsh_sdf_distance(), to the bit, of positions [count] within that radius, without the other operands. */
VSHI_SHARED void vshi_sdf_distances_within(const vsh_sdf *sdf, const uint8_t *keep, size_t count,
                                           const double (*positions)[3], double *distances);

/* vsh_sdf_distance() within a call that has seen to the floating-point environment. */
double vshi_sdf_distance_at(const vsh_sdf *sdf, vshi_vec position);

/* True where the tree is a true distance outside: shapes and unions only. */
VSHI_SHARED bool vshi_sdf_exact(const vsh_sdf *sdf);

#ifdef __cplusplus
}
#endif
#endif
