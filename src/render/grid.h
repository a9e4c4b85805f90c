/* The samples of a picture: N × N a pixel, one pixel more on each side, which the filter reaches. */
#ifndef VSHI_SAMPLE_GRID_H
#define VSHI_SAMPLE_GRID_H

#include "base/hash.h"
#include "base/job.h"
#include "base/vec.h"

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

/* --- samples */

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

#endif
