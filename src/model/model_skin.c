#include "model/model_skin.h"

#include "base/memory.h"
#include "base/try.h"
#include "base/vec.h"

#include <assimp/scene.h>

#include <stdlib.h>
#include <string.h>

typedef struct vshi_skin_node {
    const char *name;
    double world[12];
} skin_node;

/* Assimp stores rows one after the other. */
static void rows_of(const struct aiMatrix4x4 *m, double rows[12]) {
    const double own[12] = {m->a1, m->a2, m->a3, m->a4, m->b1, m->b2,
                            m->b3, m->b4, m->c1, m->c2, m->c3, m->c4};
    memcpy(rows, own, sizeof own);
}

void vshi_node_world(const double parent[12], const struct aiNode *node, double world[12]) {
    double own[12];
    rows_of(&node->mTransformation, own);
    vshi_model_compose(parent, own, world);
}

static size_t count_nodes(const struct aiNode *node, int depth) {
    enum { DEEPEST = 1024 };
    size_t count = 1;
    for (unsigned i = 0; depth < DEEPEST && i < node->mNumChildren; ++i) {
        count += count_nodes(node->mChildren[i], depth + 1);
    }
    return count;
}

static void gather(vshi_skins *skins, size_t room, const struct aiNode *node, const double parent[12]) {
    if (skins->node_count == room) {
        return;
    }
    skin_node *to = &skins->nodes[skins->node_count++];
    to->name = node->mName.data;
    vshi_node_world(parent, node, to->world);
    double world[12];
    memcpy(world, to->world, sizeof world);
    for (unsigned i = 0; i < node->mNumChildren; ++i) {
        gather(skins, room, node->mChildren[i], world);
    }
}

static int by_name(const void *a, const void *b) {
    return strcmp(((const skin_node *)a)->name, ((const skin_node *)b)->name);
}

static vsh_result find_nodes(vshi_skins *skins, vsh_error *error) {
    const vshi_model_source *source = skins->source;
    const size_t count = count_nodes(source->scene->mRootNode, 0);
    VSHI_TRY(vshi_allocate((void **)&skins->done, source->scene->mNumMeshes, sizeof *skins->done,
                           source->path, error));
    VSHI_TRY(vshi_allocate((void **)&skins->nodes, count, sizeof *skins->nodes, source->path, error));
    gather(skins, count, source->scene->mRootNode, skins->root);
    qsort(skins->nodes, skins->node_count, sizeof *skins->nodes, by_name);
    return VSH_OK;
}

static vsh_result add_bone(const vshi_skins *skins, const struct aiBone *bone, size_t vertex_count,
                           vshi_model_blend *blends, vsh_error *error) {
    const char *path = skins->source->path;
    const skin_node wanted = {.name = bone->mName.data};
    const skin_node *node = bsearch(&wanted, skins->nodes, skins->node_count, sizeof *skins->nodes, by_name);
    if (node == NULL) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: bone '%s' is no node", path, bone->mName.data);
    }
    double offset[12], moved[12];
    rows_of(&bone->mOffsetMatrix, offset);
    vshi_model_compose(node->world, offset, moved);
    for (unsigned i = 0; i < bone->mNumWeights; ++i) {
        const struct aiVertexWeight given = bone->mWeights[i];
        if (given.mVertexId >= vertex_count || !isfinite(given.mWeight)) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s: bone '%s': weight %u is %g of vertex %u of %zu",
                             path, bone->mName.data, i, (double)given.mWeight, given.mVertexId, vertex_count);
        }
        vshi_model_blend_add(&blends[given.mVertexId], (double)given.mWeight, moved);
    }
    return VSH_OK;
}

static vsh_result check_positions(const vshi_skins *skins, const vshi_model_shape *shape, vsh_error *error) {
    for (size_t v = 0; v < shape->vertex_count; ++v) {
        const float *p = shape->positions + 3 * v;
        if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2])) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s: bones move vertex %zu of %zu beyond every number",
                             skins->source->path, v, shape->vertex_count);
        }
    }
    return VSH_OK;
}

vsh_result vshi_skins_apply(vshi_skins *skins, size_t mesh, vshi_model_shape *shape, const double world[12],
                            vsh_error *error) {
    const struct aiMesh *given = skins->source->scene->mMeshes[mesh];
    if (skins->nodes == NULL) {
        VSHI_TRY(find_nodes(skins, error));
    }
    if (skins->done[mesh]) {
        return VSH_OK;
    }
    skins->done[mesh] = true;
    vshi_model_blend *blends;
    vsh_result result;
    VSHI_TRY(
        vshi_allocate((void **)&blends, shape->vertex_count, sizeof *blends, skins->source->path, error));
    for (unsigned i = 0; i < given->mNumBones; ++i) {
        VSHI_TRY_DONE(add_bone(skins, given->mBones[i], shape->vertex_count, blends, error));
    }
    vshi_model_blend_move(shape, blends, world);
    result = check_positions(skins, shape, error);
done:
    free(blends);
    return result;
}

void vshi_skins_free(vshi_skins *skins) {
    free(skins->nodes);
    free(skins->done);
}
