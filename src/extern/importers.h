/* What the module of importers gives, and importers.c passes on: Assimp and Draco. */
#ifndef VSHI_IMPORTERS_H
#define VSHI_IMPORTERS_H

#include "extern/assimp.h"
#include "extern/draco.h"
#include "extern/module_calls.h"

#ifdef __cplusplus
extern "C" {
#endif

#define VSHI_IMPORTERS_MAKES(MAKE)                                                                           \
    MAKE(vshi_import_read,                                                                                   \
         (const char *path, bool outside, vshi_job *job, size_t units, vshi_import **import,                 \
          vsh_error *error),                                                                                 \
         (path, outside, job, units, import, error), import)                                                 \
    MAKE(vshi_draco_decode,                                                                                  \
         (const unsigned char *bytes, size_t size, const char *what, vshi_draco **mesh, vsh_error *error),   \
         (bytes, size, what, mesh, error), mesh)

#define VSHI_IMPORTERS_GIVES(GIVE)                                                                           \
    GIVE(double, vshi_import_unit, (const vshi_import *import), (import))                                    \
    GIVE(const struct aiScene *, vshi_import_scene, (const vshi_import *import), (import))                   \
    GIVE(float, vshi_import_opacity, (const struct aiScene *scene, unsigned material), (scene, material))    \
    GIVE(bool, vshi_import_material_name,                                                                    \
         (const struct aiScene *scene, unsigned material, struct aiString *name), (scene, material, name))   \
    GIVE(size_t, vshi_draco_vertex_count, (const vshi_draco *mesh), (mesh))                                  \
    GIVE(size_t, vshi_draco_triangle_count, (const vshi_draco *mesh), (mesh))                                \
    GIVE(bool, vshi_draco_attribute, (const vshi_draco *mesh, uint32_t id, int components, float *values),   \
         (mesh, id, components, values))                                                                     \
    GIVE(bool, vshi_draco_elements,                                                                          \
         (const vshi_draco *mesh, uint32_t id, int type, int components, void *values),                      \
         (mesh, id, type, components, values))

#define VSHI_IMPORTERS_DOES(DO)                                                                              \
    DO(vshi_draco_indices, (const vshi_draco *mesh, uint32_t *indices), (mesh, indices))                     \
    DO(vshi_import_free, (vshi_import * import), (import))                                                   \
    DO(vshi_draco_free, (vshi_draco * mesh), (mesh))

typedef struct vshi_importers_table {
    const char *version; /* of the header that it was built with */
    VSHI_IMPORTERS_MAKES(VSHI_MEMBER_MAKE)
    VSHI_IMPORTERS_GIVES(VSHI_MEMBER_GIVE)
    VSHI_IMPORTERS_DOES(VSHI_MEMBER_DO)
} vshi_importers_table;

/* The module's one symbol. */
extern const vshi_importers_table vshi_importers_module;

#ifdef __cplusplus
}
#endif
#endif
