/* How many voxels what is baked pays for, where nobody named any. */
#ifndef VSHI_RESOLUTION_H
#define VSHI_RESOLUTION_H

#include <stdint.h>

/* Casters, and what is asked of them. */
typedef struct vshi_resolution_need {
    double values;    /* of shadows, by rays against their triangles: points × lights */
    double max_error; /* of each */
    double triangles;
    double area;    /* of these, world units² */
    double longest; /* side of the casters' box, world units */
} vshi_resolution_need;

/* Voxels along the longest side of casters that are traced: as many as save more time, by what they prove,
 * than they take to make; 0: none do. */
int32_t vshi_resolution_traced(const vshi_resolution_need *need);

/* Voxels along the longest side of casters that are known by their voxels alone, so that what these displace
 * is no more than max_error of shadows, or (`ao_only`) of AO. */
int32_t vshi_resolution_marched(double max_error, int32_t ao_only);

#endif
