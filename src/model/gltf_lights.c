/* The lights that a glTF's nodes carry: KHR_lights_punctual (Khronos, ratified 2019). */
#include "model/gltf.h"

#include "base/memory.h"
#include "base/vec.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char extension[] = "KHR_lights_punctual";

static int32_t type_of(const char *name) {
    static const char *const names[] = {[VSH_MODEL_LIGHT_DIRECTIONAL] = "directional",
                                        [VSH_MODEL_LIGHT_POINT] = "point",
                                        [VSH_MODEL_LIGHT_SPOT] = "spot"};
    for (int32_t i = 0; name != NULL && i < (int32_t)(sizeof names / sizeof names[0]); ++i) {
        if (strcmp(name, names[i]) == 0) {
            return i;
        }
    }
    return -1;
}

/* A number that stays where the key is absent. */
static vsh_result number(const vshi_gltf *gltf, const json_t *object, const char *key, double lowest,
                         double highest, const char *where, double *value, vsh_error *error) {
    const json_t *given = json_object_get(object, key);
    const double told = given != NULL ? json_number_value(given) : *value;
    if ((given != NULL && !json_is_number(given)) || !(told >= lowest && told <= highest)) {
        return vshi_gltf_fail(gltf, error, "%s: its %s is %s%g, expected a number of %g to %g", where, key,
                              json_is_number(given) ? "" : "no number, or ", told, lowest, highest);
    }
    *value = told;
    return VSH_OK;
}

static vsh_result read_values(const vshi_gltf *gltf, const json_t *given, const char *where,
                              vsh_model_light *light, vsh_error *error) {
    static const double eighth = 0.78539816339744828, quarter = 1.5707963267948966; /* turns, radians */
    /* a quarter turn that was written with the digits of a float, or few of them, is meant so */
    static const double widest = 1.5708;
    for (int i = 0; i < 3; ++i) {
        light->color[i] = 1.0;
    }
    bool good = vshi_gltf_numbers(given, "color", 3, light->color);
    for (int i = 0; i < 3; ++i) {
        good = good && light->color[i] >= 0.0 && light->color[i] <= FLT_MAX;
    }
    if (!good) {
        return vshi_gltf_fail(gltf, error, "%s: its color is no three numbers of at least 0", where);
    }
    light->intensity = 1.0;
    VSHI_TRY(number(gltf, given, "intensity", 0.0, FLT_MAX, where, &light->intensity, error));
    VSHI_TRY(number(gltf, given, "range", 0.0, FLT_MAX, where, &light->range, error));
    if (light->type == VSH_MODEL_LIGHT_SPOT) {
        const json_t *spot = json_object_get(given, "spot");
        light->outer_angle = eighth;
        VSHI_TRY(number(gltf, spot, "outerConeAngle", DBL_MIN, widest, where, &light->outer_angle, error));
        VSHI_TRY(
            number(gltf, spot, "innerConeAngle", 0.0, light->outer_angle, where, &light->inner_angle, error));
        light->outer_angle = fmin(light->outer_angle, quarter);
        light->inner_angle = fmin(light->inner_angle, quarter);
    }
    return VSH_OK;
}

/* Where its node stands, and the way its -z points. False where it points nowhere. */
static bool place(const double world[12], vsh_model_light *light) {
    const vshi_vec away = {-world[2], -world[6], -world[10]};
    for (int i = 0; i < 3; ++i) {
        light->position[i] = world[4 * i + 3];
        if (!(fabs(light->position[i]) <= FLT_MAX)) {
            return false;
        }
    }
    const double length = vshi_length(away);
    if (light->type == VSH_MODEL_LIGHT_POINT) {
        return true;
    }
    if (!(length > 0.0 && length <= FLT_MAX)) {
        return false;
    }
    const vshi_vec unit = vshi_unit(away);
    light->direction[0] = unit.x + 0.0; /* no -0, which would be told */
    light->direction[1] = unit.y + 0.0;
    light->direction[2] = unit.z + 0.0;
    return true;
}

static vsh_result add_light(vshi_gltf *gltf, size_t node, size_t index, const json_t *given,
                            vsh_error *error) {
    char where[64];
    snprintf(where, sizeof where, "lights[%zu] of %s", index, extension);
    vsh_model_light light = {.type = type_of(json_string_value(json_object_get(given, "type")))};
    if (light.type < 0) {
        vshi_warn(gltf->run, "%s: %s is left out: its type is not directional, point or spot", gltf->path,
                  where);
        return VSH_OK;
    }
    VSHI_TRY(read_values(gltf, given, where, &light, error));
    if (!place(gltf->node_world[node], &light)) {
        vshi_warn(gltf->run,
                  "%s: the light of nodes[%zu] is left out: its transform gives it no direction or place",
                  gltf->path, node);
        return VSH_OK;
    }
    const char *name = json_string_value(json_object_get(vshi_gltf_element(gltf, "nodes", node), "name"));
    name = name != NULL && name[0] != '\0' ? name : json_string_value(json_object_get(given, "name"));
    VSHI_TRY(vshi_gltf_hold(gltf, 2.0 * sizeof light + (name != NULL ? (double)strlen(name) : 0.0), error));
    return vshi_model_add_light(gltf->model, &light, name, error);
}

vsh_result vshi_gltf_add_light(vshi_gltf *gltf, size_t node, vsh_error *error) {
    const json_t *carried = vshi_gltf_extension(vshi_gltf_element(gltf, "nodes", node), extension);
    const json_t *lights = json_object_get(vshi_gltf_extension(gltf->root, extension), "lights");
    size_t index;
    if (carried == NULL) {
        return VSH_OK;
    }
    if (!vshi_gltf_count(carried, "light", SIZE_MAX, &index) || index >= json_array_size(lights)) {
        return vshi_gltf_fail(gltf, error, "nodes[%zu]: its light is none of the %zu of %s", node,
                              json_array_size(lights), extension);
    }
    return add_light(gltf, node, index, json_array_get(lights, index), error);
}
