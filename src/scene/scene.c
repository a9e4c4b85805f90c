#include "scene/scene.h"

#include "base/memory.h"
#include "scene/parts.h"
#include "json/keys.h"

#include <vdbshade/image.h>

#include <stdlib.h>
#include <string.h>

enum {
    MAX_ITEMS = 65536,
    MAX_LIGHTS = VSH_MAX_CHANNELS - 5, /* ao, A and three of irradiance must fit into the image too */
};

/* What vsh_scene_free() gets is the first member. */
typedef struct owner {
    vsh_scene scene;
    vshi_block *blocks;
} owner;

static vsh_result read_casters(vshi_reader *reader, const vshi_value *value, void *member) {
    vsh_scene *scene = member;
    void *items = NULL;
    const vsh_result result = vshi_read_list(reader, value, 1, MAX_ITEMS, sizeof *scene->casters,
                                             vshi_read_caster, &items, &scene->caster_count);
    scene->casters = items;
    return result;
}

static vsh_result read_layers(vshi_reader *reader, const vshi_value *value, void *member) {
    vsh_scene *scene = member;
    void *items = NULL;
    const vsh_result result = vshi_read_list(reader, value, 0, VSH_MAX_LAYERS, sizeof *scene->layers,
                                             vshi_read_layer, &items, &scene->layer_count);
    scene->layers = items;
    return result;
}

static vsh_result read_lights(vshi_reader *reader, const vshi_value *value, void *member) {
    vsh_scene *scene = member;
    void *items = NULL;
    const vsh_result result = vshi_read_list(reader, value, 0, MAX_LIGHTS, sizeof *scene->lights,
                                             vshi_read_light, &items, &scene->light_count);
    scene->lights = items;
    return result == VSH_OK ? vshi_check_light_names(reader, value, scene->lights, scene->light_count)
                            : result;
}

static int by_output(const void *a, const void *b) {
    const vsh_receiver *const *x = a, *const *y = b;
    const int order = strcmp((*x)->output, (*y)->output);
    return order != 0 ? order : (*x > *y) - (*x < *y);
}

/* Two receivers with one output would overwrite each other. */
static vsh_result check_outputs(vshi_reader *reader, const vshi_value *value, const vsh_scene *scene) {
    void *memory;
    vsh_result result = vshi_allocate(&memory, scene->receiver_count, sizeof(const vsh_receiver *),
                                      "receivers", reader->error);
    if (result != VSH_OK || memory == NULL) {
        return result;
    }
    const vsh_receiver **sorted = memory;
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        sorted[i] = &scene->receivers[i];
    }
    qsort(memory, scene->receiver_count, sizeof *sorted, by_output);
    for (size_t i = 1; i < scene->receiver_count; ++i) {
        const vshi_value receiver = vshi_item(value, (size_t)(sorted[i] - scene->receivers));
        vshi_value output;
        if (strcmp(sorted[i - 1]->output, sorted[i]->output) == 0 &&
            vshi_member(&receiver, "output", &output)) {
            result =
                vshi_reader_fail(reader, &output, "\"%.200s\" is the output of receivers[%zu] too",
                                 json_string_value(output.json), (size_t)(sorted[i - 1] - scene->receivers));
            break;
        }
    }
    free(memory);
    return result;
}

static vsh_result read_receivers(vshi_reader *reader, const vshi_value *value, void *member) {
    vsh_scene *scene = member;
    void *items = NULL;
    const vsh_result result = vshi_read_list(reader, value, 0, MAX_ITEMS, sizeof *scene->receivers,
                                             vshi_read_receiver, &items, &scene->receiver_count);
    scene->receivers = items;
    return result == VSH_OK ? check_outputs(reader, value, scene) : result;
}

static const vshi_key ao_keys[] = {
    {.name = "distance",
     .kind = VSHI_NUMBER,
     .required = VSHI_ALL,
     .offset = offsetof(vsh_shade_options, ao_distance),
     .highest = VSHI_LARGEST,
     .flags = VSHI_ABOVE},
    {.name = "method",
     .kind = VSHI_NAME,
     .offset = offsetof(vsh_shade_options, ao_method),
     .name_of = vsh_ao_method_name},
    {.name = "cones",
     .kind = VSHI_INTEGER,
     .variants = 1U << VSH_AO_CONES | 1U << VSH_AO_ADAPTIVE | 1U << VSH_AO_EXACT | 1U << VSH_AO_AUTO,
     .offset = offsetof(vsh_shade_options, ao_cones),
     .lowest = 1.0,
     .highest = 256.0},
    {.name = "bent_normals", .kind = VSHI_LATER, .variants = ~(1U << VSH_AO_TAPS)},
};
static const vshi_table ao_table = VSHI_TABLE(ao_keys);

static vsh_result read_ao(vshi_reader *reader, const vshi_value *value, void *member) {
    vsh_scene *scene = member;
    scene->ao = 1;
    vsh_result result = vshi_expect(reader, value, JSON_OBJECT);
    if (result == VSH_OK) {
        result = vshi_read_choice(reader, value, "method", vsh_ao_method_name, &scene->shade.ao_method);
    }
    if (result != VSH_OK) {
        return result;
    }
    static const char *const whats[] = {
        [VSH_AO_TAPS] = "ao by taps", [VSH_AO_RAYS] = "ao by rays", [VSH_AO_AUTO] = NULL};
    const char *what = whats[scene->shade.ao_method];
    result = vshi_read_object(reader, value, &ao_table, 1U << scene->shade.ao_method,
                              what != NULL ? what : "ao", &scene->shade);
    vshi_value bent;
    if (result == VSH_OK && vshi_member(value, "bent_normals", &bent)) {
        int32_t space = VSH_BENT_WORLD;
        result = vshi_read_choice(reader, value, "bent_normals", vsh_bent_space_name, &space);
        scene->bent = 1 + space;
    }
    return result;
}

/* "quadratic", or the powers of R, G and B. */
static vsh_result read_tint(vshi_reader *reader, const vshi_value *value, void *member) {
    vsh_scene *scene = member;
    const vshi_key powers = {.kind = VSHI_VECTOR, .lowest = 0.0625, .highest = 16.0, .count = 3};
    if (json_is_array(value->json)) {
        scene->tint.type = VSH_TINT_POWER;
        return vshi_read_value(reader, value, &powers, scene->tint.power);
    }
    const vsh_result result = vshi_expect(reader, value, JSON_STRING);
    scene->tint.type = result == VSH_OK ? vsh_tint_type(json_string_value(value->json)) : VSH_TINT_NONE;
    if (result == VSH_OK && scene->tint.type != VSH_TINT_NONE && scene->tint.type != VSH_TINT_QUADRATIC) {
        return vshi_reader_fail(reader, value, "\"%.64s\" is none of none, quadratic, [r, g, b]",
                                json_string_value(value->json));
    }
    return result;
}

static vsh_result read_ambient(vshi_reader *reader, const vshi_value *value, void *member) {
    vsh_scene *scene = member;
    const vshi_key color = {.kind = VSHI_VECTOR, .highest = VSHI_LARGEST, .count = 3};
    scene->has_ambient = 1;
    return vshi_read_value(reader, value, &color, scene->ambient);
}

/* A name, or metres. */
static vsh_result read_unit(vshi_reader *reader, const vshi_value *value, void *member) {
    static const vshi_key metres = {.kind = VSHI_NUMBER, .highest = 1e12, .flags = VSHI_ABOVE};
    vsh_scene *scene = member;
    if (!json_is_string(value->json)) {
        return vshi_read_value(reader, value, &metres, &scene->unit);
    }
    scene->unit = vsh_unit(json_string_value(value->json));
    return scene->unit > 0.0 ? VSH_OK
                             : vshi_reader_fail(reader, value, "\"%.64s\" is none of m, cm, mm, in, ft",
                                                json_string_value(value->json));
}

static const vshi_key scene_keys[] = {
    {.name = "casters", .kind = VSHI_CUSTOM, .required = VSHI_ALL, .read = read_casters},
    {.name = "voxel_size",
     .kind = VSHI_NUMBER,
     .offset = offsetof(vsh_scene, grid.voxel_size),
     .highest = VSHI_LARGEST,
     .flags = VSHI_ABOVE},
    {.name = "resolution",
     .kind = VSHI_INTEGER,
     .offset = offsetof(vsh_scene, grid.resolution),
     .lowest = 2.0,
     .highest = 65536.0},
    {.name = "half_width",
     .kind = VSHI_NUMBER,
     .offset = offsetof(vsh_scene, grid.half_width),
     .lowest = 3.0,
     .highest = 100.0},
    {.name = "shell_thickness",
     .kind = VSHI_NUMBER,
     .offset = offsetof(vsh_scene, grid.shell_thickness),
     .lowest = 1.0,
     .highest = 50.0},
    {.name = "layers", .kind = VSHI_CUSTOM, .read = read_layers},
    {.name = "lights", .kind = VSHI_CUSTOM, .read = read_lights},
    {.name = "ao", .kind = VSHI_CUSTOM, .read = read_ao},
    {.name = "irradiance", .kind = VSHI_BOOL, .offset = offsetof(vsh_scene, irradiance)},
    {.name = "ambient", .kind = VSHI_CUSTOM, .read = read_ambient},
    {.name = "tint", .kind = VSHI_CUSTOM, .read = read_tint},
    {.name = "method",
     .kind = VSHI_NAME,
     .offset = offsetof(vsh_scene, shade.method),
     .name_of = vsh_shadow_method_name},
    {.name = "rays",
     .kind = VSHI_INTEGER,
     .offset = offsetof(vsh_scene, shade.rays),
     .lowest = 1.0,
     .highest = 4096.0},
    {.name = "sampler",
     .kind = VSHI_NAME,
     .offset = offsetof(vsh_scene, shade.sampler),
     .name_of = vsh_sampler_name},
    {.name = "frame", .kind = VSHI_INTEGER, .offset = offsetof(vsh_scene, shade.frame), .highest = INT32_MAX},
    {.name = "early_rays",
     .kind = VSHI_INTEGER,
     .offset = offsetof(vsh_scene, shade.early_rays),
     .highest = 4096.0},
    {.name = "max_error",
     .kind = VSHI_NUMBER,
     .offset = offsetof(vsh_scene, shade.max_error),
     .lowest = 1e-4,
     .highest = 1.0},
    {.name = "jitter", .kind = VSHI_NUMBER, .offset = offsetof(vsh_scene, shade.jitter), .highest = 1.0},
    {.name = "error", .kind = VSHI_BOOL, .offset = offsetof(vsh_scene, error)},
    {.name = "invalid", .kind = VSHI_BOOL, .offset = offsetof(vsh_scene, planes.invalid)},
    {.name = "sky", .kind = VSHI_NAME, .offset = offsetof(vsh_scene, planes.sky), .name_of = vsh_up_name},
    {.name = "max_steps",
     .kind = VSHI_INTEGER,
     .offset = offsetof(vsh_scene, shade.max_steps),
     .lowest = 16.0,
     .highest = 65536.0},
    {.name = "start_offset",
     .kind = VSHI_NUMBER,
     .offset = offsetof(vsh_scene, shade.start_offset),
     .highest = 16.0},
    {.name = "unit", .kind = VSHI_CUSTOM, .read = read_unit},
    {.name = "cast_blended", .kind = VSHI_BOOL, .offset = offsetof(vsh_scene, cast_blended)},
    {.name = "receivers", .kind = VSHI_CUSTOM, .read = read_receivers},
};
static const vshi_table scene_table = VSHI_TABLE(scene_keys);

vsh_result vshi_scene_parse(const char *path, const char *text, size_t size, vsh_scene **scene,
                            vsh_error *error) {
    *scene = NULL;
    vshi_reader reader = {path, text, size, NULL, error};
    json_t *json = NULL;
    owner *made = NULL;
    vsh_result result = vshi_reader_load(&reader, &json);
    if (result != VSH_OK) {
        return result;
    }
    made = calloc(1, sizeof *made);
    if (made == NULL) {
        result = vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused %zu bytes", path, sizeof *made);
        goto done;
    }
    made->scene.grid = vsh_grid_options_default();
    made->scene.shade = vsh_shade_options_default();
    const vshi_value root = {NULL, NULL, 0, 0, json};
    result = vshi_read_object(&reader, &root, &scene_table, 1, "a scene", &made->scene);
    if (result == VSH_OK) {
        result = vshi_reject_both(&reader, &root, "voxel_size", "resolution");
        made->scene.voxels_named =
            json_object_get(json, "voxel_size") != NULL || json_object_get(json, "resolution") != NULL;
    }
    if (result == VSH_OK) {
        result = vshi_check_layers(&reader, &root, &made->scene);
    }
    made->blocks = reader.blocks;
done:
    json_decref(json);
    if (result != VSH_OK) {
        vsh_scene_free(made == NULL ? NULL : &made->scene);
        return result;
    }
    *scene = &made->scene;
    return VSH_OK;
}

void vsh_scene_free(vsh_scene *scene) {
    if (scene == NULL) {
        return;
    }
    owner *made = (owner *)scene;
    vshi_blocks_free(made->blocks);
    free(made);
}
