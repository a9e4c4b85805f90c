/* Texels of small meshes, for their tests. */
#pragma once

#include "handles.h"
#include "previews.h"
#include "testing.h"

static inline vsh_lightmap_options size_of(int32_t width, int32_t height, int32_t supersample) {
    vsh_lightmap_options options = preview_lightmap_options();
    options.width = width;
    options.height = height;
    options.supersample = supersample;
    return options;
}

/* A quad in the plane z = 0 at x = 2 u, y = 3 v, facing +z. */
typedef struct quad {
    float positions[12], uvs[8];
    vsh_mesh mesh;
} quad;

static inline void make_quad(quad *q, float u0, float v0, float u1, float v1) {
    const float corner[4][2] = {{u0, v0}, {u1, v0}, {u1, v1}, {u0, v1}};
    for (int k = 0; k < 4; ++k) {
        q->uvs[2 * k] = corner[k][0];
        q->uvs[2 * k + 1] = corner[k][1];
        q->positions[3 * k] = 2.0f * corner[k][0];
        q->positions[3 * k + 1] = 3.0f * corner[k][1];
        q->positions[3 * k + 2] = 0.0f;
    }
    q->mesh = quad_mesh("quad", q->positions, q->uvs);
}

/* A UV sphere with smooth normals and its own chart; `rows` × 2 rows segments. */
typedef struct sphere {
    float *positions, *normals, *uvs;
    uint32_t *indices;
    vsh_mesh mesh;
} sphere;

static inline void make_sphere(sphere *s, uint32_t rows, double radius) {
    const uint32_t columns = 2 * rows;
    const size_t vertices = (size_t)(rows + 1) * (columns + 1);
    s->positions = malloc(vertices * 3 * sizeof(float));
    s->normals = malloc(vertices * 3 * sizeof(float));
    s->uvs = malloc(vertices * 2 * sizeof(float));
    s->indices = malloc((size_t)rows * columns * 6 * sizeof(uint32_t));
    size_t v = 0, i = 0;
    for (uint32_t r = 0; r <= rows; ++r) {
        for (uint32_t c = 0; c <= columns; ++c, ++v) {
            const double polar = 3.141592653589793 * r / rows, around = 6.283185307179586 * c / columns;
            const double ring = r == 0 || r == rows ? 0.0 : sin(polar); /* exact poles: no slivers */
            const double n[3] = {ring * cos(around), cos(polar), -ring * sin(around)};
            for (int k = 0; k < 3; ++k) {
                s->normals[3 * v + (size_t)k] = (float)n[k];
                s->positions[3 * v + (size_t)k] = (float)(radius * n[k]);
            }
            s->uvs[2 * v] = (float)c / (float)columns;
            s->uvs[2 * v + 1] = 1.0f - (float)r / (float)rows;
        }
    }
    for (uint32_t r = 0; r < rows; ++r) {
        for (uint32_t c = 0; c < columns; ++c) {
            const uint32_t a = r * (columns + 1) + c, b = a + columns + 1;
            const uint32_t both[6] = {a, b, b + 1, a, b + 1, a + 1};
            memcpy(s->indices + i, both, sizeof both);
            i += 6;
        }
    }
    s->mesh = mesh_of_arrays("sphere", s->positions, s->uvs, vertices, s->indices, i / 3);
    s->mesh.normals = s->normals;
}

static inline void free_sphere(sphere *s) {
    free(s->indices);
    free(s->uvs);
    free(s->normals);
    free(s->positions);
}
