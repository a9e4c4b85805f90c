#include "shade/links.h"

#include "base/vec.h"

#include <math.h>

/* Cosine between the normals of neighbours, at least; and sine of the angle that the step between them has to
 * the surface, at most. */
static const double ALIKE = 0.94, STEEP = 0.35;
/* A step is no longer than so many of the others around it: charts that touch lie apart in the world. */
static const float LONG = 4.0f;
/* What is in a plane is no farther off it than this, of the square's sides. */
static const double FLAT = 0.1;

/* Length of the step between two points; infinite where no surface goes from one to the other. */
static float step_of(const vshi_texel_map *map, size_t a, size_t b) {
    if (a == 0 || b == 0) {
        return INFINITY;
    }
    const vshi_vec na = vshi_vec_off(map->normal + 3 * (a - 1)), nb = vshi_vec_off(map->normal + 3 * (b - 1));
    if (!(vshi_dot(na, nb) >= ALIKE)) {
        return INFINITY;
    }
    const vshi_vec d =
        vshi_sub(vshi_vec_off(map->position + 3 * (b - 1)), vshi_vec_off(map->position + 3 * (a - 1)));
    const double square = vshi_dot(d, d), up = vshi_dot(d, na), down = vshi_dot(d, nb);
    const double most = STEEP * STEEP * square;
    return up * up <= most && down * down <= most ? (float)sqrt(square) : INFINITY;
}

/* The same along so many texels in a row. */
static float path_of(const vshi_texel_map *map, int32_t x, int32_t y, int32_t dx, int32_t dy, int32_t steps) {
    const size_t from = vshi_texel_at(map, x, y);
    size_t last = from;
    for (int32_t k = 1; k < steps; ++k) {
        const size_t next = vshi_texel_at(map, x + k * dx, y + k * dy);
        if (!(step_of(map, last, next) < INFINITY)) {
            return INFINITY;
        }
        last = next;
    }
    const size_t end = vshi_texel_at(map, x + steps * dx, y + steps * dy);
    return last == from || step_of(map, last, end) < INFINITY ? step_of(map, from, end) : INFINITY;
}

/* The shortest step from a texel. */
static float shortest(const vshi_window_texel *texels, int32_t width, int32_t height, int32_t x, int32_t y) {
    const vshi_window_texel *e = texels + (size_t)y * (size_t)width + (size_t)x;
    float least = fminf(e->step[0], e->step[1]);
    least = x + 1 < width ? fminf(least, e[1].step[0]) : least;
    return y + 1 < height ? fminf(least, e[width].step[1]) : least;
}

void vshi_links_find(const vshi_texel_map *map, const vshi_texel_lattice *lattice,
                     vshi_window_texel *texels) {
    const int32_t width = lattice->width, height = lattice->height, spacing = lattice->spacing;
    for (int32_t y = 0; y < height; ++y) {
        for (int32_t x = 0; x < width; ++x) {
            const int32_t column = lattice->left + x * spacing, row = lattice->top + y * spacing;
            vshi_window_texel *e = texels + (size_t)y * (size_t)width + (size_t)x;
            e->step[0] = x > 0 ? path_of(map, column, row, -1, 0, spacing) : INFINITY;
            e->step[1] = y > 0 ? path_of(map, column, row, 0, -1, spacing) : INFINITY;
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

bool vshi_links_whole(const vshi_texel_map *map, int32_t column, int32_t row, int32_t spacing) {
    const size_t corner = vshi_texel_at(map, column, row), right = vshi_texel_at(map, column + spacing, row),
                 below = vshi_texel_at(map, column, row + spacing);
    if (corner == 0 || right == 0 || below == 0) {
        return false;
    }
    const vshi_vec p = vshi_vec_off(map->position + 3 * (corner - 1)),
                   n = vshi_vec_off(map->normal + 3 * (corner - 1));
    const double part = 1.0 / spacing;
    const vshi_vec u = vshi_scale(vshi_sub(vshi_vec_off(map->position + 3 * (right - 1)), p), part);
    const vshi_vec v = vshi_scale(vshi_sub(vshi_vec_off(map->position + 3 * (below - 1)), p), part);
    const double most = FLAT * FLAT * (vshi_dot(u, u) + vshi_dot(v, v)) * spacing * spacing;
    for (int32_t y = 0; y <= spacing; ++y) {
        for (int32_t x = 0; x <= spacing; ++x) {
            const size_t at = vshi_texel_at(map, column + x, row + y);
            if (at == 0 || !(vshi_dot(n, vshi_vec_off(map->normal + 3 * (at - 1))) >= ALIKE)) {
                return false;
            }
            const vshi_vec expected = vshi_add(p, vshi_add(vshi_scale(u, x), vshi_scale(v, y)));
            const vshi_vec off = vshi_sub(vshi_vec_off(map->position + 3 * (at - 1)), expected);
            if (!(vshi_dot(off, off) <= most)) {
                return false;
            }
        }
    }
    return true;
}

bool vshi_links_lead(const vshi_texel_map *map, const int32_t from[2], const int32_t to[2]) {
    float least = INFINITY, most = 0.0f;
    int32_t at[2] = {from[0], from[1]};
    size_t last = vshi_texel_at(map, at[0], at[1]);
    while (at[0] != to[0] || at[1] != to[1]) {
        const int axis = at[0] != to[0] ? 0 : 1;
        at[axis] += to[axis] > at[axis] ? 1 : -1;
        const size_t next = vshi_texel_at(map, at[0], at[1]);
        const float step = step_of(map, last, next);
        least = step < least ? step : least;
        most = step > most ? step : most;
        if (!(most < INFINITY)) {
            return false;
        }
        last = next;
    }
    return !(most > LONG * least);
}
