/* Ray-traced truth on triangles: Embree 3, against vsh_mesh views. Shares no code with the library. */
#pragma once

#include <stddef.h>
#include <vdbshade/mesh.h>

/* The triangles of all meshes in world space. Immutable; may be shared by threads. */
typedef struct truth_mesh truth_mesh;

/* Copies the meshes, with their transforms applied in double; both sides of a triangle block. NULL if Embree
 * fails. Free it with truth_mesh_free(). */
truth_mesh *truth_mesh_create(const vsh_mesh *meshes, size_t mesh_count);
void truth_mesh_free(truth_mesh *truth);

/* Fraction of a light that each of `count` origins [count][3] sees, by `rays` rays each. As for
 * truth_light(), the light is a disc of radius w, a unit away along `towards`. Rays begin exactly at the
 * origins, which the caller has lifted off the surface. Rays below the plane of `normals` [count][3] are
 * hidden; NULL: no horizon. `threads` 0: all cores; the result does not depend on them. Returns 0, or -1 if
 * threads or memory are short. */
int truth_mesh_light(const truth_mesh *truth, size_t count, const double *origins, const float *normals,
                     const double towards[3], double w, size_t rays, int threads, float *visible);

/* Cosine-weighted fraction of the hemisphere around `normals` that is free within `distance`. */
int truth_mesh_ao(const truth_mesh *truth, size_t count, const double *origins, const float *normals,
                  double distance, size_t rays, int threads, float *open);

/* Share of the cosine-weighted rays around `normals` whose first hit is the back of a triangle: near 1 inside
 * solids, 0 outside of closed, well-wound meshes. */
int truth_mesh_backs(const truth_mesh *truth, size_t count, const double *origins, const float *normals,
                     size_t rays, int threads, float *backs);
