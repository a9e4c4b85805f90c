#include "mesh/solidity.h"

#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>

static bool one_object(const vsh_mesh *a, const vsh_mesh *b) {
    return a->object != 0 && a->object == b->object && a->solidity == b->solidity &&
           vshi_mesh_same_transform(a->transform, b->transform);
}

static vsh_result put_together(const vsh_mesh *parts, size_t count, vshi_wholes *w, vsh_error *error) {
    vsh_mesh *whole = &w->meshes[w->count];
    *whole = parts[0];
    for (size_t i = 1; i < count; ++i) {
        whole->vertex_count += parts[i].vertex_count;
        whole->triangle_count += parts[i].triangle_count;
    }
    if (count == 1) {
        return VSH_OK;
    }
    whole->normals = whole->uvs = NULL;
    VSHI_TRY(vshi_allocate((void **)&w->positions[w->count], whole->vertex_count, 3 * sizeof(float),
                           "parts of an object", error));
    VSHI_TRY(vshi_allocate((void **)&w->indices[w->count], whole->triangle_count, 3 * sizeof(uint32_t),
                           "parts of an object", error));
    float *position = w->positions[w->count];
    uint32_t *index = w->indices[w->count], before = 0;
    whole->positions = position;
    whole->indices = index;
    for (size_t i = 0; i < count; ++i) {
        if (parts[i].vertex_count > 0) {
            memcpy(position, parts[i].positions, parts[i].vertex_count * 3 * sizeof *position);
        }
        position += 3 * parts[i].vertex_count;
        for (size_t k = 0; k < 3 * parts[i].triangle_count; ++k) {
            *index++ = before + parts[i].indices[k];
        }
        before += (uint32_t)parts[i].vertex_count;
    }
    return VSH_OK;
}

vsh_result vshi_wholes_make(const vsh_mesh *meshes, size_t mesh_count, vshi_wholes *w, vsh_error *error) {
    *w = (vshi_wholes){0};
    VSHI_TRY(vshi_allocate((void **)&w->meshes, mesh_count, sizeof *w->meshes, "objects", error));
    VSHI_TRY(vshi_allocate((void **)&w->first, mesh_count + 1, sizeof *w->first, "objects", error));
    VSHI_TRY(vshi_allocate((void **)&w->positions, mesh_count, sizeof *w->positions, "objects", error));
    VSHI_TRY(vshi_allocate((void **)&w->indices, mesh_count, sizeof *w->indices, "objects", error));
    for (size_t m = 0, next; m < mesh_count; m = next) {
        size_t vertices = meshes[m].vertex_count;
        for (next = m + 1; next < mesh_count && one_object(&meshes[m], &meshes[next]) &&
                           vertices + meshes[next].vertex_count <= UINT32_MAX;
             ++next) {
            vertices += meshes[next].vertex_count;
        }
        const vsh_result result = put_together(meshes + m, next - m, w, error);
        w->first[++w->count] = next; /* what it has is freed with it */
        VSHI_TRY(result);
    }
    return VSH_OK;
}

void vshi_wholes_free(vshi_wholes *w) {
    for (size_t i = 0; i < w->count; ++i) {
        free(w->positions[i]);
        free(w->indices[i]);
    }
    free(w->indices);
    free(w->positions);
    free(w->first);
    free(w->meshes);
    *w = (vshi_wholes){0};
}
