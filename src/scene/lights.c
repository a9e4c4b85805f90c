#include "light/light.h"
#include "scene/parts.h"

#include <stdio.h>
#include <string.h>

enum {
    DIRECTIONAL = 1 << VSH_LIGHT_DIRECTIONAL,
    SPHERE = 1 << VSH_LIGHT_SPHERE,
    SPOT = 1 << VSH_LIGHT_SPOT,
};

static const char *type_name(int32_t i) {
    static const char *const names[] = {[VSH_LIGHT_DIRECTIONAL] = "directional",
                                        [VSH_LIGHT_SPHERE] = "sphere",
                                        [VSH_LIGHT_SPOT] = "spot",
                                        NULL};
    return names[i];
}

/* Lights in a plane are discs. */
static const char *flat_type_name(int32_t i) {
    return i == VSH_LIGHT_SPHERE ? "disc" : type_name(i);
}

static const char *falloff_name(int32_t i) {
    static const char *const names[] = {[VSH_FALLOFF_NONE] = "none",
                                        [VSH_FALLOFF_INVERSE_SQUARE] = "inverse_square",
                                        [VSH_FALLOFF_QUADRATIC] = "quadratic",
                                        NULL};
    return names[i];
}

static vsh_result read_name(vshi_reader *reader, const vshi_value *value, void *member) {
    const vsh_result result = vshi_expect(reader, value, JSON_STRING);
    if (result != VSH_OK) {
        return result;
    }
    const char *name = json_string_value(value->json);
    if (!vshi_light_name_valid(name)) {
        return vshi_reader_fail(reader, value,
                                "\"%.64s\" is no light's name: 1 … 63 of A … Z, a … z, 0 … 9, _ and -", name);
    }
    memcpy(member, name, strlen(name) + 1);
    return VSH_OK;
}

#define COORDINATES(key, bits, member, dimensions, more)                                                     \
    {                                                                                                        \
        .name = key, .kind = VSHI_VECTOR, .variants = bits, .required = bits,                                \
        .offset = offsetof(vsh_light, member), .count = dimensions, .lowest = -VSHI_LARGEST,                 \
        .highest = VSHI_LARGEST, .flags = more                                                               \
    }

/* What lights in space and in a plane have in common. */
#define LIGHT_KEYS(dimensions, types)                                                                        \
    {.name = "name",                                                                                         \
     .kind = VSHI_CUSTOM,                                                                                    \
     .required = VSHI_ALL,                                                                                   \
     .offset = offsetof(vsh_light, name),                                                                    \
     .read = read_name},                                                                                     \
        {.name = "type",                                                                                     \
         .kind = VSHI_NAME,                                                                                  \
         .required = VSHI_ALL,                                                                               \
         .offset = offsetof(vsh_light, type),                                                                \
         .name_of = types},                                                                                  \
        COORDINATES("direction", DIRECTIONAL | SPOT, direction, dimensions, VSHI_NONZERO),                   \
        COORDINATES("position", SPHERE | SPOT, position, dimensions, 0),                                     \
        {.name = "angle_deg",                                                                                \
         .kind = VSHI_DEGREES,                                                                               \
         .variants = DIRECTIONAL,                                                                            \
         .offset = offsetof(vsh_light, angle),                                                               \
         .highest = 180.0,                                                                                   \
         .flags = VSHI_BELOW},                                                                               \
        {.name = "radius",                                                                                   \
         .kind = VSHI_NUMBER,                                                                                \
         .variants = SPHERE | SPOT,                                                                          \
         .offset = offsetof(vsh_light, radius),                                                              \
         .highest = VSHI_LARGEST},                                                                           \
        {.name = "inner_deg",                                                                                \
         .kind = VSHI_DEGREES,                                                                               \
         .variants = SPOT,                                                                                   \
         .required = SPOT,                                                                                   \
         .offset = offsetof(vsh_light, inner_angle),                                                         \
         .highest = 180.0},                                                                                  \
        {.name = "outer_deg",                                                                                \
         .kind = VSHI_DEGREES,                                                                               \
         .variants = SPOT,                                                                                   \
         .required = SPOT,                                                                                   \
         .offset = offsetof(vsh_light, outer_angle),                                                         \
         .highest = 180.0,                                                                                   \
         .flags = VSHI_ABOVE},                                                                               \
        {.name = "reach",                                                                                    \
         .kind = VSHI_NUMBER,                                                                                \
         .variants = SPHERE | SPOT,                                                                          \
         .offset = offsetof(vsh_light, reach),                                                               \
         .highest = VSHI_LARGEST,                                                                            \
         .flags = VSHI_ABOVE},                                                                               \
    {                                                                                                        \
        .name = "color", .kind = VSHI_VECTOR, .offset = offsetof(vsh_light, color), .count = 3,              \
        .highest = VSHI_LARGEST                                                                              \
    }

static const vshi_key light_keys[] = {
    LIGHT_KEYS(3, type_name),
    {.name = "falloff",
     .kind = VSHI_NAME,
     .variants = SPHERE | SPOT,
     .offset = offsetof(vsh_light, falloff),
     .name_of = falloff_name},
    {.name = "layers", .kind = VSHI_LATER},
};
static const vshi_table light_table = VSHI_TABLE(light_keys);

static const vshi_key flat_keys[] = {LIGHT_KEYS(2, flat_type_name)};
static const vshi_table flat_table = VSHI_TABLE(flat_keys);

static vsh_result read_keys(vshi_reader *reader, const vshi_value *value, const vshi_table *table,
                            vshi_name_fn *types, vsh_light *light) {
    int32_t type = -1;
    vsh_result result = vshi_expect(reader, value, JSON_OBJECT);
    if (result == VSH_OK) {
        result = vshi_read_choice(reader, value, "type", types, &type);
    }
    if (result != VSH_OK) {
        return result;
    }
    /* A light without a type still has its keys looked over: "type" may be what is misspelt. */
    char what[32] = "a light";
    if (type >= 0) {
        snprintf(what, sizeof what, "a %s light", types(type));
    }
    return vshi_read_object(reader, value, table, type < 0 ? VSHI_ALL : 1U << type, what, light);
}

/* What no key alone can tell. */
static vsh_result check(vshi_reader *reader, const vshi_value *value, const vsh_light *light) {
    vshi_value inner, outer;
    if (light->inner_angle > light->outer_angle && light->type == VSH_LIGHT_SPOT &&
        vshi_member(value, "inner_deg", &inner) && vshi_member(value, "outer_deg", &outer)) {
        return vshi_reader_fail(reader, &inner, "%.9g is over outer_deg, %.9g", json_number_value(inner.json),
                                json_number_value(outer.json));
    }
    vsh_error error;
    if (vsh_light_check(light, &error) != VSH_OK) { /* a limit that the tables above do not know of */
        return vshi_reader_fail(reader, value, "%.400s", error.message);
    }
    return VSH_OK;
}

vsh_result vshi_read_light(vshi_reader *reader, const vshi_value *value, void *member) {
    vsh_light *light = member;
    *light = vsh_light_default();
    const vsh_result result = read_keys(reader, value, &light_table, type_name, light);
    if (result != VSH_OK) {
        return result;
    }
    vshi_value reach;
    const bool has_reach = vshi_member(value, "reach", &reach);
    if (light->falloff == VSH_FALLOFF_QUADRATIC && !has_reach) {
        return vshi_reader_fail(reader, value, "key \"reach\" is missing: falloff \"quadratic\" needs it");
    }
    if (light->falloff != VSH_FALLOFF_QUADRATIC && has_reach) {
        return vshi_reader_fail_key(reader, &reach, "is of no use without falloff \"quadratic\"");
    }
    return check(reader, value, light);
}

vsh_result vshi_read_flat_light(vshi_reader *reader, const vshi_value *value, void *member) {
    vsh_light *light = member;
    *light = vsh_light_default();
    light->direction[1] = 0.0; /* so that what is read is all there is */
    const vsh_result result = read_keys(reader, value, &flat_table, flat_type_name, light);
    if (result != VSH_OK) {
        return result;
    }
    vshi_value reach;
    if (vshi_member(value, "reach", &reach)) {
        light->falloff = VSH_FALLOFF_QUADRATIC;
    }
    return check(reader, value, light);
}

vsh_result vshi_check_light_names(vshi_reader *reader, const vshi_value *value, const vsh_light *lights,
                                  size_t count) {
    for (size_t i = 0; i < count; ++i) {
        for (size_t j = 0; j < i; ++j) {
            const vshi_value light = vshi_item(value, i);
            vshi_value name;
            if (strcmp(lights[i].name, lights[j].name) == 0 && vshi_member(&light, "name", &name)) {
                return vshi_reader_fail(reader, &name, "\"%s\" is the name of lights[%zu] too",
                                        lights[i].name, j);
            }
        }
    }
    return VSH_OK;
}
