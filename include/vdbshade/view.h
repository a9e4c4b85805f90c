/* Pages that show a baked mesh in a browser, in three dimensions. */
#ifndef VDBSHADE_VIEW_H
#define VDBSHADE_VIEW_H

#include "image.h"
#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A baked mesh: a file, and where its light is not in it the planes of a bake. */
typedef struct vsh_view_bake {
    size_t struct_size;
    const char *model; /* mesh file, as of vsh_model_read(). A GLB (2.0) is put into the page as it is, with
                          its materials and textures; of every other, and of one whose geometry is compressed,
                          the triangles, normals and UVs. NULL, of a second bake: the first one's */
    const char *const *planes; /* [plane_count] image files, as of vsh_image_read(): channels of a bake of the
                                  mesh; one, or one for each page of its lightmap, in their order */
    size_t plane_count; /* 0 … VSH_MAX_VIEW_PLANES; 0: light is in the model's materials, or nowhere */
    int32_t uv_set; /* of the lightmap, 0 … VSH_MAX_UV_SETS - 1; -1: that of the materials' MOZ_lightmap, else
                       of their occlusionTexture where it has one of its own, else as of vsh_model_mesh() */
    const char
        *name; /* shown; NULL: the model's file name, or of a second bake without a model its planes' */
} vsh_view_bake;

enum { VSH_MAX_VIEW_PLANES = 1024 };

static inline vsh_view_bake vsh_view_bake_default(void) {
    vsh_view_bake bake = {sizeof(vsh_view_bake), NULL, NULL, 0, -1, NULL};
    return bake;
}

/* Writes one HTML page that needs nothing beside it and asks for nothing: the model to be turned, lit, or as
 * one of its channels, checkers, texel density or charts (docs/view.md), each texel's values to be picked.
 * `other` is a second bake beside it, with a slider between; it may be NULL. Values of planes are half floats
 * there. Atomic, as vsh_image_write(). The stages are "load" and "page". Errors:
 * - VSH_ERROR_ARGUMENT: path, bake or its model NULL; planes or a UV set out of range; run;
 * - those of vsh_model_read() and vsh_image_read() for the files, which may be anybody's: use run->reader;
 * - VSH_ERROR_LIMIT: a model of more than VSH_MAX_VIEW_MODEL bytes, as the page holds it;
 * run->memory_limit;
 * - VSH_ERROR_WRITE, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_view_write(const char *path, const vsh_view_bake *bake, const vsh_view_bake *other,
                                  const vsh_run *run, vsh_error *error);

/* The same of a scene that is not baked: the surface of its casters' voxels, with its shadows, AO and light
 * at every vertex. All casters are voxelised; receivers, tint, bent normals and the sky are left out. `name`
 * is shown. Light is the lights' irradiance, and the scene's ambient light times AO; without ambient light
 * 0.3 of each colour, or 1 where there are no lights. Errors:
 * - VSH_ERROR_ARGUMENT: path, name or scene NULL; more lights than VSH_MAX_CHANNELS - 4; run;
 * - those of vsh_assets_load(), vsh_scene_occluders() and vsh_query_points();
 * - VSH_ERROR_LIMIT: a surface of more than VSH_MAX_VIEW_MODEL bytes; run->memory_limit;
 * - VSH_ERROR_WRITE, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_view_write_scene(const char *path, const char *name, const vsh_scene *scene,
                                        const vsh_run *run, vsh_error *error);

/* Browsers hold no text of 512 MiB, which base64 makes of this. */
enum { VSH_MAX_VIEW_MODEL = 384 * 1024 * 1024 - 1024 };

#ifdef __cplusplus
}
#endif
#endif
