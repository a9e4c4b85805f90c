#include "shade/window.h"

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

/* --- windows */

enum { VALUES, VALUES_X, VALUES_Y, SQUARES, SPREADS, RAYS }; /* sums */

/* The tables hold values and spreads as multiples of these. */
#define UNIT 0x1p-24
#define SPREAD_UNIT 0x1p-40

/* Columns and rows of a window, the factors of its plane's value and slopes, and the degrees of freedom of
 * its residual. */
typedef struct window_size {
    int32_t columns, rows;
    double part, part_x, part_y, freedom;
} window_size;

#define MOMENT(a, b) ((a) > 1 ? 12.0 / ((double)(b) * (a) * ((a) * (a) + ((a) > 1 ? -1.0 : 1.0))) : 0.0)
#define SIZE(a, b)                                                                                           \
    { a, b, 1.0 / ((a) * (b)), MOMENT(a, b), MOMENT(b, a), (a) * (b)-1.0 - ((a) > 1) - ((b) > 1) }

/* Chains of growing windows: square, wide and tall. 8 × 8 is a tile, and no wide or tall one is larger.
 * Windows above 11 × 11 lose by the bend in them: with 13 × 13 the floors of rooms came out darker by
 * 0.006. */
enum { CHAINS = 3, LINKS = 7, TILE_LINK = 3 };
static const window_size SIZES[CHAINS][LINKS] = {
    {SIZE(1, 1), SIZE(3, 3), SIZE(5, 5), SIZE(8, 8), SIZE(11, 11)},
    {SIZE(1, 1), SIZE(3, 1), SIZE(5, 1), SIZE(8, 1), SIZE(11, 1), SIZE(11, 3), SIZE(11, 5)},
    {SIZE(1, 1), SIZE(1, 3), SIZE(1, 5), SIZE(1, 8), SIZE(1, 11), SIZE(3, 11), SIZE(5, 11)},
};

/* Standard deviations by which a window's estimate may differ from the texel's own value, of the second
 * window and of the others. One wrong value in a hundred is a speck in the picture, and larger windows have
 * more bias. */
static const double SIGMAS[LINKS] = {3.0, 2.5, 2.0, 2.0, 2.0, 2.0, 2.0};

/* Factor on SIGMAS for errors below FINE: noise is then so small that the bend is most of the error. */
static const double FINE = 0.01, FINE_SIGMAS = 0.7;

/* Estimates may also differ by this share of max_error. */
static const double TOLERANCE = 0.1;

/* A large square window that varies no more than this over the expected noise needs no wide or tall ones. */
static const double CALM = 1.5;

typedef struct window {
    const window_size *size;
    int32_t x[2], y[2];
    double mean;
    double value; /* the plane's at the texel */
    double slope[2];
    double weight;   /* variance of the value over that of a texel: the sum of squared weights */
    double spread;   /* mean variance of a texel's value, over p (1 - p) */
    double residual; /* variance of a texel's value, by the distances from the plane; 0: too few texels */
    double rays;
    int smaller; /* number of the fit two links before, or of the texel's own */
} window;

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
    static const vshi_window_sums NONE = {{0}, 0};
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
                const double scaled = (double)e->value * (1.0 / UNIT);
                const uint64_t value = (uint64_t)scaled;
                row.of[VALUES] += value;
                row.of[VALUES_X] += value * x;
                row.of[VALUES_Y] += value * y;
                row.of[SQUARES] += (uint64_t)(scaled * (double)e->value);
                row.of[SPREADS] += (uint64_t)((double)e->spread * (1.0 / SPREAD_UNIT));
                row.of[RAYS] += (uint64_t)e->rays;
            }
            row.breaks += x > 0 && y > 0 && !(e->left && e->above && e[-1].above && (e - width)->left);
            for (int s = 0; s < VSHI_WINDOW_SUMS; ++s) {
                here[x + 1].of[s] = above[x + 1].of[s] + row.of[s];
            }
            here[x + 1].breaks = above[x + 1].breaks + row.breaks;
        }
    }
}

/* Places `size` texels around a texel, evenly if possible. False if there are too few. */
static bool place(int32_t at, int32_t size, int32_t before, int32_t after, int32_t range[2]) {
    int32_t low = (size - 1) / 2, high = size - 1 - low;
    if (before < low) {
        high += low - before;
        low = before;
    }
    if (after < high) {
        low += high - after;
        high = after;
    }
    range[0] = at - low;
    range[1] = at + high;
    return low <= before && high <= after;
}

/* The sum of values by their distance from the middle of a range of columns or rows. */
static double moment(uint64_t by_place, uint64_t values, const int32_t range[2]) {
    return 0.5 * UNIT * (double)(int64_t)(2 * by_place - values * (uint64_t)(range[0] + range[1]));
}

/* A texel, and how far its windows may extend left, right, up and down. */
typedef struct spot {
    int32_t x, y, run[4];
} spot;

static int32_t lesser(int32_t a, int32_t b) {
    return a < b ? a : b;
}

static spot find_spot(const vshi_windows *w, int32_t x, int32_t y, int32_t tile) {
    const uint8_t *run = w->texels[(size_t)y * (size_t)w->width + (size_t)x].run;
    spot at = {x, y, {run[0], run[1], run[2], run[3]}};
    if (tile > 0) {
        at.run[0] = lesser(at.run[0], x % tile);
        at.run[1] = lesser(at.run[1], tile - 1 - x % tile);
        at.run[2] = lesser(at.run[2], y % tile);
        at.run[3] = lesser(at.run[3], tile - 1 - y % tile);
    }
    return at;
}

/* Fits the plane. False if there is no such window. */
static bool fit(const vshi_windows *w, const spot *at, const window_size *size, window *f) {
    if (!place(at->x, size->columns, at->run[0], at->run[1], f->x) ||
        !place(at->y, size->rows, at->run[2], at->run[3], f->y)) {
        return false;
    }
    const size_t stride = (size_t)w->width + 1;
    const vshi_window_sums *top = w->sums + (size_t)f->y[0] * stride,
                           *bottom = w->sums + ((size_t)f->y[1] + 1) * stride;
    const vshi_window_sums *second = top + stride;
    if (size->columns > 1 && size->rows > 1 &&
        bottom[f->x[1] + 1].breaks - bottom[f->x[0] + 1].breaks !=
            second[f->x[1] + 1].breaks - second[f->x[0] + 1].breaks) {
        return false; /* a link is missing */
    }
    uint64_t sum[VSHI_WINDOW_SUMS];
    for (int s = 0; s < VSHI_WINDOW_SUMS; ++s) {
        sum[s] =
            bottom[f->x[1] + 1].of[s] - bottom[f->x[0]].of[s] - top[f->x[1] + 1].of[s] + top[f->x[0]].of[s];
    }
    const double mean = (double)(int64_t)sum[VALUES] * UNIT * size->part;
    const double dx = at->x - 0.5 * (f->x[0] + f->x[1]), dy = at->y - 0.5 * (f->y[0] + f->y[1]);
    const double along_x = moment(sum[VALUES_X], sum[VALUES], f->x),
                 along_y = moment(sum[VALUES_Y], sum[VALUES], f->y);
    const double off = (double)(int64_t)sum[SQUARES] * UNIT - mean * mean * (size->columns * size->rows) -
                       along_x * along_x * size->part_x - along_y * along_y * size->part_y;
    const double value = mean + along_x * dx * size->part_x + along_y * dy * size->part_y;
    f->size = size;
    f->mean = mean;
    f->value = value < 0.0 ? 0.0 : value > 1.0 ? 1.0 : value;
    f->slope[0] = along_x * size->part_x;
    f->slope[1] = along_y * size->part_y;
    f->weight = size->part + dx * dx * size->part_x + dy * dy * size->part_y;
    f->spread = (double)(int64_t)sum[SPREADS] * SPREAD_UNIT * size->part;
    f->residual = size->freedom >= 4.0 && off > 0.0 ? off / size->freedom : 0.0;
    f->rays = (double)(int64_t)sum[RAYS];
    return true;
}

/* p (1 - p) of a share, by Laplace's rule of succession: a few agreeing rays do not prove that all agree. */
static double variance_of(const window *f) {
    const double p = (f->value * f->rays + 1.0) / (f->rays + 2.0);
    return p * (1.0 - p);
}

/* The factor by which a window's values vary more than those of evenly spread rays: as measured, at most as
 * random rays would. */
static double wildness(const window *f, double variance) {
    const double expected = variance * f->spread;
    if (!(f->residual > expected)) {
        return 1.0;
    }
    const double random = variance * (f->size->columns * f->size->rows) / f->rays;
    const double seen = f->residual < random ? f->residual : random;
    return seen > expected ? seen / expected : 1.0;
}

/* Whether a window agrees with a smaller one in it, up to noise. */
static bool agrees(const window *f, const window *smaller, double sigmas, double variance, double max_error) {
    const double off = fabs(f->value - smaller->value) - TOLERANCE * max_error;
    if (off <= 0.0) {
        return true;
    }
    const double most =
        sigmas * sigmas * variance * (smaller->spread * smaller->weight - f->spread * f->weight);
    return off * off <= most || off * off <= most * wildness(f, variance);
}

/* Adds the windows of a chain that agree with those before. fits[0] is the texel's own. Returns the number of
 * links that agree. */
static int widen(const vshi_windows *w, const spot *at, const window_size *sizes, double max_error,
                 window *fits, int *count) {
    window *chain = fits + *count - 1; /* [link], except the texel's own */
    const double fine = max_error < FINE ? FINE_SIGMAS : 1.0;
    for (int link = 1; link < LINKS && sizes[link].columns > 0; ++link) {
        window *f = &chain[link];
        if (!fit(w, at, &sizes[link], f)) {
            return link;
        }
        const double variance = variance_of(f);
        for (int smaller = 0; smaller < link; ++smaller) {
            if (!agrees(f, smaller == 0 ? &fits[0] : &chain[smaller], fine * SIGMAS[smaller], variance,
                        max_error)) {
                return link;
            }
        }
        f->smaller = link > 2 ? (int)(chain - fits) + link - 2 : 0;
        ++*count;
    }
    return LINKS;
}

/* Finds the largest square window that is, like the texel, all free or all hidden. The smaller ones are too.
 */
static bool find_even(const vshi_windows *w, const spot *at, window *f) {
    const double value = (double)w->texels[(size_t)at->y * (size_t)w->width + (size_t)at->x].value;
    if (value != 0.0 && value != 1.0) {
        return false;
    }
    int link = LINKS - 1;
    while (link > 0 && (SIZES[0][link].columns == 0 || !fit(w, at, &SIZES[0][link], f))) {
        --link;
    }
    return link >= TILE_LINK && f->mean == value;
}

/* The window of the least error. All are judged by the p of the best-known one: a small window whose rays are
 * all free by chance would seem to have no noise. */
static const window *choose(const window *fits, int count, double *square) {
    const window *largest = fits, *best = fits;
    for (const window *f = fits; f < fits + count; ++f) {
        largest = f->spread * f->weight < largest->spread * largest->weight ? f : largest;
    }
    const double variance = variance_of(largest);
    *square = INFINITY;
    for (const window *f = fits; f < fits + count; ++f) {
        const double expected = variance * f->spread;
        const double of = (f->residual > expected ? f->residual : expected) * f->weight;
        if (of < *square) {
            *square = of;
            best = f;
        }
    }
    return best;
}

/* Chosen windows agree, so their differences vary by this share of their noise. The bend hides in the noise
 * of random rays, so more of their differences counts as bend. */
static const double AGREEING = 0.75, RANDOM_AGREEING = 0.55, FINE_AGREEING = 0.5;

/* The square of a window's bend. The bend grows with the square of the sides, so the differences of two
 * windows beyond their noise show it. */
static double find_curved(const window *fits, const window *best, double max_error) {
    const window *small = &fits[best->smaller];
    const double sides = best->size->columns * best->size->columns + best->size->rows * best->size->rows;
    const double less = small->size->columns * small->size->columns + small->size->rows * small->size->rows;
    const double part = 1.0 - less / sides, off = best->value - small->value;
    if (!(part > 0.0)) {
        return 0.0;
    }
    const double noise = best->residual > 0.0 ? best->residual : variance_of(best) * best->spread;
    const bool random = best->spread * best->rays > 0.99 * best->size->columns * best->size->rows;
    const double agreeing = max_error < FINE ? FINE_AGREEING : random ? RANDOM_AGREEING : AGREEING;
    return (off * off - agreeing * noise * (small->weight - best->weight)) / (part * part);
}

vshi_window_estimate vshi_windows_estimate(const vshi_windows *w, int32_t x, int32_t y, double max_error,
                                           int32_t tile) {
    const spot at = find_spot(w, x, y, tile);
    window fits[1 + CHAINS * (LINKS - 1)];
    int count = 1;
    fits[0].smaller = 0;
    if (!find_even(w, &at, &fits[0])) {
        fit(w, &at, &SIZES[0][0], &fits[0]);
        for (int chain = 0; chain < CHAINS; ++chain) {
            const int good = widen(w, &at, SIZES[chain], max_error, fits, &count);
            const window *last = &fits[count - 1];
            if (chain == 0 && good > TILE_LINK && wildness(last, variance_of(last)) <= CALM) {
                break;
            }
        }
    }
    double square;
    const window *best = choose(fits, count, &square);
    return (vshi_window_estimate){.value = best->value,
                                  .deviation = sqrt(square),
                                  .centred = sqrt(square * best->size->part / best->weight),
                                  .curved = find_curved(fits, best, max_error),
                                  .slope = {best->slope[0], best->slope[1]},
                                  .x = {best->x[0], best->x[1]},
                                  .y = {best->y[0], best->y[1]}};
}

double vshi_window_weight(const vshi_window_estimate *e, int32_t x, int32_t y, int32_t column, int32_t row) {
    const double wide = e->x[1] - e->x[0] + 1, tall = e->y[1] - e->y[0] + 1;
    const double mx = 0.5 * (e->x[0] + e->x[1]), my = 0.5 * (e->y[0] + e->y[1]);
    double weight = 1.0;
    weight += wide > 1.0 ? 12.0 * (x - mx) * (column - mx) / (wide * wide - 1.0) : 0.0;
    weight += tall > 1.0 ? 12.0 * (y - my) * (row - my) / (tall * tall - 1.0) : 0.0;
    return weight / (wide * tall);
}
