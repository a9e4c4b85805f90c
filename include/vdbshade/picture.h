/* Pictures of scenes, pages that show them in a browser, and flat scenes for 2D games.
 *
 *     vsh_render_options options = vsh_render_options_default();
 *     vsh_camera_frame(&options.camera, info.bounds_min, info.bounds_max, 0.6, 0.4, 16.0 / 9.0, &error);
 *     vsh_surface surface = {vsh_occluders_get_field(occluders, NULL), {0.6, 0.6, 0.6}};
 *     static float color[720][1280][3];
 *     vsh_picture picture = {.color = &color[0][0][0]};
 *     vsh_render(&surface, 1, occluders, &sun, 1, &options, &run, &picture, NULL, &error);
 */
#pragma once

#include "scene.h"

VSH_BEGIN_C

/* --- cameras */

/* A pinhole camera. Numbers are finite. */
typedef struct vsh_camera {
    size_t struct_size;
    double position[3]; /* world units */
    double target[3];   /* centre of the picture; not the position */
    double up[3];       /* any length but 0, not along the view */
    double fov;         /* angle over the picture's height, radians, 0.001 … 3 */
} vsh_camera;

/* At (0, 0, 1), looking at the origin, y up, 35°. */
static inline vsh_camera vsh_camera_default(void) {
    vsh_camera camera = {
        sizeof(vsh_camera), {0.0, 0.0, 1.0}, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, 0.61086523819801535};
    return camera;
}

/* Moves a camera so that it sees a whole world box, whose centre becomes the target; `up` and `fov` stay.
 * `azimuth`: radians around `up` (0: +z, or -y for an `up` along z), anticlockwise from above. `elevation`:
 * radians above the horizon, within ±1.57. `aspect`: width over height, > 0. Errors: VSH_ERROR_ARGUMENT (a
 * bad `up` or `fov`; bounds that are not finite, a point, or min > max; the other numbers). */
VSH_API vsh_result vsh_camera_frame(vsh_camera *camera, const double bounds_min[3],
                                    const double bounds_max[3], double azimuth, double elevation,
                                    double aspect, vsh_error *error);

/* Moves a camera as near as it still sees all points [count][3], world units: they are centred and fill 86 %
 * of the width or height. The target is at their middle depth. Errors: as vsh_camera_frame(); points NULL,
 * not finite, or in one place. */
VSH_API vsh_result vsh_camera_frame_points(vsh_camera *camera, size_t count, const double *points,
                                           double azimuth, double elevation, double aspect, vsh_error *error);

/* Turns a camera by `angle` radians around `up` through its target, anticlockwise from above. An angle of 0
 * only checks it. Errors: VSH_ERROR_ARGUMENT, naming the member, its value and the limit. */
VSH_API vsh_result vsh_camera_orbit(vsh_camera *camera, double angle, vsh_error *error);

/* --- pictures */

enum { VSH_MAX_PICTURE_SIZE = 16384, VSH_MAX_SURFACES = 65536 };

/* A visible surface: the zero surface of a field. A view. */
typedef struct vsh_surface {
    const vsh_field *field; /* whose zero surface is visible */
    double color[3];        /* albedo, linear RGB, 0 … 1 */
} vsh_surface;

/* Visible meshes, with a lightmap or shaded at each point. A view. */
typedef struct vsh_lit_meshes {
    const vsh_mesh *meshes; /* [mesh_count], with the UVs of the lightmap */
    size_t mesh_count;
    /* of any size, row 0 at v = 1, sampled bilinearly: irradiance.R, .G, .B, or shadow.NAME of every light
     * and `ao` if there is one. NULL: shade each point */
    const vsh_image *lightmap;
    double color[3]; /* albedo, as of a surface */
    int32_t ambient; /* nonzero: the lightmap's irradiance contains the sky's light (vsh_lightmap.ambient) */
} vsh_lit_meshes;

/* How a picture is drawn. */
typedef struct vsh_render_options {
    size_t struct_size;
    vsh_camera camera; /* where the picture is seen from */
    int32_t width;     /* pixels, 1 … VSH_MAX_PICTURE_SIZE */
    int32_t height;    /* the same */
    int32_t samples; /* N: N × N rays a pixel, jittered within their cells, under a Blackman-Harris filter 3
                        pixels wide (F. J. Harris, 1978); 1 … 16, width × N and height × N at most 65000 */
    int32_t ao;      /* nonzero: multiply the sky's light by AO */
    double sky[3];   /* light of the open sky from all sides, linear RGB, ≥ 0 */
    double background[3]; /* linear RGB, ≥ 0 */
    double shafts; /* light shafts: optical thickness of a thin, even fog along the diagonal of all surfaces,
                      0 … 100. The fog reaches a quarter of the diagonal beyond them. 0: none */
    int32_t shaft_steps;       /* points along each ray where lights are evaluated, 1 … 64 */
    const vsh_lit_meshes *lit; /* [lit_count]; may be NULL. They hide surfaces up to 1.5 voxels nearer */
    size_t lit_count;
    vsh_tint tint;           /* of penumbrae */
    vsh_shade_options shade; /* methods of shadow and AO */
} vsh_render_options;

static inline vsh_render_options vsh_render_options_default(void) {
    vsh_render_options options = {sizeof(vsh_render_options),
                                  vsh_camera_default(),
                                  1280,
                                  720,
                                  3,
                                  0,
                                  {0.22, 0.27, 0.35},
                                  {0.42, 0.52, 0.66},
                                  0.0,
                                  8,
                                  NULL,
                                  0,
                                  {VSH_TINT_NONE, {1.0, 1.0, 1.0}},
                                  vsh_shade_options_default()};
    return options;
}

/* Planes [height][width] of the caller, row 0 on top; NULL planes are skipped. */
typedef struct vsh_picture {
    float *color; /* [height][width][3]: linear RGB, with the background */
    float *alpha; /* share of a pixel that surfaces cover, 0 … 1 */
    float *depth; /* along the camera's axis to the nearest surface, world units; infinite if there is none */
    float *normal; /* [height][width][3]: world space, unit; 0, 0, 0 if there is no surface */
} vsh_picture;

/* Renders a picture. Rays are sphere-traced (J. C. Hart, 1996) to the nearest of `surfaces` [surface_count],
 * to a hundredth of a voxel. A pixel is the surface's colour × (Σ lights of colour × falloff × cosine ×
 * tinted visibility + sky × AO), with vsh_shade_shadow() and vsh_shade_ao() of the occluders. Surfaces are
 * usually the occluders' fields; others of the same casters can have more colours. Rays that start within a
 * solid start where they leave it.
 *
 * Lit meshes without a lightmap are shaded on the triangle by exact methods, and half a voxel above it by
 * others. Surfaces are shaded half a voxel above for exact methods and layers without a field.
 *
 * Light shafts: the visibility at `shaft_steps` points of each ray, the first jittered by blue noise, with
 * exponential decay (K. Mitchell, "Volumetric light scattering as a post-process", GPU Gems 3, 2007).
 *
 * Pictures do not depend on threads or instruction sets. Stage: "render". `stats` includes camera rays.
 * Errors (the planes are then undefined):
 * - VSH_ERROR_ARGUMENT: picture or occluders NULL; surfaces or lights NULL with a count above 0; more than
 *   VSH_MAX_SURFACES; options out of range; run; as vsh_camera_orbit() and vsh_query_create();
 * - VSH_ERROR_INPUT: lit meshes as vsh_mesh_check(), or without UVs; a lightmap without the channels above;
 * - VSH_ERROR_LIMIT: fields, lit meshes and rendering exceed run->memory_limit;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_render(const vsh_surface *surfaces, size_t surface_count,
                              const vsh_occluders *occluders, const vsh_light *lights, size_t light_count,
                              const vsh_render_options *options, const vsh_run *run,
                              const vsh_picture *picture, vsh_shade_stats *stats, vsh_error *error);

/* Encodes a picture for files of 8 bits: color × 2^exposure through the sRGB curve (IEC 61966-2-1) in steps
 * of 1/255, dithered against banding, into planes R, G and B [height × width]. With an `alpha` plane, which
 * needs the picture's, colours are divided by alpha first, for a background of 0. NULL keeps the background.
 * exposure is -20 … 20. Runs on the calling thread. Errors: VSH_ERROR_ARGUMENT. */
VSH_API vsh_result vsh_picture_encode(const vsh_picture *picture, int32_t width, int32_t height,
                                      double exposure, float *const rgb[3], float *alpha, vsh_error *error);

/* --- pages for a browser */

enum { VSH_MAX_VIEW_PLANES = 1024 };

/* Largest model in a page. Browsers hold no text of 512 MiB, which base64 makes of this. */
enum { VSH_MAX_VIEW_MODEL = 384 * 1024 * 1024 - 1024 };

/* A baked mesh: a file, and images of its light if they are not in it. */
typedef struct vsh_view_bake {
    size_t struct_size;
    const char *model; /* as of vsh_model_read(). A GLB (2.0) goes into the page with its materials and
                          textures; other formats, and compressed geometry, give it only triangles, normals
                          and UVs. NULL, of a second bake: the first one's */
    /* [plane_count] image files of its channels, one for each page of its lightmap in order */
    const char *const *planes;
    size_t plane_count; /* 0 … VSH_MAX_VIEW_PLANES; 0: the light is in the materials, or missing */
    int32_t uv_set;     /* of the lightmap, 0 … VSH_MAX_UV_SETS - 1; -1: that of MOZ_lightmap, else of an
                           occlusionTexture with its own set, else as of vsh_model_mesh() */
    const char *name;   /* title; NULL: the file name of the model, or of the second bake's planes */
} vsh_view_bake;

static inline vsh_view_bake vsh_view_bake_default(void) {
    vsh_view_bake bake = {sizeof(vsh_view_bake), NULL, NULL, 0, -1, NULL};
    return bake;
}

/* Writes one HTML page that needs no other file and no network: the model to be turned, lit or by channel,
 * checkers, texel density or charts (docs/view.md), with the values of picked texels. `other` (may be NULL)
 * is a second bake, with a slider between. Planes become half floats. Atomic. Stages: "load", "page". Errors:
 * - VSH_ERROR_ARGUMENT: path, bake or its model NULL; planes or a UV set out of range; run;
 * - as vsh_model_read() and vsh_image_read(); use run->reader for files from strangers;
 * - VSH_ERROR_LIMIT: a model over VSH_MAX_VIEW_MODEL bytes; run->memory_limit;
 * - VSH_ERROR_WRITE, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_view_write(const char *path, const vsh_view_bake *bake, const vsh_view_bake *other,
                                  const vsh_run *run, vsh_error *error);

/* Writes such a page for a scene that is not baked: the surface of its casters' voxels, with shadows, AO and
 * light at every vertex. All casters are voxelized; receivers, tint, bent normals and the sky are left out.
 * `name` is the title. Light is the lights' irradiance plus ambient light × AO; without ambient light it is
 * 0.3 of each colour, or 1 without lights. Errors:
 * - VSH_ERROR_ARGUMENT: path, name or scene NULL; more than VSH_MAX_CHANNELS - 4 lights; run;
 * - as vsh_assets_load(), vsh_scene_occluders() and vsh_query_points();
 * - VSH_ERROR_LIMIT: a surface over VSH_MAX_VIEW_MODEL bytes; run->memory_limit;
 * - VSH_ERROR_WRITE, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_view_write_scene(const char *path, const char *name, const vsh_scene *scene,
                                        const vsh_run *run, vsh_error *error);

/* --- flat scenes: light maps of a plane, for 2D games (docs/flat.md)
 *
 * Casters are areas of the xy-plane. Shadow is the least h/(s t) along the ray to the light's centre: h is
 * the distance to the casters at t, from a grid with a cell a texel, and s the sine of the light's half
 * angle. It has the outer half of the penumbra (Kaplan's 2D lighting after Quilez, 2010). */

/* How a light map of a plane is made. */
typedef struct vsh_flat_options {
    size_t struct_size;
    int32_t width;        /* texels, 1 … 65536 */
    int32_t height;       /* the same */
    double region_min[2]; /* world rectangle of the map, finite, at most 1e15 in size */
    double region_max[2]; /* the other corner; row 0 is at y = region_max[1] */
    int32_t supersample;  /* N: N × N samples a texel, 1 … 16 */
    int32_t padding;      /* texels that values grow by into solids, 0 … 4096; never coverage */
} vsh_flat_options;

static inline vsh_flat_options vsh_flat_options_default(void) {
    vsh_flat_options options = {sizeof(vsh_flat_options), 512, 512, {-1.0, -1.0}, {1.0, 1.0}, 1, 4};
    return options;
}

/* Casters of a flat scene, and the members that they take. */
typedef enum vsh_flat_type {
    VSH_FLAT_MASK = 0, /* path, mask */
    VSH_FLAT_TEXT = 1, /* path (the font), text, letters */
    VSH_FLAT_BOX = 2   /* half_size */
} vsh_flat_type;

/* A caster of a flat scene. Members apply to the types that name them. */
typedef struct vsh_flat_caster {
    vsh_flat_type type;       /* decides which members apply */
    const char *path;         /* file */
    vsh_mask_options mask;    /* how the image becomes an outline */
    const char *text;         /* UTF-8 */
    vsh_text_options letters; /* how text becomes an outline */
    double half_size[2];      /* world units, > 0 */
    double transform[6];      /* local to world, two rows of three (column 2 translates); may mirror and scale
                                 unevenly, but not flatten */
} vsh_flat_caster;

/* A flat scene, from a file or filled by the caller. Paths are as the system takes them. */
typedef struct vsh_flat_scene {
    const vsh_flat_caster *casters; /* [caster_count] */
    size_t caster_count;
    const vsh_light *lights; /* [light_count], with unique names, which name channels */
    size_t light_count;
    vsh_flat_options options; /* of the map */
    const char *output;       /* image file; NULL: none */
    int32_t bits;             /* these three as in vsh_image_options */
    const char *pack;
    vsh_color_space color_space;
} vsh_flat_scene;

/* An empty scene. */
static inline vsh_flat_scene vsh_flat_scene_default(void) {
    vsh_flat_scene scene;
    memset(&scene, 0, sizeof scene);
    scene.options = vsh_flat_options_default();
    return scene;
}

/* Reads the file of a flat scene; files that it names stay closed. Free the scene with vsh_flat_scene_free().
 * Errors: as vsh_scene_read(). */
VSH_API vsh_result vsh_flat_scene_read(const char *path, const vsh_run *run, vsh_flat_scene **scene,
                                       vsh_error *error);
VSH_API void
vsh_flat_scene_free(vsh_flat_scene *scene); /* of vsh_flat_scene_read() only; NULL does nothing */

/* As vsh_scene_set(). */
VSH_API vsh_result vsh_flat_scene_set(vsh_flat_scene *scene, const char *name, const char *text,
                                      vsh_error *error);

/* The caller's planes [height][width], row 0 on top. */
typedef struct vsh_flat_map {
    float *const *shadow; /* [light_count] planes: visible share of each light, 0 dark … 1 lit, 0 beyond its
                             reach; NULL, or NULL planes: not wanted */
    float *const *irradiance; /* [3] planes R, G and B, linear: Σ lights of visibility × colour × falloff;
                                 NULL: not wanted */
    float *coverage;          /* share of a texel's samples outside solids; NULL: not wanted */
} vsh_flat_map;

/* Bakes the light map of a flat scene. A texel is the mean of its samples outside solids; a texel without any
 * is 0, unless padding reaches it. The third components of a light's direction, axis and position are
 * ignored; its radius is that of a disc, and a spot's angles lie in the plane. A point inside a light's disc
 * sees all of it. Errors (the planes are then undefined):
 * - VSH_ERROR_ARGUMENT: scene or map NULL; options out of range; a light that vsh_light_check() refuses or
 *   whose direction has no length in the plane (the message gives its number); a caster of no type; run;
 * - VSH_ERROR_INPUT, VSH_ERROR_READ, VSH_ERROR_UNSUPPORTED: a caster's image, font or text;
 * - VSH_ERROR_LIMIT: run->memory_limit; more than 2^31 distances in the grid;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_flat_bake(const vsh_flat_scene *scene, const vsh_run *run, const vsh_flat_map *map,
                                 vsh_error *error);

VSH_END_C
