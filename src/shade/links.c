#include "shade/links.h"

#include "base/vec.h"

#include <math.h>

/* Cosine between the normals of neighbours, at least; and sine of the angle that the step between them has to
 * the surface, at most. */
static const double ALIKE = 0.94, STEEP = 0.35;
/* A step is no longer than so many of the others around it: charts that touch lie apart in the world. */
static const float LONG = 4.0f;

/* Length of the step between two points; infinite where no surface goes from one to the other. */
static float step_of(const vsh_points *points, uint32_t a, uint32_t b) {
    if (a == 0 || b == 0) {
        return INFINITY;
    }
    const vshi_vec na = vshi_vec_off(points->normals + 3 * (size_t)(a - 1)),
                   nb = vshi_vec_off(points->normals + 3 * (size_t)(b - 1));
    if (!(vshi_dot(na, nb) >= ALIKE)) {
        return INFINITY;
    }
    const vshi_vec d = vshi_sub(vshi_vec_of(points->positions + 3 * (size_t)(b - 1)),
                                vshi_vec_of(points->positions + 3 * (size_t)(a - 1)));
    const double square = vshi_dot(d, d), up = vshi_dot(d, na), down = vshi_dot(d, nb);
    const double most = STEEP * STEEP * square;
    return up * up <= most && down * down <= most ? (float)sqrt(square) : INFINITY;
}

/* The shortest step from a texel. */
static float shortest(const vshi_window_texel *texels, int32_t width, int32_t height, int32_t x, int32_t y) {
    const vshi_window_texel *e = texels + (size_t)y * (size_t)width + (size_t)x;
    float least = fminf(e->step[0], e->step[1]);
    least = x + 1 < width ? fminf(least, e[1].step[0]) : least;
    return y + 1 < height ? fminf(least, e[width].step[1]) : least;
}

void vshi_links_find(const vsh_points *points, const uint32_t *at, int32_t width, int32_t height,
                     vshi_window_texel *texels) {
    for (int32_t y = 0; y < height; ++y) {
        for (int32_t x = 0; x < width; ++x) {
            const size_t i = (size_t)y * (size_t)width + (size_t)x;
            texels[i].step[0] = x > 0 ? step_of(points, at[i], at[i - 1]) : INFINITY;
            texels[i].step[1] = y > 0 ? step_of(points, at[i], at[i - (size_t)width]) : INFINITY;
        }
    }
    for (int32_t y = 0; y < height; ++y) {
        for (int32_t x = 0; x < width; ++x) {
            vshi_window_texel *e = texels + (size_t)y * (size_t)width + (size_t)x;
            const float left = e->step[0], above = e->step[1];
            const float own = LONG * shortest(texels, width, height, x, y);
            e->left =
                left < INFINITY && left <= own && left <= LONG * shortest(texels, width, height, x - 1, y);
            e->above =
                above < INFINITY && above <= own && above <= LONG * shortest(texels, width, height, x, y - 1);
        }
    }
}
