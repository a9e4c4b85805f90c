/* Flat scenes: light maps of a plane, for 2D games. Casters are areas of the plane (outline.h), lights are
 * discs in it or far away. */
#ifndef VDBSHADE_FLAT_H
#define VDBSHADE_FLAT_H

#include "light.h"
#include "outline.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How much of a light a point sees. Shadow is the share of the angle under which the light's disc is seen, as
 * a disc that shines evenly in a plane lights a point. */
enum {
    VSH_FLAT_HARD = 0,    /* the light's centre: 0 or 1, without error */
    VSH_FLAT_CLASSIC = 1, /* min h/(s t) along the ray to the centre, outer half of the penumbra only, h from
                             a grid of distances, s the sine of the light's half angle (Kaplan's 2D lighting
                             after Quilez, "soft shadows in raymarched SDFs", 2010) */
    VSH_FLAT_EXACT = 2    /* the union of the angles that the outline hides, in closed form: without error but
                             rounding, whatever the outline */
};

/* How a light map of a plane is made. */
typedef struct vsh_flat_options {
    size_t struct_size;
    int32_t width;        /* texels, 1 … 65536 */
    int32_t height;       /* the same */
    double region_min[2]; /* world rectangle that the map shows, finite, at most 1e15 in size; row 0 of the
                             map is */
    double region_max[2]; /* its upper side, y = region_max[1] */
    int32_t method;       /* VSH_FLAT_… */
    int32_t supersample;  /* N: N × N samples a texel, 1 … 16 */
    int32_t padding;      /* texels that values are grown by into solids, 0 … 4096; never coverage */
    int32_t
        max_steps; /* classic: 16 … 65536; a ray that has not ended after so many takes what is known then */
} vsh_flat_options;

static inline vsh_flat_options vsh_flat_options_default(void) {
    vsh_flat_options options = {sizeof(vsh_flat_options), 512, 512, {-1.0, -1.0}, {1.0, 1.0},
                                VSH_FLAT_EXACT,           1,   4,   1024};
    return options;
}

/* Where a bake's values go; each plane [height][width], row 0 on top. */
typedef struct vsh_flat_map {
    float *const *shadow; /* [light_count] planes: the share of each light that is seen, 0 dark … 1 lit, and 0
                             beyond its reach, where no light arrives; NULL, or a plane NULL: not wanted */
    float *const *irradiance; /* [3] planes, linear R, G and B: over all lights visibility × colour × falloff
                                 (and a spot's edge); NULL: not wanted */
    float *coverage;          /* share of a texel's samples outside solids; NULL: not wanted */
} vsh_flat_map;

/* Bakes a light map: each texel's values are the mean of those of its samples that are outside solids; where
 * there is none they are 0, but for padding. `casters` NULL is a plane without any. Lights are as in light.h,
 * but for the third components of direction, axis and position, which are ignored; their radius is that of a
 * disc, a spot's angles are in the plane. A point inside a light's disc sees all of it. Values depend on no
 * number of threads. Errors (the planes then hold nothing of use):
 * - VSH_ERROR_ARGUMENT: map NULL, options out of range, lights NULL with a count above 0, a light that
 *   vsh_light_check() refuses or whose direction has no length in the plane (with its number), run;
 * - VSH_ERROR_LIMIT: run->memory_limit, with outline and planes; classic: more than 2^31 distances in its
 * grid, which covers the outline and the lights' half widths around it in steps of a texel;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_flat_bake(const vsh_outline *casters, const vsh_light *lights, size_t light_count,
                                 const vsh_flat_options *options, const vsh_run *run, const vsh_flat_map *map,
                                 vsh_error *error);

/* The share of a light that a point [2] sees, as by VSH_FLAT_EXACT and without its reach: 0 … 1; NaN where
 * the point is not finite, or the light has no place in a plane. The light must have passed
 * vsh_light_check(). */
VSH_API double vsh_flat_visibility(const vsh_outline *casters, const vsh_light *light, const double point[2]);

/* --- flat scenes */

enum {
    VSH_FLAT_MASK = 0,   /* path, mask */
    VSH_FLAT_TEXT = 1,   /* path (the font), text, letters */
    VSH_FLAT_CIRCLE = 2, /* radius; as a polygon of 256 sides of the same area */
    VSH_FLAT_BOX = 3,    /* half_size */
    VSH_FLAT_POLYGON = 4 /* points */
};

/* A caster of a flat scene. Which members hold is told by its type. */
typedef struct vsh_flat_caster {
    int32_t type;             /* VSH_FLAT_… */
    const char *path;         /* file */
    vsh_mask_options mask;    /* how the image becomes an outline */
    const char *text;         /* what is written, UTF-8 */
    vsh_text_options letters; /* how it is written */
    double radius;            /* world units, > 0 */
    double half_size[2];      /* the same */
    const double *points;     /* [point_count][2], closed, of either sense, may cross itself */
    size_t point_count;       /* ≥ 3 */
    double transform[6];      /* as in vsh_outline_instance */
} vsh_flat_caster;

/* A flat scene, read from a file or filled by the caller. Paths are as the system takes them. */
typedef struct vsh_flat_scene {
    const vsh_flat_caster *casters; /* [caster_count] */
    size_t caster_count;
    const vsh_light *lights;  /* no two names alike, none empty: channels are named after them */
    size_t light_count;       /* how many lights */
    vsh_flat_options options; /* how its map is made */
    const char *output;       /* image file; NULL: none is named */
    int32_t bits;             /* as in vsh_image_options */
    const char *pack;         /* as in vsh_image_options; may be NULL */
    int32_t color_space;      /* as in vsh_image_options */
} vsh_flat_scene;

/* Reads a flat scene's file (docs/flat.md); what it names is not opened. The scene and all it points to
 * belong to *scene; free it with vsh_flat_scene_free(). Errors: as vsh_scene_read(). */
VSH_API vsh_result vsh_flat_scene_read(const char *path, const vsh_run *run, vsh_flat_scene **scene,
                                       vsh_error *error);
VSH_API void
vsh_flat_scene_free(vsh_flat_scene *scene); /* of vsh_flat_scene_read() only; NULL does nothing */

/* The union of a flat scene's casters; NULL, with VSH_OK, where it has none. Free it with vsh_outline_free().
 * Errors: VSH_ERROR_ARGUMENT (scene or outline NULL, a caster of no type, run), and with the caster's number
 * in the message those of vsh_outline_from_…() and vsh_outline_unite(). */
VSH_API vsh_result vsh_flat_scene_casters(const vsh_flat_scene *scene, const vsh_run *run,
                                          vsh_outline **outline, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
