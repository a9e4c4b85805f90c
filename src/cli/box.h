/* The box around what receives. */
#ifndef CLI_BOX_H
#define CLI_BOX_H

#include <math.h>
#include <vdbshade/vdbshade.h>

/* A world box; min > max on all axes where it is empty. */
typedef struct cli_box {
    double min[3], max[3];
} cli_box;

static inline cli_box cli_box_empty(void) {
    return (cli_box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
}

/* By the samples' box. */
static inline void cli_box_grow(cli_box *box, const vsh_texels_info *info) {
    for (int axis = 0; axis < 3 && info->samples > 0; ++axis) {
        box->min[axis] = fmin(box->min[axis], info->bounds_min[axis]);
        box->max[axis] = fmax(box->max[axis], info->bounds_max[axis]);
    }
}

#endif
