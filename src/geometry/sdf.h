/* Trees of shapes, for voxelising and tracing. */
#pragma once

#include "base/error.h"
#include "base/vec.h"

#include <stdbool.h>
#include <vdbshade/mesh.h>

VSH_BEGIN_C

/* Checks every node, and the tree. Errors: VSH_ERROR_INPUT, naming node, field, value and limit (sdf NULL is
 * a tree of 0 nodes); VSH_ERROR_MEMORY. */
VSHI_SHARED vsh_result vshi_sdf_check(const vsh_sdf *sdf, vsh_error *error);

/* Signed distance at a world position, negative inside; NaN for a position that is not finite. The tree must
 * have passed vshi_sdf_check(). Exact for the shapes and outside unions; inside unions, in intersections,
 * subtractions and smooth unions a bound (never farther than the surface). */
VSHI_SHARED double vshi_sdf_distance(const vsh_sdf *sdf, const double position[3]);

/* A box around the surface, world units; not always the smallest one. The tree must have passed
 * vshi_sdf_check(). */
VSHI_SHARED void vshi_sdf_bounds(const vsh_sdf *sdf, double bounds_min[3], double bounds_max[3]);

/* Deepest tree that vshi_sdf_check() accepts: distance and bounds recurse. */
enum { VSHI_SDF_DEPTH = 2048 };

/* Finds the operands that decide within `radius` of a finite position, and writes them to keep[node_count].
 * The tree was checked. Thread safe. */
VSHI_SHARED void vshi_sdf_narrow(const vsh_sdf *sdf, const double position[3], double radius, uint8_t *keep);

/* Equals vshi_sdf_distance() for positions [count] within that radius, but skips the other operands. */
VSHI_SHARED void vshi_sdf_distances_within(const vsh_sdf *sdf, const uint8_t *keep, size_t count,
                                           const double (*positions)[3], double *distances);

/* vshi_sdf_distance() for callers that have set the floating-point environment. */
double vshi_sdf_distance_at(const vsh_sdf *sdf, vshi_vec position);

/* Whether the tree is a true distance outside: it has shapes and unions only. */
VSHI_SHARED bool vshi_sdf_exact(const vsh_sdf *sdf);

VSH_END_C
