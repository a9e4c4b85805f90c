/* Cameras as rays. */
#ifndef VSHI_CAMERA_H
#define VSHI_CAMERA_H

#include "base/vec.h"

#include <vdbshade/render.h>

/* A camera's frame, for pictures of one size. */
typedef struct vshi_view_frame {
    vshi_vec eye;
    vshi_vec forward;     /* unit */
    vshi_vec right, down; /* of a pixel's width and height, a unit away */
    double middle[2];     /* of the picture, pixels */
} vshi_view_frame;

vshi_view_frame vshi_camera_frame(const vsh_camera *camera, int32_t width, int32_t height);

/* Direction, not unit but with 1 along the axis, through a place of the picture, pixels from its left top. */
static inline vshi_vec vshi_camera_ray(const vshi_view_frame *frame, double x, double y) {
    return vshi_add(frame->forward, vshi_add(vshi_scale(frame->right, x - frame->middle[0]),
                                             vshi_scale(frame->down, y - frame->middle[1])));
}

#endif
