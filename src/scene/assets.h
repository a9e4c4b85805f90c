/* The loaded casters and receivers of a scene: meshes, level sets, outlines, spheres; which meshes of a file
 * they take, and lightmap UVs that are made for them. */
#ifndef VSHI_ASSETS_H
#define VSHI_ASSETS_H

#include "mesh/mesh_set.h"

#include <stdbool.h>
#include <string.h>
#include <vdbshade/scene.h>
#include <vdbshade/unwrap.h>

/* A receiver's meshes with lightmap UVs that were made for them: cut along their charts, and on pages. Parts
 * are whole meshes, but for those that lie on several pages, which have a part on each, all of one object.
 * They are sorted by their pages, and stand in the meshes' order on each. */
typedef struct vshi_unwrapped {
    vsh_atlas *atlas; /* NULL: nothing was unwrapped, and all but the pages is 0 */
    vsh_mesh *parts;  /* [part_count]: views of the memory below, with the meshes' own transforms; NULL when
                         they were moved */
    size_t *numbers;  /* [part_count]: which of the meshes each is a part of */
    size_t part_count;
    size_t *page_begins; /* [page_count + 1]: first part of each page, or first mesh where nothing was
                            unwrapped; NULL: all are on one, `whole` */
    size_t page_count;
    vsh_receiver_page *pages; /* [page_count] */
    vsh_receiver_page whole;
    uint32_t *memory; /* of the parts' positions, normals and indices, of which so many elements are used */
    size_t used;
} vshi_unwrapped;

/* One caster or receiver. Its transform is in front of its meshes' own. */
typedef struct vshi_asset_place {
    vsh_mesh *meshes;
    double *transforms; /* [count][12] */
    size_t *numbers;    /* [count]: of each in its model */
    size_t count;
    struct vshi_asset_file *file; /* of mesh casters and receivers; belongs to the assets, as the next two */
    const vsh_model *model;       /* that of the file */
    const vsh_grid *grid;         /* vdb casters */
    vsh_outline *outline;         /* mask and text casters */
    vsh_model *made;              /* of heightfields; its meshes are this place's */
    vsh_heights *heights;         /* of direct heightfields, beside `made` */
    vsh_spheres *spheres;         /* voxelised or not */
    bool direct;
    vshi_mesh_set set; /* these two of a receiver */
    vshi_unwrapped unwrapped;
} vshi_asset_place;

/* A caster; all zero beyond the last. */
const vshi_asset_place *vshi_assets_caster(const vsh_assets *assets, size_t index);

/* Meshes of all casters. */
size_t vshi_assets_mesh_count(const vsh_assets *assets);

/* --- receivers */

/* Whether its meshes are unwrapped: VSH_RECEIVER_UNWRAP_NEVER, …_AUTO or …_ALWAYS. */
int32_t vshi_receiver_unwrap(const vsh_receiver *receiver);

/* Lists a receiver's pages: one, or one for each object. Unwraps its meshes where it has to, and puts the
 * parts in their place. Errors: as vsh_unwrap(); VSH_ERROR_ARGUMENT (max_size without texels_per_unit). */
vsh_result vshi_place_pages(vshi_asset_place *place, const vsh_receiver *receiver, const vsh_run *run,
                            vsh_error *error);
void vshi_unwrapped_free(vshi_unwrapped *unwrapped);

/* --- which of a file's meshes a caster or receiver takes */

/* The same of a list of patterns: *chosen is 1 for each mesh that one of them matches, of none of them for
 * no mesh. */
vsh_result vshi_select_some(const vsh_model *model, const char *path, const char *const *patterns,
                            size_t count, unsigned char **chosen, vsh_error *error);

/* The name of a mesh's object; "" where it has none. */
static inline const char *vshi_object_name(const vsh_mesh *mesh) {
    const char *name = mesh->object_name != NULL ? mesh->object_name : mesh->name;
    return name != NULL ? name : "";
}

/* Whether a pattern means a mesh by its object's name, as vsh_mesh_matches() does, or by its `material`'s:
 * that is asked where it means no mesh by the other. */
bool vshi_mesh_is_meant(const vsh_mesh *mesh, const char *pattern, bool material);

/* VSH_ERROR_INPUT, saying what a pattern may have meant that matches none of a model's meshes. */
vsh_result vshi_fail_unmatched(const vsh_model *model, const char *path, const char *pattern,
                               vsh_error *error);

/* --- the alpha of textures and vertices, by which a model's meshes cast */

/* The masks of one model, read when they are first asked for. */
typedef struct vshi_masks vshi_masks;

/* `model` must outlive the masks, and `path`, for messages, the last vshi_masks_cast(). Free with
 * vshi_masks_free(); NULL does nothing. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_masks_create(const vsh_model *model, const char *path, vshi_masks **masks, vsh_error *error);
void vshi_masks_free(vshi_masks *masks);

/* Frees what can be made anew, four bytes a texel. */
void vshi_masks_trim(vshi_masks *masks);

/* Finds the views that a mesh of the model casts as: none, one or two. Triangles that their mask leaves whole
 * become a view like those of an opaque material. Triangles that it cuts become a view with the mask.
 * Triangles that are all clear are in no view. Blended materials (VSH_ALPHA_BLENDED) are opaque where their
 * texture's alpha is at least half. The views belong to `masks`. A texture that cannot be read is opaque,
 * with a warning. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
typedef struct vshi_cast_views {
    vsh_mesh meshes[2];
    int count;
    bool cut; /* they are not the mesh itself */
} vshi_cast_views;
vsh_result vshi_masks_cast(vshi_masks *masks, size_t mesh, const vsh_run *run, vshi_cast_views *views,
                           vsh_error *error);

/* How a mesh with a blended material casts. */
typedef enum vshi_blend {
    VSHI_BLEND_GLASS,
    VSHI_BLEND_CUT_OUT, /* as masked ones are: nearly all of its texture is clear or opaque, and there is some
                           of both. So exporters make hashed leaves */
    VSHI_BLEND_NOTHING  /* opaque: vsh_model_material.by_texture, and nothing of it is left out */
} vshi_blend;

/* Warnings and errors: as above. */
vsh_result vshi_masks_blend(vshi_masks *masks, size_t mesh, const vsh_run *run, vshi_blend *blend,
                            vsh_error *error);

/* --- how casters are shaded */

/* Whether a caster is in a layer, or (NULL) in none. */
static inline bool vshi_caster_in_layer(const vsh_caster *caster, const vsh_scene_layer *layer) {
    return caster->layer == NULL ? layer == NULL : layer != NULL && strcmp(caster->layer, layer->name) == 0;
}

/* Whether a caster stays out of level sets: spheres and direct heightfields, if shadows are `hard` or
 * `classic` and AO, if there is any, is traced. */
bool vshi_caster_is_direct(const vsh_scene *scene, const vsh_caster *caster);

/* vsh_scene_triangles() of one caster alone, for the AO of casters that are shaded without voxels. */
vsh_result vshi_scene_caster_triangles(const vsh_scene *scene, const vsh_assets *assets, size_t caster,
                                       const vsh_run *run, vsh_triangles **triangles, vsh_error *error);

/* Whether a bake compares its values with rays against the casters themselves. It does not if no method keeps
 * an error, if layers cast, or if rays cannot meet all casters. */
bool vshi_scene_wants_truth(const vsh_scene *scene);

/* Whether the scene or the layer names its voxels. */
bool vshi_scene_voxels_named(const vsh_scene *scene, const vsh_scene_layer *layer);

/* Whether a layer's only caster, or (NULL) that in none, is a level set; and whether it keeps its voxels, as
 * nobody named others. */
bool vshi_scene_is_level_set(const vsh_scene *scene, const vsh_scene_layer *layer);
bool vshi_scene_keeps_voxels(const vsh_scene *scene, const vsh_scene_layer *layer);

/* Whether a method that a layer's casters, or (NULL) those in none, are shaded with has all of `traits`,
 * VSH_METHOD_…, or (`has` false) lacks one: of shadows where there are lights, of AO where it is baked. */
bool vshi_scene_method_is(const vsh_scene *scene, const vsh_scene_layer *layer, uint32_t traits, bool has);

/* About how many rays adaptive casts on the field of a layer's casters, or (NULL) of those in none, from each
 * point that is shaded. */
double vshi_scene_field_rays(const vsh_scene *scene, const vsh_scene_layer *layer);

/* Whether a caster has triangles, or is made of voxels among a layer's, or (NULL) those in none. */
bool vshi_caster_has_triangles(const vsh_caster *caster);
bool vshi_caster_has_voxels(const vsh_scene *scene, const vsh_caster *caster, const vsh_scene_layer *layer);

#endif
