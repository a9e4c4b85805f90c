/* Transforms that keep shapes: rotation, translation, mirroring, uniform scale. */
#ifndef VSHI_SIMILARITY_H
#define VSHI_SIMILARITY_H

#include <stdbool.h>
#include <stddef.h>

/* Uniform scale of a transform [12]; 0 for one that shears, scales unevenly or flattens. */
double vshi_similarity_scale(const double m[12]);

/* Whether a finite transform flattens all shapes. */
bool vshi_transform_flattens(const double m[12]);

/* Quaternion x, y, z, w of the rotation in a similarity of that scale that does not mirror. */
void vshi_similarity_rotation(const double m[12], double scale, double q[4]);

/* a × b: b's rotation first. `result` may be one of them. */
void vshi_quaternion_multiply(const double a[4], const double b[4], double result[4]);

#endif
