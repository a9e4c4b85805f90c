/* What of a model's meshes casts by the alpha of its textures. */
#ifndef VSHI_MASKS_H
#define VSHI_MASKS_H

#include "base/error.h"

#include <stdbool.h>
#include <vdbshade/mesh.h>

/* The masks of one model, read when they are first asked for. */
typedef struct vshi_masks vshi_masks;

/* `model` and `path`, for messages, are to outlive it. Free with vshi_masks_free(); NULL does nothing.
 * Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_masks_create(const vsh_model *model, const char *path, vshi_masks **masks, vsh_error *error);
void vshi_masks_free(vshi_masks *masks);

/* Frees what can be made anew, four bytes a texel. */
void vshi_masks_trim(vshi_masks *masks);

/* What a mesh of the model casts as: none, one or two views. Triangles that their mask leaves whole are as
 * those of an opaque material; what it cuts out is a view with the mask; what it leaves nothing of is in
 * none. Blended materials (VSH_ALPHA_BLENDED) are opaque where their texture's alpha is at least half. The
 * views belong to `masks`. Warns of textures that cannot be had: what has one is opaque. Errors:
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
typedef struct vshi_cast_views {
    vsh_mesh meshes[2];
    int count;
    bool cut; /* they are not the mesh itself */
} vshi_cast_views;
vsh_result vshi_masks_cast(vshi_masks *masks, size_t mesh, const vsh_run *run, vshi_cast_views *views,
                           vsh_error *error);

/* What a mesh whose material is blended is for those that cast. */
typedef enum vshi_blend {
    VSHI_BLEND_GLASS,
    VSHI_BLEND_CUT_OUT, /* as masked ones are: nearly all of its texture is clear or opaque, and there is some
                           of both. So exporters make hashed leaves */
    VSHI_BLEND_NOTHING  /* opaque: vsh_model_material.by_texture, and nothing of it is left out */
} vshi_blend;

/* Warnings and errors: as above. */
vsh_result vshi_masks_blend(vshi_masks *masks, size_t mesh, const vsh_run *run, vshi_blend *blend,
                            vsh_error *error);

#endif
