/* Texels of a lightmap that share rays: where light changes little from one to the next, rays are cast for
 * some of a square and the values between are interpolated. */
#ifndef VSHI_SHADE_INTERPOLATION_H
#define VSHI_SHADE_INTERPOLATION_H

#include "shade/shadow.h"

enum {
    VSHI_INTERPOLATION_GONE,
    VSHI_INTERPOLATION_KNOWN,
    VSHI_INTERPOLATION_OPEN,
    VSHI_INTERPOLATION_WANTED
};

/* Points of a piece, by their place in it. */
typedef struct vshi_interpolation {
    const vsh_points *points;
    size_t begin, count;
    double max_error; /* standard error that a value may have */
    int32_t sampler;  /* VSH_SAMPLER_… of the rays */
    /* rays that are cast for every open point first, to be compared with what is interpolated: what is
     * narrower than the steps between anchors shows in them */
    int32_t rays;
    uint16_t lit[VSHI_PIECE]; /* of them */
    uint8_t state[VSHI_PIECE];
    float value[VSHI_PIECE], deviation[VSHI_PIECE]; /* of what is known */
    /* runs of points in the same square of eight by eight texels */
    size_t runs;
    uint16_t run_begin[VSHI_PIECE + 1];
} vshi_interpolation;

enum { VSHI_INTERPOLATION_LEVELS = 2 }; /* squares of 8 × 8 texels, then of 4 × 4 */

/* How many rays that takes: 4 to 256, a small part of what the error takes. */
int32_t vshi_interpolation_rays(double max_error);

/* Whether points can share: they have normals, and places in a lightmap. */
bool vshi_interpolation_can(const vsh_points *points);

/* Finds the squares, of states that are set. */
void vshi_interpolation_begin(vshi_interpolation *interp);

/* Marks as VSHI_INTERPOLATION_WANTED those open points of the level's squares that the others are to be
 * interpolated from. False where there are none. */
bool vshi_interpolation_pick(vshi_interpolation *interp, int level);

/* Once all that was wanted is known: gives the open points of a square their values, where those that are
 * known agree with each other to within their errors, and with the open points' own rays; they are then known
 * too. */
void vshi_interpolation_fill(vshi_interpolation *interp, int level);

#endif
