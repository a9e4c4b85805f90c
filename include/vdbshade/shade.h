/* Shadow and ambient occlusion at points. */
#ifndef VDBSHADE_SHADE_H
#define VDBSHADE_SHADE_H

#include "light.h"
#include "occluders.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How a shadow is estimated. s is the sine of the light's half angle as seen from the point, h the distance
 * to the nearest caster at a distance t along the ray. */
enum {
    VSH_SHADOW_HARD = 0,      /* the light's centre: 0 or 1 */
    VSH_SHADOW_CLASSIC = 1,   /* min h/(s t), outer penumbra only (Quilez, "soft shadows in raymarched SDFs",
                                 2010) */
    VSH_SHADOW_PRACTICAL = 2, /* the same x through 3x² - 2x³, a march that ends at x < 0.004 (Quilez,
                                 "outdoors lighting", 2013) */
    VSH_SHADOW_IMPROVED = 3,  /* triangulated closest miss, outer penumbra only (Aaltonen, GDC 2018) */
    VSH_SHADOW_SMOOTH = 4, /* inner and outer penumbra, cubic remap (Quilez, 2018 extension of the article of
                              2010) */
    VSH_SHADOW_CONE = 5, /* inner and outer penumbra, circular segment: the share of a disc behind an edge */
    VSH_SHADOW_RAYS = 6, /* `rays` rays over the light's disc, marched against the field */
    VSH_SHADOW_ADAPTIVE =
        7,                /* a cone that proves the light fully seen or hidden, else rays until max_error */
    VSH_SHADOW_EXACT = 8, /* the same cone, the rays traced against the occluders' triangles */
    VSH_SHADOW_AUTO = 9   /* exact where the occluders have triangles, else adaptive: keeps max_error */
};

enum {
    VSH_AO_TAPS = 0, /* five samples along the normal (Quilez, "multiresolution ambient occlusion", 2008 …) */
    VSH_AO_CONES = 1,    /* cosine-weighted cones (Crassin and others, 2011, marched in a distance field) */
    VSH_AO_RAYS = 2,     /* `rays` cosine-weighted rays, marched against the field */
    VSH_AO_ADAPTIVE = 3, /* the same, as many as max_error takes */
    VSH_AO_EXACT = 4,    /* likewise, the rays traced against the occluders' triangles, from the points
                            themselves: start_offset is not added */
    VSH_AO_AUTO = 5      /* exact where the occluders have triangles, else adaptive */
};

/* What a method is like. All that takes no rays is a preview: its error depends on the scene. */
enum {
    VSH_METHOD_RAYS = 1,        /* takes rays, and knows the error that they leave */
    VSH_METHOD_KEEPS_ERROR = 2, /* takes as many as max_error asks for */
    VSH_METHOD_TRIANGLES = 4,   /* traces them against triangles, which the occluders have to have */
    VSH_METHOD_INNER = 8 /* shadows: counts the inner penumbra, so that less than half of a light is seen
                            where its centre is hidden; without it nothing is */
};

/* Where the rays of a point go, over the light's disc or the hemisphere. `frame` gives another, independent
 * set: bakes of frames 0 … n - 1 may be averaged. */
enum {
    VSH_SAMPLER_SOBOL = 0, /* low discrepancy: Owen-scrambled Sobol points (Burley, "Practical hash-based Owen
                              scrambling", 2020), their digits shifted for each point */
    VSH_SAMPLER_WHITE = 1, /* independent */
    VSH_SAMPLER_BLUE = 2 /* best-candidate points (Mitchell, 1991), turned for each texel by a blue-noise mask
                            (Ulichney, "Void and cluster", 1993) that frames shift by the golden ratio */
};

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
                                 0.0};
    return options;
}
VSH_API void vsh_shade_options_init(vsh_shade_options *options, size_t size);

/* "cone" to VSH_SHADOW_CONE and back; -1 and NULL for what is no method. Names are static strings; NULL is
 * none. */
VSH_API int32_t vsh_shadow_method(const char *name);
VSH_API const char *vsh_shadow_method_name(int32_t method);
VSH_API int32_t vsh_ao_method(const char *name);
VSH_API const char *vsh_ao_method_name(int32_t method);
VSH_API int32_t vsh_tint_type(const char *name);
VSH_API const char *vsh_tint_type_name(int32_t type);
VSH_API int32_t vsh_sampler(const char *name);
VSH_API const char *vsh_sampler_name(int32_t sampler);

/* VSH_METHOD_… of a method, 0 for what is none; of auto, what holds for both that it may come to. */
VSH_API uint32_t vsh_shadow_method_traits(int32_t method);
VSH_API uint32_t vsh_ao_method_traits(int32_t method);

/* What auto comes to with triangles (nonzero) or without; every other method is itself. */
VSH_API int32_t vsh_shadow_method_resolve(int32_t method, int32_t has_triangles);
VSH_API int32_t vsh_ao_method_resolve(int32_t method, int32_t has_triangles);

/* Receivers: a view of the caller's arrays. Points that follow each other and lie within a few voxels of each
 * other share proofs, which makes them several times as fast: sort them along a curve that fills space
 * (query.h does so). adaptive and exact also take from them how many rays a point needs, and where `texels`
 * and normals are given they cast rays for a part of the points of a square of 8 × 8 or 4 × 4 texels that
 * follow each other, lie flat and differ little, and interpolate the others (after hierarchical surpluses:
 * Bungartz and Griebel, "Sparse grids", 2004). A value thus depends, within its error, on the points before
 * and after it; never on threads. */
typedef struct vsh_points {
    size_t count;
    const double *positions; /* [count][3], world units */
    const float *normals;   /* [count][3], geometric, of any length, pointing away from the solid; may be NULL
                               for shadows: then there is no start offset, no horizon and no back side */
    const uint32_t *texels; /* [count], column + 65536 row: what the samplers tell points apart by, so that a
                             * lightmap's noise does not depend on the order of its points, and where they lie
                             * in it; NULL: the points' numbers, and no lightmap */
} vsh_points;

/* Work that was done; calls add to it, cancelled ones too. Begin with vsh_shade_stats_zero(). */
typedef struct vsh_shade_stats {
    size_t struct_size;
    uint64_t marches;    /* cones and rays that were marched */
    uint64_t samples;    /* samples of the field */
    uint64_t skipped;    /* points turned away from the light, not marched */
    uint64_t certified;  /* cones whose light was proved fully seen or fully hidden (to the field's error) */
    uint64_t unfinished; /* marches that ran out of steps; their value is what was known by then */
    uint64_t invalid;    /* points with a position or normal that is not finite, or a zero normal: NaN */
    uint64_t beyond_reach; /* cones wider somewhere than the field's reach by over 3 %, and taps farther off:
                              they may read too dark, which matters where no rays refine them. Make the field
                              with a larger reach */
    uint64_t rays;         /* rays marched or traced to refine what no cone decided, or by the rays methods */
    uint64_t refined;      /* values that took rays */
    double square_error;   /* adaptive, exact: sum over values of the estimated squared error */
    double ao_square_error; /* what of it is AO's */
} vsh_shade_stats;

static inline vsh_shade_stats vsh_shade_stats_zero(void) {
    vsh_shade_stats stats = {sizeof(vsh_shade_stats), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.0, 0.0};
    return stats;
}
VSH_API void vsh_shade_stats_init(vsh_shade_stats *stats, size_t size);

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
 * into ao[count]; invalid points are NaN; `deviation` as above. Errors (ao then holds nothing of use):
 * VSH_ERROR_ARGUMENT (options out of range, run, points->normals NULL where there are points),
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_shade_ao(const vsh_occluders *occluders, const vsh_points *points,
                                const vsh_shade_options *options, const vsh_run *run, float *ao,
                                float *deviation, vsh_shade_stats *stats, vsh_error *error);

/* AO as above, and bent normals: the mean of the directions that are open, unit, world space, into
 * bent[count][3]; the normal where none is open, NaN for invalid points (Landis, "Production-ready global
 * illumination", 2002). Layers' directions are superposed, which is exact where they hide different parts of
 * the sky. Errors: as above; VSH_ERROR_ARGUMENT too for VSH_AO_TAPS, which knows no directions. */
VSH_API vsh_result vsh_shade_bent(const vsh_occluders *occluders, const vsh_points *points,
                                  const vsh_shade_options *options, const vsh_run *run, float *ao,
                                  float *bent, vsh_shade_stats *stats, vsh_error *error);

/* Colour of penumbrae: red bleeds farther into the shadow, as light does through what surrounds it (Quilez,
 * "outdoors lighting", 2013). 1 stays white, 0 black. */
enum {
    VSH_TINT_NONE = 0,      /* (V, V, V) */
    VSH_TINT_QUADRATIC = 1, /* (V, V²/2 + V/2, V²) */
    VSH_TINT_POWER = 2      /* V to the power of each channel: (1, 1.2, 1.5), say */
};

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
