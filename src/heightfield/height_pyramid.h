/* A heightfield as it is marched: its samples under a pyramid of maxima, in units of a cell's width. */
#ifndef VSHI_HEIGHTFIELD_HEIGHT_PYRAMID_H
#define VSHI_HEIGHTFIELD_HEIGHT_PYRAMID_H

#include "base/vec.h"

#include <stdint.h>
#include <vdbshade/heights.h>

enum { VSHI_RELIEF_LEVELS = 18, VSHI_FAN = 16 };

/* Level l holds the greatest height of blocks of 2^l × 2^l cells; level 0 is the samples themselves. */
typedef struct vshi_height_pyramid {
    int32_t columns, rows; /* samples */
    int32_t top;           /* the level of one block, ≥ 1 */
    const float *height[VSHI_RELIEF_LEVELS];
    int32_t across[VSHI_RELIEF_LEVELS]; /* blocks in a row of a level */
    double depth;                       /* of a cell along z */
    double bottom;
} vshi_height_pyramid;

struct vsh_heights {
    vshi_height_pyramid relief;
    vsh_heights_info info;
    double to_relief[12]; /* world to cells: x and z from sample (0, 0), y up */
    double unit;          /* world units in a cell's width */
    float *memory;        /* of all levels */
};

/* Directions along the ground, away from one point: the slices in which its horizon is sought. */
typedef struct vshi_fan {
    float x[VSHI_FAN], z[VSHI_FAN];                 /* unit */
    float inverse_x[VSHI_FAN], inverse_z[VSHI_FAN]; /* finite */
    float far[VSHI_FAN];    /* distance along the ground beyond which nothing counts; < 0: none is sought */
    float slope[VSHI_FAN];  /* the steepest so far: those below are of no account */
    float enough[VSHI_FAN]; /* no need to know of a steeper one */
    float range;            /* distance through the air beyond which nothing counts; 0: no such */
} vshi_fan;

/* Raises fan->slope to the steepest slope from `point` to the surface in each direction; returns how many
 * blocks and cells were looked at. */
typedef uint64_t vshi_walk_fn(const vshi_height_pyramid *relief, const double point[3], vshi_fan *fan);
extern vshi_walk_fn vshi_walk_base, vshi_walk_avx2, vshi_walk_avx512;

/* Sets a direction. */
static inline void vshi_fan_set(vshi_fan *fan, int k, double x, double z) {
    static const double LEAST = 1e-18; /* so that quotients stay finite */
    fan->x[k] = (float)x;
    fan->z[k] = (float)z;
    fan->inverse_x[k] = (float)(1.0 / (fabs(x) > LEAST ? x : LEAST));
    fan->inverse_z[k] = (float)(1.0 / (fabs(z) > LEAST ? z : LEAST));
}

/* Height of the surface over (x, z), in cells, within the grid. */
double vshi_height_pyramid_height(const vshi_height_pyramid *relief, double x, double z);

#endif
