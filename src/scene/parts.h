/* What a scene file lists: casters, layers, lights, receivers. Each function reads one item into its struct.
 */
#ifndef VSHI_SCENE_PARTS_H
#define VSHI_SCENE_PARTS_H

#include "json/keys.h"

#include <vdbshade/scene.h>

/* Keys with options are settings: of a vsh_scene the first two, of a vsh_receiver, of a vsh_flat_scene. */
extern const vshi_table vshi_scene_table, vshi_ao_table, vshi_receiver_table, vshi_flat_table;

vsh_result vshi_read_caster(vshi_json *reader, const vshi_value *value, void *caster);
vsh_result vshi_read_layer(vshi_json *reader, const vshi_value *value, void *layer);
vsh_result vshi_read_light(vshi_json *reader, const vshi_value *value, void *light);
vsh_result vshi_read_receiver(vshi_json *reader, const vshi_value *value, void *receiver);

/* Reads the list of lights into a scene whose unit is known, and the files that it names, as `run` says; with
 * NULL these are not read, and their lights missing. Fails where two lights have one name. */
vsh_result vshi_read_lights(vshi_json *reader, const vshi_value *list, const vsh_run *run, vsh_scene *scene);
/* The item of that list which light `light` of the scene is of. */
vshi_value vshi_light_item(const vshi_value *list, const vsh_scene *scene, size_t light);

/* Fails where casters and lights name layers, or layers lights, that the scene does not have; layers that a
 * light does not name where it names some cast for it no more. */
vsh_result vshi_check_layers(vshi_json *reader, const vshi_value *root, vsh_scene *scene);

/* What flat scenes list as well. */

/* Texels: 1024, or [width, height]. */
vsh_result vshi_read_size(vshi_json *reader, const vshi_value *value, int32_t *width, int32_t *height);
/* A pattern, or an array of them, into a vsh_selection: what is chosen, and what of it is not. */
vsh_result vshi_read_only(vshi_json *reader, const vshi_value *value, void *selection);
vsh_result vshi_read_except(vshi_json *reader, const vshi_value *value, void *selection);
/* Patterns that are added to a caster's rules of solidity. */
vsh_result vshi_read_solid(vshi_json *reader, const vshi_value *value, void *caster);
vsh_result vshi_read_shell(vshi_json *reader, const vshi_value *value, void *caster);
vsh_result vshi_read_inward(vshi_json *reader, const vshi_value *value, void *caster);
/* Patterns of a caster's meshes that are one-sided. */
vsh_result vshi_read_one_sided(vshi_json *reader, const vshi_value *value, void *caster);
const char *vshi_color_space_key(int32_t i); /* names of color_space; NULL behind the last */
vsh_result vshi_read_bits(vshi_json *reader, const vshi_value *value, void *bits); /* int32_t */

/* Fails where two lights of the array `value` have one name. */
vsh_result vshi_check_light_names(vshi_json *reader, const vshi_value *value, const vsh_light *lights,
                                  size_t count);

vsh_result vshi_read_flat_caster(vshi_json *reader, const vshi_value *value, void *caster);
vsh_result vshi_read_flat_light(vshi_json *reader, const vshi_value *value, void *light);

#endif
