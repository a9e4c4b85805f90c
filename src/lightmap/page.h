/* A lightmap under way: its planes, the results of its tiles, and the passes over the whole page. */
#pragma once

#include "lightmap/padding.h"
#include "lightmap/texels.h"
#include "shade/ao.h"
#include "shapes/heights.h"
#include "shapes/spheres.h"

#include <vdbshade/lightmap.h>

/* --- the valid samples of a tile, and where their rays begin (origins.c) */

/* A field that samples are tested in. */
typedef struct vshi_probed_field {
    const vsh_field *field;
    double probe;                    /* world units: height above the surface where a sample is tested */
    double shell;                    /* world units: more height for open meshes */
    const vshi_triangles *triangles; /* its casters', if rays are traced against them; else NULL */
    bool marched; /* the field itself is tested: methods march it, or there are no triangles */
} vshi_probed_field;

/* Decides which samples are valid, by the same rules for all tiles of a bake. */
typedef struct vshi_placement {
    double offset; /* height of the rays' origins above the surface, world units */
    size_t field_count;
    vshi_probed_field fields[1 + VSHI_MAX_LAYERS]; /* the occluders' field, then the layers' fields */
    size_t solid_count;
    const vshi_heights *heights[VSHI_MAX_LAYERS]; /* layers without a field have one of these two */
    const vshi_spheres *spheres[VSHI_MAX_LAYERS];
    const vshi_kernel *kernel;
} vshi_placement;

/* `lights`, `ao`: whether these are baked. */
vshi_placement vshi_placement_open(const vsh_occluders *occluders, const vsh_shade_options *options,
                                   bool lights, bool ao, int32_t isa);

/* The valid samples of a tile in their order, then the samples around the tile. */
typedef struct vshi_origins {
    size_t count;     /* valid samples */
    size_t frame;     /* samples around the tile, which are not validated */
    uint32_t *sample; /* [count + frame]: number of the sample */
    double *position; /* [..][3]: start offset above the triangle, where marches begin; world units */
    double *start;    /* [..][3]: where the current channel's rays begin, see vshi_origins_lift() */
    float *normal;    /* [..][3]: smooth; decides shadow */
    float *face;      /* [..][3]: of the triangle */
    uint32_t *texel;  /* [..]: as vsh_points.texels; further samples of a texel get other numbers */
    uint8_t *valid;   /* [samples] */
    uint8_t *crease;  /* [samples]: 0, or 1 + the field in whose crease a sample lies, the field with the
                         highest probe */
} vshi_origins;

/* Allocates origins. Free them even after an error. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_origins_allocate(vshi_origins *origins, size_t room, vsh_error *error);
void vshi_origins_free(vshi_origins *origins);

/* Bytes of one sample. */
enum { VSHI_ORIGIN_BYTES = 6 * sizeof(double) + 6 * sizeof(float) + 2 * sizeof(uint32_t) + 2 };

/* Lifts each sample along its geometric normal by the start offset, and by half a shell's thickness if its
 * mesh is open. A sample is invalid inside a solid or behind a wall of the casters. Rays against triangles
 * decide, if there are any (vshi_inside()). A marched field also makes samples inside its solid, or almost
 * inside, invalid. Layers count too. */
void vshi_origins_find(const vshi_placement *placement, const vshi_samples *samples, vshi_origins *origins);

/* Adds the samples from `first` on as the frame. */
void vshi_origins_add_frame(const vshi_placement *placement, const vshi_samples *samples, size_t first,
                            vshi_origins *origins);

/* The sample's position on its triangle. */
static inline vshi_vec vshi_sample_foot(const vshi_samples *samples, size_t i) {
    return vshi_sub(vshi_vec_of(samples->position + 3 * i), vshi_vec_off(samples->lift + 3 * i));
}

static inline vshi_lift_point vshi_sample_lift_point(const vshi_samples *samples, size_t i) {
    return (vshi_lift_point){vshi_sample_foot(samples, i), vshi_vec_off(samples->lift + 3 * i),
                             vshi_vec_off(samples->geometric + 3 * i), vshi_vec_off(samples->normal + 3 * i)};
}

/* Sets origins->start, where the rays to a light begin: on the triangles if `traced`, else at
 * origins->position; plus the lift. */
void vshi_origins_lift(const vshi_lifter *lifter, const vshi_samples *samples, bool traced,
                       vshi_origins *origins);

/* --- pages (page.c) */

/* Rays to the casters from a texel whose value is not known yet. */
typedef struct vshi_compared_texel {
    uint32_t texel; /* vsh_texel() */
    uint32_t weight;
    uint16_t free[2]; /* free rays of each of two sets */
    int16_t even;     /* VSHI_TRUTH_… */
    int16_t zero;     /* padding: parts of bakes store the struct as it is */
} vshi_compared_texel;

/* Texels of a tile to compare with the casters once their values are known. */
typedef struct vshi_compared_texels {
    vshi_compared_texel *list; /* [count], or NULL */
    size_t count;
} vshi_compared_texels;

/* Results of the AO or sky rays that texels share. */
typedef struct vshi_shots {
    vshi_ao_values own; /* [height][width]: of a texel's own rays, without deviations; `ao` NULL: nothing is
                         * shared */
    int32_t *rays;      /* [height][width] */
    uint8_t *level;     /* [height][width]: vshi_ao_share's; 0: there is no valid texel */
    vshi_compared_texels *compared; /* [tiles] */
} vshi_shots;

typedef struct vshi_page {
    const vsh_charts *charts;
    vsh_lightmap lightmap; /* its rows follow each other */
    size_t light_count;
    vsh_shade_options shade; /* resolved */
    vshi_store *store;
    size_t width, height;
    uint8_t *state;  /* [height][width]: VSHI_TEXEL_… */
    uint32_t *mesh;  /* [height][width]: of a texel's first sample, + 1; 0: none */
    float *position; /* [height][width][3]: of texels that share AO, from charts->centre */
    float *normal;   /* [height][width][3]: of texels that share AO */
    float *tangent;  /* [height][width][4]: of texels that share AO; NULL: not wanted */
    vshi_shots ao, sky;
    vsh_shade_stats *stats; /* [tiles] */
    vsh_bake_error *errors; /* [tiles][error_count]: of lights, AO, the sky */
    size_t error_count;
} vshi_page;

/* Allocates a page with these planes, zeroed. `shared`: texels share rays of AO. Close it even after an
 * error, before the store, which holds its arrays. Errors: as vshi_store_take(). */
vsh_result vshi_page_open(const vsh_charts *charts, const vsh_lightmap *lightmap, size_t light_count,
                          const vsh_shade_options *shade, bool shared, vshi_store *store, vshi_page *page,
                          vsh_error *error);
void vshi_page_close(vshi_page *page);

/* Allocates arrays in a page's store. Errors: as vshi_store_take(). */
vsh_result vshi_page_take(const vshi_page *page, const vshi_array *arrays, size_t count, const char *what,
                          vsh_error *error);

/* Frees the arrays that only vshi_page_finish() needs. */
void vshi_page_close_shots(vshi_page *page);

/* The most bytes of a page: its planes and the memory for baking them. */
double vshi_lightmap_bytes(const vsh_charts *charts, const vsh_lightmap *planes, size_t light_count,
                           bool shared);

/* Whether texels share rays of AO: with methods that keep an error, unless layers take part. */
bool vshi_ao_is_shared(const vsh_shade_options *shade, int32_t spacing, bool layered_ao);

static inline size_t vshi_page_texels(const vshi_page *page) {
    return page->width * page->height;
}

/* The place of a sample's texel in the page. */
static inline size_t vshi_page_place(const vshi_page *page, uint32_t texel) {
    return vsh_texel_place(texel, (int32_t)page->width);
}

/* Stores the place, normal and tangent of a sample for its texel. */
void vshi_page_note(vshi_page *page, const vshi_samples *samples, size_t i);

/* Rasterizes a tile that another process traced, for the finish: meshes, and for shared AO places and
 * normals. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_page_rasterize(vshi_page *page, size_t tile, vsh_error *error);

/* Finishes a page whose tiles are all traced: estimates shared AO, adds up irradiance, fills invalid texels,
 * pads. Adds to *stats. Errors: as vshi_store_take(); VSH_ERROR_CANCELLED. */
vsh_result vshi_page_finish(vshi_page *page, const vsh_run *run, vsh_bake_stats *stats, vsh_error *error);

/* Checks the lights, and the members of a lightmap, for charts. Errors: VSH_ERROR_ARGUMENT. */
vsh_result vshi_lightmap_check(const vsh_lightmap *lightmap, const vsh_charts *charts,
                               const vsh_light *lights, size_t light_count, vsh_error *error);

/* vsh_lightmap_fill_hidden() with memory of a store. */
vsh_result vshi_lightmap_fill_hidden(const vsh_charts *charts, const vsh_lightmap *lightmap,
                                     size_t light_count, vshi_store *store, const vsh_run *run,
                                     uint64_t *filled, vsh_error *error);

/* Adds the errors of tiles, or of lightmaps. */
void vshi_bake_error_add(vsh_bake_error *sum, const vsh_bake_error *more);

/* --- tracing tiles (bake_tile.c) */

/* Shared by all tiles of a bake. */
typedef struct vshi_tracer vshi_tracer;

/* Prepares the shading of pages with these planes and their options. Only whether a plane is NULL counts. The
 * other arguments must outlive it. Errors: as vsh_bake_lightmap(). */
vsh_result vshi_tracer_create(const vsh_occluders *occluders, const vsh_light *lights, size_t light_count,
                              const vsh_shade_options *shade, const vsh_lightmap *planes, bool compared,
                              const vsh_run *run, vshi_tracer **tracer, vsh_error *error);
void vshi_tracer_free(vshi_tracer *tracer);

/* Whether texels of charts with this spacing share rays. */
bool vshi_tracer_shares(const vshi_tracer *tracer, int32_t spacing);

/* The most bytes of tiles at work on `threads` threads (0: all cores). */
double vshi_trace_bytes(const vsh_charts *charts, int32_t threads);

/* Traces tiles, tiles[count] or (NULL) the first `count`. Each depends only on the scene and its own
 * geometry. `job` counts them. Errors: VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED, VSH_ERROR_INTERNAL. */
vsh_result vshi_trace_tiles(const vshi_tracer *tracer, vshi_page *page, const uint32_t *tiles, size_t count,
                            vshi_job *job, vsh_error *error);

/* --- AO of texels that share rays: their shots, the estimate, and values in planes (ao_estimate.c) */

/* Bytes of a texel for shots of AO, of the sky, and for their estimate. */
double vshi_shots_bytes(const vsh_lightmap *planes, bool ao, bool sky);

/* Allocates page->ao or page->sky. Errors: as vshi_store_take(). */
vsh_result vshi_shots_open(vshi_page *page, vshi_shots *shots, vsh_error *error);
void vshi_shots_close(vshi_page *page, vshi_shots *shots);

/* Lists the arrays of shots by texel, with the bytes of a texel; those not wanted are NULL. */
enum { VSHI_SHOT_ARRAYS = 4 };
void vshi_shots_list(vshi_shots *shots, vshi_array arrays[VSHI_SHOT_ARRAYS]);

/* Stores what origin `k` of a tile shot, and its level. */
void vshi_shots_keep(const vshi_shots *shots, size_t place, size_t k, const vshi_ao_share *share,
                     const vshi_ao_values *values);

/* Estimates all texels with a level, and sets their planes. `index` is the channel's in stats->errors.
 * Errors: as vshi_store_take(); VSH_ERROR_CANCELLED. */
vsh_result vshi_ao_estimate(vshi_page *page, const vshi_shots *shots, size_t index, const vsh_run *run,
                            vsh_bake_stats *stats, vsh_error *error);

/* Turns a mean of open directions, as in vshi_ao_task, into a unit bent normal: in the tangent space of a
 * tangent [4], or (NULL) in world space. */
void vshi_bent_normal(const float *normal, const float *tangent, float *bent);

/* Makes a mean of bent normals a unit vector. */
void vshi_bent_normalize(float *bent);

/* --- vertex colours from the points of a page (vertices.c) */

typedef struct vshi_vertex_colors {
    uint16_t *values; /* [vertices of all meshes][4]: RGBA, linear, 65535 is 1 */
    double *error;    /* [meshes]: RMSE of the interpolated colours at the mesh's points; 0 without points */
} vshi_vertex_colors;

/* Fits the colours of all vertices to the points that are valid by `coverage`, for the least squared error of
 * the interpolated triangles. Vertices with equal positions and normals share a colour. `values` are
 * [texels][channels] (1 or 3), cut to 0 … 1, as colours are. Free both arrays even after an error. Errors:
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_vertex_colors_fit(const vsh_charts *charts, const float *coverage, const float *values,
                                  size_t channels, const vsh_run *run, vshi_vertex_colors *colors,
                                  vsh_error *error);

/* --- errors of values against the casters, measured on some samples (field_error.c) */

/* One channel: a light, or (NULL) AO, or with options->ao_up the sky: the free upper directions, as a share
 * of the whole hemisphere. */
typedef struct vshi_truth_channel {
    vshi_truth truth;
    vshi_lifter lifter;
    vshi_vec up;
    vshi_sampler *sampler;
} vshi_truth_channel;

/* Compares one of every `step` samples in a row, chosen by a hash, with the casters. */
typedef struct vshi_field_error {
    const vsh_occluders *occluders;
    vshi_truth truth; /* without the members of single channels */
    bool traced;      /* all values come from rays to the casters, which also decided validity */
    size_t step;
    vshi_truth_channel *channels; /* [light_count + 2]: lights, AO, the sky; NULL: nothing is compared */
} vshi_field_error;

/* Prepares the comparison for a lightmap with `samples` samples. It has no channels yet. */
vshi_field_error vshi_field_error_open(const vsh_occluders *occluders, const vsh_shade_options *shade,
                                       uint64_t samples, bool traced);

/* Close the channel even after an error. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_truth_channel_open(const vshi_field_error *of, const vsh_light *light,
                                   const vsh_shade_options *options, vshi_truth_channel *channel,
                                   vsh_error *error);
void vshi_truth_channel_close(vshi_truth_channel *channel);

/* A sample of a tile to compare with the casters. */
typedef struct vshi_compared_sample {
    uint32_t sample, origin; /* its number among the samples, among the origins */
    uint32_t weight;         /* number of samples that it represents */
} vshi_compared_sample;

/* Chooses samples of a tile that are valid for the casters too; returns how many. `compared` has room for one
 * of every `step`. */
size_t vshi_field_error_choose(const vshi_field_error *of, const vshi_samples *samples,
                               const vshi_origins *origins, vshi_compared_sample *compared);

/* Adds the errors of a channel's values [origins]. Leaves out origins whose `places` [origins][3] the light
 * does not reach. */
void vshi_field_error_add(const vshi_truth_channel *channel, const vshi_samples *samples,
                          const double *places, const vshi_compared_sample *compared, size_t count,
                          const float *values, vsh_bake_error *sum);

/* Counts the free rays of a channel; returns the number of texels. */
size_t vshi_field_error_count(const vshi_truth_channel *channel, const vshi_samples *samples,
                              const vshi_compared_sample *compared, size_t count,
                              vshi_compared_texel *texels);

/* Adds the error of a texel, once its value is known. */
void vshi_field_error_settle(const vshi_compared_texel *texel, double max_error, float value,
                             vsh_bake_error *sum);
