/* Surfaces of a few charts, and lightmaps of them with given values, for the tests of seams. */
#pragma once
#include "testing.h"

enum { SIDE = 64, TEXELS = SIDE * SIDE, MOST_VERTICES = 1024 };

/* Charts that quads are added to: four corners each, whose places, normals and texels are given. */
typedef struct charts_mesh {
    float positions[3 * MOST_VERTICES], normals[3 * MOST_VERTICES], uvs[2 * MOST_VERTICES];
    uint32_t indices[6 * MOST_VERTICES / 4];
    vsh_mesh mesh;
} charts_mesh;

static inline charts_mesh *new_mesh(void) {
    charts_mesh *m = calloc(1, sizeof *m);
    m->mesh = (vsh_mesh){.name = "charts", .positions = m->positions, .uvs = m->uvs, .indices = m->indices};
    return m;
}

/* A quad in the plane z = 0 between two corners, anticlockwise; uv[k]: of its corner k, texels. */
static inline void add_quad(charts_mesh *m, const double corner[4][3], const double texel[4][2]) {
    const uint32_t first = (uint32_t)m->mesh.vertex_count;
    for (size_t k = 0; k < 4; ++k) {
        for (size_t c = 0; c < 3; ++c) {
            m->positions[3 * (first + k) + c] = (float)corner[k][c];
        }
        m->uvs[2 * (first + k)] = (float)(texel[k][0] / SIDE);
        m->uvs[2 * (first + k) + 1] = (float)(1.0 - texel[k][1] / SIDE);
    }
    for (size_t k = 0; k < 6; ++k) {
        m->indices[3 * m->mesh.triangle_count + k] = first + QUAD_INDICES[k];
    }
    m->mesh.vertex_count += 4;
    m->mesh.triangle_count += 2;
}

/* The flat square [x, x + 1] × [0, 1], its chart a square of `size` texels whose corner (x, 0) is at `at`,
 * turned by `degrees` about it; `mirror` -1: mirrored. */
static inline void add_square(charts_mesh *m, double x, const double at[2], double size, double degrees,
                              double mirror) {
    const double corner[4][3] = {{x, 0, 0}, {x + 1, 0, 0}, {x + 1, 1, 0}, {x, 1, 0}};
    const double c = cos(degrees * 0.017453292519943295), s = sin(degrees * 0.017453292519943295);
    double texel[4][2];
    for (int k = 0; k < 4; ++k) {
        const double u = (corner[k][0] - x) * size * mirror, v = -corner[k][1] * size;
        texel[k][0] = at[0] + c * u - s * v;
        texel[k][1] = at[1] + s * u + c * v;
    }
    add_quad(m, corner, texel);
}

static inline vsh_charts *charts_of(const vsh_mesh *meshes, size_t count) {
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = SIDE;
    vsh_charts *charts = NULL;
    assert_ok(vsh_charts_create(meshes, count, &options, NULL, NULL, &charts, &failure));
    return charts;
}

static inline vsh_stitch_report stitch(const vsh_mesh *meshes, size_t count, const vsh_lightmap *lightmap,
                                       size_t lights, double max_change) {
    OWNED(vsh_charts) *charts = charts_of(meshes, count);
    vsh_stitch_options options = vsh_stitch_options_default();
    options.max_change = max_change;
    vsh_stitch_report report;
    assert_ok(stitch_one(charts, lightmap, lights, &options, NULL, &report, &failure));
    return report;
}

static inline float *new_plane(float value) {
    float *plane = malloc(TEXELS * sizeof *plane);
    for (size_t i = 0; i < TEXELS; ++i) {
        plane[i] = value;
    }
    return plane;
}

/* A random value, the same in every run. */
static inline float random_value(uint32_t *state) {
    return (float)next_random(state);
}

static inline float *random_plane(uint32_t seed) {
    float *plane = new_plane(0.0f);
    for (size_t i = 0; i < TEXELS; ++i) {
        plane[i] = random_value(&seed);
    }
    return plane;
}

static inline vsh_stitch_report stitch_ao(const charts_mesh *m, float *ao, double max_change) {
    const vsh_lightmap map = {.ao = ao};
    return stitch(&m->mesh, 1, &map, 0, max_change);
}

/* A bilinear lookup at a place, texels. */
static inline double look_up(const float *plane, double x, double y) {
    const double left = floor(x - 0.5), top = floor(y - 0.5), tx = x - 0.5 - left, ty = y - 0.5 - top;
    double sum = 0.0;
    for (int k = 0; k < 4; ++k) {
        const int column = (int)fmin(fmax(left + k % 2, 0.0), SIDE - 1.0);
        const int row = (int)fmin(fmax(top + k / 2, 0.0), SIDE - 1.0);
        sum += (k % 2 ? tx : 1.0 - tx) * (k / 2 ? ty : 1.0 - ty) * (double)plane[row * SIDE + column];
    }
    return sum;
}

/* The largest difference between two edges: from corner a to b of the first mesh, c to d of the second. */
static inline double between(const float *plane, const charts_mesh *first, uint32_t a, uint32_t b,
                             const charts_mesh *second, uint32_t c, uint32_t d) {
    enum { STEPS = 997 };
    double most = 0.0;
    for (int s = 0; s <= STEPS; ++s) {
        const double t = (double)s / STEPS;
        double value[2];
        for (int side = 0; side < 2; ++side) {
            const float *uvs = side == 0 ? first->uvs : second->uvs;
            const float *from = uvs + 2 * (side == 0 ? a : c), *to = uvs + 2 * (side == 0 ? b : d);
            const double u = (double)from[0] + t * ((double)to[0] - (double)from[0]);
            const double v = (double)from[1] + t * ((double)to[1] - (double)from[1]);
            value[side] = look_up(plane, u * SIDE, (1.0 - v) * SIDE);
        }
        most = fmax(most, fabs(value[0] - value[1]));
    }
    return most;
}

/* The largest difference between two edges of one mesh, whose corners are numbered through all its quads. */
static inline double across(const charts_mesh *m, const float *plane, uint32_t a, uint32_t b, uint32_t c,
                            uint32_t d) {
    return between(plane, m, a, b, m, c, d);
}

/* Two squares side by side, their charts apart and one of them turned, or mirrored; corners 1, 2 and 4, 7 are
 * the same places. */
static const double SECOND[2] = {41.2, 39.3}; /* its corner, texels: all turns of it stay in the image */

static inline charts_mesh *two_squares(double degrees, double mirror) {
    charts_mesh *m = new_mesh();
    add_square(m, 0.0, (const double[]){4.3, 25.6}, 18.0, 0.0, 1.0);
    add_square(m, 1.0, SECOND, 14.0, degrees, mirror);
    return m;
}

/* Whether a texel is beyond the reach of the second square and its padding. */
static inline bool is_first(size_t texel) {
    const double x = (double)(texel % SIDE) + 0.5 - SECOND[0], y = (double)(texel / SIDE) + 0.5 - SECOND[1];
    return x * x + y * y > 21.2 * 21.2;
}
