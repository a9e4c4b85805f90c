/* Lights: their types, checks and texts. */
#include "light/light.h"

#include "base/decimal.h"
#include "base/error.h"
#include "base/floats.h"

#include <stdio.h>
#include <string.h>

#define PI 3.14159265358979323846

static const double DEGREES = 180.0 / PI;

/* --- suns */

static void place_sun(const vsh_light *light, vshi_light_place *place) {
    const double half = fmin(0.5 * light->angle, VSHI_LARGEST_HALF), sine = vshi_light_sine(vshi_sin(half));
    *place = (vshi_light_place){.parallel = true,
                                .towards = vshi_unit(vshi_vec_of(light->direction)),
                                .half = sine > 0.0 ? half : 0.0,
                                .sine = sine,
                                .tangent = sine > 0.0 ? vshi_tan(half) : 0.0};
}

static double sun_gain(const vsh_light *light, vshi_vec to_light, double distance) {
    (void)light, (void)to_light, (void)distance;
    return 1.0;
}

static void resize_sun(vsh_light *light, double factor) {
    const double half = vshi_atan(factor * vshi_tan(0.5 * light->angle));
    light->angle = 2.0 * fmin(half, VSHI_LARGEST_HALF);
}

static int describe_sun(const vsh_light *light, char *text, size_t size) {
    const double *d = light->direction;
    return snprintf(text, size, "directional towards %.9g %.9g %.9g, %.9g degrees across", d[0], d[1], d[2],
                    DEGREES * light->angle);
}

/* --- lamps */

static void place_lamp(const vsh_light *light, vshi_light_place *place) {
    *place = (vshi_light_place){.centre = vshi_vec_of(light->position), .radius = light->radius};
}

static double lamp_gain(const vsh_light *light, vshi_vec to_light, double distance) {
    (void)to_light;
    /* at least the lamp's radius, so that the square stays finite */
    return vshi_light_falloff(light, fmax(distance, fmax(light->radius, 1e-30)));
}

static void resize_lamp(vsh_light *light, double factor) {
    light->radius *= factor;
}

static int describe_lamp(const vsh_light *light, char *text, size_t size) {
    const double *p = light->position;
    return snprintf(text, size, "sphere at %.9g %.9g %.9g, radius %.9g", p[0], p[1], p[2], light->radius);
}

/* The light of a lamp, with a smooth edge between the cosines of the outer and inner angles. */
static double spot_gain(const vsh_light *light, vshi_vec to_light, double distance) {
    const double cosine = -vshi_dot(vshi_unit(vshi_vec_of(light->axis)), to_light);
    const double outer = vshi_cos(0.5 * light->outer_angle), inner = vshi_cos(0.5 * light->inner_angle);
    double edge = cosine >= outer ? 1.0 : 0.0;
    if (inner > outer) {
        const double t = fmin(1.0, fmax(0.0, (cosine - outer) / (inner - outer)));
        edge = t * t * (3.0 - 2.0 * t);
    }
    return lamp_gain(light, to_light, distance) * edge;
}

static int describe_spot(const vsh_light *light, char *text, size_t size) {
    const double *d = light->axis, *p = light->position;
    return snprintf(text, size,
                    "spot at %.9g %.9g %.9g towards %.9g %.9g %.9g, radius %.9g, %.9g to %.9g degrees", p[0],
                    p[1], p[2], d[0], d[1], d[2], light->radius, 0.5 * DEGREES * light->inner_angle,
                    0.5 * DEGREES * light->outer_angle);
}

static vsh_result check_spot(const vsh_light *light, vsh_error *error) {
    if (light->inner_angle >= 0.0 && light->inner_angle <= light->outer_angle) {
        return VSH_OK;
    }
    return vshi_fail(error, VSH_ERROR_ARGUMENT,
                     "light '%s': inner_angle %.9g is out of range 0 … outer_angle %.9g", light->name,
                     light->inner_angle, light->outer_angle);
}

/* --- the tables */

static const vshi_light_type sun = {"directional", false,      place_sun, sun_gain,
                                    describe_sun,  resize_sun, NULL};
static const vshi_light_type sphere = {"sphere",      true,        place_lamp, lamp_gain,
                                       describe_lamp, resize_lamp, NULL};
static const vshi_light_type spot = {"spot",        true,        place_lamp, spot_gain,
                                     describe_spot, resize_lamp, check_spot};

static const vshi_light_type *const types[] = {
    [VSH_LIGHT_DIRECTIONAL] = &sun,
    [VSH_LIGHT_SPHERE] = &sphere,
    [VSH_LIGHT_SPOT] = &spot,
    [VSH_LIGHT_RECTANGLE] = &vshi_rectangle_type,
};

enum {
    TYPES = sizeof types / sizeof types[0],
    DIRECTIONAL = 1 << VSH_LIGHT_DIRECTIONAL,
    SPHERE = 1 << VSH_LIGHT_SPHERE,
    SPOT = 1 << VSH_LIGHT_SPOT,
    RECTANGLE = 1 << VSH_LIGHT_RECTANGLE,
};

const vshi_light_type *vshi_light_type_of(int32_t type) {
    return type >= 0 && type < TYPES ? types[type] : NULL;
}

uint32_t vshi_light_types_falling(void) {
    uint32_t bits = 0;
    for (int32_t i = 0; i < TYPES; ++i) {
        bits |= types[i]->falls_off ? 1U << i : 0;
    }
    return bits;
}

uint32_t vshi_light_types_flat(void) {
    uint32_t bits = 0;
    for (int32_t i = 0; i < TYPES; ++i) {
        bits |= vsh_get_name(VSH_NAMES_FLAT_LIGHT, i) != NULL ? 1U << i : 0;
    }
    return bits;
}

#define MEMBER(member) .name = #member, .offset = offsetof(vsh_light, member)

/* A vector of any finite length over 0 that files must give. Scene files use one key for the direction of
 * suns and of spots. */
#define VECTOR(name, of)                                                                                     \
    .key = name, .kind = VSHI_LIGHT_VECTOR, .types = (of), .required = (of), .lowest = -INFINITY,            \
    .highest = INFINITY, .above = true, .below = true, .nonzero = true

/* In the order of the checks. */
const vshi_light_member vshi_light_members[] = {
    {MEMBER(direction), VECTOR("direction", DIRECTIONAL)},
    {MEMBER(axis), VECTOR("direction", SPOT)},
    {MEMBER(position), .key = "position", .kind = VSHI_LIGHT_VECTOR, .types = SPHERE | SPOT | RECTANGLE,
     .required = SPHERE | SPOT | RECTANGLE, .lowest = -INFINITY, .highest = INFINITY, .above = true,
     .below = true},
    {MEMBER(angle), .key = "angle_deg", .kind = VSHI_LIGHT_ANGLE, .types = DIRECTIONAL, .highest = PI,
     .below = true},
    {MEMBER(radius), .key = "radius", .kind = VSHI_LIGHT_NUMBER, .types = SPHERE | SPOT, .highest = INFINITY,
     .below = true},
    {MEMBER(inner_angle), .key = "inner_deg", .kind = VSHI_LIGHT_ANGLE, .types = SPOT, .required = SPOT,
     .highest = 2.0 * PI, .half = true, .apart = true},
    {MEMBER(outer_angle), .key = "outer_deg", .kind = VSHI_LIGHT_ANGLE, .types = SPOT, .required = SPOT,
     .highest = 2.0 * PI, .half = true, .above = true},
    {MEMBER(edge_u), VECTOR("edge_u", RECTANGLE)},
    {MEMBER(edge_v), VECTOR("edge_v", RECTANGLE)},
    {MEMBER(two_sided), .key = "two_sided", .kind = VSHI_LIGHT_SWITCH, .types = RECTANGLE, .highest = 1.0},
};
const size_t vshi_light_member_count = sizeof vshi_light_members / sizeof vshi_light_members[0];

/* --- checks */

static const vshi_light_member color_member = {MEMBER(color), .kind = VSHI_LIGHT_VECTOR, .highest = INFINITY,
                                               .below = true};
static const vshi_light_member reach_member = {MEMBER(reach), .kind = VSHI_LIGHT_NUMBER, .highest = INFINITY,
                                               .above = true, .below = true};

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

vsh_result vsh_light_check(const vsh_light *light, vsh_error *error) {
    VSHI_FLOATS;
    if (light == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "light: is NULL");
    }
    /* Only lights with a channel need a name. */
    if (light->name[0] != '\0' && !vshi_light_name_valid(light->name)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "light: name '%.63s': expected at most 63 letters, digits, '_' and '-'",
                         light->name);
    }
    const vshi_light_type *type = vshi_light_type_of(light->type);
    if (type == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "light '%s': type %d is out of range 0 … %d", light->name,
                         light->type, TYPES - 1);
    }
    if ((uint32_t)light->falloff > VSH_FALLOFF_QUADRATIC) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "light '%s': falloff %d is out of range 0 … %d",
                         light->name, light->falloff, VSH_FALLOFF_QUADRATIC);
    }
    for (size_t i = 0; i < vshi_light_member_count; ++i) {
        const vshi_light_member *m = &vshi_light_members[i];
        if ((m->types & (1U << light->type)) != 0 && !m->apart) {
            VSHI_TRY(check_range(light, m, error));
        }
    }
    VSHI_TRY(check_range(light, &color_member, error));
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
    return types[light->type]->gain(light, to_light, distance);
}

vsh_light vshi_light_resized(const vsh_light *light, double factor) {
    vsh_light resized = *light;
    if (factor != 1.0) {
        types[light->type]->resize(&resized, factor);
    }
    return resized;
}

vshi_light_place vshi_light_in_world(const vsh_light *light) {
    vshi_light_place place;
    types[light->type]->place(light, &place);
    place.reach = light->falloff == VSH_FALLOFF_QUADRATIC ? light->reach : INFINITY;
    place.outer = INFINITY;
    place.rim = -INFINITY;
    if (light->type == VSH_LIGHT_SPOT) {
        place.beam = vshi_unit(vshi_vec_of(light->axis));
        place.outer = 0.5 * light->outer_angle;
        place.rim = vshi_cos(0.5 * light->outer_angle);
    }
    return place;
}

vshi_light_part vshi_light_covers(const vshi_light_place *place, vshi_vec centre, double radius) {
    static const double ROOM = 1.0 + 1e-6; /* proofs use larger balls by this factor, against rounding */
    if (place->parallel) {
        return VSHI_LIGHT_ALL;
    }
    vshi_vec to;
    const double distance = vshi_light_towards(place, centre, &to), cosine = -vshi_dot(place->beam, to);
    if (radius <= 0.0) {
        return distance < place->reach && cosine >= place->rim ? VSHI_LIGHT_ALL : VSHI_LIGHT_NO_PART;
    }
    const double wide = ROOM * radius, angle = vshi_acos(fmin(fmax(cosine, -1.0), 1.0)),
                 half = wide < distance ? ROOM * (0.5 * PI - vshi_acos(wide / distance)) : PI;
    if (distance - wide >= place->reach || angle - half > place->outer) {
        return VSHI_LIGHT_NO_PART;
    }
    return distance + wide < place->reach && angle + half < place->outer ? VSHI_LIGHT_ALL
                                                                         : VSHI_LIGHT_SOME_PART;
}

vshi_light_place vshi_light_moved(const vshi_light_place *place, const double matrix[12], double unit) {
    vshi_light_place moved = *place;
    moved.towards = vshi_unit(vshi_transform_vector(matrix, place->towards));
    moved.centre = vshi_transform_point(matrix, place->centre);
    moved.radius = place->radius / unit;
    moved.reach = place->reach / unit;
    moved.beam = vshi_unit(vshi_transform_vector(matrix, place->beam));
    if (place->shape != NULL) {
        place->shape->move(&moved, matrix, unit);
    }
    return moved;
}

void vsh_light_text(const vsh_light *light, char *text, size_t size) {
    VSHI_NUMBERS;
    const vshi_light_type *type = types[light->type];
    const double *c = light->color;
    char shape[256] = "", color[80] = "", falloff[48] = "";
    type->describe(light, shape, sizeof shape);
    if (c[0] != 1.0 || c[1] != 1.0 || c[2] != 1.0) {
        snprintf(color, sizeof color, ", color %.9g %.9g %.9g", c[0], c[1], c[2]);
    }
    if (type->falls_off && light->falloff == VSH_FALLOFF_INVERSE_SQUARE) {
        snprintf(falloff, sizeof falloff, ", inverse square");
    } else if (type->falls_off && light->falloff == VSH_FALLOFF_QUADRATIC) {
        snprintf(falloff, sizeof falloff, ", quadratic to %.9g", light->reach);
    }
    snprintf(text, size, "%s%s%s", shape, color, falloff);
}
