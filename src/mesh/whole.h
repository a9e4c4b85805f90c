/* Objects put together from the meshes that are their parts, one for each material: by itself such a part is
 * open where the next begins. */
#ifndef VSHI_WHOLE_H
#define VSHI_WHOLE_H

#include "mesh/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vshi_wholes {
    vsh_mesh *meshes; /* [count]; a view of the one part where there is only one */
    size_t *first;    /* [count + 1]: the parts that a whole is made of follow each other in the list */
    size_t count;
    float **positions;  /* [count]; NULL: the part's */
    uint32_t **indices; /* [count]; NULL: the part's */
} vshi_wholes;

/* Meshes that follow each other, of one object, transform and solidity, become one whole; its triangles are
 * theirs in their order. Errors: VSH_ERROR_MEMORY. Free with vshi_wholes_free(), after a failure too. */
vsh_result vshi_wholes_make(const vsh_mesh *meshes, size_t mesh_count, vshi_wholes *wholes, vsh_error *error);
void vshi_wholes_free(vshi_wholes *wholes);

#ifdef __cplusplus
}
#endif
#endif
