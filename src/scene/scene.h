/* Readers of scene files: each reads one item, or one key's value, into its struct. */
#ifndef VSHI_SCENE_H
#define VSHI_SCENE_H

#include "json/json.h"

#include <vdbshade/scene.h>
#include <vdbshade/settings.h>

/* How a row's value is given as an option: name, what stands for the value, VSH_SETTINGS_…, help, and then
 * what else is not 0. */
#define VSHI_OPTION(called, stands, of_group, ...)                                                           \
    .option = {.name = called, .value = stands, .group = VSH_SETTINGS_##of_group, .help = __VA_ARGS__}

/* Keys with options are settings. */
extern const vshi_table vshi_scene_table, vshi_ao_table, vshi_flat_table;

/* As vsh_scene_read(), of a text that was read from `path`. With a run of NULL no file is opened: those of
 * lights have none then. */
vsh_result vshi_scene_parse(const char *path, const char *text, size_t size, const vsh_run *run,
                            vsh_scene **scene, vsh_error *error);

/* Reads the file of a scene, or of a flat one, as vshi_json_read(); refuses files of other programs' scenes.
 */
vsh_result vshi_scene_file_read(const char *path, const vsh_run *run, size_t size, vshi_read_fn *read,
                                void **made, vsh_error *error);

/* --- items of lists */

vsh_result vshi_read_caster(vshi_json *reader, const vshi_value *value, void *caster);
vsh_result vshi_read_flat_light(vshi_json *reader, const vshi_value *value, void *light);

/* Reads the list of lights into a scene whose unit is known, and the files that it names, unless the reader
 * has no run: then their lights are missing. Fails where two lights have one name. */
vsh_result vshi_read_lights(vshi_json *reader, const vshi_value *list, vsh_scene *scene);
/* The item of that list which light `light` of the scene is of. */
vshi_value vshi_light_item(const vshi_value *list, const vsh_scene *scene, size_t light);

/* Fails where two lights of a scene have one name; `list` is where its file has them. */
vsh_result vshi_check_light_names(vshi_json *reader, const vshi_value *list, const vsh_scene *scene);

/* --- values of several kinds of items */

/* A "transform" object into double[12]. Errors: also a transform that flattens. */
vsh_result vshi_read_transform(vshi_json *reader, const vshi_value *value, void *matrix);
/* Finds which of these keys an object has, -1: none. Fails where it has two. */
vsh_result vshi_read_type(vshi_json *reader, const vshi_value *object, const char *const *names,
                          int32_t count, int32_t *type);
/* The arrays of numbers in an array, each of so many. */
vsh_result vshi_read_rows(vshi_json *reader, const vshi_value *array, int32_t columns, const char *what,
                          const double **rows);
/* Texels: 1024, or [width, height]. */
vsh_result vshi_read_size(vshi_json *reader, const vshi_value *value, int32_t *width, int32_t *height);
vsh_result vshi_read_bits(vshi_json *reader, const vshi_value *value, void *bits); /* int32_t */
const char *vshi_color_space_key(int32_t i); /* names of color_space; NULL behind the last */

/* A pattern, or an array of them, as a vshi_list. */
vsh_result vshi_read_patterns(vshi_json *reader, const vshi_value *value, void *list);

/* --- masks and texts, which solids and flat scenes share */

/* `size`, one number or two, into a vsh_mask_options. */
vsh_result vshi_read_mask_size(vshi_json *reader, const vshi_value *value, void *mask);

/* Rows for a struct with path, text, mask and letters, which is filled with the options' defaults beforehand;
 * `of_mask` and `of_text` are the bits of the two variants. */
#define VSHI_OUTLINE_KEYS(target, of_mask, of_text)                                                          \
    VSHI_KEY("mask", PATH, .variants = of_mask, .offset = offsetof(target, path)),                           \
        VSHI_KEY("size", CUSTOM, VSHI_NEEDED_BY(of_mask), .offset = offsetof(target, mask),                  \
                 .read = vshi_read_mask_size),                                                               \
        VSHI_KEY("channel", STRING, .variants = of_mask, .offset = offsetof(target, mask.channel)),          \
        VSHI_KEY("threshold", NUMBER, .variants = of_mask, .offset = offsetof(target, mask.threshold),       \
                 VSHI_ANY),                                                                                  \
        VSHI_KEY("invert", BOOL, .variants = of_mask, .offset = offsetof(target, mask.invert)),              \
        VSHI_KEY("text", STRING, .variants = of_text, .offset = offsetof(target, text)),                     \
        VSHI_KEY("font", PATH, VSHI_NEEDED_BY(of_text), .offset = offsetof(target, path)),                   \
        VSHI_KEY("height", NUMBER, VSHI_NEEDED_BY(of_text), .offset = offsetof(target, letters.height),      \
                 VSHI_POSITIVE),                                                                             \
        VSHI_KEY("line_spacing", NUMBER, .variants = of_text,                                                \
                 .offset = offsetof(target, letters.line_spacing), .highest = 1e3, .flags = VSHI_ABOVE),     \
        VSHI_KEY("align", NAME, .variants = of_text, .offset = offsetof(target, letters.align),              \
                 .names = VSH_NAMES_ALIGN)

#endif
