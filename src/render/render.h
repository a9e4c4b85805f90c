/* Pictures: cameras, samples, lit meshes, tiles and the film. */
#ifndef VSHI_RENDER_H
#define VSHI_RENDER_H

#include "base/hash.h"
#include "base/job.h"
#include "base/vec.h"
#include "field/field.h"
#include "shade/lift.h"
#include "trace/sampler.h"

#include <vdbshade/query.h>
#include <vdbshade/render.h>

/* --- cameras as rays */

/* A camera's frame, for pictures of one size. */
typedef struct vshi_view_frame {
    vshi_vec eye;
    vshi_vec forward;     /* unit */
    vshi_vec right, down; /* a pixel's width and height, a unit away */
    double middle[2];     /* of the picture, pixels */
} vshi_view_frame;

vshi_view_frame vshi_camera_frame(const vsh_camera *camera, int32_t width, int32_t height);

/* Direction, not unit but with 1 along the axis, through a place of the picture, pixels from its left top. */
static inline vshi_vec vshi_camera_ray(const vshi_view_frame *frame, double x, double y) {
    return vshi_add(frame->forward, vshi_add(vshi_scale(frame->right, x - frame->middle[0]),
                                             vshi_scale(frame->down, y - frame->middle[1])));
}

/* --- samples: N × N a pixel, one pixel more on each side, which the filter reaches */

typedef struct vshi_sample_grid {
    vshi_view_frame frame;
    int32_t width, height; /* of the picture, pixels */
    int32_t samples;       /* N */
    int32_t columns, rows;
} vshi_sample_grid;

static inline vshi_sample_grid vshi_sample_grid_of(const vsh_render_options *o) {
    return (vshi_sample_grid){.frame = vshi_camera_frame(&o->camera, o->width, o->height),
                              .width = o->width,
                              .height = o->height,
                              .samples = o->samples,
                              .columns = (o->width + 2) * o->samples,
                              .rows = (o->height + 2) * o->samples};
}

/* Ray through a sample's place in its cell: anywhere, or for one sample a pixel its middle. 1 along the
 * camera's axis, so that its parameter is the depth. */
static inline vshi_vec vshi_sample_ray(const vshi_sample_grid *grid, int32_t column, int32_t row) {
    double x = 0.5, y = 0.5;
    if (grid->samples > 1) {
        const uint64_t bits = vshi_mix(((uint64_t)(uint32_t)row << 32 | (uint32_t)column) + 1);
        x = (double)(bits >> 32) * 0x1p-32;
        y = (double)(uint32_t)bits * 0x1p-32;
    }
    return vshi_camera_ray(&grid->frame, (column + x) / grid->samples - 1.0, (row + y) / grid->samples - 1.0);
}

/* The part of a ray within a box: cuts *begin and *end. False where there is none. */
static inline bool vshi_clip(vshi_vec origin, vshi_vec direction, vshi_vec low, vshi_vec high, double *begin,
                             double *end) {
    const double o[3] = {origin.x, origin.y, origin.z}, d[3] = {direction.x, direction.y, direction.z};
    const double from[3] = {low.x, low.y, low.z}, to[3] = {high.x, high.y, high.z};
    for (int axis = 0; axis < 3; ++axis) {
        if (d[axis] == 0.0) {
            if (o[axis] < from[axis] || o[axis] > to[axis]) {
                return false;
            }
            continue;
        }
        const double a = (from[axis] - o[axis]) / d[axis], b = (to[axis] - o[axis]) / d[axis];
        *begin = fmax(*begin, fmin(a, b));
        *end = fmin(*end, fmax(a, b));
    }
    return *begin < *end;
}

/* --- from samples to pixels */

/* The result of a ray. */
typedef struct vshi_seen {
    float color[3];
    float alpha;
    float depth; /* infinite: nothing */
    float normal[3];
} vshi_seen;

typedef struct vshi_film {
    const vshi_sample_grid *grid;
    const vsh_picture *picture;
    double weight[3 * 16]; /* of the 3 N samples across the filter */
} vshi_film;

/* Empties the picture's planes. */
void vshi_film_begin(vshi_film *film, const vshi_sample_grid *grid, const vsh_picture *picture);

/* Adds rows of samples, [rows × columns], to the pixels that they reach. Every row is added once, in order.
 */
vsh_result vshi_film_add(const vshi_film *film, const vshi_seen *seen, int32_t first_row, int32_t rows,
                         vshi_job *job, vsh_error *error);

/* Makes normals unit. */
void vshi_film_end(const vshi_film *film);

/* --- meshes with lightmaps on them, rasterised at a picture's samples */

typedef struct vshi_lit vshi_lit;

/* Whether the options' lit meshes are whole, but for what their lightmaps hold. Errors: VSH_ERROR_ARGUMENT,
 * VSH_ERROR_INPUT, naming the mesh. */
vsh_result vshi_lit_check(const vsh_render_options *options, vsh_error *error);

/* Bytes that those of checked options take at most. */
double vshi_lit_bytes(const vsh_render_options *options);

/* Makes those of checked options ready; *lit is NULL where there are none. Lights and options must outlive
 * it. Errors: VSH_ERROR_INPUT where a lightmap lacks a channel, VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_create(const vsh_render_options *options, const vsh_light *lights, size_t light_count,
                           const vshi_sample_grid *grid, vshi_lit **lit, vsh_error *error);
void vshi_lit_free(vshi_lit *lit); /* NULL does nothing */

enum { VSHI_LIT_STRIP = 64 }; /* columns that one thread rasterises */

/* The nearest triangles at the samples of some rows, [rows × columns]. */
typedef struct vshi_lit_band {
    int32_t first_row, rows;
    double *depth;      /* infinite: nothing */
    uint32_t *triangle; /* that is there */
} vshi_lit_band;

/* Fills strip `strip` of a band. */
void vshi_lit_raster(const vshi_lit *lit, const vshi_lit_band *band, size_t strip);

/* Whether a triangle has no lightmap. Its light is then computed at each hit. */
bool vshi_lit_is_bare(const vshi_lit *lit, uint32_t triangle);

/* Where a ray meets a triangle. The normals point towards the eye. */
typedef struct vshi_lit_point {
    vshi_lift_point point;
    const double *color; /* [3] */
} vshi_lit_point;

vshi_lit_point vshi_lit_meet(const vshi_lit *lit, uint32_t triangle, vshi_vec ray);

/* Grows a box by all triangles, if there are any. */
void vshi_lit_grow_box(const vshi_lit *lit, vshi_vec *low, vshi_vec *high);

/* Light that comes from a triangle with a lightmap along a ray, and its unit normal towards the eye. */
void vshi_lit_shade(const vshi_lit *lit, uint32_t triangle, vshi_vec ray, float color[3], float normal[3]);

/* --- tiles of samples */

enum { VSHI_TILE = 8, VSHI_TILE_SAMPLES = VSHI_TILE * VSHI_TILE, VSHI_MOST_LIGHTS = 256 };

/* Light shafts: a thin, even fog in the box around what is seen. */
typedef struct vshi_shafts {
    const vshi_sampler *sampler; /* blue noise */
    vshi_vec low, high;          /* the fog's box */
    double extinction;           /* per world unit; 0: no fog */
} vshi_shafts;

/* The scene of a picture. */
typedef struct vshi_scenery {
    const vsh_render_options *options;
    const vshi_sample_grid *grid;
    const vsh_surface *surfaces;
    size_t surface_count;
    const vsh_light *lights;
    size_t light_count;
    const vsh_query *query;
    const vsh_occluders *occluders; /* that the query asks */
    vsh_run run;
    bool traces_shadow, traces_ao; /* rays against triangles, not marches through the field */
    double lift;                   /* of points on surfaces, voxels */
    const vshi_lit *lit;           /* NULL: none */
    vshi_shafts shafts;
} vshi_scenery;

/* Rows of samples under way. */
typedef struct vshi_rows {
    int32_t first, count;
    vshi_seen *seen;   /* [count × columns] */
    vshi_lit_band lit; /* of the same rows, where there are lit meshes */
} vshi_rows;

/* Tile of VSHI_TILE columns and rows at most, beginning at `column` and row `row` of the grid. Errors: as
 * vsh_query_points(). */
vsh_result vshi_tile_render(const vshi_scenery *scenery, const vshi_rows *rows, int32_t column, int32_t row,
                            vsh_shade_stats *stats, vsh_error *error);

/* --- where a ray meets the zero surface of a field */

/* In world space; `direction` is unit. */
typedef struct vshi_eye_ray {
    vshi_vec origin, direction;
} vshi_eye_ray;

/* Adds to *samples what it takes. Returns the distance, world units, or `end` where the ray meets nothing
 * before it, *finished telling whether that is certain. */
double vshi_field_hit(const vsh_field *field, const vshi_eye_ray *ray, double end, uint64_t *samples,
                      bool *finished);

/* Unit normal next to the surface, world space; `otherwise` where the field has none. */
vshi_vec vshi_field_normal(const vsh_field *field, vshi_vec position, vshi_vec otherwise);

#endif
