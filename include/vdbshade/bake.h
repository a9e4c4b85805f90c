/* Lightmaps: the texels of a receiver's charts, shaded. */
#ifndef VDBSHADE_BAKE_H
#define VDBSHADE_BAKE_H

#include "mesh.h"
#include "shade.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { VSH_MAX_LIGHTMAP_SIZE = 65536 };

enum { VSH_PADDING_AUTO = -1 };

/* How a lightmap is made. */
typedef struct vsh_lightmap_options {
    size_t struct_size;
    int32_t width;           /* texels, 1 … VSH_MAX_LIGHTMAP_SIZE */
    int32_t height;          /* the same */
    int32_t supersample;     /* N: N × N samples a texel, 1 … 16 */
    int32_t padding;         /* texels that charts are grown by, 0 … 4096; fills values, never coverage.
                              * VSH_PADDING_AUTO: by 16, and all that is farther takes the mean of what a mip
                              * level holds around it, so that no level reads background */
    vsh_shade_options shade; /* of a bake that is given none; checked there */
    int32_t ao_spacing; /* 1, 2, 4 or 8 texels. Above 1, texels share the rays of AO by exact and adaptive,
                         * and those between may send none. 1, and with supersampling: each has its own */
    int32_t tangents;   /* nonzero: keep what bent normals in tangent space need, 16 bytes a sample */
} vsh_lightmap_options;

static inline vsh_lightmap_options vsh_lightmap_options_default(void) {
    vsh_lightmap_options options = {sizeof(vsh_lightmap_options), 1024, 1024, 1, 4,
                                    vsh_shade_options_default(),  4,    0};
    return options;
}

/* What is wrong with a receiver's UVs, mesh by mesh. */
typedef struct vsh_uv_report {
    size_t overlap_texels;       /* texels that this mesh covers and an earlier triangle covers too */
    size_t overlap_triangles;    /* triangles of this mesh that have such texels */
    size_t outside_triangles;    /* triangles that leave the unit square; what lies outside is not baked */
    size_t degenerate_triangles; /* triangles without area in UV space, but with area in the world */
    size_t other_texels; /* of overlap_texels, those that a mesh of another object (vsh_mesh.object) covers:
                            they take light from one object and show it on another */
    size_t other_mesh;   /* in the report of the mesh with the most other_texels: the mesh that most of them
                            belong to; SIZE_MAX in all others */
    size_t other_mesh_texels; /* how many of them do; 0 in all others */
} vsh_uv_report;

/* Charts that lie closer to each other than a texel: what is read between texels takes from both. */
typedef struct vsh_closeness {
    uint64_t texels;      /* that borders so close to another chart's pass */
    uint64_t mesh_texels; /* those of the mesh with the most, */
    size_t mesh;          /* which is this */
    double gap;           /* the least between two charts, texels; 1: none is less */
} vsh_closeness;

/* Measures a receiver's charts at a size; a chart is what hangs together by edges in space and in the UVs.
 * Errors: VSH_ERROR_ARGUMENT (sizes, run), VSH_ERROR_INPUT (no UVs, and as vsh_mesh_check()), VSH_ERROR_LIMIT
 * (run->memory_limit; 2^32 / 3 triangles), VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_charts_closeness(const vsh_mesh *meshes, size_t mesh_count, int32_t width,
                                        int32_t height, const vsh_run *run, vsh_closeness *found,
                                        vsh_error *error);

/* The charts of a receiver at one size of lightmap: its triangles, checked, sorted into tiles of 64 × 64
 * texels and counted. They refer to the meshes and to the arrays behind them, which must outlive them. */
typedef struct vsh_charts vsh_charts;

/* Sorts the meshes' UVs and counts their texels, with a warning for what the reports hold. `uv_reports`
 * [mesh_count] may be NULL and is filled on success. Where triangles overlap, the first in the order of
 * meshes and triangles keeps the texel. Free the result with vsh_charts_free(). Errors:
 * - VSH_ERROR_ARGUMENT: charts or meshes NULL, no meshes or more than 2^30 - 1, sizes out of range, run, and
 *   as vsh_mesh_check();
 * - VSH_ERROR_INPUT: a mesh without UVs, UVs that are not finite, and as vsh_mesh_check();
 * - VSH_ERROR_LIMIT: run->memory_limit; more than 2^32 - 2 triangles;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_charts_create(const vsh_mesh *meshes, size_t mesh_count,
                                     const vsh_lightmap_options *options, const vsh_run *run,
                                     vsh_uv_report *uv_reports, vsh_charts **charts, vsh_error *error);
VSH_API void vsh_charts_free(vsh_charts *charts); /* NULL does nothing */

/* What charts come to. */
typedef struct vsh_charts_info {
    int32_t width; /* texels */
    int32_t height;
    uint64_t covered;                    /* texels with at least one sample */
    uint64_t samples;                    /* evaluated positions, supersampling counted */
    uint64_t bytes;                      /* in memory */
    double bounds_min[3], bounds_max[3]; /* world box of the meshes' vertices, for vsh_scene_reach() */
} vsh_charts_info;

/* Cannot fail. */
VSH_API void vsh_charts_get_info(const vsh_charts *charts, vsh_charts_info *info);

/* The samples of all texels. The charts are not needed any more. */
typedef struct vsh_texels vsh_texels;

/* Rasterizes the charts. Free the result with vsh_texels_free(). Errors: VSH_ERROR_ARGUMENT (texels or charts
 * NULL, run), VSH_ERROR_LIMIT (run->memory_limit), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_texels_create(const vsh_charts *charts, const vsh_run *run, vsh_texels **texels,
                                     vsh_error *error);
VSH_API void vsh_texels_free(vsh_texels *texels); /* NULL does nothing */

/* The samples behind a lightmap, tile by tile. A view into the texels. Positions are
 * lifted off coarse triangles towards the smooth surface (Hanika, "Hacking the shadow terminator", 2021).
 * Shadow rays begin there where the light grazes the triangle. They begin on the triangle where the light
 * stands well above it, and in between near other triangles. Rays of AO begin on the triangle. */
typedef struct vsh_texel_samples {
    size_t count;            /* samples */
    const double *positions; /* [count][3], world units */
    const float *normals;    /* [count][3], unit, decide shadow: smooth where the mesh is, or geometric */
    const float *geometric_normals; /* [count][3], unit */
    const uint32_t *texels;         /* [count], each vsh_texel() */
} vsh_texel_samples;

/* Cannot fail; the arrays belong to the texels. */
VSH_API vsh_texel_samples vsh_texels_samples(const vsh_texels *texels);

/* What the axes of bent normals are. Tangent space: x along growing u of the lightmap's UVs, orthogonal to
 * the normal; z along the normal that decides shadow; y across both, towards growing v (as in OpenGL).
 * Tangents are those of the triangle. */
enum { VSH_BENT_WORLD = 0, VSH_BENT_TANGENT = 1 };

/* Which way is up. */
enum {
    VSH_UP_NONE = 0,
    VSH_UP_X = 1,
    VSH_UP_Y = 2,
    VSH_UP_Z = 3,
    VSH_UP_MINUS_X = 4,
    VSH_UP_MINUS_Y = 5,
    VSH_UP_MINUS_Z = 6
};

/* Planes that a scene asks for beside those of its lights and AO: 0 not, else how. */
typedef struct vsh_planes {
    int32_t invalid; /* nonzero: where texels are invalid */
    int32_t sky;     /* the sky that is seen, of a sky that is up: VSH_UP_… */
} vsh_planes;

/* How many of them are shaded by themselves, as AO is. Cannot fail. */
VSH_API int32_t vsh_planes_shaded(const vsh_planes *planes);

/* A lightmap in the caller's arrays; each plane is [height][width] with row 0 at v = 1. NULL planes are not
 * baked and cost nothing. Texels that neither a chart covers nor padding reaches are 0. */
typedef struct vsh_lightmap {
    float *const *shadow; /* [light_count] planes: visible fraction of each light; may be NULL */
    float *ao;            /* open fraction */
    float *irradiance; /* [height][width][3], linear RGB: Σ visibility × colour × falloff × cosine, × AO where
                          baked; or with `ambient` + ambient × AO */
    float *coverage;            /* 1: evaluated and valid; 0 elsewhere */
    float *const *shadow_error; /* [light_count] planes: standard error left in each value, see
                                   vsh_shade_shadow(); not padded; may be NULL */
    float *ao_error; /* the same of AO. Of exact AO whose rays texels share it is the rays' part: what bends
                        within a texel or two can be half as much again, and is in vsh_bake_stats.errors */
    float *bent;     /* [height][width][3]: bent normals, unit, see vsh_shade_ao() */
    float *const *tint; /* [light_count] planes [height][width][3]: visibility as tint_by colours it, linear
                           RGB; may be NULL */
    vsh_tint tint_by;   /* of these planes, and of the visibility in irradiance */
    const double *ambient; /* [3]: of irradiance: light from all around, linear RGB ≥ 0; NULL: none, and AO
                              darkens all light */
    int32_t bent_space;    /* VSH_BENT_…; in tangent space the charts need vsh_lightmap_options.tangents */
    float *invalid;        /* 1: a chart covers the texel, but no sample is valid; 0 elsewhere. Not padded */
    vsh_planes asked;      /* options of planes, such as the axis of the sky */
    float *sky; /* what of the light of an even sky, over the horizon of `asked.sky`, comes straight to the
                   texel: 1/π ∫ V(ω) max(0, n · ω) [ω · up > 0] dω. V is 0 where a caster is in the way,
                   however far, else 1. 1: all that a surface may see, an open floor; an open wall has 1/2, an
                   open ceiling 0: (1 + n · up) / 2 where nothing is in the way. By shade.ao_method, which is
                   rays, adaptive or exact, to (1 + n · up) / 2 × shade.max_error; of layers, those that take
                   part in AO */
} vsh_lightmap;

/* What is known of a channel's error, in sums over its values, which add up. Begins as zeros. */
typedef struct vsh_bake_error {
    double values;       /* valid samples, where the channel's method keeps an error; else 0 */
    double square_error; /* over them: the squared error that rays leave, as the method estimates it; of the
                            sky before it is weighed by (1 + n · up) / 2, which makes it less */
    double held;         /* values that stand for the samples that were held against the casters themselves */
    double held_square_error; /* over them: the squared error, of whatever cause: rays or voxels */
    double worst;             /* the largest error that rays leave in a value, as the method estimates it */
} vsh_bake_error;

/* The root mean square error that is estimated: what rays leave, or what was found against the casters where
 * that is more. NaN where there are no values. */
VSH_API double vsh_bake_error_rmse(const vsh_bake_error *error);

/* What of it rays don't account for, root mean square: the field's own, as its voxels differ from the
 * casters. NaN where nothing was held against them. */
VSH_API double vsh_bake_error_field(const vsh_bake_error *error);

/* What a bake did, and how far it is from the truth where that was asked for. */
typedef struct vsh_bake_stats {
    size_t struct_size;
    uint64_t texels;           /* covered */
    uint64_t invalid_texels;   /* inside a solid or behind a wall: coverage 0, filled from the nearest valid
                                  texel of its chart (texels of the same mesh that touch) up to 64 texels off
                                  along the chart; where there is none, from the nearest of any within the
                                  padding, or 8 texels where that is more */
    uint64_t *invalid_by_mesh; /* [mesh_count] of the texels, filled where not NULL */
    vsh_shade_stats shade;     /* added to */
    vsh_bake_error *errors;    /* [light_count + 1], and with a plane of the sky [light_count + 2]: of each
                                  light, of AO, of the sky; added to; NULL: not wanted.
                                  Where a method keeps an error and the occluders have what stands for the
                                  truth (vsh_occluder_parts), a part of its samples (one in 16, 4096 to 16384
                                  of a lightmap; of exact methods one in 64, 1024 to 4096) is held against
                                  rays to that. Which part, and so what is found, depends on nothing but the
                                  lightmap */
} vsh_bake_stats;

static inline vsh_bake_stats vsh_bake_stats_zero(void) {
    vsh_bake_stats stats = {sizeof(vsh_bake_stats), 0, 0, NULL, vsh_shade_stats_zero(), NULL};
    return stats;
}

/* Shades the charts' texels and fills the lightmap's planes. NULL options are those given to
 * vsh_charts_create().
 * Rays begin start_offset + surface_offset above the surface (a voxel at least in creases), for sheets
 * half of the field's shell_thickness farther. `lights` may be NULL where light_count is 0; `stats` is
 * filled on success. Errors (planes then hold nothing of use):
 * - VSH_ERROR_ARGUMENT: occluders, charts, lightmap or lights NULL, options out of range, run, and as
 *   vsh_light_check();
 * - VSH_ERROR_LIMIT: run->memory_limit, for occluders, charts and what the bake itself takes;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_bake_lightmap(const vsh_occluders *occluders, const vsh_charts *charts,
                                     const vsh_light *lights, size_t light_count,
                                     const vsh_shade_options *options, const vsh_run *run,
                                     const vsh_lightmap *lightmap, vsh_bake_stats *stats, vsh_error *error);

/* --- seams */

/* What is done about them. */
enum {
    VSH_SEAMS_DEFAULT = 0, /* FIX where the output is an asset (vsh_lit_is_output()), else KEEP */
    VSH_SEAMS_KEEP = 1,    /* values are what was baked */
    VSH_SEAMS_FIX = 2      /* vsh_lightmap_stitch() */
};

/* How seams are stitched. */
typedef struct vsh_stitch_options {
    size_t struct_size;
    double max_change; /* how far a value may be moved, 0 … 1 (0.02): the standard error that it was baked to
                          (vsh_shade_options.max_error). Of irradiance in parts of the largest value that is
                          read at the same seams near it */
    double max_angle;  /* degrees, 0 … 180 (5): surfaces whose normals differ by more at an edge are creased
                          there, and left */
    double keep; /* what moving a value costs, 1e-6 … 1 (0.01): the square of a change against that of the
                    difference at a place on a seam, two of which there are for a texel of its length */
} vsh_stitch_options;

static inline vsh_stitch_options vsh_stitch_options_default(void) {
    vsh_stitch_options options = {sizeof(vsh_stitch_options), 0.02, 5.0, 0.01};
    return options;
}

/* What was stitched. */
typedef struct vsh_stitch_report {
    uint64_t seams;   /* edges that two charts share, or a chart with itself, where the surface is smooth */
    uint64_t places;  /* on them, half a texel apart, where both sides were made to agree */
    uint64_t crowded; /* that were left out: a lookup there reads a third chart */
    uint64_t texels;  /* read at these places */
    double before;    /* root mean square difference across, of all channels; of irradiance in parts of its */
    double after;     /* largest value */
} vsh_stitch_report;

/* Makes the values on both sides of charts' borders agree as bilinear lookups give them, by least squares
 * over the texels that they read (Iwanicki, "Lighting technology of The Last of Us", 2013): of a whole
 * lightmap that was baked of these charts. Edges count whose ends are equal in the world, whichever meshes
 * they are of. Texels where coverage is 0 (padding, invalid ones) are guesses and move as far as values go;
 * all others at most max_change, and none out of its range: 0 … 1, irradiance ≥ 0. Shadow, AO, irradiance,
 * tint and sky are moved; errors, `invalid` and coverage are not, nor bent normals, which are directions: in
 * tangent space no chart's are like another's. Planes should have a padding of 2 texels at least. `report`
 * may be NULL. The planes are not to be changed meanwhile. What is not finite is left, and all that is read
 * with it. Errors (but for VSH_ERROR_CANCELLED, planes are then as they were):
 * - VSH_ERROR_ARGUMENT: charts, lightmap NULL, options out of range, run;
 * - VSH_ERROR_LIMIT: run->memory_limit, beside the charts and the planes; 2^32 / 3 triangles; 2^32 places;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_lightmap_stitch(const vsh_charts *charts, const vsh_lightmap *lightmap,
                                       size_t light_count, const vsh_stitch_options *options,
                                       const vsh_run *run, vsh_stitch_report *report, vsh_error *error);

/* A lightmap among several that are stitched together. */
typedef struct vsh_stitch_page {
    const vsh_charts *charts;     /* of the lightmap */
    const vsh_lightmap *lightmap; /* that is stitched, whole */
} vsh_stitch_page;

/* The same of several lightmaps of any sizes that have the same planes, such as pages of one atlas: borders
 * between them, too. Nothing is done where there are none. Errors: as there. */
VSH_API vsh_result vsh_lightmaps_stitch(const vsh_stitch_page *pages, size_t page_count, size_t light_count,
                                        const vsh_stitch_options *options, const vsh_run *run,
                                        vsh_stitch_report *report, vsh_error *error);

/* Gives a whole lightmap's texels that are not valid and that no valid one of their chart filled, as those of
 * faces that touch each other, the values of the texel that is nearest in the world, of the valid ones beside
 * such that are not; and what is empty around them, up to 4 texels or the padding. Bent normals in tangent
 * space are left. `charts` are those that the lightmap was baked of. *filled (may be NULL) is how many there
 * are. Errors:
 * - VSH_ERROR_ARGUMENT: charts, lightmap or its coverage NULL; run;
 * - VSH_ERROR_LIMIT: run->memory_limit, beside charts and planes; 2^32 texels;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED (nothing has changed then). */
VSH_API vsh_result vsh_lightmap_fill_hidden(const vsh_charts *charts, const vsh_lightmap *lightmap,
                                            size_t light_count, const vsh_run *run, uint64_t *filled,
                                            vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
