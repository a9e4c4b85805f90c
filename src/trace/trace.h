/* Values at single points by rays against the casters themselves. */
#pragma once

#include "light/light.h"
#include "trace/sampler.h"

#include <stdbool.h>

/* Procedural casters as they are: no voxels, no triangles. Immutable; may be shared by threads. */
typedef struct vshi_solids vshi_solids;

/* Copies `count` trees, each under its transform (transforms: [count][12], local to world, three rows of
 * four; NULL: none is moved). Errors: VSH_ERROR_ARGUMENT (solids NULL, sdfs NULL with a count above 0),
 * VSH_ERROR_INPUT (as vshi_sdf_check(); a transform that shears or scales unevenly), VSH_ERROR_MEMORY. Free
 * the result with vshi_solids_free(). */
vsh_result vshi_solids_create(const vsh_sdf *sdfs, const double *transforms, size_t count,
                              vshi_solids **solids, vsh_error *error);
void vshi_solids_free(vshi_solids *solids); /* NULL does nothing */

/* Signed distance to the nearest solid, as vshi_sdf_distance(), world units; infinite where there is none. */
double vshi_solids_distance(const vshi_solids *solids, const double position[3]);

/* The triangles of some meshes in world space, in a tree for rays. Immutable; may be shared by threads. */
typedef struct vshi_triangles vshi_triangles;

/* Copies the meshes' triangles, transforms applied; both sides of a triangle block. The first call loads
 * Embree, which stays loaded. Errors: VSH_ERROR_UNSUPPORTED (Embree cannot be loaded), VSH_ERROR_INPUT (as
 * vsh_mesh_check()), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. Free the result with
 * vshi_triangles_free(). */
vsh_result vshi_triangles_create(const vsh_mesh *meshes, size_t mesh_count, const vsh_run *run,
                                 vshi_triangles **triangles, vsh_error *error);

/* The same, with procedural solids beside the meshes, which rays meet as they are. `solids` may be NULL; they
 * must outlive the result. */
vsh_result vshi_triangles_create_beside(const vsh_mesh *meshes, size_t mesh_count, const vshi_solids *solids,
                                        const vsh_run *run, vshi_triangles **triangles, vsh_error *error);
void vshi_triangles_free(vshi_triangles *triangles); /* NULL does nothing */

/* Bytes in memory. Cannot fail. */
uint64_t vshi_triangles_bytes(const vshi_triangles *triangles);

/* First rays of each set of a point. If they agree with the expected value, the point shoots no more. */
enum { VSHI_TRUTH_FIRST = 16 };

typedef struct vshi_truth {
    const vshi_triangles *triangles; /* one of these may be NULL */
    const vshi_solids *solids;
    const vsh_light *light; /* NULL: AO */
    vshi_light_place place; /* of the light, in world space */
    double distance;        /* of AO */
    const vshi_vec *up;     /* of AO: over this horizon alone; NULL: none */
    double offset;          /* of rays' origins along the normal, world units */
    const vshi_sampler *sampler;
    int32_t rays; /* most rays of each set of a point; the sampler has as many */
} vshi_truth;

/* Whether the first rays of both sets were all hidden, or all free. */
enum { VSHI_TRUTH_EVEN_HIDDEN = -1, VSHI_TRUTH_UNEVEN = 0, VSHI_TRUTH_EVEN_FREE = 1 };

/* vshi_truth_twice() before the expected value is known: counts the free rays of both full sets. *even:
 * VSHI_TRUTH_… of the first rays. */
bool vshi_truth_count(const vshi_truth *truth, const double position[3], const float normal[3],
                      const float *face, uint32_t texel, int32_t free[2], int32_t *even);

/* The result of vshi_truth_twice(), from the counts of vshi_truth_count(). */
void vshi_truth_settle(int32_t rays, const int32_t free[2], int32_t even, double expected, double seen[2]);

/* The value at a point, by two sets of rays, independent of each other and of shading's rays. On average (f -
 * seen[0]) (f - seen[1]) is the squared error of f, without the error of these rays. Returns false if there
 * is no value: no normal, or a position that is not finite. Thread safe. */
bool vshi_truth_twice(const vshi_truth *truth, const double position[3], const float normal[3],
                      const float *face, uint32_t texel, double expected, double seen[2]);
