/* Rays against the casters themselves, the truth that the field stands in for: against triangles through
 * Embree, against procedural solids by sphere tracing in double precision. */
#ifndef VDBSHADE_TRACE_H
#define VDBSHADE_TRACE_H

#include "light.h"
#include "mesh.h"
#include "sdf.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Procedural casters as they are: no voxels, no triangles. Immutable; may be shared by threads. */
typedef struct vsh_solids vsh_solids;

/* Copies `count` trees, each under its transform (transforms: [count][12], local to world, three rows of
 * four; NULL: none is moved). Errors: VSH_ERROR_ARGUMENT (solids NULL, sdfs NULL with a count above 0),
 * VSH_ERROR_INPUT (as vsh_sdf_check(); a transform that shears or scales unevenly), VSH_ERROR_MEMORY. Free
 * the result with vsh_solids_free(). */
VSH_API vsh_result vsh_solids_create(const vsh_sdf *sdfs, const double *transforms, size_t count,
                                     vsh_solids **solids, vsh_error *error);
VSH_API void vsh_solids_free(vsh_solids *solids); /* NULL does nothing */

/* Signed distance to the nearest solid, as vsh_sdf_distance(), world units; infinite where there is none. */
VSH_API double vsh_solids_distance(const vsh_solids *solids, const double position[3]);

/* The triangles of some meshes in world space, in a tree for rays. Immutable; may be shared by threads. */
typedef struct vsh_triangles vsh_triangles;

/* Copies the meshes' triangles, transforms applied; both sides of a triangle block. The first call loads
 * Embree, which stays loaded. Errors: VSH_ERROR_UNSUPPORTED (Embree cannot be loaded), VSH_ERROR_INPUT (as
 * vsh_mesh_check()), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. Free the result with
 * vsh_triangles_free(). */
VSH_API vsh_result vsh_triangles_create(const vsh_mesh *meshes, size_t mesh_count, const vsh_run *run,
                                        vsh_triangles **triangles, vsh_error *error);

/* The same, with procedural solids beside the meshes, which rays meet as they are. `solids` may be NULL; they
 * must outlive the result. */
VSH_API vsh_result vsh_triangles_create_beside(const vsh_mesh *meshes, size_t mesh_count,
                                               const vsh_solids *solids, const vsh_run *run,
                                               vsh_triangles **triangles, vsh_error *error);
VSH_API void vsh_triangles_free(vsh_triangles *triangles); /* NULL does nothing */

/* Bytes in memory. Cannot fail. */
VSH_API uint64_t vsh_triangles_bytes(const vsh_triangles *triangles);

/* Fraction of a light that each of `count` points [count][3] sees, into visibility[count]: `rays` rays (1 …
 * 65536) over the light's disc (Vogel's spiral, 1979), that begin `lift` world units above the point along
 * its normal [count][3] (unit; NULL: no horizon) and count as hidden below the normal's plane. Either of
 * `triangles` and `solids` may be NULL, for none; a ray is hidden that meets one of them. Rays pass no nearer
 * to a solid than a billionth of the box around all of them, so points on a solid's surface need a lift above
 * that. (J. C. Hart, "Sphere tracing", 1996; a cone that is proved free of solids, or covered by one, stands
 * for its rays.) Thread safe. Errors: VSH_ERROR_ARGUMENT, VSH_ERROR_CANCELLED, VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_trace_shadow(const vsh_triangles *triangles, const vsh_solids *solids, size_t count,
                                    const double *positions, const float *normals, double lift,
                                    const vsh_light *light, int32_t rays, const vsh_run *run,
                                    float *visibility, vsh_error *error);

/* Cosine-weighted fraction of the hemisphere that is free within `distance`, likewise; normals must be given.
 */
VSH_API vsh_result vsh_trace_ao(const vsh_triangles *triangles, const vsh_solids *solids, size_t count,
                                const double *positions, const float *normals, double lift, double distance,
                                int32_t rays, const vsh_run *run, float *ao, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
