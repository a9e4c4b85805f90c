/* A lightmap under way: its planes, and what its tiles leave to be finished over the whole page. */
#ifndef VSHI_BAKE_PAGE_H
#define VSHI_BAKE_PAGE_H

#include "bake/field_error.h"
#include "bake/padding.h"
#include "bake/texels.h"
#include "shade/links.h"

#include <vdbshade/bake.h>

/* Texels of a tile to compare with the casters once their values are known. */
typedef struct vshi_held_texels {
    vshi_held_texel *list; /* [count], or NULL */
    size_t count;
} vshi_held_texels;

/* Results of the AO or sky rays that texels share. */
typedef struct vshi_shots {
    float *share;   /* [height][width]: of a texel's own rays that are free; NULL: nothing is shared */
    int32_t *rays;  /* [height][width] */
    uint8_t *level; /* [height][width]: vshi_ao_share's; 0: there is no valid texel */
    float *open;    /* [height][width][3]: their bent, as of vshi_ao_task; NULL: not asked for */
    vshi_held_texels *held; /* [tiles] */
} vshi_shots;

typedef struct vshi_page {
    const vsh_charts *charts;
    vsh_lightmap lightmap; /* planes of the caller */
    size_t light_count;
    vsh_shade_options shade; /* resolved */
    uint32_t needs;          /* VSHI_NEEDS_… */
    vshi_store *store;
    size_t width, height;
    uint8_t *state;  /* [height][width]: VSHI_TEXEL_… */
    uint32_t *mesh;  /* [height][width]: of a texel's first sample, + 1; 0: none */
    float *position; /* [height][width][3]: of texels that share AO, from charts->centre */
    float *normal;   /* [height][width][3]: of the same */
    float *tangent;  /* [height][width][4]: of the same; NULL: not asked for */
    vshi_shots ao, sky;
    vsh_shade_stats *stats; /* [tiles] */
    vsh_bake_error *errors; /* [tiles][error_count]: of lights, AO, the sky */
    size_t error_count;
} vshi_page;

/* Takes the memory of a page with these planes, zeroed. `shared`: texels share rays of AO. Close it also
 * after an error. Errors: as vshi_store_take(). */
vsh_result vshi_page_open(const vsh_charts *charts, const vsh_lightmap *lightmap, size_t light_count,
                          const vsh_shade_options *shade, bool shared, vshi_store *store, vshi_page *page,
                          vsh_error *error);
void vshi_page_close(vshi_page *page);

/* The most bytes of a page: its planes and the memory for baking them. */
double vshi_lightmap_bytes(const vsh_charts *charts, const vsh_lightmap *planes, size_t light_count,
                           bool shared);

/* Gives back what only finishing needs. */
void vshi_page_close_shots(vshi_page *page);

/* Whether texels share rays of AO: those of methods with an error to keep do, unless layers take part. */
bool vshi_ao_is_shared(const vsh_shade_options *shade, int32_t spacing, bool layered_ao);

/* Texels of the page; of the samples' texel the place among them. */
static inline size_t vshi_page_texels(const vshi_page *page) {
    return page->width * page->height;
}

static inline size_t vshi_page_place(const vshi_page *page, uint32_t texel) {
    return vsh_texel_place(texel, (int32_t)page->width);
}

/* Notes where the texel of a sample is, which way it faces, and its tangent. */
void vshi_page_note(vshi_page *page, const vshi_samples *samples, size_t i);

/* Rasterizes a tile again for what finishing needs of it: meshes, and where AO is shared, places and normals.
 * For pages whose tiles another process traced. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_page_rasterize(vshi_page *page, size_t tile, vsh_error *error);

/* --- tracing tiles */

/* Shared by all tiles of a bake. */
typedef struct vshi_tracer vshi_tracer;

/* Prepares what shades pages with these planes, of which only which are NULL is looked at, and what they are
 * asked to hold. The other arguments must outlive it. Errors: as vsh_bake_lightmap(). */
vsh_result vshi_tracer_create(const vsh_occluders *occluders, const vsh_light *lights, size_t light_count,
                              const vsh_shade_options *shade, const vsh_lightmap *planes, bool held,
                              const vsh_run *run, vshi_tracer **tracer, vsh_error *error);
void vshi_tracer_free(vshi_tracer *tracer);

/* Whether texels of charts with this spacing share rays. */
bool vshi_tracer_shares(const vshi_tracer *tracer, int32_t spacing);

/* Bytes that tiles at work on `threads` threads (0: all cores) take, at most. */
double vshi_trace_bytes(const vsh_charts *charts, int32_t threads);

/* Traces tiles, tiles[count] or (NULL) the first `count`; each depends on the scene and its own geometry
 * alone. `job` counts them. Errors: VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED, VSH_ERROR_INTERNAL. */
vsh_result vshi_trace_tiles(const vshi_tracer *tracer, vshi_page *page, const uint32_t *tiles, size_t count,
                            vshi_job *job, vsh_error *error);

/* --- finishing */

/* Checks planes, tint, ambient light and lights. Errors: VSH_ERROR_ARGUMENT. */
vsh_result vshi_lightmap_check(const vsh_lightmap *lightmap, const vsh_charts *charts,
                               const vsh_light *lights, size_t light_count, vsh_error *error);

/* vsh_lightmap_fill_hidden() with memory of a store. */
vsh_result vshi_lightmap_fill_hidden(const vsh_charts *charts, const vsh_lightmap *lightmap,
                                     size_t light_count, vshi_store *store, const vsh_run *run,
                                     uint64_t *filled, vsh_error *error);

/* Bytes of fields and layers. */
double vshi_occluders_bytes(const vsh_occluders *occluders);

/* Finishes a page whose tiles are all traced: estimates shared AO, puts irradiance together, fills invalid
 * texels, pads. Adds to *stats. Errors: as vshi_store_take(); VSH_ERROR_CANCELLED. */
vsh_result vshi_page_finish(vshi_page *page, const vsh_run *run, vsh_bake_stats *stats, vsh_error *error);

/* Adds the errors of tiles, or of lightmaps. */
void vshi_bake_error_add(vsh_bake_error *sum, const vsh_bake_error *more);

/* Values of AO of texels that share rays: each is the best estimate that its own rays and those of the texels
 * around it allow. */

/* The plane that a window fits at its texel (slopes a texel of the page), and its error. */
typedef struct vshi_ao_plane {
    float slope[2], deviation, curved;
} vshi_ao_plane;

/* Sets values and planes [height][width] of all texels with a level and, unless it is NULL, bent
 * [height][width][3], the mean of their open directions. Adds what is known of them to *stats. Errors:
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_ao_estimate(const vshi_page *page, const vshi_shots *shots, float *values,
                            vshi_ao_plane *planes, float *bent, const vsh_run *run, vsh_shade_stats *stats,
                            vsh_error *error);

/* --- bent normals of samples, from the mean of their open directions */

/* Makes a unit bent normal of a mean of open directions, as of vshi_ao_task; in tangent space where a tangent
 * [4] is given, else (NULL) in world space. */
void vshi_bent_normal(const float *normal, const float *tangent, float *bent);

/* Makes a mean of bent normals one of unit length. */
void vshi_bent_normalize(float *bent);

#endif
