/* Transforms of the scene file, and the rotations of its SDF nodes. */
#ifndef VSHI_SCENE_TRANSFORM_H
#define VSHI_SCENE_TRANSFORM_H

#include "json/keys.h"

/* [x, y, z] degrees into double[4], the quaternion x, y, z, w: about x first, then y, then z, each about the
 * fixed axes (Blender's "XYZ Euler"). */
vsh_result vshi_read_rotation(vshi_json *reader, const vshi_value *value, void *quaternion);

/* A "transform" object into double[12]. Errors: also a transform that flattens. */
vsh_result vshi_read_transform(vshi_json *reader, const vshi_value *value, void *matrix);

/* Whether lengths all change by the same factor: rotation, translation, mirroring, uniform scale. */
bool vshi_transform_is_similarity(const double matrix[12]);

#endif
