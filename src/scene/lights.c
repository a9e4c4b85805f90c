#include "base/try.h"
#include "light/light.h"
#include "light/types.h"
#include "scene/parts.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Behind those of lights what stands in their place: a file of some (light_list.c). */
static const char *type_name(int32_t i) {
    const vshi_light_type *type = vshi_light_type_of(i);
    const bool behind = type == NULL && i > 0 && vshi_light_type_of(i - 1) != NULL;
    return type != NULL ? type->name : behind ? "file" : NULL;
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
        return vshi_json_fail(reader, value,
                              "\"%.64s\" is no light's name: 1 … 63 of A … Z, a … z, 0 … 9, _ and -", name);
    }
    memcpy(member, name, strlen(name) + 1);
    return VSH_OK;
}

static const vshi_key name_key = {.name = "name",
                                  .kind = VSHI_CUSTOM,
                                  .required = VSHI_ALL,
                                  .offset = offsetof(vsh_light, name),
                                  .read = read_name};
static const vshi_key color_key = {.name = "color",
                                   .kind = VSHI_VECTOR,
                                   .offset = offsetof(vsh_light, color),
                                   .count = 3,
                                   .highest = VSHI_LARGEST};

enum { MOST_KEYS = 24 };

/* The keys of lights in space, or in a plane. */
typedef struct light_keys {
    vshi_key keys[MOST_KEYS];
    size_t count;
} light_keys;

static void add_key(light_keys *all, const vshi_key *key) {
    if (all->count < MOST_KEYS) {
        all->keys[all->count++] = *key;
    }
}

/* A bound in files, whose numbers are no larger than VSHI_LARGEST and whose angles are degrees. */
static double bound_of(const vshi_light_member *m, double bound) {
    const double number = m->kind == VSHI_LIGHT_ANGLE ? bound / VSHI_PI * 180.0 : bound;
    return fmin(fmax(number, -VSHI_LARGEST), VSHI_LARGEST);
}

static vshi_key key_of(const vshi_light_member *m, int32_t dimensions) {
    static const vshi_kind kinds[] = {[VSHI_LIGHT_NUMBER] = VSHI_NUMBER,
                                      [VSHI_LIGHT_ANGLE] = VSHI_DEGREES,
                                      [VSHI_LIGHT_VECTOR] = VSHI_VECTOR,
                                      [VSHI_LIGHT_SWITCH] = VSHI_BOOL};
    /* what is excluded at infinity is not at the largest number */
    const bool above = m->above && isfinite(m->lowest), below = m->below && isfinite(m->highest);
    return (vshi_key){.name = m->key,
                      .kind = kinds[m->kind],
                      .variants = m->types,
                      .required = m->required,
                      .offset = m->offset,
                      .lowest = bound_of(m, m->lowest),
                      .highest = bound_of(m, m->highest),
                      .flags = (above ? VSHI_ABOVE : 0) | (below ? VSHI_BELOW : 0) |
                               (m->nonzero ? VSHI_NONZERO : 0),
                      .count = dimensions};
}

static void make_keys(bool flat, light_keys *all) {
    const uint32_t types = flat ? vshi_light_types_flat() : VSHI_ALL, falling = vshi_light_types_falling();
    const vshi_key type = type_key(flat);
    all->count = 0;
    add_key(all, &name_key);
    add_key(all, &type);
    for (size_t i = 0; i < vshi_light_member_count; ++i) {
        if ((vshi_light_members[i].types & types) != 0) {
            const vshi_key key = key_of(&vshi_light_members[i], flat ? 2 : 3);
            add_key(all, &key);
        }
    }
    add_key(all, &(vshi_key){.name = "reach",
                             .kind = VSHI_NUMBER,
                             .variants = falling,
                             .offset = offsetof(vsh_light, reach),
                             .highest = VSHI_LARGEST,
                             .flags = VSHI_ABOVE});
    add_key(all, &color_key);
    if (flat) {
        return;
    }
    add_key(all, &(vshi_key){.name = "falloff",
                             .kind = VSHI_NAME,
                             .variants = falling,
                             .offset = offsetof(vsh_light, falloff),
                             .names = VSH_NAMES_FALLOFF});
    add_key(all, &(vshi_key){.name = "layers", .kind = VSHI_LATER});
}

static vsh_result read_keys(vshi_json *reader, const vshi_value *value, bool flat, vsh_light *light) {
    const vshi_key key = type_key(flat);
    int32_t type = -1;
    VSHI_TRY(vshi_expect(reader, value, JSON_OBJECT));
    VSHI_TRY(vshi_read_choice(reader, value, &key, &type));
    /* A light without a type still has its keys looked over: "type" may be what is misspelt. */
    char what[32] = "a light";
    if (type >= 0) {
        snprintf(what, sizeof what, "a %s light", vshi_key_name(&key, type));
    }
    light_keys keys;
    make_keys(flat, &keys);
    const vshi_table table = {keys.keys, keys.count};
    return vshi_read_object(reader, value, &table, type < 0 ? VSHI_ALL : 1U << type, what, light);
}

/* What no key alone can tell. */
static vsh_result check(vshi_json *reader, const vshi_value *value, const vsh_light *light) {
    vshi_value inner, outer;
    if (light->inner_angle > light->outer_angle && light->type == VSH_LIGHT_SPOT &&
        vshi_member(value, "inner_deg", &inner) && vshi_member(value, "outer_deg", &outer)) {
        return vshi_json_fail(reader, &inner, "%.9g is over outer_deg, %.9g", json_number_value(inner.json),
                              json_number_value(outer.json));
    }
    vsh_error error;
    if (vsh_light_check(light, &error) != VSH_OK) { /* a limit that the tables above do not know of */
        return vshi_json_fail(reader, value, "%.400s", error.message);
    }
    return VSH_OK;
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
        return vshi_json_fail_key(reader, &reach, "is of no use without falloff \"quadratic\"");
    }
    return check(reader, value, light);
}

vsh_result vshi_read_flat_light(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_light *light = member;
    *light = vsh_light_default();
    light->direction[1] = light->axis[1] = 0.0; /* so that what is read is all there is */
    VSHI_TRY(read_keys(reader, value, true, light));
    vshi_value reach;
    if (vshi_member(value, "reach", &reach)) {
        light->falloff = VSH_FALLOFF_QUADRATIC;
    }
    return check(reader, value, light);
}

vsh_result vshi_check_light_names(vshi_json *reader, const vshi_value *value, const vsh_light *lights,
                                  size_t count) {
    for (size_t i = 0; i < count; ++i) {
        for (size_t j = 0; j < i; ++j) {
            const vshi_value light = vshi_item(value, i);
            vshi_value name;
            if (strcmp(lights[i].name, lights[j].name) == 0 && vshi_member(&light, "name", &name)) {
                return vshi_json_fail(reader, &name, "\"%s\" is the name of lights[%zu] too", lights[i].name,
                                      j);
            }
        }
    }
    return VSH_OK;
}
