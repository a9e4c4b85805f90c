/* Gaps between charts, compared with those of all borders. */
#include "fields.h"

enum { CHARTS = 60, WIDTH = 96, HEIGHT = 64 };

/* Rectangles, each a chart of two triangles, in texels. */
typedef struct charts {
    int count;
    double low[CHARTS][2], high[CHARTS][2];
    float positions[3 * 4 * CHARTS], uvs[2 * 4 * CHARTS];
    uint32_t indices[6 * CHARTS];
} charts;

static vsh_mesh place(charts *c, uint64_t seed, double longest) {
    for (int i = 0; i < c->count; ++i) {
        for (int axis = 0; axis < 2; ++axis) {
            const double most = axis == 0 ? WIDTH : HEIGHT;
            const double size = between(&seed, 0.1, longest);
            c->low[i][axis] = between(&seed, 0.0, most - size);
            c->high[i][axis] = c->low[i][axis] + size;
        }
        for (int k = 0; k < 4; ++k) {
            float *uv = c->uvs + 2 * (4 * i + k), *at = c->positions + 3 * (4 * i + k);
            uv[0] = (float)((k == 1 || k == 2 ? c->high[i][0] : c->low[i][0]) / WIDTH);
            uv[1] = (float)(1.0 - (k >= 2 ? c->high[i][1] : c->low[i][1]) / HEIGHT);
            at[0] = uv[0] + 2.0f * (float)i;
            at[1] = uv[1];
            at[2] = 0.0f;
        }
        for (int k = 0; k < 4; ++k) { /* as floats have them */
            const float *uv = c->uvs + 2 * (4 * i + k);
            *(k == 1 || k == 2 ? &c->high[i][0] : &c->low[i][0]) = (double)uv[0] * WIDTH;
            *(k >= 2 ? &c->high[i][1] : &c->low[i][1]) = (1.0 - (double)uv[1]) * HEIGHT;
        }
        for (int k = 0; k < 6; ++k) {
            c->indices[6 * i + k] = (uint32_t)(4 * i) + QUAD_INDICES[k];
        }
    }
    return mesh_of_arrays(NULL, c->positions, c->uvs, 4 * (size_t)c->count, c->indices, 2 * (size_t)c->count);
}

/* From a place to the border of a rectangle. */
static double distance_to(const charts *c, int chart, double x, double y) {
    const double *low = c->low[chart], *high = c->high[chart];
    double nearest = INFINITY;
    for (int side = 0; side < 4; ++side) {
        const double x0 = side == 1 ? high[0] : low[0], x1 = side == 0 ? low[0] : high[0];
        const double y0 = side == 3 ? high[1] : low[1], y1 = side == 2 ? low[1] : high[1];
        const double px = fmin(fmax(x, x0), x1), py = fmin(fmax(y, y0), y1);
        nearest = fmin(nearest, hypot(x - px, y - py));
    }
    return nearest;
}

/* All places of a border, half a texel apart at most, as the library walks them. */
static double nearest_of(const charts *c, int chart) {
    const double *low = c->low[chart], *high = c->high[chart];
    double nearest = 1.0;
    for (int side = 0; side < 4; ++side) {
        const int axis = side < 2 ? 0 : 1;
        const double length = high[axis] - low[axis];
        const int steps = 1 + (int)ceil(length / 0.5);
        for (int s = 0; s <= steps; ++s) {
            double at[2] = {side % 2 ? high[0] : low[0], side % 2 ? high[1] : low[1]};
            at[axis] = low[axis] + length * s / steps;
            for (int other = 0; other < c->count; ++other) {
                nearest = other != chart ? fmin(nearest, distance_to(c, other, at[0], at[1])) : nearest;
            }
        }
    }
    return nearest;
}

TEST(the_least_gap_is_the_one_between_all_borders) {
    static charts c;
    int apart = 0, close = 0;
    for (uint64_t seed = 1; seed <= 60; ++seed) {
        c.count = seed % 3 == 1 ? 8 : CHARTS;
        const vsh_mesh mesh = place(&c, seed, seed % 3 == 0 ? 12.0 : 1.5);
        double truth = 1.0;
        for (int i = 0; i < c.count; ++i) {
            truth = fmin(truth, nearest_of(&c, i));
        }
        vshi_closeness found;
        assert_ok(vshi_charts_closeness(&mesh, 1, WIDTH, HEIGHT, NULL, &found, &failure));
        assert_float_equal(found.gap, truth, 1e-4);
        assert_true((found.texels > 0) == (truth < 1.0));
        close += truth < 1.0;
        apart += truth >= 1.0;
    }
    assert_true(close > 10 && apart > 10);
}
