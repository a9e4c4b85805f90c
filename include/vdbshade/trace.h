/* Rays against the triangles themselves, through Embree: the truth that the field stands in for. */
#ifndef VDBSHADE_TRACE_H
#define VDBSHADE_TRACE_H

#include "light.h"
#include "mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The triangles of some meshes in world space, in a tree for rays. Immutable; may be shared by threads. */
typedef struct vsh_triangles vsh_triangles;

/* 1 where the library was built with Embree, 0 where vsh_triangles_create() returns VSH_ERROR_UNSUPPORTED. */
VSH_API int vsh_triangles_available(void);

/* Copies the meshes' triangles, transforms applied; both sides of a triangle block. Errors:
 * VSH_ERROR_UNSUPPORTED (no Embree), VSH_ERROR_INPUT (as vsh_mesh_check()), VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. Free the result with vsh_triangles_free(). */
VSH_API vsh_result vsh_triangles_create(const vsh_mesh *meshes, size_t mesh_count, const vsh_run *run,
                                        vsh_triangles **triangles, vsh_error *error);
VSH_API void vsh_triangles_free(vsh_triangles *triangles); /* NULL does nothing */

/* Bytes in memory. Cannot fail. */
VSH_API uint64_t vsh_triangles_bytes(const vsh_triangles *triangles);

/* Fraction of a light that each of `count` points [count][3] sees, into visibility[count]: `rays` rays (1 …
 * 65536) over the light's disc (Vogel's spiral, 1979), that begin `lift` world units above the point along
 * its normal [count][3] (unit; NULL: no horizon) and count as hidden below the normal's plane. Thread safe.
 * Errors: VSH_ERROR_ARGUMENT, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_trace_shadow(const vsh_triangles *triangles, size_t count, const double *positions,
                                    const float *normals, double lift, const vsh_light *light, int32_t rays,
                                    const vsh_run *run, float *visibility, vsh_error *error);

/* Cosine-weighted fraction of the hemisphere that is free within `distance`, likewise; normals must be given.
 */
VSH_API vsh_result vsh_trace_ao(const vsh_triangles *triangles, size_t count, const double *positions,
                                const float *normals, double lift, double distance, int32_t rays,
                                const vsh_run *run, float *ao, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
