/* The seeds' scene: its field, its sun, and 512² texels of the floor. */
#ifndef BENCH_SEEDS_H
#define BENCH_SEEDS_H

#include "analytic.h"

#include <vdbshade/vdbshade.h>

typedef struct bench_seeds_scene {
    vsh_grid *grid;
    vsh_field *field;
    vsh_light sun;
    size_t count;
    double *positions; /* [count][3], a thousandth above the floor, in the order of a lightmap's samples */
    float *normals;    /* [count][3] */
} bench_seeds_scene;

/* Ends the program where the asset or memory is missing. */
void bench_seeds_make(bench_seeds_scene *seeds);
void bench_seeds_free(bench_seeds_scene *seeds);

#endif
