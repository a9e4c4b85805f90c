/* The samples of a picture: N × N a pixel, one pixel more on each side, which the filter reaches. */
#ifndef VSHI_SAMPLE_GRID_H
#define VSHI_SAMPLE_GRID_H

#include "base/hash.h"
#include "render/camera.h"

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

#endif
