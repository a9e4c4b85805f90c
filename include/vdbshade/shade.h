/* Shadow and ambient occlusion at points. */
#ifndef VDBSHADE_SHADE_H
#define VDBSHADE_SHADE_H

#include "light.h"
#include "method.h"
#include "occluders.h"
#include "points.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How shadow and AO are found. */
typedef struct vsh_shade_options {
    size_t struct_size;
    int32_t method;        /* VSH_SHADOW_… (auto) */
    int32_t ao_method;     /* VSH_AO_… (auto) */
    int32_t ao_cones;      /* 1 … 256, with VSH_AO_CONES */
    int32_t max_steps;     /* 16 … 65536; a ray that has not ended after so many is counted as unfinished */
    double ao_distance;    /* how far an occluder can be, world units, > 0 (2^-1000 … 2^1000) */
    double start_offset;   /* how far above a point rays begin, along its normal, voxels, 0 … 16 */
    double surface_offset; /* added to it, world units, 0 … 2^1000: where the receiver itself is in the field
                              as a shell, half of its thickness */
    int32_t rays;          /* rays: how many (0: 64). adaptive and exact: the most that a value takes, even
                              where max_error asks for more; 0: as many as that does, up to 16384 (blue: 4096).
                              0 … 4096 (0) */
    int32_t sampler;    /* VSH_SAMPLER_…; blue is sobol where adaptive and exact are to keep less than 0.02,
                           and for AO of lightmaps whose texels share rays */
    int32_t frame;      /* ≥ 0 */
    int32_t early_rays; /* rays: where the first so many agree, the rest are not marched; 0: never */
    double max_error;   /* adaptive, exact: standard error that a value may keep, 1e-4 … 1 (0.02) */
    double jitter;      /* shadows by one march, but for improved: steps are shortened by a part between 0 and
                         * this, 0 … 1, another for each texel. What steps have in common, bands, becomes grain */
    double
        ao_up[3]; /* of any length: AO is of the directions over this horizon, d · ao_up > 0, and says which
                   * share of them is free; they are (1 + cosine to the normal) / 2 of the hemisphere, and
                   * where that is 0 the share says nothing. {0, 0, 0}: of all. By rays, adaptive and exact */
} vsh_shade_options;

static inline vsh_shade_options vsh_shade_options_default(void) {
    vsh_shade_options options = {sizeof(vsh_shade_options),
                                 VSH_SHADOW_AUTO,
                                 VSH_AO_AUTO,
                                 16,
                                 1024,
                                 1.0,
                                 0.25,
                                 0.0,
                                 0,
                                 VSH_SAMPLER_SOBOL,
                                 0,
                                 0,
                                 0.02,
                                 0.0,
                                 {0.0, 0.0, 0.0}};
    return options;
}

/* Fraction of the light that each point sees, 0 dark … 1 lit, into visibility[count]: before any cosine,
 * colour or falloff (a spot's edge counts as falloff). Points turned away from the light are 0, points inside
 * it 1, invalid ones NaN. `deviation` [count], where not NULL, takes the standard error that is left: 0 where
 * a cone proved the value, estimated where rays gave it, NaN for methods that know nothing of it. Takes up to
 * 512 KB of the stack of every thread it runs on, the caller's too. Errors (the arrays then hold nothing of
 * use): VSH_ERROR_ARGUMENT (options out of range, exact of occluders without triangles, run, and as
 * vsh_light_check()), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_shade_shadow(const vsh_occluders *occluders, const vsh_points *points,
                                    const vsh_light *light, const vsh_shade_options *options,
                                    const vsh_run *run, float *visibility, float *deviation,
                                    vsh_shade_stats *stats, vsh_error *error);

/* Cosine-weighted fraction of the hemisphere around the normal that is free within ao_distance, 0 … 1 open,
 * into ao[count]; invalid points are NaN; `deviation` as above. `bent` [count][3], where not NULL, takes bent
 * normals: the mean of the directions that are open, unit, world space; the normal where none is open, NaN
 * for invalid points (Landis, "Production-ready global illumination", 2002). Layers' directions are
 * superposed, which is exact where they hide different parts of the sky. Errors (the arrays then hold nothing
 * of use): VSH_ERROR_ARGUMENT (options out of range, run, points->normals NULL where there are points; with
 * `bent` also VSH_AO_TAPS, which knows no directions, and a horizon), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED.
 */
VSH_API vsh_result vsh_shade_ao(const vsh_occluders *occluders, const vsh_points *points,
                                const vsh_shade_options *options, const vsh_run *run, float *ao,
                                float *deviation, float *bent, vsh_shade_stats *stats, vsh_error *error);

/* Colour of penumbrae: red bleeds farther into the shadow, as light does through what surrounds it (Quilez,
 * "outdoors lighting", 2013). 1 stays white, 0 black. */
enum {
    VSH_TINT_NONE = 0,      /* (V, V, V) */
    VSH_TINT_QUADRATIC = 1, /* (V, V²/2 + V/2, V²) */
    VSH_TINT_POWER = 2      /* V to the power of each channel: (1, 1.2, 1.5), say */
};

/* How a penumbra is tinted. */
typedef struct vsh_tint {
    int32_t type;    /* VSH_TINT_… */
    double power[3]; /* VSH_TINT_POWER: of R, G, B, 1/16 … 16 */
} vsh_tint;

/* Tinted visibility, linear RGB, into rgb[count][3]; NaN stays. The tint must have passed vsh_tint_check().
 * Runs on the calling thread. */
VSH_API void vsh_shade_tint(size_t count, const float *visibility, const vsh_tint *tint, float *rgb);

/* Errors: VSH_ERROR_ARGUMENT (a type or a power out of range). */
VSH_API vsh_result vsh_tint_check(const vsh_tint *tint, vsh_error *error);

/* Irradiance of one light, linear RGB, added to irradiance[count][3]: visibility[count] × colour × falloff ×
 * the cosine to `shading_normals` [count][3], of any length (NULL: points->normals, which must then be
 * given). NaN visibilities add nothing. The light must have passed vsh_light_check(). Runs on the calling
 * thread. */
VSH_API void vsh_shade_irradiance(const vsh_points *points, const float *shading_normals,
                                  const vsh_light *light, const float *visibility, float *irradiance);

#ifdef __cplusplus
}
#endif
#endif
