/* Terrains for tests: rolling hills with terraces whose risers are steep, and a few towers one sample wide.
 */
#pragma once

#include "geometry/mesh.h"
#include "shading.h"
#include "testing.h"
#include "truth/embree.h"
#include "truth/metrics.h"

/* Height 0 … 1 of sample (i, j) of n × n. The hills are the same for every n. */
static inline float hill(int i, int j, int n) {
    const double x = (double)j / (n - 1), z = (double)i / (n - 1);
    double y = 0.5 + 0.25 * sin(9.0 * x + 2.0 * z) * cos(7.0 * z - x) + 0.12 * sin(23.0 * x - 11.0 * z) +
               0.05 * cos(41.0 * z + 17.0 * x);
    const double terrace = floor(y * 6.0) / 6.0;
    y = 0.4 * y + 0.6 * (terrace + fmin(6.0 * (y - terrace), 1.0) / 6.0 * 0.3);
    if (i * 7 % n < 7 && j * 5 % n < 5 && i > 0 && j > 0) {
        y += 0.4; /* a tower */
    }
    return (float)y;
}

static inline float *hills(int columns, int rows) {
    float *values = malloc((size_t)columns * (size_t)rows * sizeof *values);
    for (int i = 0; i < rows; ++i) {
        for (int j = 0; j < columns; ++j) {
            values[i * columns + j] = hill(i, j, columns);
        }
    }
    return values;
}

static inline vsh_heights_source source_of(const float *values, int columns, int rows, double size,
                                           double height) {
    return (vsh_heights_source){.name = "hills",
                                .columns = columns,
                                .rows = rows,
                                .values = values,
                                .size = {size, size * (rows - 1) / (columns - 1)},
                                .height = height};
}

static inline vsh_model *model_of(const vsh_heights_source *source, int32_t what) {
    vsh_model *model = NULL;
    assert_ok(vsh_model_from_heights(source, what, NULL, &model, &failure));
    return model;
}

static inline vshi_heights *heights_of(const vsh_heights_source *source) {
    vshi_heights *heights = NULL;
    assert_ok(vshi_heights_create(source, NULL, &heights, &failure));
    return heights;
}

/* Point `number` of triangle `face`, by two shares of its edges, a little above it, and the facet's normal.
 */
static inline void stand_on(const vsh_mesh *mesh, size_t face, double b, double c, size_t number,
                            double *positions, float *normals) {
    vshi_vec corner[3];
    vshi_mesh_triangle(mesh, face, corner);
    const vshi_vec ab = vshi_sub(corner[1], corner[0]), ac = vshi_sub(corner[2], corner[0]);
    const vshi_vec n = vshi_unit(vshi_cross(ab, ac));
    const vshi_vec p = vshi_add(corner[0], vshi_add(vshi_scale(ab, b), vshi_scale(ac, c)));
    const vshi_vec q = vshi_add(p, vshi_scale(n, 1e-4));
    memcpy(positions + 3 * number, (const double[]){q.x, q.y, q.z}, sizeof(double[3]));
    memcpy(normals + 3 * number, (const float[]){(float)n.x, (float)n.y, (float)n.z}, sizeof(float[3]));
}
