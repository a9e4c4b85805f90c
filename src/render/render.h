/* The camera's samples, and meshes rasterised at them (lit.c). */
#pragma once

#include "base/bytes.h"
#include "base/job.h"
#include "base/vec.h"
#include "field/field.h"
#include "shade/shade.h"
#include "trace/sampler.h"

#include <vdbshade/picture.h>

/* A camera's frame, for pictures of one size. */
typedef struct vshi_view_frame {
    vshi_vec eye;
    vshi_vec forward;     /* unit */
    vshi_vec right, down; /* a pixel's width and height, a unit away */
    double middle[2];     /* of the picture, pixels */
} vshi_view_frame;

/* N × N samples a pixel. The filter reaches one pixel beyond the picture on each side. */
typedef struct vshi_sample_grid {
    vshi_view_frame frame;
    int32_t width, height; /* of the picture, pixels */
    int32_t samples;       /* N */
    int32_t columns, rows;
} vshi_sample_grid;

/* Ray through a sample's cell: at a random place, or in the middle if there is one sample a pixel. It has
 * length 1 along the camera's axis, so its parameter is the depth. */
static inline vshi_vec vshi_sample_ray(const vshi_sample_grid *grid, int32_t column, int32_t row) {
    const vshi_view_frame *frame = &grid->frame;
    double x = 0.5, y = 0.5;
    if (grid->samples > 1) {
        const uint64_t bits = vshi_mix(((uint64_t)(uint32_t)row << 32 | (uint32_t)column) + 1);
        x = (double)(bits >> 32) * 0x1p-32;
        y = (double)(uint32_t)bits * 0x1p-32;
    }
    x = (column + x) / grid->samples - 1.0;
    y = (row + y) / grid->samples - 1.0;
    return vshi_add(frame->forward, vshi_add(vshi_scale(frame->right, x - frame->middle[0]),
                                             vshi_scale(frame->down, y - frame->middle[1])));
}

/* --- meshes with lightmaps on them */

typedef struct vshi_lit vshi_lit;

/* Checks a camera; the error names the member, its value and the limit. */
vsh_result vshi_camera_check(const vsh_camera *camera, vsh_error *error);

/* Checks the options' lit meshes, except for their lightmaps' channels. Errors: VSH_ERROR_ARGUMENT,
 * VSH_ERROR_INPUT, naming the mesh. */
vsh_result vshi_lit_check(const vsh_render_options *options, vsh_error *error);

/* Bytes of the lit meshes of checked options, at most. */
double vshi_lit_bytes(const vsh_render_options *options);

/* Prepares the lit meshes of checked options; *lit is NULL if there are none. Lights and options must outlive
 * it. Errors: VSH_ERROR_INPUT (a lightmap lacks a channel), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_create(const vsh_render_options *options, const vsh_light *lights, size_t light_count,
                           const vshi_sample_grid *grid, vshi_lit **lit, vsh_error *error);
void vshi_lit_free(vshi_lit *lit); /* NULL does nothing */

enum { VSHI_LIT_STRIP = 64 }; /* columns that one thread rasterises */

/* The nearest triangles at the samples of some rows, [rows × columns]. */
typedef struct vshi_lit_band {
    int32_t first_row, rows;
    double *depth;      /* infinite: nothing */
    uint32_t *triangle; /* number of the nearest triangle */
} vshi_lit_band;

/* Fills strip `strip` of a band. */
void vshi_lit_raster(const vshi_lit *lit, const vshi_lit_band *band, size_t strip);

/* Whether a triangle has no lightmap, so that its light is computed at each hit. */
bool vshi_lit_is_bare(const vshi_lit *lit, uint32_t triangle);

/* The point where a ray meets a triangle. The normals point towards the eye. */
typedef struct vshi_lit_point {
    vshi_lift_point point;
    const double *color; /* [3] */
} vshi_lit_point;

vshi_lit_point vshi_lit_meet(const vshi_lit *lit, uint32_t triangle, vshi_vec ray);

/* Grows a box by all triangles, if there are any. */
void vshi_lit_grow_box(const vshi_lit *lit, vshi_vec *low, vshi_vec *high);

/* Light that a triangle with a lightmap sends along a ray, and its unit normal towards the eye. */
void vshi_lit_shade(const vshi_lit *lit, uint32_t triangle, vshi_vec ray, float color[3], float normal[3]);
