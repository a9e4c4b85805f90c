/* Lightmaps: UVs for meshes that have none, and values for each texel.
 *
 *     vsh_lightmap_options options = vsh_lightmap_options_default();
 *     options.width = options.height = 256;
 *     vsh_charts *charts;
 *     vsh_charts_create(&ground, 1, &options, &run, NULL, &charts, &error);
 *     vsh_light sun = vsh_light_default();
 *     static float shadow[256 * 256], ao[256 * 256];
 *     float *planes[] = {shadow};
 *     vsh_lightmap lightmap = {.shadow = planes, .ao = ao};
 *     vsh_bake_lightmap(occluders, charts, &sun, 1, NULL, &run, &lightmap, NULL, &error);
 *     vsh_charts_free(charts);
 *
 * Texel (column, row) has its centre at u = (column + 1/2) / width, v = 1 - (row + 1/2) / height. It is
 * shaded at the point of the mesh that has these UVs. A receiver shadows itself only if it is among the
 * casters too. Texels that lie inside a caster, such as the floor under a box, have no value of their own:
 * coverage (A in images) is 0 there, and they are filled from their neighbours.
 *
 * vsh_bake_scene() bakes whole files instead. */
#pragma once

#include "light.h"

#include <math.h>

VSH_BEGIN_C

enum { VSH_MAX_PAGES = 1024, VSH_MAX_PAGE_SIZE = 65536 };

/* --- lightmap UVs */

/* The UVs that charts are made of. */
typedef enum vsh_unwrap_uvs {
    VSH_UNWRAP_ALWAYS = 0, /* new ones */
    VSH_UNWRAP_KEEP = 1 /* a mesh's own, if they lie in the unit square, run one way and do not overlap: their
                           connected parts are packed as charts; else new ones */
} vsh_unwrap_uvs;

/* The charts that share a page. */
typedef enum vsh_atlas_sharing {
    VSH_ATLAS_SHARED = 0, /* charts of any mesh */
    /* charts of one object: consecutive meshes with one vsh_mesh.object above 0, or one mesh */
    VSH_ATLAS_OBJECTS = 1
} vsh_atlas_sharing;

/* How meshes are unwrapped. */
typedef struct vsh_unwrap_options {
    size_t struct_size;
    int32_t width;     /* texels of each page, 1 … VSH_MAX_PAGE_SIZE */
    int32_t height;    /* the same */
    int32_t max_pages; /* 1 … VSH_MAX_PAGES; 1 with VSH_ATLAS_OBJECTS, where each object has one */
    /* free texels between charts along rows and columns, 0 … 4096; none at a page's border */
    int32_t padding;
    double texels_per_unit; /* texels along a world unit, ≥ 0; 0: the most at which everything fits into
                               max_pages, to a few hundredths */
    const double *density;  /* [mesh_count] factors of texels_per_unit, > 0; NULL: all 1 */
    double max_stretch;     /* largest L2 stretch of a chart, ≥ 1.01; charts are split until they keep it */
    vsh_unwrap_uvs keep_uvs; /* whether meshes may keep their UVs */
    vsh_atlas_sharing atlas; /* without texels_per_unit each object fills its own page */
    int32_t fit_pages; /* nonzero, with texels_per_unit: `width` × `height` is the largest page. A page gets
                          the smallest powers of two (or the given sizes) that its charts need */
} vsh_unwrap_options;

static inline vsh_unwrap_options vsh_unwrap_options_default(void) {
    vsh_unwrap_options options = {
        sizeof(vsh_unwrap_options), 1024, 1024, 1, 4, 0.0, NULL, 1.3, VSH_UNWRAP_ALWAYS, VSH_ATLAS_SHARED, 0};
    return options;
}

/* The chart of a triangle without one. */
#define VSH_NO_CHART UINT32_MAX

/* A mesh with its new UVs. Arrays belong to the atlas. Triangles and their corners are in the mesh's order,
 * and no vertex is in two charts. */
typedef struct vsh_atlas_mesh {
    const float *uvs; /* [vertex_count][2], 0 … 1 of the chart's page, v up; triangles run anticlockwise */
    const uint32_t *sources; /* [vertex_count]: the vertex of the mesh that each one copies */
    const uint32_t *indices; /* [triangle_count][3], each < vertex_count */
    const uint32_t *charts;  /* [triangle_count]: index into vsh_atlas_charts(). VSH_NO_CHART for a triangle
                                without area, whose corners are at (0, 0) */
    size_t vertex_count;
    size_t triangle_count;
} vsh_atlas_mesh;

/* A chart of an atlas. */
typedef struct vsh_atlas_chart {
    uint32_t page;  /* page that it lies on, from 0 */
    uint32_t mesh;  /* mesh that it was cut from */
    float stretch;  /* L2 stretch: 1 is isometric (Sander and others, "Texture mapping progressive meshes",
                       2001) */
    int32_t min[2]; /* first column and row of its texels, row 0 at v = 0 */
    int32_t max[2]; /* one past the last */
    double area;    /* of its triangles, world units² */
} vsh_atlas_chart;

/* A page of an atlas. */
typedef struct vsh_atlas_page {
    int32_t width; /* texels */
    int32_t height;
    double texels_per_unit; /* of a mesh with density 1 */
    double covered;         /* share of the texels that charts touch, 0 … 1 */
    uint32_t first_mesh;    /* first mesh with a chart on it */
} vsh_atlas_page;

/* Size and quality of an atlas. */
typedef struct vsh_atlas_info {
    uint64_t meshes;         /* as given to vsh_unwrap() */
    uint64_t charts;         /* on all pages */
    uint32_t pages;          /* that have charts */
    int32_t width;           /* of the widest page, texels */
    int32_t height;          /* of the highest page, texels */
    double texels_per_unit;  /* of the page with the fewest */
    double covered;          /* share of the texels of all pages that charts touch, 0 … 1 */
    double stretch;          /* mean over charts by area; 1 if there are none */
    double worst_stretch;    /* of a chart */
    uint64_t flat_triangles; /* triangles without a chart */
    uint64_t kept;           /* meshes that kept their UVs */
    uint64_t shared;         /* meshes that share the layout of an earlier one */
} vsh_atlas_info;

/* New UVs for meshes. Immutable. It does not need its meshes any more. */
typedef struct vsh_atlas vsh_atlas;

/* Cuts meshes into charts along creases, flattens them with little stretch, and packs them by shape. Any
 * triangles will do: edges of many triangles, duplicates, mirrored meshes. The triangles of a quad stay
 * together. Meshes with equal arrays whose transforms differ by rotation, mirroring, translation and uniform
 * scale share a layout, and objects that differ likewise are packed alike. A mesh is spread over pages only
 * if it does not fit one. Values do not depend on threads. Stages: "unwrap", "pack". Free the result with
 * vsh_atlas_free(). Errors:
 * - VSH_ERROR_ARGUMENT: meshes or atlas NULL, no meshes or more than 2^32 - 1, options out of range, run,
 *   and as vsh_mesh_check();
 * - VSH_ERROR_INPUT: as vsh_mesh_check(); no triangle with area;
 * - VSH_ERROR_LIMIT: run->memory_limit; charts that do not fit into max_pages (the message gives a density
 *   that fits); more than 2^32 / 3 triangles in a mesh;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_unwrap(const vsh_mesh *meshes, size_t mesh_count, const vsh_unwrap_options *options,
                              const vsh_run *run, vsh_atlas **atlas, vsh_error *error);
VSH_API void vsh_atlas_free(vsh_atlas *atlas); /* NULL does nothing */

/* Fills *info. Cannot fail. */
VSH_API void vsh_atlas_get_info(const vsh_atlas *atlas, vsh_atlas_info *info);

/* These cannot fail. Return a view of mesh `mesh` (< info.meshes), page `page` (< info.pages), and all charts
 * [info.charts], which belong to the atlas. */
VSH_API vsh_atlas_mesh vsh_atlas_mesh_view(const vsh_atlas *atlas, size_t mesh);
VSH_API vsh_atlas_page vsh_atlas_page_view(const vsh_atlas *atlas, size_t page);
VSH_API const vsh_atlas_chart *vsh_atlas_charts(const vsh_atlas *atlas);

/* Density and stretch of a mesh's UVs; both 0 if it has none, or none with area. */
typedef struct vsh_uvs_measures {
    double texels_per_unit; /* texels along a world unit: the root of the ratio of areas */
    double stretch; /* L2, relative to the mean density: 1 if all triangles have it and are isometric */
} vsh_uvs_measures;

/* Measures UVs in a lightmap of this size, texels. Errors: VSH_ERROR_ARGUMENT (mesh or measures NULL, a size
 * outside 1 … VSH_MAX_PAGE_SIZE, and as vsh_mesh_check()), VSH_ERROR_INPUT (as vsh_mesh_check()). */
VSH_API vsh_result vsh_uvs_measure(const vsh_mesh *mesh, int32_t width, int32_t height,
                                   vsh_uvs_measures *measures, vsh_error *error);

/* --- charts: the triangles of a receiver, sorted into the tiles of its lightmap */

enum { VSH_MAX_LIGHTMAP_SIZE = 65536 };

enum { VSH_PADDING_AUTO = -1 };

/* How a lightmap is made. */
typedef struct vsh_lightmap_options {
    size_t struct_size;
    int32_t width;       /* texels, 1 … VSH_MAX_LIGHTMAP_SIZE */
    int32_t height;      /* the same */
    int32_t supersample; /* N: N × N samples a texel, 1 … 16 */
    /* texels that charts grow by, 0 … 4096; fills values, never coverage. VSH_PADDING_AUTO: 16, and texels
     * farther off get the mean of a mip level, so that no level shows background */
    int32_t padding;
    vsh_shade_options shade; /* for bakes without options of their own */
    int32_t ao_spacing; /* 1, 2, 4 or 8 texels. Above 1, texels share the rays of exact and adaptive AO. At 1,
                           or with supersample above 1, each sample has rays of its own: slower, and not as
                           smooth */
    int32_t tangents;   /* nonzero: keep what bent normals in tangent space need, 16 bytes a sample */
} vsh_lightmap_options;

static inline vsh_lightmap_options vsh_lightmap_options_default(void) {
    vsh_lightmap_options options = {sizeof(vsh_lightmap_options), 1024, 1024, 1, 4,
                                    vsh_shade_options_default(),  4,    0};
    return options;
}

/* Faults of a mesh's UVs. */
typedef struct vsh_uv_report {
    size_t overlap_texels;       /* texels of this mesh that an earlier triangle covers too */
    size_t overlap_triangles;    /* triangles with such texels */
    size_t outside_triangles;    /* triangles that leave the unit square; the part outside is not baked */
    size_t degenerate_triangles; /* triangles with area in the world, but none in UV space */
    size_t other_texels;         /* overlap_texels covered by another object, whose light they would show */
    size_t other_mesh;        /* the mesh that most of them belong to, in the report of the mesh with the most
                                 other_texels; SIZE_MAX in all others */
    size_t other_mesh_texels; /* their number; 0 in all others */
} vsh_uv_report;

/* Charts of a receiver at one size of lightmap. They refer to the meshes and arrays, which must outlive them.
 */
typedef struct vsh_charts vsh_charts;

/* Sorts triangles into tiles of 64 × 64 texels and counts their texels. If triangles overlap, the first in
 * the order of meshes and triangles keeps the texel. Warns about what the reports hold; `uv_reports`
 * [mesh_count] may be NULL. Free the result with vsh_charts_free(). Errors:
 * - VSH_ERROR_ARGUMENT: charts or meshes NULL, no meshes or more than 2^30 - 1, sizes out of range, run, and
 *   as vsh_mesh_check();
 * - VSH_ERROR_INPUT: a mesh without UVs, UVs that are not finite, and as vsh_mesh_check();
 * - VSH_ERROR_LIMIT: run->memory_limit; more than 2^32 - 2 triangles;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_charts_create(const vsh_mesh *meshes, size_t mesh_count,
                                     const vsh_lightmap_options *options, const vsh_run *run,
                                     vsh_uv_report *uv_reports, vsh_charts **charts, vsh_error *error);
VSH_API void vsh_charts_free(vsh_charts *charts); /* NULL does nothing */

/* Size of charts. */
typedef struct vsh_charts_info {
    int32_t width; /* texels */
    int32_t height;
    uint64_t covered;                    /* texels with at least one sample */
    uint64_t samples;                    /* evaluated positions, with supersampling */
    uint64_t bytes;                      /* in memory */
    double bounds_min[3], bounds_max[3]; /* world box of the vertices */
} vsh_charts_info;

/* Fills *info. Cannot fail. */
VSH_API void vsh_charts_get_info(const vsh_charts *charts, vsh_charts_info *info);

/* --- baking */

/* Axes of bent normals. Tangent space: x along growing u of the lightmap's UVs, orthogonal to the normal; z
 * along the normal that decides shadow; y across both, towards growing v (as in OpenGL). Tangents are those
 * of the triangle. */
typedef enum vsh_bent_space { VSH_BENT_NONE = -1, VSH_BENT_WORLD = 0, VSH_BENT_TANGENT = 1 } vsh_bent_space;

/* The upward axis. */
typedef enum vsh_up {
    VSH_UP_NONE = 0,
    VSH_UP_X = 1,
    VSH_UP_Y = 2,
    VSH_UP_Z = 3,
    VSH_UP_MINUS_X = 4,
    VSH_UP_MINUS_Y = 5,
    VSH_UP_MINUS_Z = 6
} vsh_up;

/* Further planes that a scene can ask for. */
typedef struct vsh_planes {
    int32_t invalid; /* nonzero: bake `invalid` */
    vsh_up sky;      /* bake `sky` over this axis; VSH_UP_NONE: do not */
} vsh_planes;

/* A lightmap in the caller's arrays. Planes are [height][width] with row 0 at v = 1. NULL planes are not
 * baked and cost nothing. Texels that neither a chart nor padding reaches are 0. A lightmap can be a part of
 * larger images: planes then point at its first texel in them, and `row_texels` is their width. */
typedef struct vsh_lightmap {
    float *const *shadow; /* [light_count] planes: visible fraction of each light; may be NULL */
    float *ao;            /* open fraction */
    float *irradiance; /* [height][width][3], linear RGB: Σ visibility × colour × falloff × cosine, times AO
                          if it is baked and there is no `ambient`; with `ambient`: plus ambient × AO */
    float *coverage;   /* 1 if the texel was evaluated and is valid, else 0 */
    /* [light_count] planes: standard error left in each value, not padded; may be NULL */
    float *const *shadow_error;
    float *ao_error; /* likewise for AO. If texels share rays, it is the rays' part; vsh_bake_stats.errors
                        measures the rest */
    float *bent;     /* [height][width][3]: bent normals, unit */
    /* [light_count] planes [height][width][3]: tinted visibility, linear RGB; may be NULL */
    float *const *tint;
    vsh_tint tint_by;          /* tint of these planes, and of the visibility in irradiance */
    const double *ambient;     /* [3]: light from all around, linear RGB ≥ 0; NULL: none */
    vsh_bent_space bent_space; /* tangent space needs vsh_lightmap_options.tangents */
    float *invalid;            /* 1 if a chart covers the texel but no sample is valid, else 0. Not padded */
    vsh_planes asked;          /* options of planes, such as the sky's axis */
    float *sky; /* light of an even sky above the horizon of `asked.sky`, 1/π ∫ V(ω) max(0, n · ω)
                   [ω · up > 0] dω, with V 0 behind casters at any distance. Unoccluded it is
                   (1 + n · up) / 2: floors 1, walls 1/2, ceilings 0. By shade.ao_method, which must be
                   rays, adaptive or exact, to (1 + n · up) / 2 × shade.max_error; of layers, those with
                   AO */
    int32_t row_texels; /* from a row of each plane to the next, width … VSH_MAX_LIGHTMAP_SIZE; 0: the width.
                           The bake needs room for a second copy of planes with wider rows */
} vsh_lightmap;

/* The error of a channel, as sums over its values, which can be added. Begins as zeros. */
typedef struct vsh_bake_error {
    double values;       /* valid samples, if the channel's method knows an error; else 0 */
    double square_error; /* estimated squared error of their rays; of the sky before its factor (1 + n · up) /
                            2 */
    double compared;     /* samples compared with the casters, each weighted by the values it stands for */
    double compared_square_error; /* measured squared error of these, from rays and voxels */
    double worst;                 /* largest estimated error of a value */
} vsh_bake_error;

/* The root mean square error: the estimate of the rays, or the measured one if it is larger, so it is usually
 * too large. NaN without values. */
static inline double vsh_bake_error_rmse(const vsh_bake_error *error) {
    const double rays = error->square_error / error->values;
    const double compared = error->compared > 0.0 ? error->compared_square_error / error->compared : 0.0;
    return error->values > 0.0 ? sqrt(rays > compared ? rays : compared) : NAN;
}

/* The part of the measured error that rays do not explain: that of the voxels. NaN if nothing was measured.
 */
static inline double vsh_bake_error_field(const vsh_bake_error *error) {
    const double more = error->compared_square_error / error->compared - error->square_error / error->values;
    return error->values > 0.0 && error->compared > 0.0 ? sqrt(more > 0.0 ? more : 0.0) : NAN;
}

/* Counts and errors of a bake. */
typedef struct vsh_bake_stats {
    size_t struct_size;
    uint64_t texels;           /* covered */
    uint64_t invalid_texels;   /* inside a solid or behind a wall: coverage 0, filled from the nearest valid
                                  texel of the same chart up to 64 texels off, else from the nearest of any
                                  within the padding (at least 8 texels) */
    uint64_t *invalid_by_mesh; /* [mesh_count]; NULL: not counted */
    vsh_shade_stats shade;     /* added to */
    /* [light_count + 1], with a sky plane [light_count + 2]: of each light, AO and the sky; added to; NULL:
     * not measured. If the method knows an error and the occluders keep all casters, some samples (1 in 16,
     * 4096 to 16384; for exact methods 1 in 64, 1024 to 4096) are compared with rays against the casters. The
     * choice depends on the lightmap alone */
    vsh_bake_error *errors;
} vsh_bake_stats;

static inline vsh_bake_stats vsh_bake_stats_zero(void) {
    vsh_bake_stats stats = {sizeof(vsh_bake_stats), 0, 0, NULL, vsh_shade_stats_zero(), NULL};
    return stats;
}

/* Shades the charts' texels and fills the lightmap's planes. NULL options are those of vsh_charts_create().
 * Rays start start_offset + surface_offset above the surface (at least a voxel in creases), and on sheets
 * half the field's shell_thickness farther. Errors (the planes are then undefined):
 * - VSH_ERROR_ARGUMENT: occluders, charts or lightmap NULL, lights NULL with a count above 0, options or
 *   row_texels out of range, run, and as vsh_light_check();
 * - VSH_ERROR_LIMIT: run->memory_limit, for occluders, charts and the bake;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_bake_lightmap(const vsh_occluders *occluders, const vsh_charts *charts,
                                     const vsh_light *lights, size_t light_count,
                                     const vsh_shade_options *options, const vsh_run *run,
                                     const vsh_lightmap *lightmap, vsh_bake_stats *stats, vsh_error *error);

/* --- seams: edges of charts that look different on their two sides */

/* Whether seams are fixed. */
typedef enum vsh_seams {
    VSH_SEAMS_DEFAULT = 0, /* FIX for outputs that are assets (vsh_lit_is_output()), else KEEP */
    VSH_SEAMS_KEEP = 1,    /* keep the baked values */
    VSH_SEAMS_FIX = 2      /* vsh_lightmaps_stitch() */
} vsh_seams;

/* How seams are stitched. */
typedef struct vsh_stitch_options {
    size_t struct_size;
    double max_change; /* largest change of a value, 0 … 1 (0.02): its standard error. For irradiance it is
                          relative to the largest value read at the same seams nearby */
    double max_angle;  /* degrees, 0 … 180 (5): edges whose normals differ by more are creases, and stay */
    double keep; /* cost of changing a value, 1e-6 … 1 (0.01): weight of a squared change against a squared
                    difference at a place on a seam */
} vsh_stitch_options;

static inline vsh_stitch_options vsh_stitch_options_default(void) {
    vsh_stitch_options options = {sizeof(vsh_stitch_options), 0.02, 5.0, 0.01};
    return options;
}

/* Result of stitching. */
typedef struct vsh_stitch_report {
    uint64_t seams;   /* smooth edges that two charts share, or one chart twice */
    uint64_t places;  /* stitched places on them, half a texel apart */
    uint64_t crowded; /* places left out because a lookup there reads a third chart */
    uint64_t texels;  /* read at these places */
    double before; /* root mean square difference across the seams, of all channels; for irradiance relative
                      to its largest value */
    double after;  /* the same after stitching */
} vsh_stitch_report;

/* A lightmap among several that are stitched together. */
typedef struct vsh_stitch_page {
    const vsh_charts *charts;     /* charts that the lightmap was baked for */
    const vsh_lightmap *lightmap; /* a whole lightmap, not a part */
} vsh_stitch_page;

/* Makes bilinear lookups agree on both sides of seams, within and between whole lightmaps with the same
 * planes, by least squares over the texels read (Iwanicki, "Lighting technology of The Last of Us", 2013).
 * Edges match if their ends are equal in the world. Texels with coverage 0 move freely, others by at most
 * max_change, and none leaves its range (0 … 1, irradiance ≥ 0). Shadow, AO, irradiance, tint and sky change;
 * errors, `invalid`, coverage and bent normals do not. Values that are not finite stay. Planes should have a
 * padding of 2 or more. `report` may be NULL. Errors (planes are unchanged unless cancelled):
 * - VSH_ERROR_ARGUMENT: charts or lightmap NULL, options or row_texels out of range, run;
 * - VSH_ERROR_LIMIT: run->memory_limit; 2^32 / 3 triangles; 2^32 places;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_lightmaps_stitch(const vsh_stitch_page *pages, size_t page_count, size_t light_count,
                                        const vsh_stitch_options *options, const vsh_run *run,
                                        vsh_stitch_report *report, vsh_error *error);

/* Fills hidden charts, such as faces that touch each other: texels without a valid texel in their chart get
 * the value of the nearest such border in the world. Also fills the empty texels around them, up to 4 or the
 * padding. Bent normals in tangent space stay. *filled (may be NULL) is the number of texels. Errors:
 * - VSH_ERROR_ARGUMENT: charts, lightmap or its coverage NULL; row_texels out of range; run;
 * - VSH_ERROR_LIMIT: run->memory_limit; 2^32 texels;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED (nothing has changed). */
VSH_API vsh_result vsh_lightmap_fill_hidden(const vsh_charts *charts, const vsh_lightmap *lightmap,
                                            size_t light_count, const vsh_run *run, uint64_t *filled,
                                            vsh_error *error);

VSH_END_C
