/* The lights that a model, or its file, has, as those of a scene. */
#include "base/error.h"
#include "base/memory.h"
#include "base/try.h"
#include "base/vec.h"
#include "light/light.h"

#include <vdbshade/scene.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool is_taken(const vsh_light *lights, size_t count, const char *name) {
    for (size_t i = 0; i < count; ++i) {
        if (strcmp(lights[i].name, name) == 0) {
            return true;
        }
    }
    return false;
}

/* One that a channel can have, and that none of the lights before it has: "Key light" becomes "Key_light",
 * and the next of them "Key_light_2". */
static void make_name(const char *given, const vsh_light *before, size_t count, char name[64]) {
    enum { ROOM = 10 /* for what tells those of one name apart */ };
    snprintf(name, 64 - ROOM, "%s", given != NULL && given[0] != '\0' ? given : "light");
    for (char *c = name; *c != '\0'; ++c) {
        const char one[2] = {*c, '\0'};
        *c = vshi_light_name_valid(one) ? *c : '_';
    }
    const size_t length = strlen(name);
    for (unsigned k = 2; is_taken(before, count, name); ++k) {
        snprintf(name + length, 64 - length, "_%u", k);
    }
}

/* Directions are towards a sun, and away from a spot. */
static void place(const vsh_model_light *given, double scale, vsh_light *light) {
    for (int i = 0; i < 3; ++i) {
        light->direction[i] =
            given->type == VSH_MODEL_LIGHT_DIRECTIONAL ? 0.0 - given->direction[i] : light->direction[i];
        light->axis[i] = given->type == VSH_MODEL_LIGHT_SPOT ? given->direction[i] : light->axis[i];
        light->position[i] = scale * given->position[i];
        light->color[i] = given->color[i] * given->intensity;
    }
}

static vsh_light light_of(const vsh_model_light *given, double angle, double radius, double scale) {
    static const int32_t types[] = {[VSH_MODEL_LIGHT_DIRECTIONAL] = VSH_LIGHT_DIRECTIONAL,
                                    [VSH_MODEL_LIGHT_POINT] = VSH_LIGHT_SPHERE,
                                    [VSH_MODEL_LIGHT_SPOT] = VSH_LIGHT_SPOT};
    vsh_light light = vsh_light_default();
    light.type = types[given->type];
    light.falloff =
        given->type == VSH_MODEL_LIGHT_DIRECTIONAL ? VSH_FALLOFF_NONE : VSH_FALLOFF_INVERSE_SQUARE;
    light.angle = angle;
    light.radius = radius;
    if (given->type == VSH_MODEL_LIGHT_SPOT) {
        light.inner_angle = given->inner_angle;
        light.outer_angle = given->outer_angle;
    }
    place(given, scale, &light);
    return light;
}

vsh_result vsh_lights_from_model(const vsh_model *model, double angle, double radius, double unit,
                                 vsh_light **lights, size_t *count, vsh_error *error) {
    VSHI_NEEDS(lights);
    *lights = NULL;
    VSHI_NEEDS(count);
    *count = 0;
    VSHI_NEEDS(model);
    if (!(unit >= 0.0 && isfinite(unit))) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_lights_from_model: unit is %g, expected at least 0",
                         unit);
    }
    const size_t all = vsh_model_light_count(model);
    const double own = vsh_model_unit(model) > 0.0 ? vsh_model_unit(model) : 1.0;
    vsh_light *made = NULL;
    VSHI_TRY(vshi_allocate((void **)&made, all, sizeof *made, "lights", error));
    for (size_t i = 0; i < all; ++i) {
        const vsh_model_light given = vsh_model_get_light(model, i);
        made[i] = light_of(&given, angle, radius, unit > 0.0 ? unit / own : 1.0);
        make_name(given.name, made, i, made[i].name);
        const vsh_result result = vsh_light_check(&made[i], error);
        if (result != VSH_OK) {
            free(made);
            return result;
        }
    }
    *lights = made;
    *count = all;
    return VSH_OK;
}

vsh_result vsh_lights_read(const char *path, double angle, double radius, double unit, const vsh_run *run,
                           vsh_light **lights, size_t *count, vsh_error *error) {
    VSHI_NEEDS(lights);
    *lights = NULL;
    VSHI_NEEDS(count);
    *count = 0;
    vsh_model *model = NULL;
    VSHI_TRY(vsh_model_read(path, run, &model, error));
    const vsh_result result = vsh_lights_from_model(model, angle, radius, unit, lights, count, error);
    vsh_model_free(model);
    return result;
}

void vsh_lights_free(vsh_light *lights) {
    free(lights);
}
