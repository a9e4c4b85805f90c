/* Points of a caller's arrays, packed or strided, of doubles or floats, as one thing to read. */
#ifndef VSHI_VIEW_H
#define VSHI_VIEW_H

#include <vdbshade/query.h>

#include <stdbool.h>
#include <string.h>

typedef struct vshi_view {
    size_t count;
    const char *positions, *normals, *texels; /* the last two may be NULL */
    size_t position_stride, normal_stride, texel_stride;
    bool floats; /* positions are floats */
} vshi_view;

static inline void vshi_view_position(const vshi_view *view, size_t i, double position[3]) {
    const char *at = view->positions + i * view->position_stride;
    if (view->floats) {
        float p[3];
        memcpy(p, at, sizeof p);
        for (int axis = 0; axis < 3; ++axis) {
            position[axis] = (double)p[axis];
        }
    } else {
        memcpy(position, at, 3 * sizeof *position);
    }
}

#endif
