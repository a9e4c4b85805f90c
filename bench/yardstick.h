/* Embree's time for an error, in whichever way of tracing is the fastest there (rtcOccluded1, 8, 16). */
#ifndef BENCH_YARDSTICK_H
#define BENCH_YARDSTICK_H

#include "embree.h"

#include <stdio.h>

enum { BENCH_CURVE = 5 }; /* 1, 4 … 256 rays */

typedef struct bench_curve {
    double ray; /* processor seconds of a ray in the fastest way, one core, 16 rays a point */
    int packing;
    double error[BENCH_CURVE]; /* RMSE */
    double seconds[BENCH_CURVE];
} bench_curve;

/* Times every way of tracing with 16 rays a point and prints the figures; then errors and seconds, a row
 * each, called "embree N" or "embree ao N". `question`'s rays are ignored. */
bench_curve bench_embree(FILE *csv, const char *scene, const truth_mesh *mesh, const truth_question *question,
                         const float *truth, const float *valid, float *values);

/* Seconds that the curve takes for an error, between its points by powers, and beyond them likewise. */
double bench_embree_seconds(const bench_curve *curve, double error);

#endif
