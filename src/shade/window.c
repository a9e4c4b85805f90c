#include "shade/window.h"

#include "base/job.h"
#include "base/vec.h"

#include <math.h>

/* --- links */

/* Neighbours are linked if the cosine between their normals is at least ALIKE, and the sine of the angle
 * between the step and both surfaces at most STEEP. */
static const double ALIKE = 0.94, STEEP = 0.35;
/* A link is at most this many times as long as the shortest step around: charts that touch lie apart in the
 * world. */
static const float LONG = 4.0f;
/* Points of a plane are this close to it, as a share of the square's sides. */
static const double FLAT = 0.1;

/* Length of the step between two points; INFINITY if no surface connects them. */
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

/* Length of a path of several steps along a row or column; INFINITY if one is missing. */
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

static float lesser_step(float a, float b) {
    return a < b ? a : b;
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
    for (size_t k = 0; k < (size_t)width * (size_t)height; ++k) {
        vshi_window_texel *e = texels + k;
        e->shortest = lesser_step(e->step[0], e->step[1]);
        if (e->step[0] < INFINITY) {
            e[-1].shortest = lesser_step(e[-1].shortest, e->step[0]);
        }
        if (e->step[1] < INFINITY) {
            e[-width].shortest = lesser_step(e[-width].shortest, e->step[1]);
        }
    }
    for (size_t k = 0; k < (size_t)width * (size_t)height; ++k) {
        vshi_window_texel *e = texels + k;
        const float left = e->step[0], above = e->step[1], own = LONG * e->shortest;
        e->left = left < INFINITY && left <= own && left <= LONG * e[-1].shortest;
        e->above = above < INFINITY && above <= own && above <= LONG * e[-width].shortest;
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

/* --- windows */

static uint8_t one_more(uint8_t run) {
    return run < VSHI_WINDOW_REACH ? (uint8_t)(run + 1) : VSHI_WINDOW_REACH;
}

/* Counts linked texels: left and up, then right and down. */
static void find_runs(const vshi_windows *w) {
    const size_t width = (size_t)w->width, height = (size_t)w->height;
    for (size_t y = 0; y < height; ++y) {
        for (size_t x = 0; x < width; ++x) {
            vshi_window_texel *e = w->texels + y * width + x;
            e->run[0] = e->left ? one_more(e[-1].run[0]) : 0;
            e->run[2] = e->above ? one_more((e - width)->run[2]) : 0;
        }
    }
    for (size_t y = height; y-- > 0;) {
        for (size_t x = width; x-- > 0;) {
            vshi_window_texel *e = w->texels + y * width + x;
            const vshi_window_texel *right = e + 1, *below = e + width;
            e->run[1] = x + 1 < width && right->left ? one_more(right->run[1]) : 0;
            e->run[3] = y + 1 < height && below->above ? one_more(below->run[3]) : 0;
        }
    }
}

void vshi_windows_sum(vshi_windows *w) {
    static const vshi_window_sums NONE = {{0}};
    const size_t width = (size_t)w->width, stride = width + 1;
    find_runs(w);
    for (size_t x = 0; x < stride; ++x) {
        w->sums[x] = NONE;
    }
    for (size_t y = 0; y < (size_t)w->height; ++y) {
        vshi_window_sums row = NONE, *here = w->sums + (y + 1) * stride;
        const vshi_window_sums *above = here - stride;
        here[0] = NONE;
        for (size_t x = 0; x < width; ++x) {
            const vshi_window_texel *e = w->texels + y * width + x;
            if (e->rays > 0) {
                const double scaled = (double)e->value * (1.0 / VSHI_WINDOW_UNIT);
                const uint64_t value = (uint64_t)scaled;
                row.of[VSHI_SUM_V] += value;
                row.of[VSHI_SUM_VX] += value * x;
                row.of[VSHI_SUM_VY] += value * y;
                row.of[VSHI_SUM_VV] += (uint64_t)(scaled * (double)e->value);
                row.of[VSHI_SUM_SPREADS] += (uint64_t)((double)e->spread * (1.0 / VSHI_WINDOW_SPREAD_UNIT));
                row.of[VSHI_SUM_RAYS] += (uint64_t)e->rays;
            }
            row.of[VSHI_SUM_BREAKS] +=
                x > 0 && y > 0 && !(e->left && e->above && e[-1].above && (e - width)->left);
            for (int s = 0; s < VSHI_WINDOW_SUMS; ++s) {
                here[x + 1].of[s] = above[x + 1].of[s] + row.of[s];
            }
        }
    }
}

void vshi_windows_estimate(const vshi_windows *w, const uint16_t *texels, size_t count, double max_error,
                           int32_t tile, vshi_window_estimate *estimates) {
    VSHI_KERNEL_OF(vshi_windows, w->isa)(w, texels, count, max_error, tile, estimates);
}

double vshi_window_weight(const vshi_window_estimate *e, int32_t x, int32_t y, int32_t column, int32_t row) {
    const double wide = e->x[1] - e->x[0] + 1, tall = e->y[1] - e->y[0] + 1;
    const double mx = 0.5 * (e->x[0] + e->x[1]), my = 0.5 * (e->y[0] + e->y[1]);
    double weight = 1.0;
    weight += wide > 1.0 ? 12.0 * (x - mx) * (column - mx) / (wide * wide - 1.0) : 0.0;
    weight += tall > 1.0 ? 12.0 * (y - my) * (row - my) / (tall * tall - 1.0) : 0.0;
    return weight / (wide * tall);
}
