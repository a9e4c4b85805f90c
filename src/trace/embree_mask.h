/* What of a triangle lets rays through: where a mask cuts it out, and its back where it is one-sided. */
#ifndef VSHI_EMBREE_MASK_H
#define VSHI_EMBREE_MASK_H

#include "trace/embree_scene.h"

#ifdef VSH_EMBREE

#include "mesh/alpha_mask.h"

/* Of a geometry. */
typedef struct vshi_sieve {
    vsh_alpha_mask mask;     /* whose texels are the triangles' own */
    vshi_mask_place *places; /* [triangles][3]: of the corners, in the mask; NULL: it has none */
    bool one_sided;
    bool mirrored; /* its faces look where their corners run clockwise */
} vshi_sieve;

/* Copies what the meshes let through: triangles->sieves stays NULL where that is nothing. `held`: bytes that
 * are taken beside. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_sieves_create(vsh_triangles *triangles, const vsh_mesh *meshes, size_t count,
                              const vsh_run *run, double held, vsh_error *error);
void vshi_sieves_free(vsh_triangles *triangles);

/* Has rays that meet a geometry, which is that of a mesh, pass through it where they can; a geometry that
 * lets nothing through stays as it is. */
void vshi_sieve_attach(const vsh_triangles *triangles, size_t mesh, RTCGeometry geometry);

/* Whether a geometry lets anything through; no beam is cut by one that does, nor together with another, as
 * triangles of two meshes are no neighbours in the sheet. */
static inline bool vshi_sieve_is(const vsh_triangles *triangles, size_t mesh) {
    return triangles->sieves != NULL &&
           (triangles->sieves[mesh].places != NULL || triangles->sieves[mesh].one_sided);
}

#endif
#endif
