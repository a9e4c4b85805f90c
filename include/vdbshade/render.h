/* Pictures: surfaces seen by a camera, in the light that occluders leave. For looking at what is baked:
 * no materials but a colour, no light that is reflected. */
#ifndef VDBSHADE_RENDER_H
#define VDBSHADE_RENDER_H

#include "image.h"
#include "mesh.h"
#include "shade.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- cameras */

/* A pinhole. All numbers are finite. */
typedef struct vsh_camera {
    size_t struct_size;
    double position[3]; /* world units */
    double target[3];   /* what it looks at: the picture's middle; not the position */
    double up[3];       /* the way up in the picture; any length but 0, not along the view */
    double fov;         /* angle over the picture's height, radians, 0.001 … 3 */
} vsh_camera;

/* At (0, 0, 1), looking at the origin with y up and a lens of 35°. */
static inline vsh_camera vsh_camera_default(void) {
    vsh_camera camera = {
        sizeof(vsh_camera), {0.0, 0.0, 1.0}, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, 0.61086523819801535};
    return camera;
}

/* Checks a camera against the ranges above. Errors: VSH_ERROR_ARGUMENT, naming the field, the value and the
 * limit. */
VSH_API vsh_result vsh_camera_check(const vsh_camera *camera, vsh_error *error);

/* Moves a camera so that it sees a whole world box, whose middle becomes the target; `up` and `fov` stay.
 * It stands at `azimuth` radians around `up` (0: +z, or for an `up` along z -y; growing anticlockwise seen
 * from above) and `elevation` radians over the horizon (within ±1.57). `aspect` is the picture's width over
 * its height, > 0. Errors: VSH_ERROR_ARGUMENT (camera as above, but for position and target; bounds that are
 * not finite, or min > max, or a point; the other numbers). */
VSH_API vsh_result vsh_camera_frame(vsh_camera *camera, const double bounds_min[3],
                                    const double bounds_max[3], double azimuth, double elevation,
                                    double aspect, vsh_error *error);

/* The same for points [count][3], world units, as near as they can all be seen from there: they fill 86 % of
 * the picture's width or height, and lie around its middle. The target is at their middle depth. Errors:
 * VSH_ERROR_ARGUMENT, as there (points NULL, not finite, or all in one place). */
VSH_API vsh_result vsh_camera_frame_points(vsh_camera *camera, size_t count, const double *points,
                                           double azimuth, double elevation, double aspect, vsh_error *error);

/* Turns a camera by `angle` radians around the axis along `up` through its target,
 * anticlockwise seen from above. The camera must have passed vsh_camera_check(). */
VSH_API void vsh_camera_orbit(vsh_camera *camera, double angle);

/* --- pictures */

enum { VSH_MAX_PICTURE_SIZE = 16384, VSH_MAX_SURFACES = 65536 };

/* What camera rays meet: the zero surface of a field. A view; nothing is owned. */
typedef struct vsh_surface {
    const vsh_field *field; /* whose zero surface is shown */
    double color[3];        /* linear RGB, share of light that comes back, 0 … 1 */
} vsh_surface;

/* Meshes that are shown themselves, with a lightmap on them or in the light that the occluders leave. A
 * view; nothing is owned. */
typedef struct vsh_lit_meshes {
    const vsh_mesh *meshes; /* [mesh_count], with the UVs of the lightmap */
    size_t mesh_count;
    const vsh_image *lightmap; /* NULL: none, light is asked for at each point. Of any size, row 0 at v = 1,
                                  looked up bilinearly: either irradiance.R, .G, .B or shadow.NAME of every
                                  light, and `ao` if there is one */
    double color[3];           /* as of a surface */
    int32_t ambient; /* nonzero: its irradiance has the sky's light in it already (vsh_lightmap.ambient) */
} vsh_lit_meshes;

/* How a picture is drawn. */
typedef struct vsh_render_options {
    size_t struct_size;
    vsh_camera camera; /* where it is seen from */
    int32_t width;     /* pixels, 1 … VSH_MAX_PICTURE_SIZE */
    int32_t height;    /* the same */
    int32_t samples; /* N: N × N rays a pixel, jittered within their cells, under a Blackman-Harris filter 3
                        pixels wide (F. J. Harris, 1978); 1 … 16, and width × N at most 65000, so height */
    int32_t ao;      /* nonzero: the sky's light is multiplied by ambient occlusion */
    double sky[3];   /* light of the open sky from all sides, linear RGB, ≥ 0 */
    double background[3]; /* where there is nothing, linear RGB, ≥ 0 */
    double
        shafts; /* light shafts: optical thickness of a thin, even fog along the diagonal of the box around
                   all surfaces, 0 … 100; it goes a quarter of the diagonal farther on every side. 0: none */
    int32_t shaft_steps;       /* points along each ray at which lights are asked for, 1 … 64 */
    const vsh_lit_meshes *lit; /* [lit_count]: shown in front of surfaces up to 1.5 voxels nearer; may be
                                  NULL */
    size_t lit_count;
    vsh_tint tint;           /* of penumbrae */
    vsh_shade_options shade; /* how shadow and AO are found */
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

/* Planes of the caller's, [height][width] with row 0 on top; those that are NULL are left out. */
typedef struct vsh_picture {
    float
        *color; /* [height][width][3]: linear RGB with the background in it, exposed as lights' colours are */
    float *alpha;  /* share of a pixel that is covered by surfaces, 0 … 1 */
    float *depth;  /* along the camera's axis to the nearest surface in the pixel, world units; infinite where
                      there is none */
    float *normal; /* [height][width][3]: world space, unit; 0, 0, 0 where there is nothing */
} vsh_picture;

/* Renders a picture. Each ray is sphere-traced (J. C. Hart, 1996) to the nearest of `surfaces`
 * [surface_count], and its hit is found to a hundredth of a voxel; normals are central differences over a
 * voxel to each side. There a pixel's colour is the surface's × (sum over lights of colour × falloff × cosine
 * × tinted visibility + sky × AO), with the values of vsh_shade_shadow() and vsh_shade_ao() among the
 * occluders. Surfaces are usually their fields; others of the same casters tell more colours
 * apart. Rays that begin within a solid begin where they leave it.
 *
 * On lit meshes without a lightmap, VSH_SHADOW_EXACT and VSH_AO_EXACT shade the point on the triangle. Other
 * methods shade a point half a voxel over it. On surfaces, points are lifted by half a voxel for
 * VSH_SHADOW_EXACT, VSH_AO_EXACT and layers without a field.
 *
 * Light shafts: at `shaft_steps` points of each ray through the fog, the first jittered by blue noise, what
 * the lights' visibility there lets through comes to the eye with exponential decay (K. Mitchell, "Volumetric
 * light scattering as a post-process", GPU Gems 3, 2007, with the visibility itself in the image's place).
 *
 * The picture is the same for any number of threads and any instruction set. Stages: "render". `stats` gets
 * marches and samples of camera rays too. Errors (planes then hold nothing of use):
 * - VSH_ERROR_ARGUMENT: picture or occluders NULL, surfaces or lights NULL with a count above 0, more than
 *   VSH_MAX_SURFACES, options out of range, run, and as vsh_camera_check(), vsh_query_create();
 * - VSH_ERROR_INPUT: lit meshes as vsh_mesh_check() or without UVs; a lightmap without the channels above;
 * - VSH_ERROR_LIMIT: fields, lit meshes and what rendering takes pass run->memory_limit;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_render(const vsh_surface *surfaces, size_t surface_count,
                              const vsh_occluders *occluders, const vsh_light *lights, size_t light_count,
                              const vsh_render_options *options, const vsh_run *run,
                              const vsh_picture *picture, vsh_shade_stats *stats, vsh_error *error);

/* A picture of width × height for files of 8 bits: color × 2^exposure through the sRGB curve (IEC 61966-2-1)
 * to 0 … 1 in steps of 1/255, dithered so that gradients do not band, into planes R, G, B
 * and A, [height × width] each. A NULL `alpha` plane keeps the background; else colours are divided by
 * alpha first, for a picture whose background is 0. `color` and, for alpha, `alpha` of the picture must be
 * there; exposure is -20 … 20. Runs on the calling thread. Errors: VSH_ERROR_ARGUMENT. */
VSH_API vsh_result vsh_picture_encode(const vsh_picture *picture, int32_t width, int32_t height,
                                      double exposure, float *const rgb[3], float *alpha, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
