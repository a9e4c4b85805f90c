/* Scenes: casters, lights and receivers in one description, from a JSON file (docs/scene.md) or filled by the
 * caller; and bakes from files to files.
 *
 *     vsh_scene *scene;
 *     vsh_scene_read("scene.json", &run, &scene, &error);
 *     vsh_bake_scene(scene, NULL, &run, NULL, &error); // writes the receivers' outputs
 *     vsh_scene_free(scene);
 *
 * vsh_assets_load() and vsh_scene_occluders() give the parts of a bake one by one. */
#pragma once

#include "image.h"
#include "lightmap.h"

#include <string.h>

VSH_BEGIN_C

/* --- casters */

/* Kinds of casters. */
typedef enum vsh_caster_type {
    VSH_CASTER_MESH = 0,
    VSH_CASTER_SDF = 1,
    VSH_CASTER_VDB = 2,
    VSH_CASTER_HEIGHTFIELD = 3, /* an image: integers are 0 … 1, floats as they are; luminance of R, G and B,
                                   else the first channel */
    VSH_CASTER_SPHERES = 4,     /* spheres of a CSV file, or given here */
    VSH_CASTER_MASK = 5,        /* an image, extruded */
    VSH_CASTER_TEXT = 6         /* text, extruded */
} vsh_caster_type;

/* Selects meshes of a file. A pattern matches a mesh by its name, its object's name, or the part of its name
 * behind its object's ("Wall", "Cube.003" or "Wall/Cube.003" for a node Wall with a mesh Cube.003), as a
 * shell matches: *, ?, [a-c], [!a-c]; \\ quotes. Case counts. "material:PATTERN" matches materials, and so
 * does a pattern that matches no name. All zero: all meshes. */
typedef struct vsh_selection {
    const char *const *only; /* [only_count]: meshes that match one of these; none: all meshes */
    size_t only_count;
    const char *const *except; /* [except_count]: but not those that match one of these */
    size_t except_count;
} vsh_selection;

/* Solidity of the meshes that a pattern matches. */
typedef struct vsh_solidity_rule {
    const char *pattern;   /* as in vsh_selection */
    vsh_solidity solidity; /* of the meshes */
} vsh_solidity_rule;

/* A caster. Members apply to the types that they name. */
typedef struct vsh_caster {
    vsh_caster_type type; /* decides which members apply */
    const char *path; /* mesh, vdb, heightfield, mask: file; text: font; spheres: NULL, or a CSV file of x, y,
                         z and radius, with commas, semicolons, tabs or blanks between */
    const char *grid; /* vdb: name of the grid; NULL: the first level set */
    vsh_sdf sdf;      /* sdf: tree */
    double transform[12]; /* local to world, three rows of four; meshes alone may be sheared or scaled
                             unevenly */
    const char *layer;    /* name of its layer; NULL: none */
    double size[2]; /* heightfield: these three as in vsh_heights_source. If size[1] is 0, size[0] is the
                       longer side and pixels are square */
    double height;
    double base;
    int32_t direct; /* heightfield: nonzero: VSH_SHADOW_HARD and VSH_SHADOW_CLASSIC march it directly */
    const double *spheres; /* [sphere_count][4] of x, y, z and radius, if there is no path */
    size_t sphere_count;
    int32_t voxelised;                 /* spheres: nonzero: part of the level set; 0: cast in closed form */
    vsh_mask_options mask;             /* mask */
    const char *text;                  /* text: UTF-8 */
    vsh_text_options letters;          /* text */
    double thickness;                  /* mask, text: along z, local units, > 0 */
    double color[3];                   /* in pictures, linear RGB, 0 … 1; all 0: a light grey (0.6) */
    vsh_selection objects;             /* mesh: the meshes that cast */
    const vsh_solidity_rule *solidity; /* mesh: [solidity_count]; the last match wins */
    size_t solidity_count;
    /* mesh: [one_sided_count] patterns of one-sided meshes (vsh_mesh.one_sided) */
    const char *const *one_sided;
    size_t one_sided_count;
} vsh_caster;

/* A caster of type mesh without a file, untransformed. */
static inline vsh_caster vsh_caster_default(void) {
    vsh_caster caster;
    memset(&caster, 0, sizeof caster);
    caster.transform[0] = caster.transform[5] = caster.transform[10] = 1.0;
    caster.mask = vsh_mask_options_default();
    caster.letters = vsh_text_options_default();
    return caster;
}

/* A group of casters that is shaded in its own way. */
typedef struct vsh_scene_layer {
    const char *name;  /* unique */
    double voxel_size; /* these two as in vsh_grid_options; both 0: those of the scene */
    int32_t resolution;
    vsh_shadow_method method; /* of its shadows (VSH_SHADOW_OF_SCENE). Heightfields that are marched
                       directly know VSH_SHADOW_HARD and VSH_SHADOW_CLASSIC; spheres in closed form know
                       these and one soft method, which replaces the others */
    vsh_combine combine;      /* with other layers */
    double softness;          /* factor on the sizes of lights, 0 (hard) … 1000 */
    double remap[2]; /* its shadow goes through a smoothstep from remap[0] (dark) to remap[1] (lit), within 0
                        … 1; both 0: unchanged (for clouds: Quilez, "outdoors lighting", 2013) */
    double start_offset; /* voxels, 0 … 16; -1: that of the scene. Cells of directly marched heights, where -1
                            means 0 */
    const char *const *lights; /* [light_count]: names of the lights that it casts for; NULL: all */
    size_t light_count;
    int32_t ao; /* nonzero: part of ambient occlusion */
} vsh_scene_layer;

/* A layer without a name, shaded as the scene. */
static inline vsh_scene_layer vsh_scene_layer_default(void) {
    vsh_scene_layer layer;
    memset(&layer, 0, sizeof layer);
    layer.method = VSH_SHADOW_OF_SCENE;
    layer.softness = 1.0;
    layer.start_offset = -1.0;
    layer.ao = 1;
    return layer;
}

/* --- receivers */

/* The share of a lightmap's covered texels that objects may share: charts that touch. */
#define VSH_LARGEST_OVERLAP 0.01

/* Kinds of receivers. */
typedef enum vsh_receiver_type {
    VSH_RECEIVER_MESH = 0,
    VSH_RECEIVER_HEIGHTFIELD = 1,
    VSH_RECEIVER_PLANE = 2
} vsh_receiver_type;

/* Whether a receiver gets new lightmap UVs. */
typedef enum vsh_receiver_unwrap {
    VSH_RECEIVER_UNWRAP_DEFAULT = 0, /* AUTO for outputs that are assets (vsh_lit_is_output()), else NEVER */
    VSH_RECEIVER_UNWRAP_NEVER = 1,
    /* if its own are missing, leave the unit square or overlap, and if texels_per_unit, pages, max_size or
       density are given. Meshes with good UVs keep them, packed anew */
    VSH_RECEIVER_UNWRAP_AUTO = 2,
    VSH_RECEIVER_UNWRAP_ALWAYS = 3
} vsh_receiver_unwrap;

/* A factor of texels_per_unit for the meshes that a pattern matches. */
typedef struct vsh_density_rule {
    const char *pattern; /* as in vsh_selection */
    double factor;       /* finite, > 0 */
} vsh_density_rule;

/* A mesh, heightfield or plane that gets a lightmap. */
typedef struct vsh_receiver {
    const char *path;     /* mesh file, image of a heightfield, or name of a plane in messages */
    double transform[12]; /* local to world */
    int32_t uv_set;       /* 0 … VSH_MAX_UV_SETS - 1; -1: the second, else the first */
    int32_t width;        /* these five as in vsh_lightmap_options */
    int32_t height;
    int32_t supersample;
    int32_t padding;
    int32_t ao_spacing;
    const char *output; /* image file, or an asset (vsh_lit_is_output()) */
    int32_t bits;       /* these two as in vsh_image_options */
    const char *pack;
    vsh_receiver_type type; /* heightfields and planes are VSH_HEIGHTS_SURFACE, with UV set 0 */
    double extent[2]; /* heightfield: size in vsh_heights_source; plane: the same, flat, around the origin,
                         facing +y */
    double relief;    /* heightfield: height in vsh_heights_source. In scene files a heightfield that receives
                         also casts, unless a caster has its image */
    vsh_selection objects; /* mesh: the meshes that receive */
    int32_t partial;       /* mesh: nonzero: skip meshes without UVs, or without the set, with a warning */
    int32_t allow_overlap; /* nonzero: accept objects whose UVs overlap */
    vsh_color_space color_space; /* as in vsh_image_options */
    vsh_receiver_unwrap unwrap;  /* mesh: whether it gets new UVs */
    double texels_per_unit; /* these two for new UVs, as in vsh_unwrap_options; `width` × `height` is a page.
                               0: as many as fit */
    int32_t pages;   /* most pages, ≤ VSH_MAX_PAGES; 0: one, or with texels_per_unit as many as it takes */
    vsh_seams seams; /* mesh: FIX changes values by up to shade.max_error, and pads by 2 texels or
                      more */
    vsh_atlas_sharing atlas; /* mesh: with OBJECTS each object has its own lightmap, and the name of its
                      image contains the object's */
    int32_t max_size; /* for new UVs with texels_per_unit: largest side of a page, which then has the fewest
                         texels that it needs, ≤ VSH_MAX_LIGHTMAP_SIZE; 0: pages are `width` × `height` */
    const vsh_density_rule *density; /* [density_count], for new UVs; the last match wins */
    size_t density_count;
    /* "ao", "irradiance" or "shadow.NAME": instead of lightmaps, the asset gets these values as vertex
     * colours that fit points on its triangles best; UVs and sizes are not used. NULL: lightmaps */
    const char *vertex_colors;
} vsh_receiver;

/* A receiver of type mesh without a file, untransformed. */
static inline vsh_receiver vsh_receiver_default(void) {
    const vsh_lightmap_options lightmap = vsh_lightmap_options_default();
    vsh_receiver receiver;
    memset(&receiver, 0, sizeof receiver);
    receiver.transform[0] = receiver.transform[5] = receiver.transform[10] = 1.0;
    receiver.uv_set = -1;
    receiver.width = lightmap.width;
    receiver.height = lightmap.height;
    receiver.supersample = lightmap.supersample;
    receiver.padding = lightmap.padding;
    receiver.ao_spacing = lightmap.ao_spacing;
    return receiver;
}

/* --- scenes */

/* A scene. Paths are as the system takes them; vsh_scene_read() resolves relative ones from the scene file's
 * folder. */
typedef struct vsh_scene {
    const vsh_caster *casters; /* [caster_count] */
    size_t caster_count;
    const vsh_scene_layer *layers; /* [layer_count] */
    size_t layer_count;
    const vsh_light *lights; /* [light_count], with unique names, which name channels */
    size_t light_count;
    const vsh_receiver *receivers; /* [receiver_count] */
    size_t receiver_count;
    vsh_grid_options grid;   /* of the casters' level set */
    vsh_shade_options shade; /* methods of shadow and AO */
    int32_t ao;          /* nonzero: bake AO within shade.ao_distance; 0 there: vsh_assets_info.ao_distance */
    vsh_bent_space bent; /* with ao: bake bent normals in that space */
    int32_t irradiance;  /* nonzero: bake irradiance */
    vsh_tint tint;       /* tint of shadows and irradiance; VSH_TINT_NONE: none */
    int32_t has_ambient; /* nonzero: `ambient` applies */
    double ambient[3];   /* as in vsh_lightmap */
    vsh_planes planes;   /* further planes to bake */
    int32_t error;       /* nonzero: bake the error left in shadow and AO, if the method knows it */
    /* [solidity_count], for all mesh casters, after their own rules; each must match a mesh */
    const vsh_solidity_rule *solidity;
    size_t solidity_count;
    double unit; /* metres in one unit of mesh files, > 0, overriding the files' own; 0: the files' own */
    int32_t voxels_named; /* nonzero: `grid` has a voxel size or resolution by choice; 0: the bake chooses the
                             voxels */
    int32_t cast_blended; /* nonzero: meshes of blended materials cast where their texture's alpha is 0.5 or
                             more */
} vsh_scene;

/* An empty scene. */
static inline vsh_scene vsh_scene_default(void) {
    vsh_scene scene;
    memset(&scene, 0, sizeof scene);
    scene.grid = vsh_grid_options_default();
    scene.shade = vsh_shade_options_default();
    scene.bent = VSH_BENT_NONE;
    return scene;
}

/* Reads a scene file, and files of lights that it names; other files stay closed. Free the scene with
 * vsh_scene_free(). Errors:
 * - VSH_ERROR_ARGUMENT: path or scene NULL, run;
 * - VSH_ERROR_READ: no such file, no permission, no regular file;
 * - VSH_ERROR_INPUT, with line and column: no JSON, an unknown or missing key, a value of the wrong type or
 *   out of range;
 * - VSH_ERROR_LIMIT: a file over 64 MiB, or values beyond run->memory_limit;
 * - as vsh_lights_read();
 * - VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_scene_read(const char *path, const vsh_run *run, vsh_scene **scene, vsh_error *error);
VSH_API void vsh_scene_free(vsh_scene *scene); /* only a scene of vsh_scene_read(); NULL does nothing */

/* Refuses outputs [output_count] that would replace an input: a file that the scene names, or one that those
 * name (buffers and textures of a glTF, materials of an OBJ), by whatever path or link. Errors:
 * - VSH_ERROR_ARGUMENT: such an output; scene or outputs NULL, run;
 * - VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED (stage "hash"). */
VSH_API vsh_result vsh_scene_check_outputs(const vsh_scene *scene, const char *const *outputs,
                                           size_t output_count, const vsh_run *run, vsh_error *error);

/* Reads the lights of a glTF or GLB. Lights of files have no size: directional ones get `angle` (angular
 * diameter, radians, 0 … π, excluded). Points become spheres of `radius` (world units, ≥ 0), and spots get it
 * too; both use VSH_FALLOFF_INVERSE_SQUARE, and ranges are ignored. Colours are colour × intensity.
 * Characters that light names do not allow become _, and equal names get _2, _3, … `unit` as vsh_scene.unit.
 * Free *lights, NULL if *count is 0, with vsh_lights_free(). Errors: as vsh_model_read(); VSH_ERROR_ARGUMENT
 * (NULL, an angle, radius or unit out of range, a light out of range). */
VSH_API vsh_result vsh_lights_read(const char *path, double angle, double radius, double unit,
                                   const vsh_run *run, vsh_light **lights, size_t *count, vsh_error *error);
VSH_API void vsh_lights_free(vsh_light *lights); /* NULL does nothing */

/* --- settings: keys of scene files, options of commands, and their help, in one table */

/* Topics of settings. */
typedef enum vsh_setting_topic {
    VSH_SETTINGS_OCCLUSION = 0, /* AO and methods of shadow */
    VSH_SETTINGS_CHANNELS = 1,  /* further channels */
    VSH_SETTINGS_ACCURACY = 2,
    VSH_SETTINGS_CASTERS = 3, /* and their voxels */
    VSH_SETTINGS_IMAGE = 4,   /* image of a receiver */
    VSH_SETTINGS_TEXELS = 5,  /* texels of a receiver */
    VSH_SETTINGS_FLAT_IMAGE = 6,
    VSH_SETTINGS_FLAT_TEXELS = 7,
    VSH_SETTINGS_LEVEL_SET = 8, /* narrow band of level set files */
    VSH_SETTINGS_FILE_ONLY = 9  /* keys of scene files without an option */
} vsh_setting_topic;

/* Owners of settings. */
typedef enum vsh_setting_owner {
    VSH_SETTING_OF_SCENE = 0,    /* vsh_scene_set() */
    VSH_SETTING_OF_RECEIVER = 1, /* vsh_receiver_set() */
    VSH_SETTING_OF_FLAT = 2      /* vsh_flat_scene_set() */
} vsh_setting_owner;

/* A setting. */
typedef struct vsh_setting {
    char key[64];            /* in a scene file: "rays", "ao.distance", "receivers.padding" */
    char option[64];         /* of commands: "ao-method" */
    char value[32];          /* placeholder in help: "N", "VOXELS"; "": a flag, off by default */
    char help[320];          /* what it does */
    char range[160];         /* "1 to 4096", "more than 0", names; "": none */
    char otherwise[160];     /* the default: "64"; "": nothing */
    vsh_setting_topic group; /* of help */
    vsh_setting_owner owner; /* struct that it belongs to */
} vsh_setting;

/* Gets setting `index`, from 0. Returns 0 beyond the last one, without changing *setting. */
VSH_API int32_t vsh_setting_get(size_t index, vsh_setting *setting);

/* Set a setting by its key ("ao.method") or option ("--ao-method") from text: "64", "exact", "0.1,0.2,0.3";
 * for flags "true", "false", or NULL for true. Related settings follow: a distance of AO bakes AO, a voxel
 * size replaces a resolution. Settings that are texts keep the pointer. Errors (nothing has changed):
 * - VSH_ERROR_ARGUMENT: scene, receiver or name NULL; no such setting;
 * - VSH_ERROR_INPUT: a bad value, with what is expected;
 * - VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_scene_set(vsh_scene *scene, const char *name, const char *text, vsh_error *error);
VSH_API vsh_result vsh_receiver_set(vsh_receiver *receiver, const char *name, const char *text,
                                    vsh_error *error);

/* --- assets: the content of a scene's files */

/* Each file is read once, however many casters and receivers use it. */
typedef struct vsh_assets vsh_assets;

/* Reads the files that a scene names, receivers first, and applies transforms. If the scene has AO within 0,
 * sets shade.ao_distance to vsh_assets_info.ao_distance. The scene need not outlive the call. Free the result
 * with vsh_assets_free(). Errors:
 * - VSH_ERROR_ARGUMENT: scene or assets NULL; an unknown type; a caster or receiver without a path, or whose
 *   transform is not finite or flattens; a UV set out of range; run;
 * - VSH_ERROR_INPUT: a receiver's mesh without UVs or without the set; a pattern that matches no mesh, or
 *   patterns that leave none; a caster with blended meshes only, without scene->cast_blended; an image one
 *   pixel across; bad files;
 * - VSH_ERROR_READ, VSH_ERROR_LIMIT (for each file), VSH_ERROR_UNSUPPORTED: as the calls that read single
 *   files;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_assets_load(vsh_scene *scene, const vsh_run *run, vsh_assets **assets,
                                   vsh_error *error);
VSH_API void vsh_assets_free(vsh_assets *assets); /* NULL does nothing */

/* Size of a scene, world units. */
typedef struct vsh_assets_info {
    double bounds_min[3]; /* box of the casters and receivers; min > max if they have no extent */
    double bounds_max[3]; /* the other corner */
    double area;          /* of the receiver with the largest surface; 0: there are no receivers */
    double ao_distance;   /* a twelfth of the box's diagonal, to three digits; 0 for a point */
} vsh_assets_info;

/* Fills *info. Cannot fail. */
VSH_API void vsh_assets_get_info(const vsh_assets *assets, vsh_assets_info *info);

/* Return the meshes of receiver (caster) `index` in the world, with the receiver's UV set. Views that belong
 * to the assets. NULL and a count of 0 beyond the last, and for casters without triangles. */
VSH_API const vsh_mesh *vsh_assets_receiver(const vsh_assets *assets, size_t index, size_t *mesh_count);
VSH_API const vsh_mesh *vsh_assets_caster(const vsh_assets *assets, size_t index, size_t *mesh_count);

/* Fills density[mesh count] with the factor of the last rule that matches each mesh of a model, else 1.
 * `path` is for messages. Errors: VSH_ERROR_ARGUMENT (a pointer NULL; a rule without a pattern; a factor out
 * of range), VSH_ERROR_INPUT (a rule that matches no mesh, with similar names). */
VSH_API vsh_result vsh_model_densities(const vsh_model *model, const char *path,
                                       const vsh_density_rule *rules, size_t count, double *density,
                                       vsh_error *error);

/* Sets *needs to 1 if a receiver gets new UVs for these meshes, by its output, size and unwrap options, else
 * to 0. Errors: as vsh_charts_create(). */
VSH_API vsh_result vsh_receiver_needs_unwrap(const vsh_receiver *receiver, const vsh_mesh *meshes,
                                             size_t count, const vsh_run *run, int32_t *needs,
                                             vsh_error *error);

/* Makes the union of all voxelized casters of a scene, in all layers, as a level set. Its voxel size is
 * scene->grid's, else by its resolution over all casters, else that of the finest level set among them.
 * `assets` were loaded for this scene. Errors:
 * - VSH_ERROR_ARGUMENT: scene, assets or grid NULL, scene->grid out of range, run;
 * - VSH_ERROR_INPUT: no voxelized casters, casters without extent, a transform that shears or scales a
 *   caster other than a mesh unevenly; as the vsh_grid_from_… calls;
 * - VSH_ERROR_LIMIT: as the vsh_grid_from_… calls;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_scene_casters(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                                     vsh_grid **grid, vsh_error *error);

/* Options of a scene's occluders. */
typedef struct vsh_scene_occluders_options {
    size_t struct_size;
    const double *receivers_min; /* [3], both: world box of the receivers. Fields reach as far as lights and
                                    AO need there. NULL: unknown */
    const double *receivers_max;
    double within; /* without a box: largest distance of points from the casters' box, world units; 0: four of
                      its diagonals */
    const vsh_grid *grid; /* level set of the casters in no layer, if it exists already; NULL: make it */
    int32_t triangles;    /* nonzero: keep triangles if the scene's methods trace them */
    int32_t truth; /* nonzero: keep what errors are measured against, if a method knows its error, there are
                      no layers, and rays can meet all casters */
    int32_t silent_voxels; /* nonzero: no warnings about what the voxels lose */
    int32_t voxels; /* nonzero: always make voxels, by scene->grid or the layer: for distances and other
                       methods. 0: only if they pay off */
    double points;  /* number of points to shade; 0: unknown or few. With many, rays of adaptive trace the
                       surface of the field */
} vsh_scene_occluders_options;

static inline vsh_scene_occluders_options vsh_scene_occluders_options_default(void) {
    vsh_scene_occluders_options options = {
        sizeof(vsh_scene_occluders_options), NULL, NULL, 0.0, NULL, 1, 0, 0, 0, 0.0};
    return options;
}

/* Makes the occluders of a scene: a field for the casters in no layer and one for each layer, unless methods
 * only trace them; triangles if methods trace them; heightfields and spheres that cast directly. Warns about
 * casters that voxels lose, and about exact methods without Embree. Scene and assets must outlive the handle.
 * Errors, with the layer's name:
 * - VSH_ERROR_ARGUMENT: scene, assets or occluders NULL, half a box, options, run;
 * - VSH_ERROR_INPUT: no casters; more than 128 layers and direct casters; as vsh_scene_casters() and
 *   vsh_occluders_create();
 * - VSH_ERROR_LIMIT: as these;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_scene_occluders(const vsh_scene *scene, const vsh_assets *assets,
                                       const vsh_scene_occluders_options *options, const vsh_run *run,
                                       vsh_occluders **occluders, vsh_error *error);

/* --- provenance: what an output was made of */

/* The source of an output. A view. */
typedef struct vsh_provenance_source {
    size_t struct_size;
    const vsh_scene *scene;   /* with options applied; may be NULL */
    const char *const *files; /* [file_count]: inputs that the scene does not name, its own file first */
    size_t file_count;
    const char *command;             /* command line; may be NULL */
    double voxel_size;               /* of the level set that casts, world units; 0: none */
    const vsh_attribute *attributes; /* [attribute_count]: further lines; values are cut to one line */
    size_t attribute_count;
    int32_t has_triangles; /* of vsh_occluders_info: decides what auto was */
    int32_t lightmap;      /* nonzero: a lightmap with scene->planes */
} vsh_provenance_source;

static inline vsh_provenance_source vsh_provenance_source_default(void) {
    vsh_provenance_source source = {sizeof(vsh_provenance_source), NULL, NULL, 0, NULL, 0.0, NULL, 0, 0, 0};
    return source;
}

/* Attributes without dates, hosts, paths or thread counts, so that equal runs give equal files, in this
 * order:
 * - vdbshade_version: "0.2.0";
 * - vdbshade_command;
 * - vdbshade_shadow: "exact, max error 0.02, 64 rays, sobol"; vdbshade_ao: "cones, 16 within 2";
 *   vdbshade_sky: "exact over y, max error 0.02, sobol";
 * - vdbshade_light_NAME: type, place and size of each light;
 * - vdbshade_voxel_size;
 * - those of the source;
 * - vdbshade_input_N: "sha256:… NAME" of each input, from 0: the source's files, files of casters and
 *   receivers, and files that these name, each once. Files outside their model's folder need
 *   run->allow_outside. */
typedef struct vsh_provenance vsh_provenance;

/* Reads and hashes every input. Free the result with vsh_provenance_free(). Errors:
 * - VSH_ERROR_ARGUMENT: source or provenance NULL, run;
 * - VSH_ERROR_READ: as vsh_file_digest();
 * - VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED (stage "hash"). */
VSH_API vsh_result vsh_provenance_create(const vsh_provenance_source *source, const vsh_run *run,
                                         vsh_provenance **provenance, vsh_error *error);

/* Returns the attributes, which belong to the provenance; none of NULL. Cannot fail. */
VSH_API const vsh_attribute *vsh_provenance_attributes(const vsh_provenance *provenance, size_t *count);
VSH_API void vsh_provenance_free(vsh_provenance *provenance); /* NULL does nothing */

/* --- baking a scene */

/* A lightmap of a scene. Pointers are valid until the bake returns. */
typedef struct vsh_scene_lightmap {
    size_t receiver;        /* index in the scene */
    size_t page;            /* of the receiver: several if it is unwrapped onto several, or per object */
    const char *path;       /* of the receiver's file */
    const char *output;     /* file to write: OUT.exr; of several pages OUT.PAGE.exr or OUT.OBJECT.exr */
    const vsh_mesh *meshes; /* [mesh_count]: that receive */
    size_t mesh_count;
    int32_t width; /* texels */
    int32_t height;
    uint64_t covered;        /* texels with at least one sample; 0 until charts are counted */
    uint64_t samples;        /* evaluated positions, with supersampling; 0 until then */
    uint64_t invalid_texels; /* as in vsh_bake_stats; 0 until it is baked */
    double vertex_error;     /* of vertex colours, for which texels are points on the triangles: RMSE between
                                the vertices of the worst mesh; 0 until they are written */
} vsh_scene_lightmap;

/* Receives `count` rows of a lightmap, from row `first` on: planes[image->channel_count][count][width].
 * Lightmaps follow each other, each from row 0 on, on the calling thread. `image` has names and no planes. A
 * result other than VSH_OK ends the bake; the callback then fills `error`. */
typedef vsh_result vsh_rows_fn(void *user, const vsh_scene_lightmap *lightmap, const vsh_image *image,
                               int32_t first, int32_t count, const float *const *planes, vsh_error *error);

/* How vsh_bake_scene() bakes. */
typedef struct vsh_bake_options {
    size_t struct_size;
    const char *scratch; /* folder for nameless files beyond run->memory_limit; NULL: the output's folder */
    const char *invalid_picture; /* PNG of the invalid texels, one for each lightmap; several are
                                    FILE.N.OUTPUT.png, N from 0. NULL: none */
    /* receives the lightmaps instead of files. NULL: write the receivers' outputs, with their provenance;
     * outputs that end in .glb, .gltf or .obj are assets with their light */
    vsh_rows_fn *rows;
    const char *command; /* these three as in vsh_provenance_source */
    const char *const *files;
    size_t file_count;
    /* Called when the scene's files are read and lightmaps[count] are known, before baking. A result other
     * than VSH_OK ends the bake; the callback then fills `error`. May be NULL. */
    vsh_result (*loaded)(void *user, const vsh_scene_lightmap *lightmaps, size_t count, vsh_error *error);
    /* Called when a lightmap is written. May be NULL. */
    void (*done)(void *user, const vsh_scene_lightmap *lightmap);
    void *user;          /* passed to the callbacks */
    int32_t lit_preview; /* nonzero: assets show the light as unlit base colour */
    const char *lit_exr; /* EXR of all channels beside a single asset; NULL: none */
    int32_t shard;       /* 1 … shard_count: bake every shard_count-th tile with texels into the file
                            PARTS.SHARD-of-COUNT.part; 0: all tiles. Not with `rows` or `invalid_picture` */
    int32_t shard_count; /* 1 … 10000; vsh_merge_scene() also takes 0: as many as there are beside PARTS */
    const char *parts;   /* prefix of the parts' names; NULL: the first lightmap's output */
    const char *const *words; /* [word_count]: stored in a part for vsh_part_words() */
    size_t word_count;
} vsh_bake_options;

static inline vsh_bake_options vsh_bake_options_default(void) {
    vsh_bake_options options;
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
    return options;
}

/* Times and counts of a bake. Begins as zeros. */
typedef struct vsh_bake_report {
    double load_s;   /* seconds to read and hash files */
    double bake_s;   /* seconds to make and shade texels */
    double write_s;  /* seconds to pack and write rows */
    uint64_t texels; /* these three of all lightmaps */
    uint64_t samples;
    uint64_t invalid_texels;
    size_t lightmap_count;        /* 0 for a shard without tiles */
    vsh_shade_stats shade;        /* of all lightmaps */
    vsh_occluders_info occluders; /* of the scene */
    /* [2 + lights of the scene], the caller's: of each light, AO and the sky; NULL: not wanted */
    vsh_bake_error *errors;
    double ao_distance; /* of AO, world units; 0: there is none */
} vsh_bake_report;

/* Checks whether the image or asset of receiver `index` can be written, without reading a file. Errors: as
 * vsh_image_check(); VSH_ERROR_ARGUMENT (scene NULL, no such receiver, more than VSH_MAX_CHANNELS; an asset
 * without AO, irradiance and shadows, of 32 bits, or with a pack; vertex colours of values that the scene
 * does not have, or of an image). */
VSH_API vsh_result vsh_receiver_check(const vsh_scene *scene, size_t index, vsh_error *error);

/* Bakes a scene: loads files, makes occluders, bakes lightmaps tile by tile and writes them. A shard writes a
 * part instead. `report` may be NULL. Lightmaps written before an error stay. Errors: as vsh_assets_load(),
 * vsh_receiver_check(), vsh_charts_create(), vsh_scene_occluders(), vsh_bake_lightmap(), vsh_image_write()
 * and the callbacks; VSH_ERROR_ARGUMENT (a pointer NULL, options, run; no receivers); VSH_ERROR_INPUT (UVs
 * that cover no texel; objects that share more than VSH_LARGEST_OVERLAP of the texels; a lightmap without
 * valid texels); VSH_ERROR_WRITE (the scratch folder is full); VSH_ERROR_LIMIT; VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_bake_scene(const vsh_scene *scene, const vsh_bake_options *options, const vsh_run *run,
                                  vsh_bake_report *report, vsh_error *error);

/* Merges the parts of a scene that vsh_bake_scene() wrote with the same scene and options, on any machines.
 * Writes the same files, bit by bit, as one bake. The parts stay. Errors: as vsh_bake_scene(); VSH_ERROR_READ
 * (a part is missing); VSH_ERROR_INPUT (no parts; a part is damaged, or of other inputs, options or another
 * version). */
VSH_API vsh_result vsh_merge_scene(const vsh_scene *scene, const vsh_bake_options *options,
                                   const vsh_run *run, vsh_bake_report *report, vsh_error *error);

/* Reads the words of the first part of `shard_count` (0: as many as there are beside `parts`):
 * (*words)[*count], then NULL. Free them with vsh_part_words_free(). Anybody may have written a part, so do
 * not trust its words. Errors: VSH_ERROR_ARGUMENT (NULL, run), VSH_ERROR_READ, VSH_ERROR_INPUT (no parts,
 * parts of several shard counts, not a part), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_part_words(const char *parts, int32_t shard_count, const vsh_run *run, char ***words,
                                  size_t *count, vsh_error *error);
VSH_API void vsh_part_words_free(char **words); /* NULL does nothing */

/* Texels, voxels and memory of a bake, scaled up from a trial with few voxels. */
typedef struct vsh_bake_forecast {
    size_t lightmap_count; /* of all receivers */
    uint64_t texels;       /* with at least one sample */
    uint64_t samples;      /* evaluated positions */
    double voxels;         /* active, of all level sets; 0, as the next two, if there are none */
    double voxel_size;     /* world units */
    double resolution;     /* voxels along the longest side */
    double peak_bytes;     /* at most */
    double grid_bytes;     /* of the level sets */
    double field_bytes;    /* of the fields */
    int32_t has_triangles; /* nonzero: triangles are traced, and auto is exact */
    double ao_distance;    /* of AO, world units; 0: there is none */
} vsh_bake_forecast;

/* Forecasts vsh_bake_scene() of the whole scene. The outputs' folders need not exist. Errors: as there. */
VSH_API vsh_result vsh_forecast_scene(const vsh_scene *scene, const vsh_bake_options *options,
                                      const vsh_run *run, vsh_bake_forecast *forecast, vsh_error *error);

/* Makes the charts of a receiver's meshes as its bake does, with its warnings about UVs. The meshes must
 * outlive them. Free them with vsh_charts_free(). Errors: as vsh_bake_scene(); VSH_ERROR_ARGUMENT (a pointer
 * NULL, no such receiver). */
VSH_API vsh_result vsh_receiver_charts(const vsh_scene *scene, size_t index, const vsh_mesh *meshes,
                                       size_t mesh_count, const vsh_run *run, vsh_charts **charts,
                                       vsh_error *error);

/* --- lit assets: models written with their light */

/* A mesh of a model with its light: the triangles of vsh_model_mesh() in their order, with vertices of the
 * atlas. A view. */
typedef struct vsh_lit_mesh {
    const float *uvs; /* [vertex_count][2], v up, 0 … 1 of the chart's page. NULL: keep the file's, and light
                         by `uv_set` */
    const uint32_t *sources; /* [vertex_count]: the vertex of the mesh that each one copies */
    const uint32_t *indices; /* [triangle_count][3] into these; their sources are the mesh's own indices */
    const uint32_t *charts;  /* [triangle_count]: < chart_count, or VSH_NO_CHART; NULL: all lie on `page` */
    size_t vertex_count;
    size_t triangle_count;
    uint32_t page; /* without charts */
    /* without uvs: 0 … VSH_MAX_UV_SETS - 1, which the mesh must have; -1: the mesh stays unlit */
    int32_t uv_set;
    /* without uvs: [vertex_count of the model's mesh][4], RGBA, linear, 65535 is 1: COLOR_0, times the file's
     * own. NULL: none */
    const uint16_t *colors;
} vsh_lit_mesh;

/* Uses of an image in the materials of its page. */
typedef enum vsh_lit_purpose {
    VSH_LIT_OCCLUSION = 0, /* occlusionTexture of core glTF: R, linear; replaces the file's own */
    VSH_LIT_LIGHTMAP = 1,  /* MOZ_lightmap: R, G and B, linear irradiance, times its intensity */
    /* base colour of KHR_materials_unlit: R, G and B, sRGB, times the material's factor, instead of its
       texture. Materials that are cut out or blended by their texture stay */
    VSH_LIT_PREVIEW = 2,
} vsh_lit_purpose;

/* An image of one page for one purpose, at most one each: either `png` or planes. */
typedef struct vsh_lit_image {
    vsh_lit_purpose purpose; /* its use */
    uint32_t page;           /* from 0 */
    const void *png;         /* [png_size] bytes of a PNG file */
    size_t png_size;         /* bytes */
    int32_t width, height;   /* of planes: texels, 1 … 65536 */
    const float *const
        *channels;         /* of planes: [channel_count][height × width], row 0 on top (v = 1), linear */
    int32_t channel_count; /* 1 (grey) or 3 */
    int32_t bits;          /* of planes: 8 or 16; 0: 8 */
    double intensity; /* LIGHTMAP: factor that viewers apply; 0: 1. Planes over 1 are divided by their largest
                         value, which goes into it. PREVIEW: factor before planes are cut at 1; 0: 1 */
} vsh_lit_image;

/* How a lit file is written. */
typedef struct vsh_lit_options {
    size_t struct_size;
    const uint32_t *chart_pages; /* [chart_count]: page of each chart */
    size_t chart_count;
    /* [image_count], in any order: into a GLB, beside a glTF and an OBJ as OUT.PURPOSE.png, or
     * OUT.PURPOSE.PAGE.png for several or named pages. Pages without images keep their materials */
    const vsh_lit_image *images;
    size_t image_count;
    const char *const *page_names; /* [page_count], UTF-8, as file names may be: part of image names, and of
                                      their files. NULL, and NULL names: numbers */
    size_t page_count;
    /* [attribute_count]: provenance, in the extras of the document's asset, replacing earlier ones that begin
     * with "vdbshade_"; comments of an .obj */
    const vsh_attribute *attributes;
    size_t attribute_count;
    int32_t unlit; /* nonzero: materials of meshes with colours get KHR_materials_unlit */
} vsh_lit_options;

static inline vsh_lit_options vsh_lit_options_default(void) {
    vsh_lit_options options = {sizeof(vsh_lit_options), NULL, 0, NULL, 0, NULL, 0, NULL, 0, 0};
    return options;
}

/* Writes `output`, a .glb, .gltf or .obj by its ending. `model` is what vsh_model_read() made of `path`,
 * which is unchanged since. `meshes` has one for each of its meshes; NULL: all are lit by their default UV
 * set on page 0.
 *
 * If `path` is a .glb or .gltf, the document keeps everything, known or not. New UVs become TEXCOORD_1 or
 * replace those of an earlier call (extras "vdbshade_uv_sets"); if textures use that set, they become the
 * first free TEXCOORD_n, with a warning. Vertices are copied only where the atlas splits them, with all
 * attributes and morph targets. Primitives on several pages become several; nodes and instances
 * (EXT_mesh_gpu_instancing) that share a mesh get their own where UVs differ. Changed primitives lose Draco's
 * compression. Textures of earlier calls (extras "vdbshade_texture") go if nothing uses them, unless the file
 * has unknown extensions. Images and buffers beside the file stay there if output is in its folder, else they
 * are packed into the buffer. A .gltf has its buffer in OUT.bin.
 *
 * Other formats, and a NULL `path`, give a new document: a node for each object with transform, positions,
 * normals, UV sets with the new one as the second, and white materials.
 *
 * Vertex colours replace those of an earlier call, which their accessor's name tells. Others become the
 * attribute _COLOR_0, and COLOR_0 is their product.
 *
 * An .obj holds the meshes in the world, by name, with the UVs that they are lit by. Its images are PREVIEW,
 * beside it, in materials page_N (OUT.mtl).
 *
 * Stage: "lit". All files are renamed into place when they are complete. Errors:
 * - VSH_ERROR_ARGUMENT: model, output or an array NULL; options, run; another ending; a mesh that does not
 *   fit the model's; a chart, page, set or image out of range; two images of one page and purpose; UVs that
 *   are not finite; an output that would replace an input, or a foreign OUT.mtl;
 * - VSH_ERROR_INPUT: a document that is not well formed, or not the model's;
 * - VSH_ERROR_READ: as vsh_model_read(); a short or missing buffer;
 * - VSH_ERROR_LIMIT: run->memory_limit; a GLB of 4 GiB or more; a primitive with VSH_MAX_UV_SETS sets of its
 *   own;
 * - VSH_ERROR_WRITE, VSH_ERROR_UNSUPPORTED, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_lit_write(const char *path, const vsh_model *model, const vsh_lit_mesh *meshes,
                                 const vsh_lit_options *options, const char *output, const vsh_run *run,
                                 vsh_error *error);

/* Returns 1 if `path` ends as a file of vsh_lit_write(), else 0; 0 for NULL. */
VSH_API int32_t vsh_lit_is_output(const char *path);

VSH_END_C
