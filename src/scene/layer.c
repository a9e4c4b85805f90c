#include "base/try.h"
#include "scene/assets.h"
#include "scene/parts.h"

#include <string.h>
#include <vdbshade/scene.h>

/* Names of lights, each a string that is the name of one. */
static vsh_result read_light_names(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_scene_layer *layer = member;
    VSHI_TRY(vshi_expect(reader, value, JSON_ARRAY));
    const vshi_key key = {.kind = VSHI_STRING};
    const size_t count = json_array_size(value->json);
    const char **names;
    /* one more: no lights at all are not NULL, which is all of them */
    VSHI_TRY(vshi_json_allocate(reader, (void **)&names, count + 1, sizeof *names, "lights of a layer"));
    for (size_t i = 0; i < count; ++i) {
        const vshi_value name = vshi_item(value, i);
        VSHI_TRY(vshi_read_value(reader, &name, &key, &names[i]));
    }
    layer->shade.lights = names;
    layer->shade.light_count = count;
    return VSH_OK;
}

static const vshi_key layer_keys[] = {
    {.name = "name", .kind = VSHI_STRING, .required = VSHI_ALL, .offset = offsetof(vsh_scene_layer, name)},
    {.name = "voxel_size",
     .kind = VSHI_NUMBER,
     .offset = offsetof(vsh_scene_layer, voxel_size),
     .lowest = VSHI_SMALLEST_LENGTH,
     .highest = VSHI_LARGEST_VOXEL},
    {.name = "resolution",
     .kind = VSHI_INTEGER,
     .offset = offsetof(vsh_scene_layer, resolution),
     .lowest = 2.0,
     .highest = 65536.0},
    {.name = "method",
     .kind = VSHI_NAME,
     .offset = offsetof(vsh_scene_layer, shade.method),
     .names = VSH_NAMES_SHADOW},
    {.name = "combine",
     .kind = VSHI_NAME,
     .offset = offsetof(vsh_scene_layer, shade.combine),
     .names = VSH_NAMES_COMBINE},
    {.name = "softness",
     .kind = VSHI_NUMBER,
     .offset = offsetof(vsh_scene_layer, shade.softness),
     .highest = 1000.0},
    {.name = "remap",
     .kind = VSHI_VECTOR,
     .offset = offsetof(vsh_scene_layer, shade.remap),
     .highest = 1.0,
     .count = 2},
    {.name = "start_offset",
     .kind = VSHI_NUMBER,
     .offset = offsetof(vsh_scene_layer, shade.start_offset),
     .highest = 16.0},
    {.name = "lights", .kind = VSHI_CUSTOM, .read = read_light_names},
    {.name = "ao", .kind = VSHI_BOOL, .offset = offsetof(vsh_scene_layer, shade.ao)},
};
static const vshi_table layer_table = VSHI_TABLE(layer_keys);

vsh_result vshi_read_layer(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_scene_layer *layer = member;
    layer->shade = vsh_layer_default();
    VSHI_TRY(vshi_read_object(reader, value, &layer_table, 1, "a layer", layer));
    VSHI_TRY(vshi_reject_both(reader, value, "voxel_size", "resolution"));
    vshi_value remap;
    if (vshi_member(value, "remap", &remap) && !(layer->shade.remap[0] < layer->shade.remap[1])) {
        return vshi_json_fail(reader, &remap, "expected two numbers that rise, found %g and %g",
                              layer->shade.remap[0], layer->shade.remap[1]);
    }
    return VSH_OK;
}

static vsh_result check_casters(vshi_json *reader, const vshi_value *root, const vsh_scene *scene) {
    vshi_value casters, name;
    for (size_t i = 0; i < scene->caster_count && vshi_member(root, "casters", &casters); ++i) {
        bool found = scene->casters[i].layer == NULL;
        for (size_t k = 0; !found && k < scene->layer_count; ++k) {
            found = vshi_caster_in_layer(&scene->casters[i], &scene->layers[k]);
        }
        const vshi_value caster = vshi_item(&casters, i);
        if (!found && vshi_member(&caster, "layer", &name)) {
            return vshi_json_fail(reader, &name, "\"%.64s\" is none of the scene's layers",
                                  scene->casters[i].layer);
        }
    }
    return VSH_OK;
}

/* Whether a light is among those that a layer casts for. */
static bool casts_for(const vsh_layer *layer, const vsh_light *light) {
    bool casts = layer->lights == NULL;
    for (size_t i = 0; !casts && i < layer->light_count; ++i) {
        casts = strcmp(layer->lights[i], light->name) == 0;
    }
    return casts;
}

static vsh_result check_lights(vshi_json *reader, const vshi_value *layers, const vsh_scene *scene,
                               size_t i) {
    const vsh_layer *layer = &scene->layers[i].shade;
    const vshi_value at = vshi_item(layers, i);
    vshi_value names;
    for (size_t k = 0; layer->lights != NULL && k < layer->light_count; ++k) {
        bool found = false;
        for (size_t l = 0; !found && l < scene->light_count; ++l) {
            found = strcmp(layer->lights[k], scene->lights[l].name) == 0;
        }
        if (!found && vshi_member(&at, "lights", &names)) {
            const vshi_value name = vshi_item(&names, k);
            return vshi_json_fail(reader, &name, "\"%.64s\" is none of the scene's lights", layer->lights[k]);
        }
    }
    return VSH_OK;
}

/* Takes a light from those that a layer casts for. */
static vsh_result take_out(vshi_json *reader, const vsh_scene *scene, const vsh_light *light,
                           vsh_layer *layer) {
    const char **left;
    size_t count = 0;
    VSHI_TRY(vshi_json_allocate(reader, (void **)&left, scene->light_count + 1, sizeof *left,
                                "lights of a layer"));
    for (size_t l = 0; l < scene->light_count; ++l) {
        if (&scene->lights[l] != light && casts_for(layer, &scene->lights[l])) {
            left[count++] = scene->lights[l].name;
        }
    }
    layer->lights = left;
    layer->light_count = count;
    return VSH_OK;
}

/* A light that names layers: the others do not cast for it. */
static vsh_result choose_layers(vshi_json *reader, const vshi_value *names, const vsh_light *light,
                                const vsh_scene *scene, vsh_scene_layer *layers) {
    bool named[VSH_MAX_LAYERS] = {false};
    VSHI_TRY(vshi_expect(reader, names, JSON_ARRAY));
    for (size_t n = 0; n < json_array_size(names->json); ++n) {
        const vshi_value name = vshi_item(names, n);
        VSHI_TRY(vshi_expect(reader, &name, JSON_STRING));
        bool found = false;
        for (size_t k = 0; k < scene->layer_count; ++k) {
            const bool is = strcmp(json_string_value(name.json), layers[k].name) == 0;
            named[k] = named[k] || is;
            found = found || is;
        }
        if (!found) {
            return vshi_json_fail(reader, &name, "\"%.64s\" is none of the scene's layers",
                                  json_string_value(name.json));
        }
    }
    for (size_t k = 0; k < scene->layer_count; ++k) {
        if (!named[k] && casts_for(&layers[k].shade, light)) {
            VSHI_TRY(take_out(reader, scene, light, &layers[k].shade));
        }
    }
    return VSH_OK;
}

static vsh_result choose_all(vshi_json *reader, const vshi_value *root, vsh_scene *scene) {
    vshi_value lights, names;
    vsh_scene_layer *layers;
    if (!vshi_member(root, "lights", &lights)) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_json_allocate(reader, (void **)&layers, scene->layer_count + 1, sizeof *layers, "layers"));
    if (scene->layer_count > 0) {
        memcpy(layers, scene->layers, scene->layer_count * sizeof *layers);
    }
    for (size_t l = 0; l < scene->light_count; ++l) {
        const vshi_value light = vshi_light_item(&lights, scene, l);
        if (vshi_member(&light, "layers", &names)) {
            VSHI_TRY(choose_layers(reader, &names, &scene->lights[l], scene, layers));
        }
    }
    scene->layers = layers;
    return VSH_OK;
}

/* What names what: casters their layers, layers their lights, lights their layers. */
vsh_result vshi_check_layers(vshi_json *reader, const vshi_value *root, vsh_scene *scene) {
    vshi_value layers, name;
    VSHI_TRY(check_casters(reader, root, scene));
    const bool layered = vshi_member(root, "layers", &layers);
    for (size_t i = 0; layered && i < scene->layer_count; ++i) {
        const vshi_value at = vshi_item(&layers, i);
        for (size_t k = 0; k < i; ++k) {
            if (strcmp(scene->layers[i].name, scene->layers[k].name) == 0 &&
                vshi_member(&at, "name", &name)) {
                return vshi_json_fail(reader, &name, "\"%.64s\" is the name of layers[%zu] too",
                                      scene->layers[i].name, k);
            }
        }
        VSHI_TRY(check_lights(reader, &layers, scene, i));
    }
    return choose_all(reader, root, scene);
}
