/* The components of a mesh: pieces that hang together by their edges, turned to face one way. */
#ifndef VSHI_COMPONENTS_H
#define VSHI_COMPONENTS_H

#include "mesh/mesh.h"

#include <stdint.h>

/* An open edge, from vertex a to b as the triangle beside it runs once it is turned. */
typedef struct vshi_rim {
    uint32_t component;
    uint32_t a, b;
} vshi_rim;

typedef struct vshi_components {
    size_t count;
    uint32_t *weld;   /* [vertex_count]: vshi_mesh_weld() */
    uint8_t *turned;  /* [triangle_count]: against the others of its component */
    uint8_t *doubled; /* [triangle_count]: there is one with the same corners that faces the other way */
    size_t *begin;    /* [count + 1] in `list` */
    uint32_t *list;   /* triangles by component, ascending */
    uint8_t *twisted; /* [count]: no turning makes all its faces agree (a Moebius strip); none is turned */
    vshi_rim *rims;   /* sorted by component, then by triangle */
    size_t rim_count;
} vshi_components;

/* Vertices count as one where their positions are equal. Two triangles at an edge hang together; where there
 * are more, those that have a solid between them do. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. Free the
 * result with vshi_components_free(), after a failure too. */
vsh_result vshi_components_find(const vsh_mesh *mesh, size_t index, vshi_components *found, vsh_error *error);
void vshi_components_free(vshi_components *components);

#endif
