/* Nested SDF objects of the scene file, as the plain array of nodes that vsh_sdf is. */
#ifndef VSHI_SCENE_TREE_H
#define VSHI_SCENE_TREE_H

#include "json/keys.h"

/* Into a vsh_sdf. */
vsh_result vshi_read_sdf(vshi_json *reader, const vshi_value *value, void *sdf);

#endif
