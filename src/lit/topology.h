/* A primitive as the document holds it, beside the mesh that the model made of it: which elements of its
 * accessors the mesh's vertices are. */
#ifndef VSHI_LIT_TOPOLOGY_H
#define VSHI_LIT_TOPOLOGY_H

#include "lit/document.h"
#include "lit/draco.h"

enum { VSHI_LIT_TRIANGLES = 4, VSHI_LIT_STRIP = 5, VSHI_LIT_FAN = 6 };

typedef struct vshi_lit_topology {
    size_t mode;                 /* VSHI_LIT_… */
    size_t element_count;        /* of each attribute's accessor */
    size_t vertex_count;         /* of the model's mesh */
    uint32_t *elements;          /* [vertex_count] of each vertex, increasing */
    const vshi_lit_draco *draco; /* NULL: its vertices are not compressed */
} vshi_lit_topology;

/* Finds that of `primitive`, which messages call `where`, and holds it against the model's mesh. `draco` is
 * its decoded data, NULL where it has none. Free with vshi_lit_topology_free(), after a failure too. Errors:
 * VSH_ERROR_INPUT (not well formed; not what the model was made of), VSH_ERROR_READ, VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY. */
vsh_result vshi_lit_topology_find(vshi_lit_document *document, const json_t *primitive, const char *where,
                                  const vshi_lit_draco *draco, const vsh_mesh *mesh,
                                  vshi_lit_topology *topology, vsh_error *error);
void vshi_lit_topology_free(vshi_lit_topology *topology);

#endif
