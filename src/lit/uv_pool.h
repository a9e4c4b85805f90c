/* New UV sets of primitives that keep their vertices. Primitives that use parts of the same accessors share
 * one accessor of UVs as far as they agree: each of its own would be as long as all of them. */
#ifndef VSHI_LIT_UV_POOL_H
#define VSHI_LIT_UV_POOL_H

#include "lit/topology.h"

typedef struct vshi_lit_uvs {
    size_t positions; /* accessor of the vertices' positions */
    size_t count;     /* elements */
    size_t accessor;
    size_t offset; /* of its values in the document's added bytes */
    bool *set;     /* [count] */
} vshi_lit_uvs;

typedef struct vshi_lit_uv_pool {
    vshi_lit_uvs *list;
    size_t count, capacity;
} vshi_lit_uv_pool;

void vshi_lit_uv_pool_free(vshi_lit_uv_pool *pool);

/* An accessor in which elements[i] (< count of elements) has values[i], v down. Elements may come twice, with
 * the same values. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_uv_pool_put(vshi_lit_document *document, vshi_lit_uv_pool *pool, size_t positions,
                                size_t element_count, const uint32_t *elements, const float (*values)[2],
                                size_t count, size_t *accessor, vsh_error *error);

#endif
