/* What a scene file lists: casters, lights, receivers. Each function reads one item into its struct. */
#ifndef VSHI_SCENE_PARTS_H
#define VSHI_SCENE_PARTS_H

#include "scene/keys.h"

vsh_result vshi_read_caster(vshi_reader *reader, const vshi_value *value, void *caster);
vsh_result vshi_read_light(vshi_reader *reader, const vshi_value *value, void *light);
vsh_result vshi_read_receiver(vshi_reader *reader, const vshi_value *value, void *receiver);

#endif
