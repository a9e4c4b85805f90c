/* Scenes: casters, lights and receivers as one description, read from a JSON file (docs/scene.md). */
#ifndef VDBSHADE_SCENE_H
#define VDBSHADE_SCENE_H

#include "bake.h"
#include "field.h"
#include "grid.h"
#include "heights.h"
#include "occluders.h"
#include "outline.h"
#include "spheres.h"
#include "unwrap.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    VSH_CASTER_MESH = 0,
    VSH_CASTER_SDF = 1,
    VSH_CASTER_VDB = 2,
    VSH_CASTER_HEIGHTFIELD = 3, /* an image: integers are values 0 … 1, floats values as they are; of R, G and
                                   B the luminance, else the first channel */
    VSH_CASTER_SPHERES = 4,     /* spheres, of a CSV file or given here */
    VSH_CASTER_MASK = 5,        /* an image, extruded: vsh_outline_from_image(), vsh_grid_from_outline() */
    VSH_CASTER_TEXT = 6         /* text, likewise */
};

/* Which of a file's meshes are meant, by patterns as of vsh_mesh_matches(); one that matches none of them by
 * these names means materials of that name. All zero: all of them. */
typedef struct vsh_selection {
    const char *const *only; /* [only_count]: those that one of these matches, where there are any */
    size_t only_count;
    const char *const *except; /* [except_count]: but not those that one of these matches */
    size_t except_count;
} vsh_selection;

/* What meshes are to be taken for, by a pattern as in vsh_selection. */
typedef struct vsh_solidity_rule {
    const char *pattern; /* of the names that are meant */
    int32_t solidity;    /* VSH_SOLIDITY_… */
} vsh_solidity_rule;

/* A caster of a scene. The type says which members apply. Begin with vsh_caster_default() (settings.h). */
typedef struct vsh_caster {
    int32_t type;         /* VSH_CASTER_… */
    const char *path;     /* mesh, vdb, heightfield, mask: file; text: font; spheres: NULL, or a file
                             (vsh_spheres_read()) */
    const char *grid;     /* vdb: name of the grid; NULL: the file's first level set */
    vsh_sdf sdf;          /* sdf: tree */
    double transform[12]; /* local to world, three rows of four; but for meshes no shear, no uneven scale */
    const char *layer;    /* name of the layer it is in; NULL: none */
    double size[2]; /* heightfield, as in vsh_heights_source: these three. A size[1] of 0 follows from the
                       image's pixels, and size[0] is the longer side */
    double height;
    double base;
    int32_t direct;        /* heightfield: nonzero: marched as it is (vsh_heights) by VSH_SHADOW_HARD and
                              VSH_SHADOW_CLASSIC; no other method takes notice */
    const double *spheres; /* [sphere_count][4], where there is no path: as in vsh_spheres_create() */
    size_t sphere_count;
    int32_t voxelised;        /* spheres: nonzero: part of the level set; 0: cast as they are (vsh_spheres) */
    vsh_mask_options mask;    /* mask: how its image becomes an outline */
    const char *text;         /* text: what is written, UTF-8 */
    vsh_text_options letters; /* text */
    double thickness;         /* mask, text: along z, local units, > 0 */
    double color[3];          /* in pictures, linear RGB, 0 … 1; all 0: 0.6, a light grey */
    vsh_selection objects;    /* mesh: which of its meshes cast */
    const vsh_solidity_rule *solidity; /* [solidity_count]; mesh: of those that cast; later ones overrule */
    size_t solidity_count;
    const char *const *one_sided; /* [one_sided_count]; mesh: patterns of those that are (vsh_mesh.one_sided):
                                     of materials, too, where no object is called so */
    size_t one_sided_count;
} vsh_caster;

/* Casters that are shaded in a way of their own. */
typedef struct vsh_scene_layer {
    const char *name;  /* no two alike */
    double voxel_size; /* these two as in vsh_grid_options; both 0: as the scene's */
    int32_t resolution;
    vsh_layer shade; /* field and triangles NULL */
} vsh_scene_layer;

/* The share of a lightmap's covered texels that objects may take from each other: charts that touch. */
#define VSH_LARGEST_OVERLAP 0.01

enum { VSH_RECEIVER_MESH = 0, VSH_RECEIVER_HEIGHTFIELD = 1, VSH_RECEIVER_PLANE = 2 };

/* Whether a receiver's lightmap UVs are made for it (vsh_unwrap()), in place of those of its file. */
enum {
    VSH_RECEIVER_UNWRAP_DEFAULT = 0, /* AUTO where its output is an asset (vsh_lit_is_output()), else NEVER */
    VSH_RECEIVER_UNWRAP_NEVER = 1,
    VSH_RECEIVER_UNWRAP_AUTO =
        2, /* where no lightmap can be baked by its own, because there are none, they
              leave the unit square or lie over each other (of VSH_ATLAS_OBJECTS within an object),
              and where texels_per_unit, pages, max_size or density are given; what is laid out
              well in each of its meshes stays so, and is packed anew */
    VSH_RECEIVER_UNWRAP_ALWAYS = 3
};

/* A factor of a receiver's texels_per_unit for the meshes that a pattern means, as in vsh_selection. */
typedef struct vsh_density_rule {
    const char *pattern; /* of names, as in vsh_mesh_matches() */
    double factor;       /* finite, > 0 */
} vsh_density_rule;

/* A mesh, heightfield or plane that a lightmap is baked for. Begin with vsh_receiver_default() (settings.h).
 */
typedef struct vsh_receiver {
    const char *path;     /* mesh file, a heightfield's image, or a plane's name in messages */
    double transform[12]; /* local to world */
    int32_t uv_set; /* from 0 to VSH_MAX_UV_SETS - 1; -1: the second where there is one, else the first */
    int32_t width;  /* these four as in vsh_lightmap_options */
    int32_t height;
    int32_t supersample;
    int32_t padding;
    int32_t ao_spacing; /* as in vsh_lightmap_options */
    const char *output; /* image file */
    int32_t bits;       /* as in vsh_image_options */
    const char *pack;   /* as in vsh_image_options; may be NULL */
    int32_t type; /* VSH_RECEIVER_…; heightfields and planes are made as VSH_HEIGHTS_SURFACE, their UV set
                   * is 0 */
    double extent[2]; /* heightfield: size and height in vsh_heights_source; plane: the same, and flat, about
                       * the origin, facing +y */
    double relief;    /* heightfield: the caster's height. Scene files have a heightfield that receives
                            cast too, where no heightfield caster is of its image */
    vsh_selection objects; /* mesh: which of its meshes receive */
    int32_t partial; /* mesh: nonzero: those without UVs, or without the set, are left out with a warning,
                        as long as one has them */
    int32_t allow_overlap;  /* nonzero: objects whose UVs lie over each other are meant so (vdbshade bake then
                               does not refuse them) */
    int32_t color_space;    /* as in vsh_image_options */
    int32_t unwrap;         /* mesh: VSH_RECEIVER_UNWRAP_… */
    double texels_per_unit; /* these two where it is unwrapped, as in vsh_unwrap_options: `width` × `height`
                               is a page's size. 0: the most that fit */
    int32_t pages; /* that may be filled at most, ≤ VSH_MAX_PAGES; 0: one, or with texels_per_unit as
                      many as it takes */
    int32_t seams; /* mesh: VSH_SEAMS_…; FIX moves values by up to the scene's shade.max_error, and pads
                      by 2 texels at least */
    int32_t
        atlas; /* mesh: VSH_ATLAS_…; OBJECTS: each object has a lightmap of its own, whose UVs, where it is
                  unwrapped, are packed alone. An image's name then has the object's (vsh_scene_lightmap)
                */
    int32_t max_size;                /* where it is unwrapped, with texels_per_unit: a page has the fewest
                                        texels that it needs (vsh_unwrap_options.fit_pages), at most so many on
                                        a side, ≤ VSH_MAX_LIGHTMAP_SIZE; 0: it has `width` × `height` */
    const vsh_density_rule *density; /* [density_count]: where it is unwrapped (vsh_model_densities()) */
    size_t density_count;
} vsh_receiver;

/* A file whose lights a scene file takes, and which of the scene's they are. */
typedef struct vsh_light_file {
    const char *path; /* of a .glb or .gltf, as the system takes it */
    double angle;     /* these two as in vsh_lights_read() */
    double radius;
    size_t first; /* lights[first …] of the scene, `count` > 0 of them, are the file's */
    size_t count; /* of its lights */
} vsh_light_file;

/* A whole scene, read from a file or filled by the caller. Paths are as the system takes them (the reader has
 * put the scene file's folder in front of relative ones). */
typedef struct vsh_scene {
    const vsh_caster *casters; /* [caster_count] */
    size_t caster_count;
    const vsh_scene_layer *layers; /* that casters may be in */
    size_t layer_count;            /* how many layers */
    const vsh_light *lights;       /* no two names alike, none empty: channels are named after them */
    size_t light_count;            /* how many lights */
    const vsh_receiver *receivers; /* [receiver_count] */
    size_t receiver_count;
    vsh_grid_options grid;   /* of the casters' level set */
    vsh_shade_options shade; /* how shadow and AO are found */
    int32_t ao;              /* nonzero: bake AO, within shade.ao_distance */
    int32_t bent;            /* with ao: bake bent normals in the space VSH_BENT_… + 1; 0: none */
    int32_t irradiance;      /* nonzero: bake irradiance */
    vsh_tint tint;           /* bake tinted shadows, and irradiance by them; VSH_TINT_NONE: none */
    int32_t has_ambient;     /* nonzero: `ambient` holds; 0: there is no such light */
    double ambient[3];       /* of irradiance, as in vsh_lightmap; where has_ambient is not 0 */
    vsh_planes planes;       /* to be baked too */
    int32_t error; /* nonzero: bake the error left in each shadow and AO value too, where methods know it */
    const vsh_solidity_rule *solidity; /* [solidity_count]: of all mesh casters, over what they say
                                          themselves; each must match one's mesh */
    size_t solidity_count;
    double unit;          /* of the numbers in mesh files, metres, > 0: instead of what the files say
                             (vsh_model_unit());   0: as they say, and those that say nothing as they are */
    int32_t voxels_named; /* nonzero: `grid` holds a voxel size or a resolution that was asked for; 0: where
                             it is the default, what is baked chooses them (vsh_scene_resolution()) */
    int32_t cast_blended; /* nonzero: meshes of blended materials (VSH_ALPHA_BLENDED) cast, where the alpha of
                             their texture is at least half, without one whole; 0: they only receive */
    const vsh_light_file *light_files; /* [light_file_count], by `first`: where some of `lights` came from,
                                          for those who look after inputs; a scene need not have any */
    size_t light_file_count;
} vsh_scene;

/* Reads a scene file; of what it names, files of lights alone are opened. The scene and all it points to
 * belong to *scene; free it with vsh_scene_free(). Errors:
 * - VSH_ERROR_ARGUMENT: path or scene NULL, run;
 * - VSH_ERROR_READ: no such file, no permission, no regular file;
 * - VSH_ERROR_INPUT, with line and column: no JSON, an unknown or missing key, a value of the wrong type or
 *   out of range;
 * - VSH_ERROR_LIMIT: a file of more than 64 MiB; one whose values may take more than run->memory_limit,
 * before they are read;
 * - of files of lights: as vsh_lights_read();
 * - VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_scene_read(const char *path, const vsh_run *run, vsh_scene **scene, vsh_error *error);
VSH_API void vsh_scene_free(vsh_scene *scene); /* of vsh_scene_read() only; NULL does nothing */

/* Refuses an output that is there already and is read with the scene: a file that it names, or what those
 * name (the buffers and textures of a glTF, the materials of an OBJ), by whatever path or link. Of models it
 * looks for names only, and only where there is such an output. `outputs` [output_count], none NULL. Thread
 * safe. Errors:
 * - VSH_ERROR_ARGUMENT: such an output; scene or outputs NULL, run;
 * - VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED (under the stage "hash"). */
VSH_API vsh_result vsh_scene_check_outputs(const vsh_scene *scene, const char *const *outputs,
                                           size_t output_count, const vsh_run *run, vsh_error *error);

/* The lights of a model's file (vsh_model_get_light()) as those of a scene. Lights of files have no size:
 * directional ones get `angle` (angular diameter, radians, 0 … π, excluded), points, which become spheres,
 * and spots `radius` (world units, ≥ 0) and VSH_FALLOFF_INVERSE_SQUARE. Colours are colour × intensity;
 * ranges are not taken. A name is the model's with _ for what a light's cannot have ("light" where it has
 * none), and _2, _3 … behind it where one before has it. `unit` as vsh_scene.unit. Free *lights, NULL where
 * *count is 0, with vsh_lights_free(). Safe for one model in any number of threads. Errors:
 * VSH_ERROR_ARGUMENT (NULL, an angle, a radius or a unit out of range, a light whose place is then none that
 * lights can have), VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_lights_from_model(const vsh_model *model, double angle, double radius, double unit,
                                         vsh_light **lights, size_t *count, vsh_error *error);
VSH_API void vsh_lights_free(vsh_light *lights); /* NULL does nothing */

/* The same of a file that vsh_model_read() reads. Errors: as there, and those of vsh_lights_from_model(). */
VSH_API vsh_result vsh_lights_read(const char *path, double angle, double radius, double unit,
                                   const vsh_run *run, vsh_light **lights, size_t *count, vsh_error *error);

/* What a scene's files hold, each file read once, however many casters and receivers use it. */
typedef struct vsh_assets vsh_assets;

/* Reads the models and level sets that `scene` names, receivers' first, and puts them in their places. The
 * scene need not outlive the call. Free the result with vsh_assets_free(). Errors:
 * - VSH_ERROR_ARGUMENT: scene or assets NULL, a caster of no type, a caster or receiver without a path or
 *   with a transform that is not finite or flattens, a UV set outside -1 … VSH_MAX_UV_SETS - 1, run;
 * - VSH_ERROR_INPUT: a receiver's mesh without UVs or without the set asked for; a pattern that matches no
 *   mesh of its file, patterns that leave none; a caster whose meshes are all blended, without
 *   scene->cast_blended; as vsh_model_read(),
 *   vsh_grid_read(), vsh_image_read(), vsh_model_from_heights() and vsh_outline_from_…(); an image of no
 *   more than a pixel across;
 * - VSH_ERROR_READ, VSH_ERROR_LIMIT (for each file alone), VSH_ERROR_UNSUPPORTED: as these;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_assets_load(const vsh_scene *scene, const vsh_run *run, vsh_assets **assets,
                                   vsh_error *error);
VSH_API void vsh_assets_free(vsh_assets *assets); /* NULL does nothing */

/* The meshes of receiver (caster) `index`, transforms composed, UVs of the receiver's set; views that belong
 * to assets. NULL and a count of 0 for an index beyond the scene's, and for a caster without triangles. */
VSH_API const vsh_mesh *vsh_assets_receiver(const vsh_assets *assets, size_t index, size_t *mesh_count);
VSH_API const vsh_mesh *vsh_assets_caster(const vsh_assets *assets, size_t index, size_t *mesh_count);

/* The model of receiver `index`, and which of its meshes each of the receiver's is: (*numbers)[mesh_count].
 * They belong to the assets; NULL for an index beyond the scene's. */
VSH_API const vsh_model *vsh_assets_receiver_model(const vsh_assets *assets, size_t index,
                                                   const size_t **numbers);

/* Fills density[mesh count]: for each of a model's meshes the factor of the last rule that means it, else 1.
 * `path` is the model's, for messages. Errors: VSH_ERROR_ARGUMENT (a pointer NULL; a rule without a pattern,
 * or whose factor is out of range), VSH_ERROR_INPUT (a rule that means no mesh, with names that it might have
 * meant). */
VSH_API vsh_result vsh_model_densities(const vsh_model *model, const char *path,
                                       const vsh_density_rule *rules, size_t count, double *density,
                                       vsh_error *error);

/* *needs is 1 where a receiver's meshes are unwrapped, as receiver->unwrap says, and 0 where their own UVs
 * are baked. Of `receiver` what it says of its output, size and unwrapping is read. Errors: as
 * vsh_charts_create(). */
VSH_API vsh_result vsh_receiver_needs_unwrap(const vsh_receiver *receiver, const vsh_mesh *meshes,
                                             size_t count, const vsh_run *run, int32_t *needs,
                                             vsh_error *error);

/* Pages of receiver `index`: 1 but where it is unwrapped and needs more, or has one for each object; 0 beyond
 * the scene's. */
VSH_API size_t vsh_assets_receiver_pages(const vsh_assets *assets, size_t index);

/* A page of a receiver; `object` belongs to the assets. */
typedef struct vsh_receiver_page {
    int32_t width; /* texels */
    int32_t height;
    const char *object; /* the name of the object whose it is, "" where it has none; NULL: it is shared */
} vsh_receiver_page;

/* Fills *page; false, and nothing changes, beyond what there is. */
VSH_API int32_t vsh_assets_receiver_page_info(const vsh_assets *assets, size_t index, size_t page,
                                              vsh_receiver_page *info);

/* The meshes of vsh_assets_receiver() that lie on page `page`, which are some in a row of them: *first is the
 * place of the first in that list. NULL and a count of 0 beyond what there is. */
VSH_API const vsh_mesh *vsh_assets_receiver_page(const vsh_assets *assets, size_t index, size_t page,
                                                 size_t *first, size_t *mesh_count);

/* Where it is unwrapped: its atlas, and which of the atlas's meshes each of vsh_assets_receiver() is, or a
 * part of: (*numbers)[mesh_count]. They belong to the assets. Else NULL. */
VSH_API const vsh_atlas *vsh_assets_receiver_atlas(const vsh_assets *assets, size_t index,
                                                   const size_t **numbers);

/* The heightfield that caster `index` marches, and the spheres that it casts without voxels. They belong to
 * the assets. NULL for every other caster, and beyond the scene's. */
VSH_API const vsh_heights *vsh_assets_heights(const vsh_assets *assets, size_t index);
VSH_API const vsh_spheres *vsh_assets_spheres(const vsh_assets *assets, size_t index);

/* The union of all of a scene's casters that are voxelised, whatever their layers, as one level set of
 * scene->grid's voxel size; without one, of the longest side of the box around all casters over
 * scene->grid.resolution; where that is 0 too, of the finest of the level sets among them (one that is alone
 * and stands as it is stays as it is). `assets` are those loaded for this scene. Free the grid with
 * vsh_grid_free(). Errors:
 * - VSH_ERROR_ARGUMENT: scene, assets or grid NULL, scene->grid out of range (a resolution of 0 without a
 *   level set too), run;
 * - VSH_ERROR_INPUT: no casters that are voxelised, casters without extent, a caster other than a mesh whose
 *   transform shears or scales unevenly; as vsh_mesh_check(), vsh_sdf_check() and the vsh_grid_from_… calls;
 * - VSH_ERROR_LIMIT: as the vsh_grid_from_… calls and vsh_grid_unite();
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_scene_casters(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                                     vsh_grid **grid, vsh_error *error);

/* The same of the casters in `layer`, of its voxel size, or (NULL) of those in none; *grid is NULL where
 * there are none. Errors: as there; VSH_ERROR_ARGUMENT too where the scene has no such layer. */
VSH_API vsh_result vsh_scene_layer_casters(const vsh_scene *scene, const vsh_assets *assets,
                                           const vsh_scene_layer *layer, const vsh_run *run, vsh_grid **grid,
                                           vsh_error *error);

/* Makes a scene's casters in `layer`, or (NULL) in none, ready for rays of VSH_SHADOW_EXACT and VSH_AO_EXACT.
 * Meshes and heightfields become triangles. Procedural shapes and spheres keep their exact form. Level sets,
 * masks and texts become the surface of their own voxels. *triangles is NULL if there are no casters. Free
 * the result with vsh_triangles_free(). Errors:
 * - VSH_ERROR_ARGUMENT: scene, assets or triangles NULL, run;
 * - VSH_ERROR_INPUT: a transform that shears or scales a shape or a level set unevenly;
 * - VSH_ERROR_UNSUPPORTED, VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED: as
 *   vsh_triangles_create_beside(), and for level sets vsh_grid_unite() and vsh_field_create(). */
VSH_API vsh_result vsh_scene_triangles(const vsh_scene *scene, const vsh_assets *assets,
                                       const vsh_scene_layer *layer, const vsh_run *run,
                                       vsh_triangles **triangles, vsh_error *error);

/* 1 where auto traces the casters in `layer`, or (NULL) in none. 0 where it marches them: one level set
 * alone, which keeps its voxels so, and masks and texts alone. Spheres in closed form and heightfields
 * that are marched do not count. Also 1 if there are no other casters. */
VSH_API int32_t vsh_scene_traceable(const vsh_scene *scene, const vsh_scene_layer *layer);

/* 1 where shadows of the casters in `layer`, or (NULL) in none, or AO are baked by a method that knows them
 * by their voxels alone; 0 where rays against triangles decide, and voxels only save rays. */
VSH_API int32_t vsh_scene_marches(const vsh_scene *scene, const vsh_scene_layer *layer);

/* What vsh_scene_resolution() gives where it is named. */
enum { VSH_RESOLUTION_NAMED = -1 };

/* Voxels along the longest side of the casters in `layer`, or (NULL) in none, where `points` of receivers are
 * to be shaded by the scene's methods (docs/accuracy.md: how they are chosen). VSH_RESOLUTION_NAMED: those
 * that the scene or the layer names; 0: none, rays against triangles are faster alone. It depends on what
 * the scene holds, and on nothing else. `assets` are those loaded for this scene. Cannot fail. */
VSH_API int32_t vsh_scene_resolution(const vsh_scene *scene, const vsh_assets *assets,
                                     const vsh_scene_layer *layer, double points);

/* Which of a scene's casters' parts are to be made, and for what. */
typedef struct vsh_scene_occluders_options {
    size_t struct_size;
    const double *receivers_min; /* [3], both: world box of the receivers that are shaded: the field reaches
                                    as far as the scene's lights and AO need there (vsh_scene_reach()). NULL:
                                    they are not known beforehand */
    const double *receivers_max;
    double
        within; /* without a box: how far points may be from the box around the casters, world units; 0: four
                 * of its diagonals. It does not depend on the points, so that neither do their bits */
    const vsh_grid *grid; /* the casters in no layer as a level set that is there already; NULL: it is made */
    int32_t triangles;    /* nonzero: keep those that the scene's methods trace: where one is exact, or auto
                             comes to it */
    int32_t truth;        /* nonzero: keep what errors are measured against, where one of the scene's methods
                             keeps an error, nothing is in layers and rays can meet all casters */
    int32_t silent_voxels; /* nonzero: nothing is warned of what voxels make of the casters, or lose of them:
                              a trial at voxels other than those that are meant */
    int32_t voxels; /* nonzero: voxels in any case, as many as scene->grid or a layer says: for distances, and
                       for other methods than the scene's. 0: those of vsh_scene_resolution() */
    double points; /* that are to be shaded; 0: not known, or few. Where adaptive casts rays enough on a field
                      for it, its surface is extracted for them (vsh_field_options.surface) */
} vsh_scene_occluders_options;

static inline vsh_scene_occluders_options vsh_scene_occluders_options_default(void) {
    vsh_scene_occluders_options options = {
        sizeof(vsh_scene_occluders_options), NULL, NULL, 0.0, NULL, 1, 0, 0, 0, 0.0};
    return options;
}

/* What casts in a scene: a field of the casters in no layer and one of each layer's, or none where what is
 * only traced needs none (then distances are not known, and other methods are refused), triangles where
 * methods trace them, heightfields and spheres that cast as they are. Warns (run->warning) of casters that
 * voxels lose where they decide, and where exact would be meant but the library has no Embree. Scene and
 * assets must outlive the handle. Free it with vsh_occluders_free(). Errors, those of a layer's casters with
 * its name:
 * - VSH_ERROR_ARGUMENT: scene, assets or occluders NULL, a box of which a half is NULL, options, run;
 * - VSH_ERROR_INPUT: no casters, more layers and casters that are not voxelised than VSH_MAX_LAYERS; as
 *   vsh_scene_casters(), vsh_field_create() and vsh_triangles_create();
 * - VSH_ERROR_LIMIT: as these;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_scene_occluders(const vsh_scene *scene, const vsh_assets *assets,
                                       const vsh_scene_occluders_options *options, const vsh_run *run,
                                       vsh_occluders **occluders, vsh_error *error);

/* A scene's casters as rays meet them, whatever their layers: the triangles of meshes and heightfields, and
 * procedural ones as they are, for vsh_trace_shadow() and vsh_trace_ao(). Each is NULL where there are none.
 * Free them with vsh_triangles_free() and vsh_solids_free(). Errors:
 * VSH_ERROR_ARGUMENT (a pointer NULL, run); as vsh_triangles_create() and vsh_solids_create(). */
VSH_API vsh_result vsh_scene_truth(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                                   vsh_triangles **triangles, vsh_solids **solids, vsh_error *error);

/* Reach, world units > 0, that a field of `grid` needs for the scene's lights and AO at receivers within a
 * world box: see vsh_field_options. Directional lights count up to a half angle of 60°. */
VSH_API double vsh_scene_reach(const vsh_scene *scene, const vsh_grid *grid, const double receivers_min[3],
                               const double receivers_max[3]);

#ifdef __cplusplus
}
#endif
#endif
