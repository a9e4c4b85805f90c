#include "bake/ao_texels.h"

#include "bake/raster.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"
#include "shade/ao.h"
#include "shade/links.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* Tiles that are estimated together, and with those around them that their windows reach. */
enum { ROWS = 8, COLUMNS = 8, HELD_ROWS = ROWS + 2, HELD_COLUMNS = COLUMNS + 2 };
enum { WIDTH = HELD_COLUMNS * VSHI_TILE, HEIGHT = HELD_ROWS * VSHI_TILE, TEXELS = WIDTH * HEIGHT };
_Static_assert((int)VSHI_WINDOW_REACH <= (int)VSHI_TILE, "windows reach the next tile, no farther");

typedef struct sharing {
    const vsh_texels *texels;
    const vshi_origins *origins;
    const vsh_points *points;
    const vsh_shade_options *options;
    size_t *tile;     /* [tiles + 1]: first origin of each */
    size_t *row_tile; /* [rows of tiles + 1]: first tile of each */
    float *shot;      /* [origins.count]: shares of each texel's own rays */
    int32_t *rays;    /* [origins.count]: how many */
    float *open;      /* [origins.count][3]: bent normals by them; NULL: not asked for */
    float *values, *deviation, *bent;
    size_t block_columns;
    _Atomic size_t refused;  /* blocks whose memory was */
    _Atomic uint64_t square; /* of the estimates' errors, of the band's own, in VSHI_SQUARE_UNIT */
    _Atomic double worst;    /* of the same, the largest */
    int64_t *curved;         /* [block_columns][rows of tiles]: vshi_window_estimate's, likewise */
} sharing;

/* Some tiles and those around them, as one rectangle of texels. */
typedef struct block {
    int32_t left, top;   /* of its first texel */
    uint32_t at[TEXELS]; /* origin + 1 */
    vshi_window_texel texels[TEXELS];
    vshi_window_sums sums[(WIDTH + 1) * (HEIGHT + 1)];
    vshi_windows windows;
} block;

static int32_t column_of(const sharing *s, size_t i) {
    return (int32_t)(s->origins->texel[i] & 0xffffu);
}

static int32_t row_of(const sharing *s, size_t i) {
    return (int32_t)(s->origins->texel[i] >> 16);
}

/* Where tiles begin; sets tile[] and row_tile[] where they are there. Returns how many there are. */
static size_t list_tiles(const vshi_origins *origins, size_t *tile, size_t *row_tile) {
    size_t tiles = 0;
    for (size_t row = 0; row < origins->rows.count; ++row) {
        const size_t begin = origins->rows.start[row], end = origins->rows.start[row + 1];
        uint32_t last = 0;
        if (row_tile != NULL) {
            row_tile[row] = tiles;
        }
        for (size_t i = begin; i < end; ++i) {
            const uint32_t of = origins->texel[i] / VSHI_TILE % (0x10000 / VSHI_TILE);
            if (i > begin && of == last) {
                continue;
            }
            if (tile != NULL) {
                tile[tiles] = i;
            }
            ++tiles;
            last = of;
        }
    }
    if (tile != NULL) {
        tile[tiles] = origins->count;
        row_tile[origins->rows.count] = tiles;
    }
    return tiles;
}

/* The first tile of a row that is at `column` of tiles or behind it. */
static size_t find_tile(const sharing *s, size_t row, int32_t column) {
    size_t low = s->row_tile[row], high = s->row_tile[row + 1];
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (column_of(s, s->tile[middle]) / VSHI_TILE < column) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

/* The origins of a row of tiles from column `from` of tiles on, before column `to`. */
static void find_origins(const sharing *s, size_t row, int32_t from, int32_t to, size_t range[2]) {
    range[0] = s->tile[find_tile(s, row, from)];
    range[1] = s->tile[find_tile(s, row, to)];
}

/* Lays out rows `begin` … `end` - 1 of tiles and columns `from` … `to` - 1. */
static void lay_out(const sharing *s, size_t begin, size_t end, int32_t from, int32_t to, block *b) {
    memset(b->at, 0, sizeof b->at);
    memset(b->texels, 0, sizeof b->texels);
    b->left = from * VSHI_TILE;
    b->top = (int32_t)(s->texels->band.held_begin + begin) * VSHI_TILE;
    b->windows = (vshi_windows){WIDTH, (int32_t)(end - begin) * VSHI_TILE, b->texels, b->sums};
    for (size_t row = begin; row < end; ++row) {
        size_t range[2];
        find_origins(s, row, from, to, range);
        for (size_t i = range[0]; i < range[1]; ++i) {
            if (s->rays[i] == 0) {
                continue;
            }
            const int32_t place = (row_of(s, i) - b->top) * WIDTH + column_of(s, i) - b->left;
            b->at[place] = (uint32_t)i + 1;
            b->texels[place].value = s->shot[i];
            b->texels[place].rays = s->rays[i];
            b->texels[place].spread =
                (float)vshi_ao_spread(vshi_ao_tile_sampler(s->options->sampler), s->rays[i]);
        }
    }
    vshi_links_find(s->points, b->at, b->windows.width, b->windows.height, b->texels);
    vshi_windows_sum(&b->windows);
}

/* Bent normals turn with the surface, and windows are chosen by values, which may not change where it turns:
 * what is averaged is how far each is from its own texel's normal. */
static void bend(const sharing *s, const block *b, const vshi_window_estimate *e, int32_t x, int32_t y,
                 float *bent) {
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
static vshi_window_estimate estimate(const sharing *s, const block *b, int32_t x, int32_t y) {
    const double max_error = s->options->max_error;
    const vshi_window_estimate e = vshi_windows_estimate(&b->windows, x, y, max_error, 0);
    if (e.centred <= VSHI_AO_TILE_ENOUGH * max_error) {
        return e;
    }
    const vshi_window_estimate own = vshi_windows_estimate(&b->windows, x, y, max_error, VSHI_TILE);
    return own.centred < e.centred ? own : e;
}

/* Returns the sum of what is curved, in VSHI_SQUARE_UNIT. */
static int64_t estimate_row(sharing *s, const block *b, const size_t range[2], bool own) {
    uint64_t square = 0;
    double worst = 0.0;
    int64_t curved = 0;
    for (size_t i = range[0]; i < range[1]; ++i) {
        if (s->rays[i] == 0) {
            s->values[i] = s->shot[i];
            if (s->deviation != NULL) {
                s->deviation[i] = isnan(s->shot[i]) ? NAN : 0.0f;
            }
            for (size_t axis = 0; axis < 3 && s->bent != NULL; ++axis) {
                s->bent[3 * i + axis] = s->open[3 * i + axis];
            }
            continue;
        }
        const int32_t x = column_of(s, i) - b->left, y = row_of(s, i) - b->top;
        const vshi_window_estimate e = estimate(s, b, x, y);
        s->values[i] = (float)e.value;
        if (s->deviation != NULL) {
            s->deviation[i] = (float)e.deviation;
        }
        if (s->bent != NULL) {
            bend(s, b, &e, x, y, s->bent + 3 * i);
        }
        square += own ? (uint64_t)(e.deviation * e.deviation / VSHI_SQUARE_UNIT) : 0;
        curved += own ? (int64_t)(e.curved / VSHI_SQUARE_UNIT) : 0;
        worst = own ? fmax(worst, e.deviation) : worst;
    }
    atomic_fetch_add(&s->square, square);
    vshi_raise(&s->worst, worst);
    return curved;
}

/* A vshi_range_fn over blocks, row by row. */
static void estimate_block(void *user, size_t begin, size_t end) {
    sharing *s = user;
    const vshi_point_rows *rows = &s->origins->rows;
    for (size_t n = begin; n < end; ++n) {
        const size_t first = n / s->block_columns * ROWS;
        const size_t last = first + ROWS < rows->count ? first + ROWS : rows->count;
        const int32_t left = (int32_t)(n % s->block_columns) * COLUMNS, right = left + COLUMNS;
        size_t range[2], count = 0;
        for (size_t row = first; row < last; ++row) {
            find_origins(s, row, left, right, range);
            count += range[1] - range[0];
        }
        if (count == 0) {
            continue;
        }
        block *b = malloc(sizeof *b);
        if (b == NULL) {
            atomic_fetch_add(&s->refused, 1);
            return;
        }
        const size_t below = last < rows->count ? last + 1 : last;
        lay_out(s, first > 0 ? first - 1 : 0, below, left > 0 ? left - 1 : 0, right + 1, b);
        for (size_t row = first; row < last; ++row) {
            find_origins(s, row, left, right, range);
            s->curved[n % s->block_columns * rows->count + row] =
                estimate_row(s, b, range, row >= rows->first && row < rows->last);
        }
        free(b);
    }
}

/* What is curved in all texels, by rows of tiles, whose sums are known well enough to tell what is above zero
 * and depend on no band. */
static double sum_curved(const sharing *s) {
    const vshi_point_rows *rows = &s->origins->rows;
    double all = 0.0;
    for (size_t row = rows->first; row < rows->last; ++row) {
        int64_t sum = 0;
        for (size_t column = 0; column < s->block_columns; ++column) {
            sum += s->curved[column * rows->count + row];
        }
        all += sum > 0 ? (double)sum * VSHI_SQUARE_UNIT : 0.0;
    }
    return all;
}

double vshi_ao_texels_bytes(double samples, int32_t threads, bool bent) {
    const double all_cores = 64.0; /* threads == 0: how many there are is the pool's business */
    return samples * ((bent ? 4.0 : 1.0) * sizeof(float) + sizeof(int32_t) + sizeof(size_t)) +
           (threads > 0 ? threads : all_cores) * (double)sizeof(block);
}

/* Estimates all, once each texel's own rays are shot. */
static vsh_result estimate_all(sharing *s, vshi_job *job, vsh_error *error) {
    const size_t blocks = (s->origins->rows.count + ROWS - 1) / ROWS * s->block_columns;
    VSHI_TRY(vshi_parallel_for(job, blocks, 1, 0, estimate_block, s, error));
    return s->refused > 0 ? vshi_fail(error, VSH_ERROR_MEMORY, "AO texels: the system refused memory")
                          : VSH_OK;
}

vsh_result vshi_ao_texels(const vsh_occluders *occluders, const vsh_texels *texels,
                          const vshi_origins *origins, const vsh_points *points,
                          const vsh_shade_options *options, const vsh_run *run, float *values,
                          float *deviation, float *bent, vsh_shade_stats *stats, vsh_error *error) {
    sharing s = {.texels = texels,
                 .origins = origins,
                 .points = points,
                 .options = options,
                 .values = values,
                 .deviation = deviation,
                 .bent = bent};
    const char *what = "AO texels";
    const size_t columns = ((size_t)texels->info.width + VSHI_TILE - 1) / VSHI_TILE;
    s.block_columns = (columns + COLUMNS - 1) / COLUMNS;
    vsh_run quiet = *run;
    quiet.progress = NULL;
    vshi_job *job = vshi_job_begin(&quiet, "ao", origins->count);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "ao: the system refused memory");
    }
    vsh_result result;
    const size_t tiles = list_tiles(origins, NULL, NULL);
    VSHI_TRY_DONE(vshi_allocate((void **)&s.tile, tiles + 1, sizeof *s.tile, what, error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&s.row_tile, origins->rows.count + 1, sizeof *s.row_tile, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&s.shot, origins->count, sizeof *s.shot, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&s.rays, origins->count, sizeof *s.rays, what, error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&s.open, bent != NULL ? origins->count : 0, 3 * sizeof *s.open, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&s.curved, s.block_columns * origins->rows.count, sizeof *s.curved,
                                what, error));
    if (tiles > 0) {
        list_tiles(origins, s.tile, s.row_tile);
        const vshi_point_rows rows = {.count = tiles,
                                      .first = s.row_tile[origins->rows.first],
                                      .last = s.row_tile[origins->rows.last],
                                      .start = s.tile};
        VSHI_TRY_DONE(vshi_shade_ao(occluders, points, &rows, options, run, s.shot, NULL, s.open, s.rays,
                                    stats, error));
        VSHI_TRY_DONE(estimate_all(&s, job, error));
    }
    if (stats != NULL) {
        const double square = (double)s.square * VSHI_SQUARE_UNIT + sum_curved(&s);
        stats->square_error += square;
        stats->ao_square_error += square;
        stats->worst_error = fmax(stats->worst_error, s.worst);
    }
done:
    free(s.curved);
    free(s.open);
    free(s.rays);
    free(s.shot);
    free(s.row_tile);
    free(s.tile);
    vshi_job_end(job);
    return result;
}
