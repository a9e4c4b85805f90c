/* A table's top, a block beside it and a rectangular light, with brute force over its parts: their tests. */
#ifndef TESTS_RECTANGLES_H
#define TESTS_RECTANGLES_H

#include "field/field.h"
#include "traced.h"
#include "volumes.h"

enum { EDGE = 24, COUNT = EDGE * EDGE, PARTS = 96 };

/* A table's top and a block beside it, over the receivers' plane y = 0. */
static const truth_solid SOLIDS[] = {
    {.shape = TRUTH_BOX, .center = {0.1, 0.9, 0.0}, .half = {0.5, 0.1, 0.35}},
    {.shape = TRUTH_BOX, .center = {-0.9, 0.35, 0.6}, .half = {0.2, 0.35, 0.3}},
};
static const truth_scene SCENE = {SOLIDS, 2};
static const double VOXEL = 0.02;

static double positions[3 * COUNT];
static float normals[3 * COUNT];

static inline void place_receivers(void) {
    for (size_t i = 0; i < COUNT; ++i) {
        positions[3 * i] = -2.0 + 4.0 * ((double)(i % EDGE) + 0.5) / EDGE;
        positions[3 * i + 1] = 0.0;
        positions[3 * i + 2] = -2.0 + 4.0 * ((double)(i / EDGE) + 0.5) / EDGE;
        normals[3 * i] = normals[3 * i + 2] = 0.0f;
        normals[3 * i + 1] = 1.0f;
    }
}

static inline vsh_light panel(const double centre[3], const double u[3], const double v[3]) {
    vsh_light light = vsh_light_default();
    light.type = VSH_LIGHT_RECTANGLE;
    memcpy(light.position, centre, sizeof light.position);
    memcpy(light.edge_u, u, sizeof light.edge_u);
    memcpy(light.edge_v, v, sizeof light.edge_v);
    strcpy(light.name, "panel");
    return light;
}

/* On a ceiling, leaning, a tube close over the table, a wall that reaches below the floor (by whole parts), a
 * large one close over the table. */
static inline vsh_light light_of(int which) {
    static const double DATA[][9] = {
        {0.2, 2.4, -0.3, 1.2, 0.0, 0.0, 0.0, 0.0, 0.8},   {-1.2, 2.0, 0.4, 0.6, 0.6, 0.0, 0.0, 0.0, 1.0},
        {0.0, 1.3, 0.1, 2.4, 0.0, 0.0, 0.0, 0.0, 0.1},    {2.2, 0.75, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 3.0},
        {-0.2, 1.15, 0.05, 1.6, 0.0, 0.0, 0.0, 0.0, 1.2},
    };
    const double *d = DATA[which];
    vsh_light light = panel(d, d + 3, d + 6);
    light.two_sided = 1;
    return light;
}
enum { LIGHTS = 5 };

/* Whether the segment from a to b meets the inside of a solid of the scene. */
static inline bool is_cut(const double a[3], const double b[3]) {
    for (size_t s = 0; s < SCENE.count; ++s) {
        double first = 0.0, last = 1.0;
        for (int axis = 0; axis < 3; ++axis) {
            const double low = SOLIDS[s].center[axis] - SOLIDS[s].half[axis] - a[axis];
            const double high = SOLIDS[s].center[axis] + SOLIDS[s].half[axis] - a[axis];
            const double way = b[axis] - a[axis];
            if (way == 0.0) {
                last = low > 0.0 || high < 0.0 ? -1.0 : last;
                continue;
            }
            first = fmax(first, fmin(low / way, high / way));
            last = fmin(last, fmax(low / way, high / way));
        }
        if (first < last) {
            return true;
        }
    }
    return false;
}

/* Fraction of the light's solid angle that a point sees, in *solid all of it. */
static inline double look(const vsh_light *light, const double *from, const float *normal, bool in_the_way,
                          double *solid) {
    double n[3], all = 0.0, seen = 0.0;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        n[i] = light->edge_u[j] * light->edge_v[k] - light->edge_u[k] * light->edge_v[j]; /* of its area */
    }
    for (int i = 0; i < PARTS * PARTS; ++i) {
        const double u = (i % PARTS + 0.5) / PARTS - 0.5, v = ((double)(i / PARTS) + 0.5) / PARTS - 0.5;
        double at[3], square = 0.0, across = 0.0, up = 0.0;
        for (int axis = 0; axis < 3; ++axis) {
            at[axis] = light->position[axis] + u * light->edge_u[axis] + v * light->edge_v[axis];
            const double way = at[axis] - from[axis];
            square += way * way;
            across -= way * n[axis];
            up += normal != NULL ? way * (double)normal[axis] : 1.0;
        }
        const double weight = fabs(across) / (square * sqrt(square) * PARTS * PARTS);
        all += weight;
        seen += (across > 0.0 || light->two_sided) && up > 0.0 && !(in_the_way && is_cut(from, at)) ? weight
                                                                                                    : 0.0;
    }
    if (solid != NULL) {
        *solid = all;
    }
    return seen / all;
}

static inline vsh_shade_options options_of(int32_t method) {
    vsh_shade_options options = vsh_shade_options_default();
    options.method = method;
    options.rays = 256;
    return options;
}

static inline void shade_by(const vsh_occluders *occluders, const vsh_light *light,
                            const vsh_shade_options *options, float *values, float *deviation) {
    const vsh_points points = {COUNT, positions, normals, NULL};
    assert_ok(vsh_shade_shadow(occluders, &points, light, options, NULL, values, deviation, NULL, &failure));
}

static inline void shade(const casting *c, const vsh_light *light, const vsh_shade_options *options,
                         float *values, float *deviation) {
    shade_by(occluders_of_caster(c), light, options, values, deviation);
}

typedef struct difference {
    double root_mean_square, largest, bias;
} difference;

static inline difference compare(const float *values, const double *truth) {
    difference d = {0.0, 0.0, 0.0};
    for (size_t i = 0; i < COUNT; ++i) {
        const double off = (double)values[i] - truth[i];
        d.root_mean_square += off * off / COUNT;
        d.bias += off / COUNT;
        d.largest = fmax(d.largest, fabs(off));
    }
    d.root_mean_square = sqrt(d.root_mean_square);
    return d;
}

static inline int set_up(void **state) {
    static casting c;
    place_receivers();
    c = caster_of(SCENE, VOXEL, 3.0);
    *state = &c;
    return 0;
}

static inline int tear_down(void **state) {
    caster_free(*state);
    return 0;
}

#endif
