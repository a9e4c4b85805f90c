/* What texels are expected to take, in nanoseconds or so: what two files reckon by. */
#ifndef VSHI_WORK_H
#define VSHI_WORK_H

#include <vdbshade/scene.h>

/* A sample's position and whether it is valid; what a valid one takes beside rays. */
static const double VSHI_LAID_OUT = 250.0, VSHI_VALID = 200.0;
/* A light that is proved, or dark; one in its penumbra. */
static const double VSHI_LIT = 100.0, VSHI_PENUMBRA = 6000.0;
/* What a border costs, in rows, for each texel of spacing between those that share AO. */
static const double VSHI_SHARED_ROWS = 1.5;

/* Times that what is open is shaded. */
static inline double vshi_work_openings(const vsh_scene *scene) {
    return (scene->ao ? 1.0 : 0.0) + vsh_planes_shaded(&scene->planes);
}

#endif
