#include "lit/uv_pool.h"

#include <stdlib.h>
#include <string.h>

void vshi_lit_uv_pool_free(vshi_lit_uv_pool *pool) {
    for (size_t i = 0; i < pool->count; ++i) {
        free(pool->list[i].set);
    }
    free(pool->list);
    *pool = (vshi_lit_uv_pool){.list = NULL};
}

static unsigned char *place(const vshi_lit_document *document, const vshi_lit_uvs *uvs, uint32_t element) {
    return document->added.at + uvs->offset + (size_t)element * sizeof(float[2]);
}

static bool fits(const vshi_lit_document *document, const vshi_lit_uvs *uvs, const uint32_t *elements,
                 const float (*values)[2], size_t count) {
    for (size_t i = 0; i < count; ++i) {
        if (uvs->set[elements[i]] &&
            memcmp(place(document, uvs, elements[i]), values[i], sizeof values[i]) != 0) {
            return false;
        }
    }
    return true;
}

static vsh_result add(vshi_lit_document *document, vshi_lit_uv_pool *pool, size_t positions,
                      size_t element_count, vsh_error *error) {
    if (pool->count == pool->capacity) {
        const size_t capacity = 2 * pool->capacity + 8;
        vshi_lit_uvs *list = realloc(pool->list, capacity * sizeof *list);
        if (list == NULL) {
            return vshi_lit_no_memory(document, error);
        }
        pool->list = list;
        pool->capacity = capacity;
    }
    vshi_lit_uvs *made = &pool->list[pool->count];
    *made = (vshi_lit_uvs){.positions = positions, .count = element_count};
    VSHI_TRY(
        vshi_gltf_allocate(&document->gltf, (void **)&made->set, element_count, sizeof *made->set, error));
    ++pool->count;
    return vshi_lit_add_floats(document, NULL, element_count, 2, false, &made->accessor, &made->offset,
                               error);
}

vsh_result vshi_lit_uv_pool_put(vshi_lit_document *document, vshi_lit_uv_pool *pool, size_t positions,
                                size_t element_count, const uint32_t *elements, const float (*values)[2],
                                size_t count, size_t *accessor, vsh_error *error) {
    size_t found = 0;
    while (found < pool->count &&
           (pool->list[found].positions != positions || pool->list[found].count != element_count ||
            !fits(document, &pool->list[found], elements, values, count))) {
        ++found;
    }
    if (found == pool->count) {
        VSHI_TRY(add(document, pool, positions, element_count, error));
    }
    const vshi_lit_uvs *uvs = &pool->list[found];
    for (size_t i = 0; i < count; ++i) {
        memcpy(place(document, uvs, elements[i]), values[i], sizeof values[i]);
        uvs->set[elements[i]] = true;
    }
    *accessor = uvs->accessor;
    return VSH_OK;
}
