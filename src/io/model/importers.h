/* The module of importers: Assimp, and Draco's decoder (KHR_draco_mesh_compression of glTF). */
#pragma once

#include "base/job.h"

VSH_BEGIN_C

struct aiScene;
struct aiString;

/* A file that Assimp has read. */
typedef struct vshi_import {
    const struct aiScene *scene; /* belongs to the import */
    double unit;                 /* metres in one unit of an FBX, unscaled by Assimp; 0: another format */
} vshi_import;

/* A triangle mesh that Draco has decoded. */
typedef struct vshi_draco {
    size_t vertex_count, triangle_count;
} vshi_draco;

/* Types of components by glTF's numbers. */
enum {
    VSHI_GLTF_BYTE = 5120,
    VSHI_GLTF_UBYTE = 5121,
    VSHI_GLTF_SHORT = 5122,
    VSHI_GLTF_USHORT = 5123,
    VSHI_GLTF_UINT = 5125,
    VSHI_GLTF_FLOAT = 5126
};

typedef struct vshi_importers_table {
    const char *version; /* of the headers that the module was built with */

    /* Reads the file without changes: polygons stay polygons, nothing is joined, generated or transformed.
     * Opens only regular files that the file names, in its folder or `outside`. Advances the job by up to
     * `units`. Errors: VSH_ERROR_INPUT (a file outside), VSH_ERROR_READ with Assimp's reason,
     * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED (a few readers only). */
    vsh_result (*read)(const char *path, bool outside, vshi_job *job, size_t units, vshi_import **import,
                       vsh_error *error);
    void (*free)(vshi_import *import);

    /* Get a material's opacity, by default 1, and its name; false if it has no name. */
    float (*opacity)(const struct aiScene *scene, unsigned material);
    bool (*material_name)(const struct aiScene *scene, unsigned material, struct aiString *name);

    /* Decodes a triangle mesh. Errors: VSH_ERROR_INPUT with Draco's reason, VSH_ERROR_MEMORY. */
    vsh_result (*draco_decode)(const unsigned char *bytes, size_t size, const char *what, vshi_draco **mesh,
                               vsh_error *error);
    void (*draco_free)(vshi_draco *mesh);

    void (*draco_indices)(const vshi_draco *mesh, uint32_t *indices); /* [triangle_count][3] */

    /* Writes attribute `id` as [vertex_count][components] numbers of a type VSHI_GLTF_…. Returns false if
     * there is no such attribute, or it has another number of components. */
    bool (*draco_elements)(const vshi_draco *mesh, uint32_t id, int type, int components, void *values);
} vshi_importers_table;

/* The module's one symbol. */
VSHI_SHARED extern const vshi_importers_table vshi_importers_module;

/* Loads the module. Errors: as vshi_module_load(). */
vsh_result vshi_importers_load(vsh_error *error);

/* NULL before vshi_importers_load(). */
const vshi_importers_table *vshi_importers(void);

VSH_END_C
