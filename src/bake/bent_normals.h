/* Bent normals of samples, from the mean of their open directions. */
#ifndef VSHI_BAKE_BENT_NORMALS_H
#define VSHI_BAKE_BENT_NORMALS_H

#include <vdbshade/bake.h>

/* Makes a unit bent normal of a mean of open directions, as of vshi_ao_task; in tangent space where a tangent
 * [4] is given, else (NULL) in world space. */
void vshi_bent_normal(const float *normal, const float *tangent, float *bent);

/* Makes a mean of bent normals one of unit length. */
void vshi_bent_normalize(float *bent);

#endif
