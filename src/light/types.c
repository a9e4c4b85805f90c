#include "light/types.h"

#include "base/error.h"
#include "light/light.h"

#include <stddef.h>
#include <stdio.h>

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
    /* not nearer than the lamp's own surface, so that the square stays finite */
    return vshi_light_falloff(light, fmax(distance, fmax(light->radius, 1e-30)));
}

static void resize_lamp(vsh_light *light, double factor) {
    light->radius *= factor;
}

static int describe_lamp(const vsh_light *light, char *text, size_t size) {
    const double *p = light->position;
    return snprintf(text, size, "sphere at %.9g %.9g %.9g, radius %.9g", p[0], p[1], p[2], light->radius);
}

/* --- spots: lamps that shine one way */

static double smoothstep(double from, double to, double x) {
    const double t = fmin(1.0, fmax(0.0, (x - from) / (to - from)));
    return t * t * (3.0 - 2.0 * t);
}

/* Smooth edge between the cosines of the outer and the inner angle. */
static double spot_edge(const vsh_light *light, vshi_vec to_light) {
    const double cosine = -vshi_dot(vshi_unit(vshi_vec_of(light->axis)), to_light);
    const double outer = vshi_cos(light->outer_angle), inner = vshi_cos(light->inner_angle);
    return inner > outer ? smoothstep(outer, inner, cosine) : (cosine >= outer ? 1.0 : 0.0);
}

static double spot_gain(const vsh_light *light, vshi_vec to_light, double distance) {
    return lamp_gain(light, to_light, distance) * spot_edge(light, to_light);
}

static int describe_spot(const vsh_light *light, char *text, size_t size) {
    const double *d = light->axis, *p = light->position;
    return snprintf(text, size,
                    "spot at %.9g %.9g %.9g towards %.9g %.9g %.9g, radius %.9g, %.9g to %.9g degrees", p[0],
                    p[1], p[2], d[0], d[1], d[2], light->radius, DEGREES * light->inner_angle,
                    DEGREES * light->outer_angle);
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

static const vshi_light_type types[] = {
    [VSH_LIGHT_DIRECTIONAL] = {.name = "directional",
                               .place = place_sun,
                               .gain = sun_gain,
                               .describe = describe_sun,
                               .resize = resize_sun},
    [VSH_LIGHT_SPHERE] = {.name = "sphere",
                          .falls_off = true,
                          .place = place_lamp,
                          .gain = lamp_gain,
                          .describe = describe_lamp,
                          .resize = resize_lamp},
    [VSH_LIGHT_SPOT] = {.name = "spot",
                        .falls_off = true,
                        .place = place_lamp,
                        .gain = spot_gain,
                        .describe = describe_spot,
                        .resize = resize_lamp,
                        .check = check_spot},
    [VSH_LIGHT_RECTANGLE] = {.name = "rectangle",
                             .falls_off = true,
                             .place = vshi_rectangle_place,
                             .gain = vshi_rectangle_gain,
                             .describe = vshi_rectangle_describe,
                             .resize = vshi_rectangle_resize,
                             .check = vshi_rectangle_check},
};

enum {
    TYPES = sizeof types / sizeof types[0],
    DIRECTIONAL = 1 << VSH_LIGHT_DIRECTIONAL,
    SPHERE = 1 << VSH_LIGHT_SPHERE,
    SPOT = 1 << VSH_LIGHT_SPOT,
    RECTANGLE = 1 << VSH_LIGHT_RECTANGLE,
};

const vshi_light_type *vshi_light_type_of(int32_t type) {
    return type >= 0 && type < TYPES ? &types[type] : NULL;
}

uint32_t vshi_light_types_falling(void) {
    uint32_t bits = 0;
    for (int32_t i = 0; i < TYPES; ++i) {
        bits |= types[i].falls_off ? 1U << i : 0;
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

#define EDGE(name)                                                                                           \
    .key = name, .kind = VSHI_LIGHT_VECTOR, .types = RECTANGLE, .required = RECTANGLE, .lowest = -INFINITY,  \
    .highest = INFINITY, .above = true, .below = true, .nonzero = true

/* One key of two members: what a sun's direction and a spot's are called in scene files. */
#define TOWARDS_OR_AXIS(type)                                                                                \
    .key = "direction", .kind = VSHI_LIGHT_VECTOR, .types = (type), .required = (type), .lowest = -INFINITY, \
    .highest = INFINITY, .above = true, .below = true, .nonzero = true

/* In the order in which they are checked. */
const vshi_light_member vshi_light_members[] = {
    {MEMBER(direction), TOWARDS_OR_AXIS(DIRECTIONAL)},
    {MEMBER(axis), TOWARDS_OR_AXIS(SPOT)},
    {MEMBER(position), .key = "position", .kind = VSHI_LIGHT_VECTOR, .types = SPHERE | SPOT | RECTANGLE,
     .required = SPHERE | SPOT | RECTANGLE, .lowest = -INFINITY, .highest = INFINITY, .above = true,
     .below = true},
    {MEMBER(angle), .key = "angle_deg", .kind = VSHI_LIGHT_ANGLE, .types = DIRECTIONAL, .highest = PI,
     .below = true},
    {MEMBER(radius), .key = "radius", .kind = VSHI_LIGHT_NUMBER, .types = SPHERE | SPOT, .highest = INFINITY,
     .below = true},
    {MEMBER(inner_angle), .key = "inner_deg", .kind = VSHI_LIGHT_ANGLE, .types = SPOT, .required = SPOT,
     .highest = PI, .apart = true},
    {MEMBER(outer_angle), .key = "outer_deg", .kind = VSHI_LIGHT_ANGLE, .types = SPOT, .required = SPOT,
     .highest = PI, .above = true},
    {MEMBER(edge_u), EDGE("edge_u")},
    {MEMBER(edge_v), EDGE("edge_v")},
    {MEMBER(two_sided), .key = "two_sided", .kind = VSHI_LIGHT_SWITCH, .types = RECTANGLE, .highest = 1.0},
};
const size_t vshi_light_member_count = sizeof vshi_light_members / sizeof vshi_light_members[0];
