/* Where a ray meets the zero surface of a field. */
#ifndef VSHI_HIT_H
#define VSHI_HIT_H

#include "field/field.h"

/* In world space; `direction` is unit. */
typedef struct vshi_eye_ray {
    vshi_vec origin, direction;
} vshi_eye_ray;

/* Adds to *samples what it takes. Returns the distance, world units, or `end` where the ray meets nothing
 * before it, *finished telling whether that is certain. */
double vshi_field_hit(const vsh_field *field, const vshi_eye_ray *ray, double end, uint64_t *samples,
                      bool *finished);

/* Unit normal next to the surface, world space; `otherwise` where the field has none. */
vshi_vec vshi_field_normal(const vsh_field *field, vshi_vec position, vshi_vec otherwise);

#endif
