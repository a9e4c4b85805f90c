/* The loaded casters and receivers of a scene: meshes, level sets, outlines, spheres; which meshes of a file
 * they take, and lightmap UVs that are made for them. */
#pragma once

#include "geometry/mesh_set.h"
#include "shapes/heights.h"
#include "shapes/spheres.h"
#include "trace/trace.h"

#include <stdbool.h>
#include <vdbshade/lightmap.h>
#include <vdbshade/scene.h>

/* Makes a scene's lights from those of a model's file. Lights of files have no size: directional ones get
 * `angle` (angular diameter, radians, 0 … π, excluded); points, which become spheres, and spots get `radius`
 * (world units, ≥ 0). Points and spots get VSH_FALLOFF_INVERSE_SQUARE; ranges are ignored. Colours are colour
 * × intensity. In names, characters that a light's name cannot have become _; lights without a name are
 * "light", and later lights of the same name end in _2, _3 … `unit` as in vsh_scene. Free *lights with
 * vsh_lights_free(); it is NULL if *count is 0. Errors: VSH_ERROR_ARGUMENT (a number out of range, a light
 * beyond the range of positions), VSH_ERROR_MEMORY. */
vsh_result vshi_lights_from_model(const vsh_model *model, double angle, double radius, double unit,
                                  vsh_light **lights, size_t *count, vsh_error *error);

/* A page of a receiver; `object` belongs to the assets. */
typedef struct vshi_receiver_page {
    int32_t width; /* texels */
    int32_t height;
    const char *object; /* name of the page's object, "" if it has none; NULL: objects share the page */
} vshi_receiver_page;

/* Voxelises the casters in `layer`, with its voxel size, or (NULL) those in no layer; *grid is NULL if there
 * are none. Errors: as vsh_scene_casters(). */
vsh_result vshi_scene_layer_casters(const vsh_scene *scene, const vsh_assets *assets,
                                    const vsh_scene_layer *layer, const vsh_run *run, vsh_grid **grid,
                                    vsh_error *error);

/* Makes a scene's casters in `layer`, or (NULL) in none, ready for rays of VSH_SHADOW_EXACT and VSH_AO_EXACT.
 * Meshes and heightfields become triangles. Procedural shapes and spheres keep their exact form. Level sets,
 * masks and texts become the surface of their own voxels. *triangles is NULL if there are no casters. Free
 * the result with vshi_triangles_free(). Errors:
 * - VSH_ERROR_ARGUMENT: run;
 * - VSH_ERROR_INPUT: a transform that shears or scales a shape or a level set unevenly;
 * - VSH_ERROR_UNSUPPORTED, VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED: as
 *   vshi_triangles_create(), and for level sets vsh_grid_unite() and vshi_field_create(). */
vsh_result vshi_scene_triangles(const vsh_scene *scene, const vsh_assets *assets,
                                const vsh_scene_layer *layer, const vsh_run *run, vshi_triangles **triangles,
                                vsh_error *error);

/* Whether the casters in `layer`, or (NULL) in no layer, get shadows or AO by a method that only sees voxels.
 * Otherwise rays against triangles decide, and voxels only save rays. */
int32_t vshi_scene_marches(const vsh_scene *scene, const vsh_scene_layer *layer);

/* Result of vshi_scene_resolution() if the scene or the layer sets the voxels. */
enum { VSHI_RESOLUTION_NAMED = -1 };

/* Chooses the voxels along the longest side of the casters in `layer`, or (NULL) in no layer, for `points` of
 * receivers (docs/accuracy.md). VSHI_RESOLUTION_NAMED: the scene or the layer sets them; 0: no voxels, rays
 * against triangles are faster. The result depends only on the scene and its `assets`. */
int32_t vshi_scene_resolution(const vsh_scene *scene, const vsh_assets *assets, const vsh_scene_layer *layer,
                              double points);

/* Makes all casters ready for a vshi_truth, whatever their layers: meshes and heightfields as triangles,
 * procedural shapes as solids. Each is NULL if there are none. Free them with vshi_triangles_free() and
 * vshi_solids_free(). Errors: as vshi_triangles_create() and vshi_solids_create(). */
vsh_result vshi_scene_truth(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                            vshi_triangles **triangles, vshi_solids **solids, vsh_error *error);

/* The pages of a receiver: one, one for each object, or those of an atlas. Meshes are sorted by pages. An
 * atlas cuts them along their charts; a mesh on several pages has a part on each, all of one object. */
typedef struct vshi_receiver_pages {
    size_t count;
    vshi_receiver_page *list; /* [count] */
    size_t *begins;           /* [count + 1]: first mesh of each page */
    vsh_atlas *atlas;         /* NULL: the meshes are the file's */
    size_t *atlas_numbers;    /* [meshes]: of each in the atlas */
    uint32_t *memory;         /* positions, normals and indices of the parts */
} vshi_receiver_pages;

/* One caster or receiver. Its transform is applied after its meshes' own. */
typedef struct vshi_asset_place {
    vsh_mesh *meshes;
    double *transforms;      /* [count][12] */
    const double *transform; /* applied after the meshes' own; lives as long as the scene */
    double scale;            /* applied between the two */
    size_t *numbers;         /* [count]: of each in its model */
    size_t count;
    struct vshi_asset_file *file; /* of mesh casters and receivers; belongs to the assets, as the next two */
    const vsh_model *model;       /* that of the file */
    const vsh_grid *grid;         /* vdb casters */
    vsh_outline *outline;         /* mask and text casters */
    vsh_model *made;              /* of heightfields; its meshes are this place's */
    vshi_heights *heights;        /* of direct heightfields, beside `made` */
    vshi_spheres *spheres;        /* voxelised or not */
    bool direct;
    vshi_mesh_set set; /* these two of a receiver */
    vshi_receiver_pages pages;
} vshi_asset_place;

/* A caster or receiver; all zero beyond the last. */
const vshi_asset_place *vshi_assets_caster(const vsh_assets *assets, size_t index);
const vshi_asset_place *vshi_assets_receiver(const vsh_assets *assets, size_t index);

/* The meshes on page `page` of a receiver: place->meshes from *first on. */
const vsh_mesh *vshi_place_page(const vshi_asset_place *place, size_t page, size_t *first,
                                size_t *mesh_count);

/* Measures a scene with loaded assets. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_scene_measure(const vsh_scene *scene, const vsh_assets *assets, vsh_assets_info *info,
                              vsh_error *error);

/* The meshes of all casters; they are solved. */
const vshi_mesh_set *vshi_assets_set(const vsh_assets *assets);

/* --- receivers */

/* Whether its meshes are unwrapped: VSH_RECEIVER_UNWRAP_NEVER, …_AUTO or …_ALWAYS. */
int32_t vshi_receiver_unwrap(const vsh_receiver *receiver);

/* Lists a receiver's pages. Unwraps its meshes if it has to, and puts the parts in their place. Errors: as
 * vsh_unwrap(); VSH_ERROR_ARGUMENT (max_size without texels_per_unit). */
vsh_result vshi_place_pages(vshi_asset_place *place, const vsh_receiver *receiver, const vsh_run *run,
                            vsh_error *error);
void vshi_receiver_pages_free(vshi_receiver_pages *pages);

/* --- which of a file's meshes a caster or receiver takes */

/* Sets *chosen [mesh count] to 1 for each mesh that one of the patterns matches. Without patterns it chooses
 * no mesh. */
vsh_result vshi_select_some(const vsh_model *model, const char *path, const char *const *patterns,
                            size_t count, unsigned char **chosen, vsh_error *error);

/* The name of a mesh's object, or "". */
static inline const char *vshi_object_name(const vsh_mesh *mesh) {
    const char *name = mesh->object_name != NULL ? mesh->object_name : mesh->name;
    return name != NULL ? name : "";
}

/* --- the alpha of textures and vertices, by which a model's meshes cast */

/* The masks of one model, read when they are first asked for. */
typedef struct vshi_masks vshi_masks;

/* `model` must outlive the masks, and `path`, for messages, the last vshi_masks_cast(). Free with
 * vshi_masks_free(); NULL does nothing. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_masks_create(const vsh_model *model, const char *path, vshi_masks **masks, vsh_error *error);
void vshi_masks_free(vshi_masks *masks);

/* Frees the tables, four bytes a texel, which can be made again. */
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
    VSHI_BLEND_CUT_OUT, /* as masked ones: nearly all of its texture is clear or opaque, and there is some of
                           both. Exporters write leaves with hashed alpha like that */
    VSHI_BLEND_NOTHING  /* like opaque ones: vshi_material.by_texture, without holes */
} vshi_blend;

/* Warnings and errors: as above. */
vsh_result vshi_masks_blend(vshi_masks *masks, size_t mesh, const vsh_run *run, vshi_blend *blend,
                            vsh_error *error);

/* --- how casters are shaded. A layer of NULL stands for the casters that are in no layer */

/* Whether a caster stays out of level sets: spheres and direct heightfields, if shadows are `hard` or
 * `classic` and AO, if there is any, is traced. */
bool vshi_caster_is_direct(const vsh_scene *scene, const vsh_caster *caster);

/* Whether a caster is in the layer, and in its level set. */
bool vshi_caster_has_voxels(const vsh_scene *scene, const vsh_caster *caster, const vsh_scene_layer *layer);

/* Whether the scene or the layer sets its voxels. */
bool vshi_scene_sets_voxels(const vsh_scene *scene, const vsh_scene_layer *layer);

/* Whether the layer's only caster is a level set that keeps its voxels. */
bool vshi_scene_keeps_voxels(const vsh_scene *scene, const vsh_scene_layer *layer);

/* vshi_scene_triangles() of one caster alone, for the AO of casters that are shaded without voxels. */
vsh_result vshi_scene_caster_triangles(const vsh_scene *scene, const vsh_assets *assets, size_t caster,
                                       const vsh_run *run, vshi_triangles **triangles, vsh_error *error);
