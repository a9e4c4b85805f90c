/* Lights of scene files, in space or in a plane, and of models and their files. */
#include "base/memory.h"
#include "io/model/model.h"
#include "light/light.h"
#include "scene/assets.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/image.h>

/* --- one light */

static const char *type_name(int32_t i) {
    const vshi_light_type *type = vshi_light_type_of(i);
    return type != NULL ? type->name : NULL;
}

static vshi_key type_key(bool flat) {
    return (vshi_key){.name = "type",
                      .kind = VSHI_NAME,
                      .required = VSHI_ALL,
                      .offset = offsetof(vsh_light, type),
                      .names = VSH_NAMES_FLAT_LIGHT,
                      .name_of = flat ? NULL : type_name};
}

static vsh_result read_name(vshi_json *reader, const vshi_value *value, void *member) {
    VSHI_TRY(vshi_expect(reader, value, JSON_STRING));
    const char *name = json_string_value(value->json);
    if (!vshi_light_name_valid(name)) {
        return vshi_json_fail(
            reader, value, "\"%.64s\" cannot name a light: expected 1 … 63 of A … Z, a … z, 0 … 9, _ and -",
            name);
    }
    memcpy(member, name, strlen(name) + 1);
    return VSH_OK;
}

enum { MOST_KEYS = 24 };

/* Converts a bound for files: numbers are at most VSHI_LARGEST, and angles are degrees. */
static double convert_bound(const vshi_light_member *m, double bound) {
    const double number = m->kind == VSHI_LIGHT_ANGLE ? bound / VSHI_PI * (m->half ? 90.0 : 180.0) : bound;
    return fmin(fmax(number, -VSHI_LARGEST), VSHI_LARGEST);
}

static vshi_key make_key(const vshi_light_member *m, int32_t dimensions) {
    static const vshi_key_kind kinds[] = {[VSHI_LIGHT_NUMBER] = VSHI_NUMBER,
                                          [VSHI_LIGHT_ANGLE] = VSHI_DEGREES,
                                          [VSHI_LIGHT_VECTOR] = VSHI_VECTOR,
                                          [VSHI_LIGHT_SWITCH] = VSHI_BOOL};
    /* bounds at infinity are excluded, but the largest number is not */
    const bool above = m->above && isfinite(m->lowest), below = m->below && isfinite(m->highest);
    return (vshi_key){.name = m->key,
                      .kind = kinds[m->kind],
                      .variants = m->types,
                      .required = m->required,
                      .offset = m->offset,
                      .lowest = convert_bound(m, m->lowest),
                      .highest = convert_bound(m, m->highest),
                      .flags = (above ? VSHI_ABOVE : 0) | (below ? VSHI_BELOW : 0) |
                               (m->nonzero ? VSHI_NONZERO : 0),
                      .count = dimensions};
}

#define AT(member) .offset = offsetof(vsh_light, member)

/* Lists the keys of lights in space, or in a plane; returns how many there are. */
static size_t list_keys(bool flat, vshi_key keys[MOST_KEYS]) {
    const uint32_t types = flat ? vshi_light_types_flat() : VSHI_ALL, falling = vshi_light_types_falling();
    const vshi_key common[] = {
        VSHI_KEY("name", CUSTOM, AT(name), .required = VSHI_ALL, .read = read_name), type_key(flat),
        VSHI_KEY("reach", NUMBER, AT(reach), .variants = falling, VSHI_POSITIVE),
        VSHI_KEY("color", VECTOR, AT(color), .count = 3, .highest = VSHI_LARGEST),
        VSHI_KEY("falloff", NAME, AT(falloff), .variants = falling, .names = VSH_NAMES_FALLOFF)};
    size_t count = flat ? 4 : 5; /* in a plane lights have no falloff */
    memcpy(keys, common, count * sizeof *keys);
    for (size_t i = 0; i < vshi_light_member_count && count < MOST_KEYS; ++i) {
        if ((vshi_light_members[i].types & types) != 0) {
            keys[count++] = make_key(&vshi_light_members[i], flat ? 2 : 3);
        }
    }
    return count;
}
#undef AT

static vsh_result read_keys(vshi_json *reader, const vshi_value *value, bool flat, vsh_light *light) {
    const vshi_key key = type_key(flat);
    int32_t type = -1;
    VSHI_TRY(vshi_expect(reader, value, JSON_OBJECT));
    VSHI_TRY(vshi_read_choice(reader, value, &key, &type));
    /* keys are checked even without a type, which may be misspelt */
    char what[32] = "a light";
    if (type >= 0) {
        snprintf(what, sizeof what, "a %s light", vshi_key_name(&key, type));
    }
    vshi_key keys[MOST_KEYS];
    const vshi_table table = {keys, list_keys(flat, keys)};
    VSHI_TRY(vshi_read_object(reader, value, &table, type < 0 ? VSHI_ALL : 1U << type, what, light));
    if (type == VSH_LIGHT_SPOT) {
        light->inner_angle *= 2.0; /* files have half angles */
        light->outer_angle *= 2.0;
    }
    return VSH_OK;
}

/* Checks keys together. */
static vsh_result check_light(vshi_json *reader, const vshi_value *value, const vsh_light *light) {
    vshi_value inner, outer;
    if (light->inner_angle > light->outer_angle && light->type == VSH_LIGHT_SPOT &&
        vshi_member(value, "inner_deg", &inner) && vshi_member(value, "outer_deg", &outer)) {
        return vshi_json_fail(reader, &inner, "%.9g is over outer_deg, %.9g", json_number_value(inner.json),
                              json_number_value(outer.json));
    }
    vsh_error error;
    return vsh_light_check(light, &error) == VSH_OK ? VSH_OK
                                                    : vshi_json_fail(reader, value, "%.400s", error.message);
}

vsh_result vshi_read_light(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_light *light = member;
    *light = vsh_light_default();
    VSHI_TRY(read_keys(reader, value, false, light));
    vshi_value reach;
    const bool has_reach = vshi_member(value, "reach", &reach);
    if (light->falloff == VSH_FALLOFF_QUADRATIC && !has_reach) {
        return vshi_json_fail(reader, value, "key \"reach\" is missing: falloff \"quadratic\" needs it");
    }
    if (light->falloff != VSH_FALLOFF_QUADRATIC && has_reach) {
        return vshi_json_fail_key(reader, &reach, "needs falloff \"quadratic\"");
    }
    return check_light(reader, value, light);
}

vsh_result vshi_read_flat_light(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_light *light = member;
    *light = vsh_light_default();
    light->direction[1] = light->axis[1] = 0.0; /* only the file's numbers count */
    VSHI_TRY(read_keys(reader, value, true, light));
    vshi_value reach;
    if (vshi_member(value, "reach", &reach)) {
        light->falloff = VSH_FALLOFF_QUADRATIC;
    }
    return check_light(reader, value, light);
}

vsh_result vshi_check_light_names(vshi_json *reader, const vshi_value *list, const vsh_light *lights,
                                  size_t count) {
    for (size_t i = 0; i < count; ++i) {
        for (size_t k = 0; k < i; ++k) {
            const vshi_value light = vshi_item(list, i);
            vshi_value name;
            if (strcmp(lights[i].name, lights[k].name) == 0 && vshi_member(&light, "name", &name)) {
                return vshi_json_fail(reader, &name, "\"%s\" is the name of lights[%zu] too", lights[i].name,
                                      k);
            }
        }
    }
    return VSH_OK;
}

/* --- lights of a model */

static bool is_taken(const vsh_light *lights, size_t count, const char *name) {
    for (size_t i = 0; i < count; ++i) {
        if (strcmp(lights[i].name, name) == 0) {
            return true;
        }
    }
    return false;
}

/* Makes a name for channels that no light before has: "Key light" becomes "Key_light", the next one
 * "Key_light_2". */
static void make_name(const char *given, const vsh_light *before, size_t count, char name[64]) {
    enum { ROOM = 10 /* for the number of a second light of one name */ };
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

static vsh_light make_light(const vshi_model_light *given, double angle, double radius, double scale) {
    static const int32_t types[] = {[VSHI_MODEL_LIGHT_DIRECTIONAL] = VSH_LIGHT_DIRECTIONAL,
                                    [VSHI_MODEL_LIGHT_POINT] = VSH_LIGHT_SPHERE,
                                    [VSHI_MODEL_LIGHT_SPOT] = VSH_LIGHT_SPOT};
    vsh_light light = vsh_light_default();
    light.type = types[given->type];
    light.falloff =
        given->type == VSHI_MODEL_LIGHT_DIRECTIONAL ? VSH_FALLOFF_NONE : VSH_FALLOFF_INVERSE_SQUARE;
    light.angle = angle;
    light.radius = radius;
    if (given->type == VSHI_MODEL_LIGHT_SPOT) {
        light.inner_angle = 2.0 * given->inner_angle;
        light.outer_angle = 2.0 * given->outer_angle;
        memcpy(light.axis, given->direction, sizeof light.axis); /* away from the spot */
    }
    for (int i = 0; i < 3; ++i) {
        if (given->type == VSHI_MODEL_LIGHT_DIRECTIONAL) {
            light.direction[i] = 0.0 - given->direction[i]; /* towards the sun */
        }
        light.position[i] = scale * given->position[i];
        light.color[i] = given->color[i] * given->intensity;
    }
    return light;
}

vsh_result vshi_lights_from_model(const vsh_model *model, double angle, double radius, double unit,
                                  vsh_light **lights, size_t *count, vsh_error *error) {
    if (!(unit >= 0.0 && isfinite(unit))) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vshi_lights_from_model: unit is %g, expected at least 0",
                         unit);
    }
    const size_t all = model->light_count;
    const double own = vsh_model_unit(model) > 0.0 ? vsh_model_unit(model) : 1.0;
    vsh_light *made = NULL;
    VSHI_TRY(vshi_allocate((void **)&made, all, sizeof *made, "lights", error));
    for (size_t i = 0; i < all; ++i) {
        made[i] = make_light(&model->lights[i], angle, radius, unit > 0.0 ? unit / own : 1.0);
        make_name(model->lights[i].name, made, i, made[i].name);
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
    VSHI_MAKES(lights);
    VSHI_NEEDS(count);
    *count = 0;
    vsh_model *model = NULL;
    VSHI_TRY(vsh_model_read(path, run, &model, error));
    const vsh_result result = vshi_lights_from_model(model, angle, radius, unit, lights, count, error);
    vsh_model_free(model);
    return result;
}

void vsh_lights_free(vsh_light *lights) {
    free(lights);
}
