/* Lights, methods, and shading of points: shadow, ambient occlusion (AO), irradiance and distance.
 *
 *     vsh_light sun = vsh_light_default(); // half a degree, overhead
 *     sun.direction[0] = 0.5;              // towards the light
 *     sun.angle = 0.1;                     // angular diameter, radians
 *     double position[3] = {0.0, 0.0, 0.0};
 *     float normal[3] = {0.0f, 1.0f, 0.0f};
 *     vsh_points points = {1, position, normal, NULL};
 *     float lit;
 *     vsh_shade_shadow(occluders, &points, &sun, NULL, &run, &lit, NULL, NULL, &error);
 *
 * vsh_query answers repeated calls for few points faster, and reads points from the caller's own structs. */
#pragma once

#include "occluders.h"

VSH_BEGIN_C

/* Shapes of lights, and the members that place them. */
typedef enum vsh_light_type {
    VSH_LIGHT_DIRECTIONAL = 0, /* direction, angle */
    VSH_LIGHT_SPHERE = 1,      /* position, radius */
    VSH_LIGHT_SPOT = 2,        /* position, radius, axis, inner_angle, outer_angle */
    VSH_LIGHT_RECTANGLE = 3    /* position, edge_u, edge_v, two_sided */
} vsh_light_type;

/* How light falls off with the distance d. */
typedef enum vsh_falloff {
    VSH_FALLOFF_NONE = 0,
    VSH_FALLOFF_INVERSE_SQUARE = 1, /* 1 / d² */
    VSH_FALLOFF_QUADRATIC = 2       /* (1 - d / reach)², 0 beyond the reach */
} vsh_falloff;

/* A light. `direction` points towards the light; only a spot's `axis` points away from it. Angles are full
 * angles. Shadow values depend on its shape and place alone; falloff, colour, a spot's edge and cosines
 * enter irradiance. But points beyond the reach of VSH_FALLOFF_QUADRATIC, or outside a spot's outer cone, get
 * no light: their shadow value is 0, and costs no ray. A size (angle, radius) of 0 is a hard light, and so is
 * a half angle whose sine is below 1e-6. Numbers are finite. Members that the type does not name are ignored.
 *
 * The visible fraction of a rectangle is that of its solid angle. VSH_SHADOW_RAYS, ADAPTIVE and EXACT cast
 * rays over the rectangle, and VSH_SHADOW_HARD to its centre. Other methods, and heights and spheres without
 * voxels, replace it by a disc of equal solid angle, cut where its cone would reach the rectangle's plane.
 * Points behind a one-sided rectangle, or in its plane, see nothing of it (0). Its irradiance includes the
 * cosine at the light; with VSH_FALLOFF_INVERSE_SQUARE each part has its own distance and cosine, which sums
 * to its solid angle over its area. */
typedef struct vsh_light {
    vsh_light_type type; /* decides which members apply */
    vsh_falloff falloff; /* not of directional lights */
    double direction[3]; /* directional: towards the light. Any length but 0 */
    double position[3];  /* of the centre, world units */
    double angle;        /* directional: angular diameter, radians, 0 … π (excluded) */
    double radius;       /* sphere, spot: world units, ≥ 0 */
    double axis[3];      /* spot: the way it shines, away from the light. Any length but 0 */
    double inner_angle;  /* spot: angle across full light, radians, 0 … outer_angle */
    double outer_angle;  /* spot: angle across all light, radians, > 0 … 2 π */
    double reach;        /* for VSH_FALLOFF_QUADRATIC: world units, > 0 */
    double color[3]; /* linear RGB times intensity, ≥ 0: irradiance at normal incidence, before falloff */
    char name[64]; /* "sun": its channel is shadow.sun. Up to 63 of A-Z, a-z, 0-9, _ and -; may be empty if no
                      channel needs it */
    double edge_u[3]; /* rectangle: full sides, world units, 1e-15 … 1e15 long, at right angles (to a cosine
                         of 0.001). It shines along edge_u × edge_v */
    double edge_v[3]; /* the other side */
    int32_t two_sided; /* rectangle: 1 if it shines both ways, else 0 */
} vsh_light;

/* A white sun of half a degree overhead (+y), named "sun". */
static inline vsh_light vsh_light_default(void) {
    vsh_light light = {VSH_LIGHT_DIRECTIONAL,
                       VSH_FALLOFF_NONE,
                       {0.0, 1.0, 0.0},
                       {0.0, 0.0, 0.0},
                       0.00925,
                       0.0,
                       {0.0, -1.0, 0.0},
                       0.7,
                       1.0,
                       1.0,
                       {1.0, 1.0, 1.0},
                       "sun",
                       {1.0, 0.0, 0.0},
                       {0.0, 0.0, 1.0},
                       0};
    return light;
}

/* Checks a light against the ranges above. Errors: VSH_ERROR_ARGUMENT, naming the light, the member, its
 * value and the limit; light NULL. */
VSH_API vsh_result vsh_light_check(const vsh_light *light, vsh_error *error);

/* Describes a checked light in one line, cut to `size` bytes with NUL: type, place and size, and colour and
 * falloff unless they are the defaults. */
VSH_API void vsh_light_text(const vsh_light *light, char *text, size_t size);

/* --- methods */

/* How a shadow is estimated. s is the sine of the light's half angle, and h the distance to the nearest
 * caster at a distance t along the ray. Methods without rays are previews: their error depends on the scene.
 */
typedef enum vsh_shadow_method {
    VSH_SHADOW_OF_SCENE = -1, /* for layers of a scene: the scene's method */
    VSH_SHADOW_HARD = 0,      /* the light's centre: 0 or 1 (Hart, "Sphere tracing", 1996) */
    /* min h/(s t), outer penumbra only (Quilez, "soft shadows in raymarched SDFs", 2010) */
    VSH_SHADOW_CLASSIC = 1,
    /* CLASSIC's value x becomes 3x² - 2x³, and the march ends at x < 0.004 (Quilez, "outdoors lighting",
     * 2013) */
    VSH_SHADOW_PRACTICAL = 2,
    VSH_SHADOW_IMPROVED = 3, /* triangulated closest miss, outer penumbra only (Aaltonen, GDC 2018) */
    VSH_SHADOW_SMOOTH = 4,   /* inner and outer penumbra, cubic remap (Quilez, 2018) */
    VSH_SHADOW_CONE = 5,     /* inner and outer penumbra: the share of a disc behind an edge */
    VSH_SHADOW_RAYS = 6,     /* `rays` rays over the light's disc, marched through the field */
    VSH_SHADOW_ADAPTIVE = 7, /* cones that prove full light or shadow, else rays until max_error */
    VSH_SHADOW_EXACT = 8,    /* rays against triangles until max_error; voxels, if any, prove cones first */
    VSH_SHADOW_AUTO = 9      /* exact if the occluders have triangles, else adaptive */
} vsh_shadow_method;

/* How ambient occlusion is estimated. */
typedef enum vsh_ao_method {
    VSH_AO_TAPS = 0,  /* five samples along the normal (Quilez, "multiresolution ambient occlusion", 2008) */
    VSH_AO_CONES = 1, /* cosine-weighted cones through the field (Crassin and others, 2011) */
    VSH_AO_RAYS = 2,  /* `rays` cosine-weighted rays, marched through the field */
    VSH_AO_ADAPTIVE = 3, /* as RAYS, with as many rays as max_error needs */
    /* as ADAPTIVE, but against the casters' triangles, from the points themselves without start_offset */
    VSH_AO_EXACT = 4,
    VSH_AO_AUTO = 5 /* exact if the occluders have triangles, else adaptive */
} vsh_ao_method;

/* Traits of methods: bits. */
typedef enum vsh_method_trait {
    VSH_METHOD_RAYS = 1,        /* casts rays, and knows the error that they leave */
    VSH_METHOD_KEEPS_ERROR = 2, /* casts as many rays as max_error needs */
    VSH_METHOD_TRIANGLES = 4,   /* needs triangles */
    VSH_METHOD_INNER = 8 /* shadows: knows the inner penumbra, where less than half of the light is visible */
} vsh_method_trait;

/* Returns the traits of a shadow method (VSH_NAMES_SHADOW) or AO method (VSH_NAMES_AO), as a sum of
 * VSH_METHOD_…; 0 for others. For auto, those that adaptive and exact share. */
VSH_API uint32_t vsh_method_traits(vsh_names kind, int32_t method);

/* How rays are distributed over the light's disc or the hemisphere. vsh_shade_options.frame picks an
 * independent set: bakes of frames 0 … n - 1 may be averaged. */
typedef enum vsh_sampler {
    /* Owen-scrambled Sobol points (Burley, "Practical hash-based Owen scrambling", 2020) */
    VSH_SAMPLER_SOBOL = 0,
    VSH_SAMPLER_WHITE = 1, /* independent */
    /* best-candidate points (Mitchell, 1991), rotated for each texel by a blue-noise mask (Ulichney, "Void
       and cluster", 1993) that frames shift by the golden ratio */
    VSH_SAMPLER_BLUE = 2
} vsh_sampler;

/* How shadow and AO are computed. */
typedef struct vsh_shade_options {
    size_t struct_size;
    vsh_shadow_method method; /* (auto) */
    vsh_ao_method ao_method;  /* (auto) */
    int32_t ao_cones;         /* for VSH_AO_CONES: 1 … 256 */
    int32_t max_steps;        /* of a march, 16 … 65536; rays that need more count as unfinished */
    double ao_distance;       /* how far occluders count, world units, > 0 (2^-1000 … 2^1000) */
    double start_offset;      /* how far above a point rays start, along its normal, voxels, 0 … 16 */
    double surface_offset; /* added to it, world units, 0 … 2^1000: half the thickness if the receiver itself
                              is a shell in the field */
    int32_t rays; /* for rays: their number (0: 64). For adaptive and exact: the most that a value takes, 0 …
                     4096; 0: as many as max_error needs, up to 16384 (blue: 4096) */
    vsh_sampler sampler; /* blue becomes sobol for adaptive and exact with max_error below 0.02,
                        and for AO of lightmaps whose texels share rays */
    int32_t frame;       /* ≥ 0 */
    int32_t early_rays;  /* for rays: if this many first rays agree, skip the rest; 0: never */
    double max_error;    /* for adaptive and exact: root mean square error of all values, 1e-4 … 1 (0.02);
                            single values in a penumbra may be off by several times as much */
    double jitter;   /* shadows by one march, except improved: shorten steps by up to this share, 0 … 1, at
                        random for each texel, which turns bands into grain */
    double ao_up[3]; /* AO over this horizon only, any length: the free share of the directions with d · ao_up
                        > 0, which are (1 + cosine to the normal) / 2 of the hemisphere. {0, 0, 0}: all
                        directions. For rays, adaptive and exact */
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

/* --- points */

/* A texel of a lightmap as one number: column + 65536 row, both 0 … 65535, row 0 at v = 1. These functions
 * return that number, its column, its row, and its index in a plane of `width` columns. */
static inline uint32_t vsh_texel(uint32_t column, uint32_t row) {
    return column + 65536u * row;
}
static inline uint32_t vsh_texel_column(uint32_t texel) {
    return texel % 65536u;
}
static inline uint32_t vsh_texel_row(uint32_t texel) {
    return texel / 65536u;
}
static inline size_t vsh_texel_place(uint32_t texel, int32_t width) {
    return (size_t)vsh_texel_row(texel) * (size_t)width + vsh_texel_column(texel);
}

/* Receivers as points. A view. Consecutive points within a few voxels of each other share proofs, which makes
 * them several times faster, so sort them along a space-filling curve (vsh_query does). adaptive and exact
 * also learn from them how many rays a point needs. With `texels` and normals they cast rays for some points
 * of a flat square of 8 × 8 or 4 × 4 texels, and interpolate the others if these agree (hierarchical
 * surpluses: Bungartz and Griebel, "Sparse grids", 2004). So values depend on neighbouring points within
 * their error, but never on threads. */
typedef struct vsh_points {
    size_t count;            /* points */
    const double *positions; /* [count][3], world units */
    const float *normals; /* [count][3], geometric, of any length, away from the solid. NULL (shadows only):
                             no start offset, no horizon, no back side */
    /* [count] of vsh_texel(): they seed the samplers, so that noise does not depend on the order of points,
     * and place points in the lightmap. NULL: the points' indices */
    const uint32_t *texels;
} vsh_points;

/* Work counters. Calls add to them, even cancelled ones. Begin with vsh_shade_stats_zero(). */
typedef struct vsh_shade_stats {
    size_t struct_size;
    uint64_t marches;       /* cones and rays that were marched */
    uint64_t samples;       /* samples of the field */
    uint64_t skipped;       /* points that face away from the light, or lie beyond its reach or cone */
    uint64_t certified;     /* cones that proved full light or full shadow, within the field's error */
    uint64_t unfinished;    /* marches that ran out of steps, which keep the value reached by then */
    uint64_t invalid;       /* points whose position or normal is not finite, or zero normals: NaN */
    uint64_t beyond_reach;  /* cones and taps beyond the field's reach (by 3 %), which may be too dark unless
                               rays refine them. Give the field a larger reach */
    uint64_t rays;          /* rays marched or traced */
    uint64_t refined;       /* values that needed rays */
    double square_error;    /* adaptive, exact: sum of the values' estimated squared errors */
    double ao_square_error; /* AO's part of it */
    double worst_error;     /* adaptive, exact: largest estimated error of a value */
} vsh_shade_stats;

static inline vsh_shade_stats vsh_shade_stats_zero(void) {
    vsh_shade_stats stats = {sizeof(vsh_shade_stats), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.0, 0.0, 0.0};
    return stats;
}

/* --- shading */

/* Writes the fraction of the light that each point sees, 0 dark … 1 lit, to visibility[count]: before cosine,
 * colour and falloff (a spot's edge is falloff). Points that face away from the light, or lie beyond its
 * reach or cone, get 0, points inside it 1, invalid ones NaN. `shadow_error` [count] (may be NULL) receives
 * the standard error left: 0 if a cone through voxels proved the value, an upper estimate if rays gave it,
 * NaN if the method knows none. Uses up to 512 KB of each thread's stack, the caller's too. Errors (the
 * arrays are then undefined): VSH_ERROR_ARGUMENT (options out of range, exact without triangles, run, and as
 * vsh_light_check()), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_shade_shadow(const vsh_occluders *occluders, const vsh_points *points,
                                    const vsh_light *light, const vsh_shade_options *options,
                                    const vsh_run *run, float *visibility, float *shadow_error,
                                    vsh_shade_stats *stats, vsh_error *error);

/* Writes the cosine-weighted fraction of the hemisphere that is free within ao_distance, 0 … 1 open, to
 * ao[count]; NaN for invalid points. Occluders count fully up to that distance. `ao_error` as above. `bent`
 * [count][3] (may be NULL) receives bent normals: the mean of the open directions, unit, world space; the
 * normal if none is open, NaN for invalid points (Landis, "Production-ready global illumination", 2002).
 * Layers' directions are superposed, which is exact if they hide different parts of the sky. Errors (the
 * arrays are then undefined): VSH_ERROR_ARGUMENT (options out of range, run, no normals; `bent` with
 * VSH_AO_TAPS or a horizon), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_shade_ao(const vsh_occluders *occluders, const vsh_points *points,
                                const vsh_shade_options *options, const vsh_run *run, float *ao,
                                float *ao_error, float *bent, vsh_shade_stats *stats, vsh_error *error);

/* Colours of penumbrae: red reaches farther into the shadow (Quilez, "outdoors lighting", 2013). V is the
 * visibility. */
typedef enum vsh_tint_type {
    VSH_TINT_NONE = 0,      /* (V, V, V) */
    VSH_TINT_QUADRATIC = 1, /* (V, V²/2 + V/2, V²) */
    VSH_TINT_POWER = 2      /* V to the power of each channel, such as (1, 1.2, 1.5) */
} vsh_tint_type;

/* How a penumbra is tinted. */
typedef struct vsh_tint {
    vsh_tint_type type; /* how */
    double power[3];    /* VSH_TINT_POWER: for R, G and B, 1/16 … 16 */
} vsh_tint;

/* Adds the irradiance of one light, linear RGB, to irradiance[count][3]: visibility[count] × colour × falloff
 * × cosine to `shading_normals` [count][3], of any length (NULL: points->normals). NaN visibilities add
 * nothing. The light must have passed vsh_light_check(). Runs on the calling thread. */
VSH_API void vsh_shade_irradiance(const vsh_points *points, const float *shading_normals,
                                  const vsh_light *light, const float *visibility, float *irradiance);

/* --- queries */

/* Occluders, lights and options, checked and prepared once, so that a call for one point costs little more
 * than its march. Immutable; threads may share it. */
typedef struct vsh_query vsh_query;

/* Copies lights [light_count] (NULL for none) and options; the occluders must outlive the handle. Free it
 * with vsh_query_free(). Errors: VSH_ERROR_ARGUMENT (options out of range; a light that vsh_light_check()
 * refuses, with its number; an exact method without triangles), VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_query_create(const vsh_occluders *occluders, const vsh_light *lights,
                                    size_t light_count, const vsh_shade_options *options, vsh_query **query,
                                    vsh_error *error);
VSH_API void vsh_query_free(vsh_query *query); /* NULL does nothing */

/* Arrays for the values, in the points' order; NULL arrays cost nothing. Values are those of
 * vsh_shade_shadow(), vsh_shade_ao() and vsh_field_sample(). */
typedef struct vsh_query_output {
    size_t struct_size;
    float *const *visibility;   /* [light_count] arrays [count]; each, or all, may be NULL */
    float *const *shadow_error; /* [light_count] arrays [count]: standard errors of the visibilities */
    float *ao;                  /* [count]; needs normals */
    float *ao_error;            /* [count], with `ao` */
    float *distance; /* [count], signed, world units, of the point itself without start offset; NaN if its
                        position is not finite */
    float *gradient; /* [count][3], unit: the direction of growing distance, which is the normal next to a
                        surface and some degrees off beyond the finest band. 0 if the field has none (beyond
                        its reach, at the centre of a sphere); NaN if the position is not finite */
    size_t stride; /* bytes between the values of consecutive points in every array, a multiple of 4, at least
                      4 (with `gradient` 12); 0: packed */
} vsh_query_output;

static inline vsh_query_output vsh_query_output_default(void) {
    vsh_query_output output = {sizeof(vsh_query_output), NULL, NULL, NULL, NULL, NULL, NULL, 0};
    return output;
}

/* Layout of points in the caller's memory, such as an array of structs. Strides are bytes between consecutive
 * points, multiples of the element size (4, for doubles 8), at least one point long; 0: packed. */
typedef struct vsh_point_layout {
    size_t struct_size;
    const float *float_positions; /* [count][3]: replaces points->positions, which must be NULL; equal numbers
                                     give equal bits */
    size_t position_stride;       /* bytes between positions */
    size_t normal_stride;         /* bytes between normals */
    size_t texel_stride;          /* bytes between texels */
    const float *face_normals;    /* [count][3], unit, packed: of the faces, if points->normals are smooth. AO
                                     leaves out directions below the face. NULL: points->normals */
} vsh_point_layout;

static inline vsh_point_layout vsh_point_layout_default(void) {
    vsh_point_layout layout = {sizeof(vsh_point_layout), NULL, 0, 0, 0, NULL};
    return layout;
}

/* Points that are sorted together; see vsh_query_points(). */
enum { VSH_QUERY_BATCH = 1 << 20 };

/* Shades points for every light and AO that the output asks for. `layout` may be NULL. Equal points give
 * equal bits in every layout.
 *
 * Up to 64 points are shaded at once on the calling thread, without allocation, progress or cancelling. More
 * run on run->threads under the stage "query". If many points do not follow each other in space, they are
 * shaded along a space-filling curve (Morton, 1966), VSH_QUERY_BATCH at a time with 16 bytes each, because
 * neighbours share proofs and memory.
 *
 * The other points of a call change no bit of AO, of shadows by rays, or of shadows by one march that ends
 * within max_steps. They change shadows by adaptive and exact, and errors of shadows by rays, within their
 * error. Calls with VSH_QUERY_BATCH points each, with the points' numbers as `texels`, give the bits of one
 * call.
 *
 * Errors (the arrays are then undefined): VSH_ERROR_ARGUMENT (run, a struct_size, a bad stride, positions of
 * both kinds or of neither, errors without their values, AO without normals), VSH_ERROR_LIMIT (occluders
 * and order exceed run->memory_limit), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_query_points(const vsh_query *query, const vsh_points *points,
                                    const vsh_point_layout *layout, const vsh_run *run,
                                    const vsh_query_output *output, vsh_shade_stats *stats, vsh_error *error);

VSH_END_C
