#include "light/light.h"

#include "base/elementary.h"
#include "base/error.h"
#include "base/floats.h"
#include "base/numbers.h"
#include "base/vec.h"

#include <stdio.h>
#include <string.h>

#define PI 3.14159265358979323846

enum {
    DIRECTIONAL = 1 << VSH_LIGHT_DIRECTIONAL,
    SPHERE = 1 << VSH_LIGHT_SPHERE,
    SPOT = 1 << VSH_LIGHT_SPOT,
    ALL = DIRECTIONAL | SPHERE | SPOT,
};

/* One number, or three, that a light of some types must have in a range. */
typedef struct field {
    const char *name;
    size_t offset;
    int count;
    int types;
    double lowest, highest;
    bool above, below; /* ends that are excluded */
    bool nonzero;      /* not all of the numbers may be 0 */
} field;

/* Infinity as an excluded end stands for: any finite value. */
static const field fields[] = {
    {"direction", offsetof(vsh_light, direction), 3, DIRECTIONAL | SPOT, -INFINITY, INFINITY, true, true,
     true},
    {"position", offsetof(vsh_light, position), 3, SPHERE | SPOT, -INFINITY, INFINITY, true, true, false},
    {"angle", offsetof(vsh_light, angle), 1, DIRECTIONAL, 0.0, PI, false, true, false},
    {"radius", offsetof(vsh_light, radius), 1, SPHERE | SPOT, 0.0, INFINITY, false, true, false},
    {"outer_angle", offsetof(vsh_light, outer_angle), 1, SPOT, 0.0, PI, true, false, false},
    {"color", offsetof(vsh_light, color), 3, ALL, 0.0, INFINITY, false, true, false},
};

static const field reach_field = {
    "reach", offsetof(vsh_light, reach), 1, SPHERE | SPOT, 0.0, INFINITY, true, true, false};

bool vshi_light_name_valid(const char *name) {
    static const char allowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
    const size_t length = strnlen(name, sizeof(((vsh_light *)NULL)->name));
    return length > 0 && length < sizeof(((vsh_light *)NULL)->name) && strspn(name, allowed) == length;
}

static vsh_result check_field(const vsh_light *light, const field *f, vsh_error *error) {
    static const char *const items[2][3] = {{""}, {"[0]", "[1]", "[2]"}};
    double values[3];
    memcpy(values, (const char *)light + f->offset, (size_t)f->count * sizeof values[0]);
    bool zero = true;
    for (int i = 0; i < f->count; ++i) {
        const bool above = f->above ? values[i] > f->lowest : values[i] >= f->lowest;
        const bool below = f->below ? values[i] < f->highest : values[i] <= f->highest;
        if (!above || !below) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "light '%s': %s%s %.9g is out of range %.9g%s … %.9g%s", light->name, f->name,
                             items[f->count == 3][i], values[i], f->lowest, f->above ? " (excluded)" : "",
                             f->highest, f->below ? " (excluded)" : "");
        }
        zero = zero && values[i] == 0.0;
    }
    if (zero && f->nonzero) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "light '%s': %s (0, 0, 0): expected a length over 0",
                         light->name, f->name);
    }
    return VSH_OK;
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
    if (light->type < VSH_LIGHT_DIRECTIONAL || light->type > VSH_LIGHT_SPOT) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "light '%s': type %d is out of range 0 … %d", light->name,
                         light->type, VSH_LIGHT_SPOT);
    }
    if (light->falloff < VSH_FALLOFF_NONE || light->falloff > VSH_FALLOFF_QUADRATIC) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "light '%s': falloff %d is out of range 0 … %d",
                         light->name, light->falloff, VSH_FALLOFF_QUADRATIC);
    }
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; ++i) {
        if ((fields[i].types & (1 << light->type)) != 0) {
            const vsh_result result = check_field(light, &fields[i], error);
            if (result != VSH_OK) {
                return result;
            }
        }
    }
    if (light->type == VSH_LIGHT_SPOT &&
        !(light->inner_angle >= 0.0 && light->inner_angle <= light->outer_angle)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "light '%s': inner_angle %.9g is out of range 0 … outer_angle %.9g", light->name,
                         light->inner_angle, light->outer_angle);
    }
    if (light->falloff == VSH_FALLOFF_QUADRATIC && light->type != VSH_LIGHT_DIRECTIONAL) {
        return check_field(light, &reach_field, error);
    }
    return VSH_OK;
}

static double smoothstep(double from, double to, double x) {
    const double t = fmin(1.0, fmax(0.0, (x - from) / (to - from)));
    return t * t * (3.0 - 2.0 * t);
}

static double falloff(const vsh_light *light, double distance) {
    if (light->falloff == VSH_FALLOFF_INVERSE_SQUARE) {
        return 1.0 / (distance * distance);
    }
    if (light->falloff == VSH_FALLOFF_QUADRATIC) {
        const double left = 1.0 - fmin(1.0, distance / light->reach);
        return left * left;
    }
    return 1.0;
}

/* Smooth edge between the cosines of the outer and the inner angle. */
static double spot(const vsh_light *light, vshi_vec to_light) {
    const double cosine = -vshi_dot(vshi_unit(vshi_vec_of(light->direction)), to_light);
    const double outer = vshi_cos(light->outer_angle), inner = vshi_cos(light->inner_angle);
    return inner > outer ? smoothstep(outer, inner, cosine) : (cosine >= outer ? 1.0 : 0.0);
}

double vshi_light_gain(const vsh_light *light, vshi_vec to_light, double distance) {
    if (light->type == VSH_LIGHT_DIRECTIONAL) {
        return 1.0;
    }
    return falloff(light, distance) * (light->type == VSH_LIGHT_SPOT ? spot(light, to_light) : 1.0);
}

static int describe_shape(const vsh_light *light, char *text, size_t size) {
    const double degrees = 180.0 / PI, *d = light->direction, *p = light->position;
    switch (light->type) {
    case VSH_LIGHT_DIRECTIONAL:
        return snprintf(text, size, "directional towards %.9g %.9g %.9g, %.9g degrees across", d[0], d[1],
                        d[2], degrees * light->angle);
    case VSH_LIGHT_SPHERE:
        return snprintf(text, size, "sphere at %.9g %.9g %.9g, radius %.9g", p[0], p[1], p[2], light->radius);
    default:
        return snprintf(text, size,
                        "spot at %.9g %.9g %.9g towards %.9g %.9g %.9g, radius %.9g, %.9g to %.9g degrees",
                        p[0], p[1], p[2], d[0], d[1], d[2], light->radius, degrees * light->inner_angle,
                        degrees * light->outer_angle);
    }
}

void vshi_light_text(const vsh_light *light, char *text, size_t size) {
    VSHI_NUMBERS;
    const double *c = light->color;
    char shape[256], color[80] = "", falloff[48] = "";
    describe_shape(light, shape, sizeof shape);
    if (c[0] != 1.0 || c[1] != 1.0 || c[2] != 1.0) {
        snprintf(color, sizeof color, ", color %.9g %.9g %.9g", c[0], c[1], c[2]);
    }
    if (light->type != VSH_LIGHT_DIRECTIONAL && light->falloff == VSH_FALLOFF_INVERSE_SQUARE) {
        snprintf(falloff, sizeof falloff, ", inverse square");
    } else if (light->type != VSH_LIGHT_DIRECTIONAL && light->falloff == VSH_FALLOFF_QUADRATIC) {
        snprintf(falloff, sizeof falloff, ", quadratic to %.9g", light->reach);
    }
    snprintf(text, size, "%s%s%s", shape, color, falloff);
}
