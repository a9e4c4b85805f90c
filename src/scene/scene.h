/* Readers of scene files: each reads one item, or one key's value, into its struct. */
#pragma once

#include "io/json.h"

#include <vdbshade/picture.h>

/* Returns the standard error that the values of a channel ("ao", "sky", "shadow.NAME") were made to, by the
 * attributes of their file. NaN if these do not say, or if a limit of rays was given, so that values may miss
 * it. Cannot fail. */
double vshi_provenance_max_error(const vsh_attribute *attributes, size_t count, const char *channel);

/* A row's option: name, word for the value, VSH_SETTINGS_…, help, and other members that are not 0. */
#define VSHI_OPTION(called, stands, of_group, ...)                                                           \
    .option = {.name = called, .value = stands, .group = VSH_SETTINGS_##of_group, .help = __VA_ARGS__}

/* Keys with options are settings. */
extern const vshi_table vshi_scene_table, vshi_ao_table, vshi_flat_table;

/* As vsh_scene_read(), of a text that was read from `path`. */
vsh_result vshi_scene_parse(const char *path, const char *text, size_t size, vsh_scene **scene,
                            vsh_error *error);

/* Reads the file of a scene, or of a flat one, as vshi_json_read(); refuses scenes of other programs. */
vsh_result vshi_scene_file_read(const char *path, const vsh_run *run, size_t size, vshi_read_fn *read,
                                void **made, vsh_error *error);

/* --- casters (caster.c) */

vsh_result vshi_read_caster(vshi_json *reader, const vshi_value *value, void *caster);
vsh_result vshi_read_flat_caster(vshi_json *reader, const vshi_value *value, void *caster);

/* A "transform" object into double[12]. Errors: also a transform that flattens. */
vsh_result vshi_read_transform(vshi_json *reader, const vshi_value *value, void *matrix);
/* Finds which of these keys an object has; -1: none. Fails if it has two. */
vsh_result vshi_read_type(vshi_json *reader, const vshi_value *object, const char *const *names,
                          int32_t count, int32_t *type);
/* A pattern, or an array of them, as a vshi_list. */
vsh_result vshi_read_patterns(vshi_json *reader, const vshi_value *value, void *list);

/* --- lights (lights.c) */

vsh_result vshi_read_flat_light(vshi_json *reader, const vshi_value *value, void *light);
vsh_result vshi_read_light(vshi_json *reader, const vshi_value *value, void *member);
/* Fails if two of the lights [count] have one name; `list` is their place in the file. */
vsh_result vshi_check_light_names(vshi_json *reader, const vshi_value *list, const vsh_light *lights,
                                  size_t count);

/* --- images (scene.c) */

/* Texels, 1024 or [width, height], as two int32_t. */
vsh_result vshi_read_size(vshi_json *reader, const vshi_value *value, void *size);
vsh_result vshi_read_bits(vshi_json *reader, const vshi_value *value, void *bits); /* int32_t */
const char *vshi_color_space_key(int32_t i); /* names of color_space; NULL behind the last */

/* The union of a flat scene's casters; NULL, with VSH_OK, if it has none. Free it with vsh_outline_free(). */
vsh_result vshi_flat_scene_casters(const vsh_flat_scene *scene, const vsh_run *run, vsh_outline **outline,
                                   vsh_error *error);
