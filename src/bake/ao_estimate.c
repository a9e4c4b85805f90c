/* Estimates of texels by what they and those around them shot. */
#include "bake/ao_estimate.h"

#include "bake/raster.h"
#include "base/memory.h"
#include "base/try.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Tiles of a lattice that are estimated together, and with those around them that their windows reach. */
enum { TILES = 8, INNER = TILES * VSHI_TILE, WIDTH = INNER + 2 * VSHI_TILE, TEXELS = WIDTH * WIDTH };
_Static_assert((int)VSHI_WINDOW_REACH <= (int)VSHI_TILE, "windows reach the next tile, no farther");

/* Some tiles of a lattice and those around them, as one rectangle of its texels. */
typedef struct block {
    vshi_texel_lattice lattice;
    uint32_t at[TEXELS]; /* origin + 1 */
    vshi_window_texel texels[TEXELS];
    vshi_window_sums sums[(WIDTH + 1) * (WIDTH + 1)];
    vshi_windows windows;
} block;

/* --- estimates of texels that shot */

static bool is_own(const vshi_ao_estimates *s, uint32_t at) {
    return at > 0 && s->share.rays[at - 1] > 0 && s->share.level[at - 1] == s->spacing;
}

/* False where no texel within is to be estimated. */
static bool find_texels(const vshi_ao_estimates *s, block *b) {
    bool any = false;
    for (int32_t k = 0; k < TEXELS; ++k) {
        const int32_t x = k % WIDTH, y = k / WIDTH;
        b->at[k] =
            vshi_texel_at(&s->share.map, b->lattice.left + x * s->spacing, b->lattice.top + y * s->spacing);
        any =
            any || (x >= VSHI_TILE && x < VSHI_TILE + INNER && y >= VSHI_TILE && y < VSHI_TILE + INNER &&
                    is_own(s, b->at[k]) && vshi_ao_is_estimated(&s->reach, b->lattice.top + y * s->spacing));
    }
    return any;
}

static void lay_out(const vshi_ao_estimates *s, block *b) {
    const int32_t sampler = vshi_ao_tile_sampler(s->options->sampler);
    memset(b->texels, 0, sizeof b->texels);
    b->windows = (vshi_windows){WIDTH, WIDTH, b->texels, b->sums};
    int32_t rays = 0;
    float spread = 0.0f;
    for (size_t k = 0; k < TEXELS; ++k) {
        const size_t i = (size_t)b->at[k] - 1;
        if (b->at[k] == 0 || s->share.rays[i] == 0) {
            b->at[k] = 0;
            continue;
        }
        if (s->share.rays[i] != rays) {
            rays = s->share.rays[i];
            spread = (float)vshi_ao_shared_spread(sampler, rays);
        }
        b->texels[k].value = s->shot[i];
        b->texels[k].rays = rays;
        b->texels[k].spread = spread;
    }
    vshi_links_find(s->points, &s->share.map, &b->lattice, b->texels);
    for (size_t k = 0; k < TEXELS; ++k) { /* what shot nothing parts those beside it */
        const bool none = b->at[k] == 0;
        b->texels[k].left = b->texels[k].left && !none && b->at[k - 1] > 0;
        b->texels[k].above = b->texels[k].above && !none && b->at[k - WIDTH] > 0;
    }
    vshi_windows_sum(&b->windows);
}

/* Bent normals turn with the surface, and windows are chosen by values, which may not change where it turns:
 * what is averaged is how far each is from its own texel's normal. */
static void bend(const vshi_ao_estimates *s, const block *b, const vshi_window_estimate *e, int32_t x,
                 int32_t y, float *bent) {
    const float *own = s->points->normals + 3 * ((size_t)b->at[y * WIDTH + x] - 1);
    double sum[3];
    for (size_t axis = 0; axis < 3; ++axis) {
        sum[axis] = VSHI_AO_OPEN * e->value * (double)own[axis];
    }
    for (int32_t row = e->y[0]; row <= e->y[1]; ++row) {
        for (int32_t column = e->x[0]; column <= e->x[1]; ++column) {
            const size_t i = (size_t)b->at[row * WIDTH + column] - 1;
            const float *open = s->open + 3 * i, *normal = s->points->normals + 3 * i;
            const double weight = vshi_window_weight(e, x, y, column, row);
            const double even = VSHI_AO_OPEN * (double)s->shot[i];
            for (size_t axis = 0; axis < 3; ++axis) {
                sum[axis] += weight * ((double)open[axis] - even * (double)normal[axis]);
            }
        }
    }
    for (size_t axis = 0; axis < 3; ++axis) {
        bent[axis] = (float)sum[axis];
    }
}

/* By windows across tiles; where these know less than was enough for the texel's tile, by the tile's own. */
static vshi_window_estimate estimate(const vshi_ao_estimates *s, const block *b, int32_t x, int32_t y) {
    const double max_error = s->options->max_error;
    const vshi_window_estimate e = vshi_windows_estimate(&b->windows, x, y, max_error, 0);
    if (e.centred <= VSHI_AO_TILE_ENOUGH * max_error) {
        return e;
    }
    const vshi_window_estimate own = vshi_windows_estimate(&b->windows, x, y, max_error, VSHI_TILE);
    return own.centred < e.centred ? own : e;
}

static void estimate_own(const vshi_ao_estimates *s, const block *b) {
    const float part = 1.0f / (float)s->spacing;
    for (int32_t y = VSHI_TILE; y < VSHI_TILE + INNER; ++y) {
        if (!vshi_ao_is_estimated(&s->reach, b->lattice.top + y * s->spacing)) {
            continue;
        }
        for (int32_t x = VSHI_TILE; x < VSHI_TILE + INNER; ++x) {
            const uint32_t at = b->at[y * WIDTH + x];
            if (!is_own(s, at)) {
                continue;
            }
            const size_t i = (size_t)at - 1;
            const vshi_window_estimate e = estimate(s, b, x, y);
            s->values[i] = (float)e.value;
            s->planes[i] = (vshi_ao_plane){
                {part * (float)e.slope[0], part * (float)e.slope[1]}, (float)e.deviation, (float)e.curved};
            if (s->bent != NULL) {
                bend(s, b, &e, x, y, s->bent + 3 * i);
            }
        }
    }
}

static size_t blocks_across(int32_t texels, int32_t spacing) {
    const int32_t side = INNER * spacing;
    return (size_t)((texels + side - 1) / side);
}

/* A vshi_range_fn over blocks, row by row. */
static void estimate_blocks(void *user, size_t begin, size_t end) {
    vshi_ao_estimates *s = user;
    const size_t columns = blocks_across(s->share.map.width, s->spacing);
    block *b = malloc(sizeof *b);
    if (b == NULL) {
        atomic_fetch_add(&s->refused, 1);
        return;
    }
    for (size_t n = begin; n < end; ++n) {
        const int32_t side = INNER * s->spacing, beside = VSHI_TILE * s->spacing;
        b->lattice = (vshi_texel_lattice){(int32_t)(n % columns) * side - beside,
                                          (int32_t)(n / columns) * side - beside, s->spacing, WIDTH, WIDTH};
        if (find_texels(s, b)) {
            lay_out(s, b);
            estimate_own(s, b);
        }
    }
    free(b);
}

/* --- of those between */

/* A cell whose texels are estimated by the windows of its corners. */
typedef struct cell {
    int32_t at[2];
    uint32_t good;    /* corners that are of the lattice, as bits */
    size_t corner[4]; /* origins */
    bool whole;
} cell;

static void look_at(const vshi_ao_estimates *s, cell *c) {
    c->good = 0;
    for (int32_t k = 0; k < 4; ++k) {
        const uint32_t at =
            vshi_texel_at(&s->share.map, c->at[0] + (k & 1) * s->spacing, c->at[1] + (k >> 1) * s->spacing);
        c->corner[k] = (size_t)at - 1;
        if (at > 0 && s->share.rays[at - 1] > 0 && s->share.level[at - 1] >= s->spacing) {
            c->good |= 1u << k;
        }
    }
    c->whole = vshi_links_whole(s->points, &s->share.map, c->at[0], c->at[1], s->spacing);
}

/* Where a texel lies between its cell's corners, 0 … 1, but never on one's line. */
static double part_of(int32_t place, int32_t spacing) {
    return (place + 0.25) / (spacing + 0.5);
}

/* The planes of the corners, blended. */
static void fill_texel(const vshi_ao_estimates *s, const cell *c, int32_t dx, int32_t dy, size_t i) {
    const uint32_t corners = c->good & vshi_ao_corners(s->points, &s->share.map, c->at, s->spacing, c->whole,
                                                       c->at[0] + dx, c->at[1] + dy);
    const double u = part_of(dx, s->spacing), v = part_of(dy, s->spacing);
    double sum = 0.0, value = 0.0, deviation = 0.0, curved = 0.0, bent[3] = {0.0, 0.0, 0.0};
    for (int32_t k = 0; k < 4; ++k) {
        if ((corners >> k & 1) == 0) {
            continue;
        }
        const size_t corner = c->corner[k];
        const vshi_ao_plane *p = &s->planes[corner];
        const double weight = (k & 1 ? u : 1.0 - u) * (k >> 1 ? v : 1.0 - v);
        const int32_t x = dx - (k & 1) * s->spacing, y = dy - (k >> 1) * s->spacing;
        const double at = (double)s->values[corner] + (double)p->slope[0] * x + (double)p->slope[1] * y;
        sum += weight;
        value += weight * (at < 0.0 ? 0.0 : at > 1.0 ? 1.0 : at);
        deviation += weight * (double)p->deviation;
        curved += weight * (double)p->curved;
        for (size_t axis = 0; axis < 3 && s->bent != NULL; ++axis) {
            bent[axis] += weight * ((double)s->bent[3 * corner + axis] -
                                    VSHI_AO_OPEN * (double)s->values[corner] *
                                        (double)s->points->normals[3 * corner + axis]);
        }
    }
    if (!(sum > 0.0)) { /* of rows that no bake left */
        s->values[i] = 0.0f;
        return;
    }
    s->values[i] = (float)(value / sum);
    s->planes[i] = (vshi_ao_plane){{0.0f, 0.0f}, (float)(deviation / sum), (float)(curved / sum)};
    for (size_t axis = 0; axis < 3 && s->bent != NULL; ++axis) {
        s->bent[3 * i + axis] =
            (float)(VSHI_AO_OPEN * (double)s->values[i] * (double)s->points->normals[3 * i + axis] +
                    bent[axis] / sum);
    }
}

/* A vshi_range_fn over rows of cells. */
static void fill_cells(void *user, size_t begin, size_t end) {
    const vshi_ao_estimates *s = user;
    const vshi_texel_map *map = &s->share.map;
    for (size_t row = begin; row < end; ++row) {
        if (!s->reach.wanted[row * (size_t)s->spacing / VSHI_TILE]) {
            continue;
        }
        for (int32_t column = 0; column < map->width; column += s->spacing) {
            cell c = {.at = {column, (int32_t)row * s->spacing}};
            bool looked = false;
            for (int32_t k = 0; k < s->spacing * s->spacing; ++k) {
                const int32_t dx = k % s->spacing, dy = k / s->spacing;
                const uint32_t at = vshi_texel_at(map, c.at[0] + dx, c.at[1] + dy);
                if (at == 0 || s->share.rays[at - 1] > 0 || s->share.level[at - 1] != s->spacing) {
                    continue;
                }
                if (!looked) {
                    look_at(s, &c);
                    looked = true;
                }
                fill_texel(s, &c, dx, dy, (size_t)at - 1);
            }
        }
    }
}

/* --- all */

/* A vshi_range_fn over rows of tiles. */
static void sum_rows(void *user, size_t begin, size_t end) {
    vshi_ao_estimates *s = user;
    const vshi_point_rows *rows = s->rows;
    for (size_t row = begin; row < end; ++row) {
        const bool wanted = s->reach.wanted[row], counted = row >= rows->first && row < rows->last;
        uint64_t square = 0, rays = 0, refined = 0, invalid = 0;
        int64_t curved = 0;
        double worst = 0.0;
        for (size_t i = rows->start[row]; (wanted || counted) && i < rows->start[row + 1]; ++i) {
            if (s->share.level[i] == VSHI_AO_KNOWN_LEVEL) {
                s->values[i] = s->shot[i];
                s->planes[i] = (vshi_ao_plane){.deviation = isnan(s->shot[i]) ? NAN : 0.0f};
                for (size_t axis = 0; axis < 3 && s->bent != NULL; ++axis) {
                    s->bent[3 * i + axis] = s->open[3 * i + axis];
                }
                invalid += isnan(s->shot[i]);
            } else if (wanted) {
                const double deviation = (double)s->planes[i].deviation;
                square += (uint64_t)(deviation * deviation / VSHI_SQUARE_UNIT);
                curved += (int64_t)((double)s->planes[i].curved / VSHI_SQUARE_UNIT);
                worst = fmax(worst, deviation);
                rays += (uint64_t)s->share.rays[i];
                ++refined;
            }
            if (s->deviation != NULL) {
                s->deviation[i] = s->planes[i].deviation;
            }
        }
        s->square[row] = square;
        s->curved[row] = curved;
        if (counted) {
            vshi_raise(&s->worst, worst);
            atomic_fetch_add(&s->rays, rays);
            atomic_fetch_add(&s->refined, refined);
            atomic_fetch_add(&s->invalid, invalid);
        }
    }
}

/* What is curved is summed by rows of tiles, whose sums are known well enough to tell what is above zero and
 * depend on no band. */
void vshi_ao_estimate_add(const vshi_ao_estimates *s, vsh_shade_stats *stats) {
    const vshi_point_rows *rows = s->rows;
    double square = 0.0;
    for (size_t row = rows->first; row < rows->last; ++row) {
        square += (double)s->square[row] * VSHI_SQUARE_UNIT;
        square += s->curved[row] > 0 ? (double)s->curved[row] * VSHI_SQUARE_UNIT : 0.0;
    }
    stats->square_error += square;
    stats->ao_square_error += square;
    stats->worst_error = fmax(stats->worst_error, s->worst);
    stats->rays += s->rays;
    stats->refined += s->refined;
    stats->invalid += s->invalid;
}

vsh_result vshi_ao_estimates_open(vshi_ao_estimates *s, size_t count, vsh_error *error) {
    const char *what = "AO texels";
    const vshi_texel_map *map = &s->share.map;
    const size_t texels = (size_t)map->width * (size_t)map->height, rows = s->reach.rows;
    VSHI_TRY(vshi_allocate((void **)&s->at, texels, sizeof *s->at, what, error));
    s->share.map.at = s->at;
    VSHI_TRY(vshi_allocate((void **)&s->shot, count, sizeof *s->shot, what, error));
    VSHI_TRY(vshi_allocate((void **)&s->share.rays, count, sizeof *s->share.rays, what, error));
    VSHI_TRY(vshi_allocate((void **)&s->share.level, count, 1, what, error));
    VSHI_TRY(vshi_allocate((void **)&s->planes, count, sizeof *s->planes, what, error));
    VSHI_TRY(vshi_allocate((void **)&s->square, rows, sizeof *s->square, what, error));
    VSHI_TRY(vshi_allocate((void **)&s->curved, rows, sizeof *s->curved, what, error));
    return vshi_allocate((void **)&s->reach.wanted, rows, 1, what, error);
}

void vshi_ao_estimates_close(vshi_ao_estimates *s) {
    free(s->reach.wanted);
    free(s->curved);
    free(s->square);
    free(s->planes);
    free(s->share.level);
    free(s->share.rays);
    free(s->shot);
    free(s->at);
}

double vshi_ao_estimates_bytes(double samples, int32_t width, int32_t rows, int32_t threads) {
    const double all_cores = 64.0; /* threads == 0: how many there are is the pool's business */
    const double blocks = (double)blocks_across(width, 1) * (double)blocks_across(rows, 1);
    return samples * (sizeof(float) + sizeof(int32_t) + sizeof(vshi_ao_plane) + 1.0) +
           (double)width * rows * sizeof(uint32_t) +
           fmin(threads > 0 ? threads : all_cores, blocks) * (double)sizeof(block);
}

vsh_result vshi_ao_estimate(vshi_ao_estimates *s, vshi_job *job, vsh_error *error) {
    const int32_t rows = s->share.map.height;
    for (s->spacing = s->share.spacing; s->spacing > 0; s->spacing /= 2) {
        const size_t blocks = blocks_across(s->share.map.width, s->spacing) * blocks_across(rows, s->spacing);
        VSHI_TRY(vshi_parallel_for(job, blocks, 1, 0, estimate_blocks, s, error));
    }
    if (s->refused > 0) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "AO texels: the system refused memory");
    }
    for (s->spacing = s->share.spacing; s->spacing > 1; s->spacing /= 2) {
        const size_t cells = (size_t)((rows + s->spacing - 1) / s->spacing);
        VSHI_TRY(vshi_parallel_for(job, cells, 1, 0, fill_cells, s, error));
    }
    return vshi_parallel_for(job, s->rows->count, 1, 0, sum_rows, s, error);
}
