/* Reads STL, Collada and FBX through Assimp. First searches the file's bytes for defects that Assimp 5.2
 * hides: it drops or repeats faces of files that end early, and replaces numbers that are not finite. Then
 * converts its scene: arrays, polygons, skins at rest, places. */
#define _GNU_SOURCE
#include "base/bytes.h"
#include "base/decimal.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/vec.h"
#include "geometry/mesh.h"
#include "io/model/faces.h"
#include "io/model/importers.h"
#include "io/model/model.h"
#include "io/model/text.h"

#include <assimp/material.h>
#include <assimp/scene.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

typedef struct assimp {
    const char *path;
    const vsh_run *run;
    vshi_job *job;
    size_t faces; /* least number of polygons with three corners or more; 0: not known */
    double unit;  /* metres in a unit of a Collada file, which Assimp multiplies by; 0: another format */
    const struct aiScene *scene;
    double root[12]; /* the transform above the scene's root */
    bool *skinned;   /* [mNumMeshes]: whether bones have moved the mesh */
} assimp;

_Static_assert(sizeof(struct aiVector3D) == sizeof(float[3]), "Assimp's vectors are three floats");

/* --- the file's bytes */

/* STL: the number of triangles gives the size of a binary file. An ASCII file ends in "endsolid" and holds
 * numbers; Assimp 5.2 reads one that ends between two facets as a smaller mesh. */

enum { HEADER = 84, FACET = 50 };

static vsh_result scan_ascii(assimp *scan, vshi_text *text, vsh_error *error) {
    const char *at = text->bytes, *end = text->bytes + text->size;
    size_t vertices = 0;
    bool ended = false;
    for (;;) {
        const vshi_token token = vshi_scan_token(&at, end);
        if (token.text == NULL) {
            break;
        }
        if (vshi_token_is(token, "solid") || vshi_token_is(token, "endsolid")) {
            ended = token.text[0] == 'e';
            const char *stop = memchr(at, '\n', (size_t)(end - at)); /* a name of any words may follow */
            at = stop != NULL ? stop : end;
        } else if (vshi_token_is(token, "endfacet")) {
            ++scan->faces;
            VSHI_TRY(vshi_text_poll(text, at, error));
        } else if (vshi_token_is(token, "vertex")) {
            for (int k = 0; k < 3; ++k) {
                const vshi_token number = vshi_scan_token(&at, end);
                if (number.text != NULL && vshi_token_number(number) != VSHI_NUMBER_FINITE) {
                    return vshi_fail(error, VSH_ERROR_INPUT,
                                     "%s: vertex %zu of facet %zu holds '%.*s', expected a finite number",
                                     scan->path, vertices % 3, vertices / 3, VSHI_TOKEN_ARGS(number));
                }
            }
            ++vertices;
        }
    }
    if (!ended) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cut short: no 'endsolid' after %zu facets", scan->path,
                         scan->faces);
    }
    return VSH_OK;
}

static vsh_result scan_stl(assimp *scan, vshi_text *text, vsh_error *error) {
    const size_t facets = text->size >= HEADER ? (size_t)vshi_bytes_number(text->bytes + 80, 4, false) : 0;
    const uint64_t expected = HEADER + FACET * (uint64_t)facets;
    const char *at = text->bytes;
    const bool solid = vshi_token_is(vshi_scan_token(&at, text->bytes + text->size), "solid");
    if (text->size >= HEADER && expected == text->size) {
        scan->faces = facets;
        return VSH_OK;
    }
    if (solid && memchr(text->bytes, '\0', text->size < HEADER ? text->size : HEADER) == NULL) {
        return scan_ascii(scan, text, error);
    }
    if (text->size < HEADER || expected > text->size) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cut short: %zu bytes of %llu", scan->path, text->size,
                         (unsigned long long)(text->size < HEADER ? HEADER : expected));
    }
    scan->faces = facets;
    return VSH_OK;
}

/* Collada: the unit of the asset ("<unit meter="0.01"/>"). Assimp multiplies by it, but does not report
 * it. */

/* Reads meter="NUMBER" between `at` and `end`; 0: it is absent or no number. XML allows blanks around "=". */
static double read_metres(const char *at, const char *end) {
    static const char name[] = "meter";
    double metres = 0.0;
    at = memmem(at, (size_t)(end - at), name, sizeof name - 1);
    at = at != NULL ? vshi_scan_rest(at + sizeof name - 1, end).text : end;
    at = at < end && *at == '=' ? vshi_scan_rest(at + 1, end).text : end;
    const bool quoted = at < end && (*at == '"' || *at == '\'');
    const char *stop = quoted ? memchr(at + 1, *at, (size_t)(end - at - 1)) : NULL;
    return stop != NULL && vshi_decimal_read(at + 1, stop, &metres) ? metres : 0.0;
}

static void scan_dae(assimp *scan, const vshi_text *text) {
    static const char open[] = "<unit";
    const char *end = text->bytes + text->size;
    const char *tag = memmem(text->bytes, text->size, open, sizeof open - 1);
    const char *stop = tag != NULL ? memchr(tag, '>', (size_t)(end - tag)) : NULL;
    const double metres = stop != NULL ? read_metres(tag, stop) : 1.0;
    scan->unit = metres > 0.0 && metres < 1e12 ? metres : 1.0; /* the default of Collada */
}

/* Searches the file's bytes. Errors: VSH_ERROR_READ (it ends early), VSH_ERROR_INPUT, VSH_ERROR_CANCELLED. */
static vsh_result scan_file(assimp *scan, size_t units, vsh_error *error) {
    const char *ending = vshi_path_ending(scan->path);
    vshi_budget budget = {scan->path, scan->run, 0.0};
    vshi_text text;
    vsh_result result;
    VSHI_TRY_DONE(vshi_text_read_whole(&text, &budget, scan->job, units, error));
    if (strcasecmp(ending, "stl") == 0) {
        VSHI_TRY_DONE(scan_stl(scan, &text, error));
    } else if (strcasecmp(ending, "dae") == 0) {
        scan_dae(scan, &text);
    }
    result = vshi_text_poll(&text, text.bytes + text.size, error);
done:
    vshi_text_free(&text);
    return result;
}

/* --- its scene */

enum { DEEPEST = 1024 /* levels of nodes */ };

static void copy_rows(const struct aiMatrix4x4 *m, double rows[12]) {
    const double own[12] = {m->a1, m->a2, m->a3, m->a4, m->b1, m->b2,
                            m->b3, m->b4, m->c1, m->c2, m->c3, m->c4};
    memcpy(rows, own, sizeof own);
}

/* world = parent × the node's own transform. */
static void find_node_world(const double parent[12], const struct aiNode *node, double world[12]) {
    double own[12];
    copy_rows(&node->mTransformation, own);
    vshi_transform_compose(parent, own, world);
}

/* Finds the world transform of the first node with a name, at or below `node`. */
static bool find_node(const struct aiNode *node, const char *name, const double parent[12], int depth,
                      double world[12]) {
    double own[12];
    find_node_world(parent, node, own);
    if (strcmp(node->mName.data, name) == 0) {
        memcpy(world, own, sizeof own);
        return true;
    }
    for (unsigned i = 0; depth < DEEPEST && i < node->mNumChildren; ++i) {
        if (find_node(node->mChildren[i], name, own, depth + 1, world)) {
            return true;
        }
    }
    return false;
}

static vsh_result add_bone(const assimp *source, const struct aiBone *bone, size_t vertex_count,
                           vshi_model_blend *blends, vsh_error *error) {
    const char *path = source->path;
    double world[12], offset[12], moved[12];
    if (!find_node(source->scene->mRootNode, bone->mName.data, source->root, 0, world)) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: bone '%s' is no node", path, bone->mName.data);
    }
    copy_rows(&bone->mOffsetMatrix, offset);
    vshi_transform_compose(world, offset, moved);
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

/* Moves the vertices of mesh `mesh` into the world: Σ weight × bone's node × offset matrix; vertices without
 * a bone by `world`. Does so once, even if several nodes use the mesh. Errors: VSH_ERROR_INPUT (a bone
 * without a node, a vertex out of range, a weight that is not finite), VSH_ERROR_MEMORY. */
static vsh_result apply_skin(assimp *source, size_t mesh, vshi_model_shape *shape, const double world[12],
                             vsh_error *error) {
    const struct aiMesh *given = source->scene->mMeshes[mesh];
    if (source->skinned[mesh]) {
        return VSH_OK;
    }
    source->skinned[mesh] = true;
    vshi_model_blend *blends;
    vsh_result result;
    VSHI_TRY(VSHI_ALLOCATE(blends, shape->vertex_count, source->path, error));
    for (unsigned i = 0; i < given->mNumBones; ++i) {
        VSHI_TRY_DONE(add_bone(source, given->mBones[i], shape->vertex_count, blends, error));
    }
    vshi_model_blend_move(shape, blends, world);
    result = vshi_model_check_positions(source->path, "moved by bones", shape->positions, shape->vertex_count,
                                        error);
done:
    free(blends);
    return result;
}

/* Counts the triangles that a mesh's faces make at most. */
static size_t count_triangles(const struct aiMesh *mesh) {
    size_t count = 0;
    for (unsigned f = 0; f < mesh->mNumFaces; ++f) {
        const unsigned corners = mesh->mFaces[f].mNumIndices;
        count += corners >= 3 ? corners - 2 : 0;
    }
    return count;
}

static vsh_result check_size(const assimp *source, vsh_error *error) {
    double bytes = 0.0;
    for (unsigned m = 0; m < source->scene->mNumMeshes; ++m) {
        const struct aiMesh *mesh = source->scene->mMeshes[m];
        double vertex = 0.0; /* bytes of ours and of Assimp */
        vertex += sizeof(float[3]) + sizeof(struct aiVector3D);
        vertex += mesh->mNormals != NULL ? sizeof(float[3]) + sizeof(struct aiVector3D) : 0;
        for (int set = 0; set < VSH_MAX_UV_SETS; ++set) {
            vertex += mesh->mTextureCoords[set] != NULL ? sizeof(float[2]) + sizeof(struct aiVector3D) : 0;
        }
        vertex += mesh->mNumBones > 0 ? sizeof(vshi_model_blend) : 0;
        /* each of Assimp's faces has an array, of 32 bytes with malloc's header */
        bytes += vertex * mesh->mNumVertices + (sizeof(struct aiFace) + 32.0) * mesh->mNumFaces +
                 (double)sizeof(uint32_t[3]) * (double)count_triangles(mesh);
    }
    return vshi_check_limit(source->run, bytes, source->path, error);
}

static vsh_result copy_faces(const assimp *source, const struct aiMesh *mesh, vshi_model_shape *shape,
                             vsh_error *error) {
    vshi_face_cutter cutter = {
        .positions = shape->positions, .job = source->job, .turns = shape->triangle_count > mesh->mNumFaces};
    vsh_result result = VSH_OK;
    shape->triangle_count = 0;
    for (unsigned f = 0; result == VSH_OK && f < mesh->mNumFaces; ++f) {
        const struct aiFace *face = &mesh->mFaces[f];
        size_t made;
        result = vshi_face_cut(&cutter, face->mIndices, face->mNumIndices,
                               shape->indices + 3 * shape->triangle_count, &made, error);
        shape->triangle_count += made;
    }
    vshi_face_cutter_end(&cutter, source->run, source->path, mesh->mName.data);
    return result;
}

static vsh_result copy_shape(const assimp *source, const struct aiMesh *mesh, vshi_model_shape *shape,
                             vsh_error *error) {
    const char *path = source->path;
    const size_t count = mesh->mNumVertices;
    shape->vertex_count = count;
    shape->triangle_count = count_triangles(mesh);
    if (shape->triangle_count == 0) {
        return VSH_OK; /* points or lines */
    }
    if (mesh->mMaterialIndex < source->scene->mNumMaterials) {
        const float opacity = vshi_importers()->opacity(source->scene, mesh->mMaterialIndex);
        shape->alpha = opacity < 1.0F ? VSH_ALPHA_BLENDED : VSH_ALPHA_OPAQUE;
        shape->material = (int32_t)mesh->mMaterialIndex + 1;
    }
    VSHI_TRY(vshi_allocate((void **)&shape->positions, count, sizeof(float[3]), path, error));
    VSHI_TRY(
        vshi_allocate((void **)&shape->indices, shape->triangle_count, sizeof(uint32_t[3]), path, error));
    memcpy(shape->positions, mesh->mVertices, count * sizeof(float[3]));
    for (int set = 0; set < VSH_MAX_UV_SETS; ++set) {
        const struct aiVector3D *uv = mesh->mTextureCoords[set];
        if (uv == NULL) {
            continue;
        }
        shape->uv_sets = set + 1;
        VSHI_TRY(vshi_allocate((void **)&shape->uvs[set], count, sizeof(float[2]), path, error));
        for (size_t v = 0; v < count; ++v) {
            memcpy(shape->uvs[set] + 2 * v, &uv[v], sizeof(float[2]));
        }
    }
    /* STL's normals are often zero or wrong; the triangles give better ones */
    if (mesh->mNormals != NULL && strcasecmp(vshi_path_ending(path), "stl") != 0) {
        char where[MAXLEN + 16];
        snprintf(where, sizeof where, "mesh '%s'", mesh->mName.data);
        VSHI_TRY(vshi_allocate((void **)&shape->normals, count, sizeof(float[3]), path, error));
        memcpy(shape->normals, mesh->mNormals, count * sizeof(float[3]));
        vshi_model_check_normals(path, source->run, where, shape);
    }
    return copy_faces(source, mesh, shape, error);
}

static vsh_result add_nodes(assimp *source, vsh_model *model, const struct aiNode *node,
                            const double parent[12], int depth, vsh_error *error) {
    if (depth > DEEPEST) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: its nodes are nested deeper than %d", source->path,
                         DEEPEST);
    }
    VSHI_TRY(vshi_job_check(source->job, error));
    double world[12];
    find_node_world(parent, node, world);
    const uint32_t object = vshi_model_next_object(model);
    for (unsigned i = 0; i < node->mNumMeshes; ++i) {
        const unsigned shape = node->mMeshes[i];
        if (shape >= model->shape_count || model->shapes[shape].triangle_count == 0) {
            continue;
        }
        const struct aiMesh *mesh = source->scene->mMeshes[shape];
        const bool skinned = mesh->mNumBones > 0;
        if (skinned) {
            VSHI_TRY(apply_skin(source, shape, &model->shapes[shape], world, error));
        }
        const vshi_model_place place = {.node = node->mName.data,
                                        .mesh = mesh->mName.data,
                                        .object = object,
                                        .shape = shape,
                                        .world = skinned ? vshi_identity : world};
        VSHI_TRY(vshi_model_add(model, source->path, source->run, &place, error));
    }
    for (unsigned i = 0; i < node->mNumChildren; ++i) {
        VSHI_TRY(add_nodes(source, model, node->mChildren[i], world, depth + 1, error));
    }
    return VSH_OK;
}

/* Copies the materials' names, and from the meshes whether their materials are blended. */
static vsh_result copy_materials(const assimp *source, vsh_model *model, vsh_error *error) {
    const struct aiScene *scene = source->scene;
    VSHI_TRY(vshi_model_add_materials(model, scene->mNumMaterials, error));
    for (size_t m = 0; m < model->shape_count; ++m) {
        const int32_t material = model->shapes[m].material;
        if (material > 0) {
            model->materials[material - 1].values.alpha = model->shapes[m].alpha;
        }
    }
    for (unsigned i = 0; i < scene->mNumMaterials; ++i) {
        struct aiString name;
        if (vshi_importers()->material_name(scene, i, &name)) {
            VSHI_TRY(vshi_model_copy_line(name.data, &model->materials[i].name, error));
        }
    }
    return VSH_OK;
}

/* Checks a mesh's numbers, and counts its polygons. */
static vsh_result check_mesh(const char *path, const struct aiMesh *mesh, unsigned number, size_t *polygons,
                             vsh_error *error) {
    char where[MAXLEN + 32];
    snprintf(where, sizeof where, "mesh %u '%s'", number, mesh->mName.data);
    VSHI_TRY(
        vshi_model_check_positions(path, where, (const float *)mesh->mVertices, mesh->mNumVertices, error));
    for (unsigned f = 0; f < mesh->mNumFaces; ++f) {
        const struct aiFace *face = &mesh->mFaces[f];
        *polygons += face->mNumIndices >= 3;
        for (unsigned k = 0; k < face->mNumIndices; ++k) {
            if (face->mIndices[k] >= mesh->mNumVertices) {
                return vshi_fail(error, VSH_ERROR_INPUT,
                                 "%s: %s: face %u uses vertex %u, but there are only %u", path, where, f,
                                 face->mIndices[k], mesh->mNumVertices);
            }
        }
    }
    return VSH_OK;
}

/* Checks the scene's numbers, and that Assimp lost no faces. */
static vsh_result check_scene(const assimp *source, vsh_error *error) {
    const char *path = source->path;
    size_t polygons = 0;
    for (unsigned m = 0; m < source->scene->mNumMeshes; ++m) {
        VSHI_TRY(vshi_job_check(source->job, error));
        VSHI_TRY(check_mesh(path, source->scene->mMeshes[m], m, &polygons, error));
    }
    if (polygons < source->faces) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: only %zu of its %zu faces can be read: the others use vertices out of range",
                         path, polygons, source->faces);
    }
    return VSH_OK;
}

static vsh_result build(assimp *source, double unit, vsh_model **out, vsh_error *error) {
    vsh_model *model = NULL;
    const struct aiScene *scene = source->scene;
    const double metres = source->unit > 0.0 || !(unit > 0.0) ? 1.0 : unit; /* Assimp has scaled Collada */
    vsh_result result;
    VSHI_TRY(check_size(source, error));
    VSHI_TRY_DONE(VSHI_ALLOCATE(model, 1, source->path, error));
    VSHI_TRY_DONE(VSHI_ALLOCATE(model->shapes, scene->mNumMeshes, source->path, error));
    model->shape_count = scene->mNumMeshes;
    VSHI_TRY_DONE(VSHI_ALLOCATE(source->skinned, scene->mNumMeshes, source->path, error));
    model->unit = source->unit > 0.0 ? source->unit : unit;
    for (size_t m = 0; m < model->shape_count; ++m) {
        VSHI_TRY_DONE(vshi_job_check(source->job, error));
        VSHI_TRY_DONE(copy_shape(source, scene->mMeshes[m], &model->shapes[m], error));
    }
    VSHI_TRY_DONE(copy_materials(source, model, error));
    if (scene->mRootNode != NULL) {
        source->root[0] = source->root[5] = source->root[10] = metres;
        VSHI_TRY_DONE(add_nodes(source, model, scene->mRootNode, source->root, 0, error));
    }
    *out = model;
    model = NULL;
done:
    free(source->skinned);
    vsh_model_free(model);
    return result;
}

vsh_result vshi_assimp_read(const char *path, const vsh_run *run, vshi_job *job, size_t units,
                            vsh_model **model, vsh_error *error) {
    const size_t scan_units = units / 5;
    assimp source = {.path = path, .run = run, .job = job};
    vshi_import *import = NULL;
    vsh_result result;
    VSHI_TRY(scan_file(&source, scan_units, error));
    VSHI_TRY(vshi_importers_load(error));
    VSHI_TRY(vshi_importers()->read(path, run->allow_outside != 0, job, units - scan_units, &import, error));
    source.scene = import->scene;
    VSHI_TRY_DONE(check_scene(&source, error));
    result = build(&source, import->unit, model, error);
done:
    vshi_importers()->free(import);
    return result;
}
