/* What a scene file lists: casters, layers, lights, receivers. Each function reads one item into its struct.
 */
#ifndef VSHI_SCENE_PARTS_H
#define VSHI_SCENE_PARTS_H

#include "scene/keys.h"

#include <vdbshade/scene.h>

vsh_result vshi_read_caster(vshi_reader *reader, const vshi_value *value, void *caster);
vsh_result vshi_read_layer(vshi_reader *reader, const vshi_value *value, void *layer);
vsh_result vshi_read_light(vshi_reader *reader, const vshi_value *value, void *light);
vsh_result vshi_read_receiver(vshi_reader *reader, const vshi_value *value, void *receiver);

/* Fails where casters name layers, or layers lights, that the scene does not have. */
vsh_result vshi_check_layers(vshi_reader *reader, const vshi_value *root, const vsh_scene *scene);

#endif
