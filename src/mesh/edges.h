/* Which triangles of a mesh meet at their edges, and the components that hang together by them. */
#ifndef VSHI_EDGES_H
#define VSHI_EDGES_H

#include "mesh/mesh.h"

#include <stdint.h>

#define VSHI_NO_PARTNER UINT32_MAX

/* Side 3 i + k of a mesh runs from corner k to corner k + 1 of triangle i, in the world's order. */
typedef struct vshi_edges {
    uint32_t *weld;    /* [vertex_count]: vshi_mesh_weld() */
    uint8_t *skipped;  /* [triangle_count]: of no area, or given before with the same corners */
    uint32_t *first;   /* [triangle_count]: the triangle that was, or the triangle itself */
    uint8_t *doubled;  /* [triangle_count]: see vshi_components */
    uint32_t *partner; /* [3 triangle_count]: the side that goes on beyond this one; VSHI_NO_PARTNER: open */
    size_t open;       /* sides without a partner, but for those of triangles that are skipped */
} vshi_edges;

/* VSH_ERROR_LIMIT where a mesh has more triangles than edges can be numbered of. */
vsh_result vshi_edges_check(const vsh_mesh *mesh, size_t index, vsh_error *error);

/* Finds partners. Where `copies_apart`, triangles with the same corners, whichever way they look, are in
 * different layers, and partners of one layer: copies, and faces that look both ways, do not mix. Errors: of
 * vshi_edges_check(), VSH_ERROR_MEMORY. Free with vshi_edges_free(), after a failure too. */
vsh_result vshi_edges_find(const vsh_mesh *mesh, size_t index, bool copies_apart, vshi_edges *edges,
                           vsh_error *error);
void vshi_edges_free(vshi_edges *edges);

/* The welded vertices of triangle i in the world's order. */
static inline void vshi_edges_corners(const vsh_mesh *mesh, const uint32_t *weld, bool mirrored, size_t i,
                                      uint32_t v[3]) {
    const uint32_t *given = mesh->indices + 3 * i;
    v[0] = weld[given[0]];
    v[1] = weld[given[mirrored ? 2 : 1]];
    v[2] = weld[given[mirrored ? 1 : 2]];
}

/* --- the components of a mesh: pieces that hang together by their edges, turned to face one way */

/* An open edge, from vertex a to b as the triangle beside it runs once it is turned. */
typedef struct vshi_rim {
    uint32_t component;
    uint32_t a, b;
} vshi_rim;

typedef struct vshi_components {
    size_t count;
    uint8_t *turned;  /* [triangle_count]: against the others of its component */
    uint8_t *doubled; /* [triangle_count]: there is one with the same corners that faces the other way */
    uint32_t *begin;  /* [count + 2] in `list` */
    uint32_t *list;   /* triangles by component, ascending */
    uint8_t *twisted; /* [at least count]: no turning makes all its faces agree (a Moebius strip); none is
                         turned */
    vshi_rim *rims;   /* sorted by component, then by triangle */
    size_t rim_count;
} vshi_components;

/* Vertices count as one where their positions are equal. Two triangles at an edge hang together; where there
 * are more, those that have a solid between them do. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. Free the
 * result with vshi_components_free(), after a failure too. */
vsh_result vshi_components_find(const vsh_mesh *mesh, size_t index, vshi_components *found, vsh_error *error);
void vshi_components_free(vshi_components *components);

#endif
