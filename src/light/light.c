#include "light/light.h"

#include "base/decimal.h"
#include "base/error.h"
#include "base/floats.h"
#include "light/types.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const vshi_light_member color_member = {.name = "color",
                                               .kind = VSHI_LIGHT_VECTOR,
                                               .offset = offsetof(vsh_light, color),
                                               .highest = INFINITY,
                                               .below = true};
static const vshi_light_member reach_member = {.name = "reach",
                                               .kind = VSHI_LIGHT_NUMBER,
                                               .offset = offsetof(vsh_light, reach),
                                               .highest = INFINITY,
                                               .above = true,
                                               .below = true};

bool vshi_light_name_valid(const char *name) {
    static const char allowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
    const size_t length = strnlen(name, sizeof(((vsh_light *)NULL)->name));
    return length > 0 && length < sizeof(((vsh_light *)NULL)->name) && strspn(name, allowed) == length;
}

static vsh_result check_range(const vsh_light *light, const vshi_light_member *m, vsh_error *error) {
    static const char *const items[2][3] = {{""}, {"[0]", "[1]", "[2]"}};
    const bool is_vector = m->kind == VSHI_LIGHT_VECTOR;
    const int count = is_vector ? 3 : 1;
    double values[3];
    if (m->kind == VSHI_LIGHT_SWITCH) {
        values[0] = (double)*(const int32_t *)((const char *)light + m->offset);
    } else {
        memcpy(values, (const char *)light + m->offset, (size_t)count * sizeof values[0]);
    }
    bool zero = true;
    for (int i = 0; i < count; ++i) {
        const bool above = m->above ? values[i] > m->lowest : values[i] >= m->lowest;
        const bool below = m->below ? values[i] < m->highest : values[i] <= m->highest;
        if (!above || !below) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "light '%s': %s%s %.9g is out of range %.9g%s … %.9g%s", light->name, m->name,
                             items[is_vector][i], values[i], m->lowest, m->above ? " (excluded)" : "",
                             m->highest, m->below ? " (excluded)" : "");
        }
        zero = zero && values[i] == 0.0;
    }
    if (zero && m->nonzero) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "light '%s': %s (0, 0, 0): expected a length over 0",
                         light->name, m->name);
    }
    return VSH_OK;
}

/* The ranges of the members that a type has. */
static vsh_result check_members(const vsh_light *light, vsh_error *error) {
    for (size_t i = 0; i < vshi_light_member_count; ++i) {
        const vshi_light_member *m = &vshi_light_members[i];
        if ((m->types & (1U << light->type)) == 0 || m->apart) {
            continue;
        }
        VSHI_TRY(check_range(light, m, error));
    }
    return check_range(light, &color_member, error);
}

vsh_result vsh_light_check(const vsh_light *light, vsh_error *error) {
    VSHI_FLOATS;
    if (light == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "light: is NULL");
    }
    /* An empty name is allowed: lights that no channel is named after need none. */
    if (light->name[0] != '\0' && !vshi_light_name_valid(light->name)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "light: name '%.63s': expected at most 63 letters, digits, '_' and '-'",
                         light->name);
    }
    const vshi_light_type *type = vshi_light_type_of(light->type);
    if (type == NULL) {
        int32_t last = 0;
        while (vshi_light_type_of(last + 1) != NULL) {
            ++last;
        }
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "light '%s': type %d is out of range 0 … %d", light->name,
                         light->type, last);
    }
    if (light->falloff < VSH_FALLOFF_NONE || light->falloff > VSH_FALLOFF_QUADRATIC) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "light '%s': falloff %d is out of range 0 … %d",
                         light->name, light->falloff, VSH_FALLOFF_QUADRATIC);
    }
    VSHI_TRY(check_members(light, error));
    if (type->check != NULL) {
        VSHI_TRY(type->check(light, error));
    }
    if (light->falloff == VSH_FALLOFF_QUADRATIC && type->falls_off) {
        VSHI_TRY(check_range(light, &reach_member, error));
    }
    return VSH_OK;
}

double vshi_light_falloff(const vsh_light *light, double distance) {
    if (light->falloff == VSH_FALLOFF_INVERSE_SQUARE) {
        return 1.0 / (distance * distance);
    }
    if (light->falloff == VSH_FALLOFF_QUADRATIC) {
        const double left = 1.0 - fmin(1.0, distance / light->reach);
        return left * left;
    }
    return 1.0;
}

double vshi_light_gain(const vsh_light *light, vshi_vec to_light, double distance) {
    const vshi_light_type *type = vshi_light_type_of(light->type);
    return type != NULL ? type->gain(light, to_light, distance) : 0.0;
}

vsh_light vshi_light_resized(const vsh_light *light, double factor) {
    const vshi_light_type *type = vshi_light_type_of(light->type);
    vsh_light resized = *light;
    if (factor != 1.0 && type != NULL) {
        type->resize(&resized, factor);
    }
    return resized;
}

vshi_light_place vshi_light_in_world(const vsh_light *light) {
    const vshi_light_type *type = vshi_light_type_of(light->type);
    vshi_light_place place = {0};
    if (type != NULL) {
        type->place(light, &place);
    }
    return place;
}

vshi_light_place vshi_light_moved(const vshi_light_place *place, const double matrix[12], double unit) {
    vshi_light_place moved = *place;
    moved.towards = vshi_unit(vshi_transform_vector(matrix, place->towards));
    moved.centre = vshi_transform_point(matrix, place->centre);
    moved.radius = place->radius / unit;
    if (place->shape != NULL) {
        place->shape->move(&moved, matrix, unit);
    }
    return moved;
}

void vsh_light_text(const vsh_light *light, char *text, size_t size) {
    VSHI_NUMBERS;
    const vshi_light_type *type = vshi_light_type_of(light->type);
    const double *c = light->color;
    char shape[256] = "", color[80] = "", falloff[48] = "";
    if (type != NULL) {
        type->describe(light, shape, sizeof shape);
    }
    if (c[0] != 1.0 || c[1] != 1.0 || c[2] != 1.0) {
        snprintf(color, sizeof color, ", color %.9g %.9g %.9g", c[0], c[1], c[2]);
    }
    if (type != NULL && type->falls_off && light->falloff == VSH_FALLOFF_INVERSE_SQUARE) {
        snprintf(falloff, sizeof falloff, ", inverse square");
    } else if (type != NULL && type->falls_off && light->falloff == VSH_FALLOFF_QUADRATIC) {
        snprintf(falloff, sizeof falloff, ", quadratic to %.9g", light->reach);
    }
    snprintf(text, size, "%s%s%s", shape, color, falloff);
}
