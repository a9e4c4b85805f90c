/* The lights of flat scenes: as those of others, with two coordinates. */
#include "scene/parts.h"

#include <stdio.h>

enum {
    DIRECTIONAL = 1 << VSH_LIGHT_DIRECTIONAL,
    DISC = 1 << VSH_LIGHT_SPHERE,
    SPOT = 1 << VSH_LIGHT_SPOT,
};

static const char *type_name(int32_t i) {
    static const char *const names[] = {[VSH_LIGHT_DIRECTIONAL] = "directional",
                                        [VSH_LIGHT_SPHERE] = "disc",
                                        [VSH_LIGHT_SPOT] = "spot",
                                        NULL};
    return names[i];
}

static const vshi_key light_keys[] = {
    {.name = "name",
     .kind = VSHI_CUSTOM,
     .required = VSHI_ALL,
     .offset = offsetof(vsh_light, name),
     .read = vshi_read_light_name},
    {.name = "type",
     .kind = VSHI_NAME,
     .required = VSHI_ALL,
     .offset = offsetof(vsh_light, type),
     .name_of = type_name},
    {.name = "direction",
     .kind = VSHI_VECTOR,
     .variants = DIRECTIONAL | SPOT,
     .required = DIRECTIONAL | SPOT,
     .offset = offsetof(vsh_light, direction),
     .count = 2,
     .lowest = -VSHI_LARGEST,
     .highest = VSHI_LARGEST,
     .flags = VSHI_NONZERO},
    {.name = "position",
     .kind = VSHI_VECTOR,
     .variants = DISC | SPOT,
     .required = DISC | SPOT,
     .offset = offsetof(vsh_light, position),
     .count = 2,
     .lowest = -VSHI_LARGEST,
     .highest = VSHI_LARGEST},
    {.name = "angle_deg",
     .kind = VSHI_DEGREES,
     .variants = DIRECTIONAL,
     .offset = offsetof(vsh_light, angle),
     .highest = 180.0,
     .flags = VSHI_BELOW},
    {.name = "radius",
     .kind = VSHI_NUMBER,
     .variants = DISC | SPOT,
     .offset = offsetof(vsh_light, radius),
     .highest = VSHI_LARGEST},
    {.name = "inner_deg",
     .kind = VSHI_DEGREES,
     .variants = SPOT,
     .required = SPOT,
     .offset = offsetof(vsh_light, inner_angle),
     .highest = 180.0},
    {.name = "outer_deg",
     .kind = VSHI_DEGREES,
     .variants = SPOT,
     .required = SPOT,
     .offset = offsetof(vsh_light, outer_angle),
     .highest = 180.0,
     .flags = VSHI_ABOVE},
    {.name = "reach",
     .kind = VSHI_NUMBER,
     .variants = DISC | SPOT,
     .offset = offsetof(vsh_light, reach),
     .highest = VSHI_LARGEST,
     .flags = VSHI_ABOVE},
    {.name = "color",
     .kind = VSHI_VECTOR,
     .offset = offsetof(vsh_light, color),
     .count = 3,
     .highest = VSHI_LARGEST},
};
static const vshi_table light_table = VSHI_TABLE(light_keys);

vsh_result vshi_read_flat_light(vshi_reader *reader, const vshi_value *value, void *member) {
    vsh_light *light = member;
    *light = vsh_light_default();
    light->direction[1] = 0.0; /* so that what is read is all there is */
    vsh_result result = vshi_expect(reader, value, JSON_OBJECT);
    if (result != VSH_OK) {
        return result;
    }
    int32_t type = -1;
    result = vshi_read_choice(reader, value, "type", type_name, &type);
    if (result != VSH_OK) {
        return result;
    }
    char what[32] = "a light";
    if (type >= 0) {
        snprintf(what, sizeof what, "a %s light", type_name(type));
    }
    result = vshi_read_object(reader, value, &light_table, type < 0 ? VSHI_ALL : 1U << type, what, light);
    if (result != VSH_OK) {
        return result;
    }
    vshi_value given;
    if (vshi_member(value, "reach", &given)) {
        light->falloff = VSH_FALLOFF_QUADRATIC;
    }
    vsh_error error;
    if (vsh_light_check(light, &error) != VSH_OK) { /* a limit that the table above does not know of */
        return vshi_reader_fail(reader, value, "%.400s", error.message);
    }
    return VSH_OK;
}
