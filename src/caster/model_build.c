#include "base/memory.h"
#include "caster/mesh.h"
#include "caster/model.h"

#include <assimp/scene.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static size_t count_triangles(const struct aiMesh *mesh) {
    size_t count = 0;
    for (unsigned f = 0; f < mesh->mNumFaces; ++f) {
        count += mesh->mFaces[f].mNumIndices == 3;
    }
    return count;
}

static vsh_result check_size(const vshi_model_source *source, vsh_error *error) {
    double bytes = 0.0;
    for (unsigned m = 0; m < source->scene->mNumMeshes; ++m) {
        const struct aiMesh *mesh = source->scene->mMeshes[m];
        double vertex = 0.0; /* our bytes and Assimp's */
        vertex += sizeof(float[3]) + sizeof(struct aiVector3D);
        vertex += mesh->mNormals != NULL ? sizeof(float[3]) + sizeof(struct aiVector3D) : 0;
        for (int set = 0; set < VSH_MAX_UV_SETS; ++set) {
            vertex += mesh->mTextureCoords[set] != NULL ? sizeof(float[2]) + sizeof(struct aiVector3D) : 0;
        }
        /* Each of Assimp's faces has an array of its own, of 32 bytes with malloc's header. */
        const double face = sizeof(uint32_t[3]) + sizeof(struct aiFace) + 32;
        bytes += vertex * mesh->mNumVertices + face * mesh->mNumFaces;
    }
    return vshi_check_limit(source->run, bytes, source->path, error);
}

/* Vectors that are not finite become zero, which no direction is: flat there. Returns how many. */
static size_t copy_normals(float *to, const struct aiVector3D *from, size_t count) {
    size_t bad = 0;
    for (size_t v = 0; v < count; ++v) {
        const vshi_vec n = {from[v].x, from[v].y, from[v].z};
        const bool good = vshi_finite(n);
        to[3 * v] = good ? from[v].x : 0.0F;
        to[3 * v + 1] = good ? from[v].y : 0.0F;
        to[3 * v + 2] = good ? from[v].z : 0.0F;
        bad += !good;
    }
    return bad;
}

static vsh_result copy_shape(const vshi_model_source *source, const struct aiMesh *mesh,
                             vshi_model_shape *shape, vsh_error *error) {
    const char *what = source->path;
    const size_t count = mesh->mNumVertices;
    shape->vertex_count = count;
    shape->triangle_count = count_triangles(mesh);
    if (shape->triangle_count == 0) {
        return VSH_OK; /* points or lines */
    }
    vsh_result result = vshi_allocate((void **)&shape->positions, count, sizeof(float[3]), what, error);
    if (result == VSH_OK) {
        result =
            vshi_allocate((void **)&shape->indices, shape->triangle_count, sizeof(uint32_t[3]), what, error);
    }
    if (result == VSH_OK && mesh->mNormals != NULL && source->keep_normals) {
        result = vshi_allocate((void **)&shape->normals, count, sizeof(float[3]), what, error);
    }
    for (int set = 0; set < VSH_MAX_UV_SETS && result == VSH_OK; ++set) {
        if (mesh->mTextureCoords[set] != NULL) {
            shape->uv_sets = set + 1;
            result = vshi_allocate((void **)&shape->uvs[set], count, sizeof(float[2]), what, error);
        }
    }
    if (result != VSH_OK) {
        return result;
    }
    for (size_t v = 0; v < count; ++v) {
        const struct aiVector3D p = mesh->mVertices[v];
        memcpy(shape->positions + 3 * v, (float[3]){p.x, p.y, p.z}, sizeof(float[3]));
    }
    for (int set = 0; set < shape->uv_sets; ++set) {
        const struct aiVector3D *uv = mesh->mTextureCoords[set];
        for (size_t v = 0; v < count && uv != NULL; ++v) {
            memcpy(shape->uvs[set] + 2 * v, (float[2]){uv[v].x, uv[v].y}, sizeof(float[2]));
        }
    }
    if (shape->normals != NULL) {
        const size_t bad = copy_normals(shape->normals, mesh->mNormals, count);
        if (bad > 0) {
            vshi_warn(source->run, "%s: mesh '%s': %zu normals are not finite: flat there", what,
                      mesh->mName.data, bad);
        }
    }
    uint32_t *index = shape->indices;
    for (unsigned f = 0; f < mesh->mNumFaces; ++f) {
        if (mesh->mFaces[f].mNumIndices == 3) {
            memcpy(index, mesh->mFaces[f].mIndices, sizeof(uint32_t[3]));
            index += 3;
        }
    }
    return VSH_OK;
}

static void make_line(char *text) {
    for (char *c = text; *c != '\0'; ++c) {
        *c = (unsigned char)*c < 0x20 || *c == 0x7f ? '?' : *c;
    }
}

/* "node/mesh", or whichever has a name, or NULL; on one line. */
static vsh_result make_name(const struct aiNode *node, const struct aiMesh *mesh, char **name,
                            vsh_error *error) {
    const char *first = node->mName.data, *second = mesh->mName.data;
    const bool both = first[0] != '\0' && second[0] != '\0' && strcmp(first, second) != 0;
    *name = NULL;
    if (first[0] == '\0' && second[0] == '\0') {
        return VSH_OK;
    }
    const size_t size = strlen(first) + strlen(second) + 2;
    const vsh_result result = vshi_allocate((void **)name, size, 1, "a mesh's name", error);
    if (result != VSH_OK) {
        return result;
    }
    snprintf(*name, size, "%s%s%s", first, both ? "/" : "", both || first[0] == '\0' ? second : "");
    make_line(*name);
    return VSH_OK;
}

static vsh_result make_object_name(const struct aiNode *node, char **name, vsh_error *error) {
    const size_t size = strlen(node->mName.data) + 1;
    *name = NULL;
    if (size == 1) {
        return VSH_OK;
    }
    const vsh_result result = vshi_allocate((void **)name, size, 1, "an object's name", error);
    if (result == VSH_OK) {
        memcpy(*name, node->mName.data, size);
        make_line(*name);
    }
    return result;
}

static vsh_result grow_entries(vsh_model *model, vsh_error *error) {
    if (model->entry_count < model->entry_capacity) {
        return VSH_OK;
    }
    const size_t capacity = model->entry_capacity > 0 ? 2 * model->entry_capacity : 8;
    vshi_model_entry *entries = NULL;
    const vsh_result result =
        vshi_allocate((void **)&entries, capacity, sizeof *entries, "a model's meshes", error);
    if (result != VSH_OK) {
        return result;
    }
    if (model->entry_count > 0) {
        memcpy(entries, model->entries, model->entry_count * sizeof *entries);
    }
    free(model->entries);
    model->entries = entries;
    model->entry_capacity = capacity;
    return VSH_OK;
}

static vsh_result add_entry(const vshi_model_source *source, vsh_model *model, const struct aiNode *node,
                            uint32_t object, unsigned shape, const double world[12], vsh_error *error) {
    const struct aiMesh *mesh = source->scene->mMeshes[shape];
    vsh_result result = grow_entries(model, error);
    char *name = NULL, *object_name = NULL;
    if (result == VSH_OK) {
        result = make_name(node, mesh, &name, error);
    }
    if (result == VSH_OK) {
        result = make_object_name(node, &object_name, error);
    }
    if (result != VSH_OK) {
        free(name);
        return result;
    }
    vshi_model_entry *entry = &model->entries[model->entry_count++];
    *entry = (vshi_model_entry){.name = name, .object_name = object_name, .object = object, .shape = shape};
    memcpy(entry->transform, world, sizeof entry->transform);
    vsh_error why;
    const vsh_mesh view = vsh_model_mesh(model, model->entry_count - 1, 0);
    if (vshi_mesh_check_transform(&view, VSHI_MESH_ALONE, &why) == VSH_OK) {
        return VSH_OK;
    }
    for (int i = 0; i < 12; ++i) {
        if (!isfinite(world[i])) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s: %s", source->path, why.message);
        }
    }
    /* A scale of zero is how scenes hide things. */
    vshi_warn(source->run, "%s: %s; left out", source->path, why.message);
    free(object_name);
    free(name);
    --model->entry_count;
    return VSH_OK;
}

/* parent × the node's own transform, whose rows Assimp stores one after the other. */
static void node_transform(const double parent[12], const struct aiMatrix4x4 *m, double world[12]) {
    const double own[12] = {m->a1, m->a2, m->a3, m->a4, m->b1, m->b2,
                            m->b3, m->b4, m->c1, m->c2, m->c3, m->c4};
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 4; ++column) {
            double sum = column == 3 ? parent[4 * row + 3] : 0.0;
            for (int k = 0; k < 3; ++k) {
                sum += parent[4 * row + k] * own[4 * k + column];
            }
            world[4 * row + column] = sum;
        }
    }
}

static vsh_result add_nodes(const vshi_model_source *source, vsh_model *model, const struct aiNode *node,
                            const double parent[12], int depth, vsh_error *error) {
    enum { DEEPEST = 1024 };
    if (depth > DEEPEST) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: its nodes are nested deeper than %d", source->path,
                         DEEPEST);
    }
    if (vshi_job_cancelled(source->job)) {
        return vshi_job_fail_cancelled(source->job, error);
    }
    double world[12];
    node_transform(parent, &node->mTransformation, world);
    vsh_result result = VSH_OK;
    /* that of the last entry is the highest so far */
    const uint32_t object = model->entry_count > 0 ? model->entries[model->entry_count - 1].object + 1 : 1;
    for (unsigned i = 0; i < node->mNumMeshes && result == VSH_OK; ++i) {
        const unsigned shape = node->mMeshes[i];
        if (shape < model->shape_count && model->shapes[shape].triangle_count > 0) {
            result = add_entry(source, model, node, object, shape, world, error);
        }
    }
    for (unsigned i = 0; i < node->mNumChildren && result == VSH_OK; ++i) {
        result = add_nodes(source, model, node->mChildren[i], world, depth + 1, error);
    }
    return result;
}

vsh_result vshi_model_build(const vshi_model_source *source, vsh_model **out, vsh_error *error) {
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    vsh_model *model = NULL;
    vsh_result result = check_size(source, error);
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&model, 1, sizeof *model, source->path, error);
    }
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&model->shapes, source->scene->mNumMeshes, sizeof *model->shapes,
                               source->path, error);
    }
    if (result == VSH_OK) {
        model->shape_count = source->scene->mNumMeshes;
    }
    for (size_t m = 0; result == VSH_OK && m < model->shape_count; ++m) {
        result = vshi_job_cancelled(source->job)
                     ? vshi_job_fail_cancelled(source->job, error)
                     : copy_shape(source, source->scene->mMeshes[m], &model->shapes[m], error);
    }
    if (result == VSH_OK && source->scene->mRootNode != NULL) {
        result = add_nodes(source, model, source->scene->mRootNode, identity, 0, error);
    }
    if (result == VSH_OK && model->entry_count == 0) {
        result = vshi_fail(error, VSH_ERROR_INPUT, "%s: holds no triangles: no node uses its meshes",
                           source->path);
    }
    if (result == VSH_OK) {
        *out = model;
    } else {
        vsh_model_free(model);
    }
    return result;
}
