/* Meshes put together from parts, for tests of solids. */
#pragma once

#include "testing.h"

enum { SHAPE_VERTICES = 40000, SHAPE_TRIANGLES = 80000 };

typedef struct shape {
    float positions[SHAPE_VERTICES][3];
    uint32_t indices[SHAPE_TRIANGLES][3];
    size_t vertices, triangles;
} shape;

static inline shape *shape_new(void) {
    shape *s = calloc(1, sizeof *s);
    return s;
}

static inline vsh_mesh shape_mesh(const shape *s, const char *name) {
    return mesh_of_arrays(name, s->positions[0], NULL, s->vertices, s->indices[0], s->triangles);
}

static inline uint32_t shape_vertex(shape *s, double x, double y, double z) {
    assert_true(s->vertices < SHAPE_VERTICES);
    s->positions[s->vertices][0] = (float)x;
    s->positions[s->vertices][1] = (float)y;
    s->positions[s->vertices][2] = (float)z;
    return (uint32_t)s->vertices++;
}

static inline void shape_triangle(shape *s, uint32_t a, uint32_t b, uint32_t c) {
    assert_true(s->triangles < SHAPE_TRIANGLES);
    s->indices[s->triangles][0] = a;
    s->indices[s->triangles][1] = b;
    s->indices[s->triangles++][2] = c;
}

static inline void shape_quad(shape *s, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    shape_triangle(s, a, b, c);
    shape_triangle(s, a, c, d);
}

/* A quad with vertices of its own. */
static inline void shape_quad_at(shape *s, const double corners[4][3]) {
    const uint32_t first = (uint32_t)s->vertices;
    for (int k = 0; k < 4; ++k) {
        shape_vertex(s, corners[k][0], corners[k][1], corners[k][2]);
    }
    shape_quad(s, first, first + 1, first + 2, first + 3);
}

/* Turns the triangles from `first` on over. */
static inline void shape_turn(shape *s, size_t first) {
    for (size_t i = first; i < s->triangles; ++i) {
        const uint32_t kept = s->indices[i][1];
        s->indices[i][1] = s->indices[i][2];
        s->indices[i][2] = kept;
    }
}

enum { LEFT = 1, RIGHT = 2, FRONT = 4, BACK = 8, BOTTOM = 16, TOP = 32, ALL_SIDES = 63 };

/* Adds the sides of a box that the bits of `sides` choose, each with four vertices. They look outwards. */
static inline void shape_box(shape *s, const double low[3], const double high[3], unsigned sides) {
    static const int corner[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    for (int f = 0; f < 6; ++f) {
        if ((sides >> f & 1) != 0) {
            double at[4][3];
            for (int i = 0; i < 12; ++i) {
                at[i / 3][i % 3] = (corner[f][i / 3] >> i % 3 & 1 ? high : low)[i % 3];
            }
            shape_quad_at(s, (const double(*)[3])at);
        }
    }
}

/* A surface of revolution about z: `rings` radii and heights, from the bottom up; it looks outwards. Radii of
 * 0 close it. */
static inline void shape_turned(shape *s, const double centre[3], const double (*rings)[2], size_t count,
                                uint32_t around) {
    const uint32_t first = (uint32_t)s->vertices;
    for (size_t r = 0; r < count; ++r) {
        for (uint32_t i = 0; i < around; ++i) {
            const double angle = 6.283185307179586 * i / around;
            shape_vertex(s, centre[0] + rings[r][0] * cos(angle), centre[1] + rings[r][0] * sin(angle),
                         centre[2] + rings[r][1]);
        }
    }
    for (uint32_t r = 0; r + 1 < count; ++r) {
        for (uint32_t i = 0; i < around; ++i) {
            const uint32_t a = first + r * around + i, b = first + r * around + (i + 1) % around;
            if (rings[r][0] > 0.0) {
                shape_triangle(s, a, b, b + around);
            }
            if (rings[r + 1][0] > 0.0) {
                shape_triangle(s, a, b + around, a + around);
            }
        }
    }
}

/* The part of a sphere between two heights, radii; -1 and 1: all of it. */
static inline void shape_ball(shape *s, const double centre[3], double radius, double from, double to,
                              uint32_t around) {
    double rings[128][2];
    const size_t count = around / 2 + 1 < 128 ? around / 2 + 1 : 128;
    const double begin = asin(from), end = asin(to);
    for (size_t i = 0; i < count; ++i) {
        const double at = begin + (end - begin) * (double)i / (double)(count - 1);
        rings[i][0] = radius * cos(at);
        rings[i][1] = radius * sin(at);
        if (rings[i][0] < 1e-9 * radius) {
            rings[i][0] = 0.0;
        }
    }
    shape_turned(s, centre, (const double(*)[2])rings, count, around);
}
