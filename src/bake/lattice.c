#include "bake/lattice.h"

#include "bake/take.h"
#include "base/parallel.h"
#include "shade/rays.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A cell is interpolated where a free ball of so many of its spacings touches its middle: what hides the sky
 * from it is farther away than that, or low. */
static const double CLEAR = 1.0;
/* What such a ball may lack of being free, of its radius and in voxels: fields are not better known. */
static const double LACK = 0.25, LACK_VOXELS = 0.25;
/* The corners of a cell differ by at most this. */
static const double RANGE = 0.2;
/* The texels between lie so flat, of the spacing, and their normals within so much (cosine) of each other. */
static const double FLAT = 0.2, ALIKE = 0.95;
/* Corners are shaded to this share of max_error: many texels are made of them. */
static const double FINER = 0.5;

enum { UNKNOWN, CHOSEN, KNOWN, BETWEEN }; /* known: shaded, or interpolated */

typedef struct lattice {
    const vsh_field *field;
    const vsh_texels *texels;
    const vshi_origins *origins;
    const vsh_points *points;
    double distance; /* of AO, finest voxels */
    int32_t spacing; /* of this pass */
    uint32_t *at;    /* [rows held][width]: number of the texel's origin + 1, 0: none */
    uint8_t *state;  /* [origins.count] */
    size_t *before;  /* [blocks + 1]: chosen origins before each block */
    size_t blocks;
    float *values, *deviation;
    float *bent; /* [origins.count][3], or NULL */
    /* of the chosen */
    uint32_t *number;
    double *position;
    float *normal;
    uint32_t *texel;
    float *chosen_values, *chosen_deviation, *chosen_bent;
    size_t *row_start; /* [rows of the origins + 1] */
} lattice;

enum { BLOCK = VSHI_ORIGIN_BLOCK };

static size_t block_end(const lattice *l, size_t block) {
    const size_t end = (block + 1) * BLOCK;
    return end < l->origins->count ? end : l->origins->count;
}

static uint32_t column_of(const lattice *l, size_t i) {
    return l->origins->texel[i] & 0xffff;
}

static uint32_t row_of(const lattice *l, size_t i) {
    return l->origins->texel[i] >> 16;
}

static void find_texels(void *user, size_t begin, size_t end) {
    const lattice *l = user;
    for (size_t i = begin; i < end; ++i) {
        const size_t row = row_of(l, i) - (uint32_t)l->texels->band.first;
        l->at[row * (size_t)l->texels->info.width + column_of(l, i)] = (uint32_t)i + 1;
    }
}

/* --- cells */

/* Between lattice lines, both included; at the edge of a chart clipped to the texels that are there. */
typedef struct cell {
    uint32_t column, row; /* of its first lattice lines */
    uint32_t left, right, top, bottom;
    bool good;
    size_t corner[4]; /* origins: left and right of the upper row, of the lower */
} cell;

static bool lookup(const lattice *l, uint32_t column, uint32_t row, size_t *i) {
    const vshi_band *band = &l->texels->band;
    const uint32_t width = (uint32_t)l->texels->info.width, held = row - (uint32_t)band->first;
    if (column >= width || held >= (uint32_t)band->rows) {
        return false;
    }
    const uint32_t number = l->at[(size_t)held * width + column];
    *i = (size_t)number - 1;
    return number != 0;
}

/* Texels of the cell from (column, row) on; false where they are no rectangle. */
static bool clip(const lattice *l, uint32_t column, uint32_t row, cell *c) {
    const uint32_t s = (uint32_t)l->spacing;
    size_t i, found = 0;
    *c = (cell){
        .column = column, .row = row, .left = column, .right = column + s, .top = row, .bottom = row + s};
    if (lookup(l, column, row, &i) && lookup(l, column + s, row, &i) && lookup(l, column, row + s, &i) &&
        lookup(l, column + s, row + s, &i)) {
        return true;
    }
    uint32_t left = UINT32_MAX, right = 0, top = UINT32_MAX, bottom = 0;
    for (uint32_t y = row; y <= c->bottom; ++y) {
        for (uint32_t x = column; x <= c->right; ++x) {
            if (lookup(l, x, y, &i)) {
                left = x < left ? x : left;
                right = x > right ? x : right;
                top = y < top ? y : top;
                bottom = y;
                ++found;
            }
        }
    }
    c->left = left, c->right = right, c->top = top, c->bottom = bottom;
    return found > 0 && found == (size_t)(right - left + 1) * (bottom - top + 1);
}

/* Whether a texel is the corner of a cell, its own or one that ends at it. */
static bool is_corner(const lattice *l, uint32_t column, uint32_t row) {
    const uint32_t s = (uint32_t)l->spacing, mask = s - 1;
    if (((column | row) & mask) == 0) {
        return true;
    }
    for (uint32_t k = 0; k < 4; ++k) {
        const uint32_t before = k & 1, above = k >> 1;
        if ((before && ((column & mask) != 0 || column == 0)) || (above && ((row & mask) != 0 || row == 0))) {
            continue;
        }
        cell c;
        if (clip(l, (column & ~mask) - before * s, (row & ~mask) - above * s, &c) &&
            (column == c.left || column == c.right) && (row == c.top || row == c.bottom)) {
            return true;
        }
    }
    return false;
}

/* --- the texels of a pass */

static void choose(void *user, size_t begin, size_t end) {
    const lattice *l = user;
    for (size_t block = begin; block < end; ++block) {
        size_t count = 0;
        for (size_t i = block * BLOCK; i < block_end(l, block); ++i) {
            if (l->state[i] == UNKNOWN && is_corner(l, column_of(l, i), row_of(l, i))) {
                l->state[i] = CHOSEN;
                ++count;
            }
        }
        l->before[block] = count;
    }
}

static void pack(void *user, size_t begin, size_t end) {
    const lattice *l = user;
    for (size_t block = begin; block < end; ++block) {
        size_t next = l->before[block];
        for (size_t i = block * BLOCK; i < block_end(l, block); ++i) {
            if (l->state[i] == CHOSEN) {
                memcpy(l->position + 3 * next, l->points->positions + 3 * i, 3 * sizeof(double));
                memcpy(l->normal + 3 * next, l->points->normals + 3 * i, 3 * sizeof(float));
                l->texel[next] = l->points->texels[i];
                l->number[next++] = (uint32_t)i;
            }
        }
    }
}

/* Where the rows of the origins begin among the chosen. */
static vshi_point_rows chosen_rows(const lattice *l, size_t count) {
    vshi_point_rows rows = l->origins->rows;
    size_t next = 0;
    for (size_t row = 0; row <= rows.count; ++row) {
        while (next < count && l->number[next] < rows.start[row]) {
            ++next;
        }
        l->row_start[row] = next;
    }
    rows.start = l->row_start;
    return rows;
}

static void unpack(void *user, size_t begin, size_t end) {
    const lattice *l = user;
    for (size_t n = begin; n < end; ++n) {
        const size_t i = l->number[n];
        l->values[i] = l->chosen_values[n];
        if (l->deviation != NULL) {
            l->deviation[i] = l->chosen_deviation[n];
        }
        if (l->bent != NULL) {
            memcpy(l->bent + 3 * i, l->chosen_bent + 3 * n, 3 * sizeof *l->bent);
        }
        l->state[i] = KNOWN;
    }
}

/* --- values between */

/* Corner values weighted for a place of the cell, 0 … 1 along both sides. */
static double mix(const double v[4], double x, double y) {
    return (v[0] * (1.0 - x) + v[1] * x) * (1.0 - y) + (v[2] * (1.0 - x) + v[3] * x) * y;
}

/* How far x lies between two lines, 0 … 1. */
static double part(uint32_t x, uint32_t from, uint32_t to) {
    return to > from ? (double)(x - from) / (double)(to - from) : 0.0;
}

static vshi_vec position_of(const lattice *l, size_t i) {
    return vshi_to_field(l->field, l->points->positions + 3 * i);
}

static bool corners_agree(const lattice *l, const cell *c) {
    double low = INFINITY, high = -INFINITY;
    for (int k = 0; k < 4; ++k) {
        const double v = (double)l->values[c->corner[k]];
        if (isnan(v)) {
            return false;
        }
        low = fmin(low, v);
        high = fmax(high, v);
    }
    return high - low <= RANGE;
}

/* Whether all texels of a cell are there, in a plane, and turned alike. */
static bool lies_flat(const lattice *l, const cell *c, const vshi_vec p[4], double size) {
    const vshi_vec n = vshi_vec_off(l->points->normals + 3 * c->corner[0]);
    const double x[4] = {p[0].x, p[1].x, p[2].x, p[3].x}, y[4] = {p[0].y, p[1].y, p[2].y, p[3].y},
                 z[4] = {p[0].z, p[1].z, p[2].z, p[3].z};
    for (uint32_t row = c->top; row <= c->bottom; ++row) {
        for (uint32_t column = c->left; column <= c->right; ++column) {
            size_t i;
            if (!lookup(l, column, row, &i) ||
                vshi_dot(n, vshi_vec_off(l->points->normals + 3 * i)) < ALIKE) {
                return false;
            }
            const double u = part(column, c->left, c->right), v = part(row, c->top, c->bottom);
            const vshi_vec off =
                vshi_sub(position_of(l, i), (vshi_vec){mix(x, u, v), mix(y, u, v), mix(z, u, v)});
            if (vshi_dot(off, off) > FLAT * FLAT * size * size) {
                return false;
            }
        }
    }
    return true;
}

static bool is_clear(const lattice *l, const cell *c, const vshi_vec p[4], double size) {
    const vshi_vec sum = vshi_add(vshi_add(p[0], p[1]), vshi_add(p[2], p[3]));
    const vshi_vec normal =
        vshi_direction_to_field(l->field, vshi_vec_off(l->points->normals + 3 * c->corner[0]));
    const double radius = fmin(CLEAR * size, l->distance);
    const vshi_vec centre = vshi_add(vshi_scale(sum, 0.25), vshi_scale(normal, radius));
    const float at[3] = {(float)centre.x, (float)centre.y, (float)centre.z};
    const double lack = fmax(LACK * radius, LACK_VOXELS);
    return (double)vshi_field_distance(l->field, at) >= radius - lack;
}

static cell look_at(const lattice *l, uint32_t column, uint32_t row) {
    cell c;
    vshi_vec p[4];
    if (!clip(l, column, row, &c)) {
        return c;
    }
    for (int k = 0; k < 4; ++k) {
        if (!lookup(l, k & 1 ? c.right : c.left, k >> 1 ? c.bottom : c.top, &c.corner[k]) ||
            l->state[c.corner[k]] < KNOWN) {
            return c;
        }
        p[k] = position_of(l, c.corner[k]);
    }
    if (!corners_agree(l, &c)) {
        return c;
    }
    const double size = fmax(vshi_length(vshi_sub(p[3], p[0])), vshi_length(vshi_sub(p[2], p[1])));
    c.good = is_clear(l, &c, p, size) && lies_flat(l, &c, p, size);
    return c;
}

/* One of so many channels of the corners' values, at a place of the cell. */
static float between(const float *values, size_t channels, size_t channel, const cell *c, double x,
                     double y) {
    double v[4];
    for (int k = 0; k < 4; ++k) {
        v[k] = (double)values[channels * c->corner[k] + channel];
    }
    return (float)mix(v, x, y);
}

/* Interpolates what lies in good cells. Corners are not among it, so none is read that is being written. */
static void interpolate(void *user, size_t begin, size_t end) {
    const lattice *l = user;
    const uint32_t s = (uint32_t)l->spacing;
    for (size_t block = begin; block < end; ++block) {
        cell c = {.column = UINT32_MAX};
        for (size_t i = block * BLOCK; i < block_end(l, block); ++i) {
            if (l->state[i] != UNKNOWN) {
                continue;
            }
            const uint32_t column = column_of(l, i), row = row_of(l, i);
            const uint32_t first_column = column & ~(s - 1), first_row = row & ~(s - 1);
            if (c.column != first_column || c.row != first_row) {
                c = look_at(l, first_column, first_row);
            }
            if (!c.good) {
                continue;
            }
            const double x = part(column, c.left, c.right), y = part(row, c.top, c.bottom);
            l->values[i] = between(l->values, 1, 0, &c, x, y);
            if (l->deviation != NULL) {
                l->deviation[i] = between(l->deviation, 1, 0, &c, x, y);
            }
            for (size_t axis = 0; axis < 3 && l->bent != NULL; ++axis) {
                l->bent[3 * i + axis] = between(l->bent, 3, axis, &c, x, y);
            }
            l->state[i] = BETWEEN;
        }
    }
}

/* --- passes */

/* Progress of all passes as one stage: a pass moves it by its share. */
typedef struct passes {
    const vsh_run *run;
    double done, share;
} passes;

static int32_t tell(void *user, const char *stage, double fraction) {
    const passes *p = user;
    return p->run->progress(p->run->user, stage, p->done + p->share * fraction);
}

static void warn(void *user, const char *message) {
    const passes *p = user;
    p->run->warning(p->run->user, message);
}

static vsh_result shade_pass(lattice *l, const vsh_shade_options *options, size_t count, const vsh_run *run,
                             vshi_job *job, vsh_shade_stats *stats, vsh_error *error) {
    vsh_result result = VSH_OK;
    const char *what = "AO texels";
    l->number = vshi_take(count, sizeof *l->number, what, &result, error);
    l->position = vshi_take(count, 3 * sizeof(double), what, &result, error);
    l->normal = vshi_take(count, 3 * sizeof(float), what, &result, error);
    l->texel = vshi_take(count, sizeof *l->texel, what, &result, error);
    l->chosen_values = vshi_take(count, sizeof(float), what, &result, error);
    l->chosen_deviation = vshi_take(l->deviation != NULL ? count : 0, sizeof(float), what, &result, error);
    l->chosen_bent = vshi_take(l->bent != NULL ? count : 0, 3 * sizeof(float), what, &result, error);
    if (result == VSH_OK) {
        result = vshi_parallel_for(job, l->blocks, 1, 0, pack, l, error);
    }
    if (result == VSH_OK) {
        vsh_shade_options shade = *options;
        if (l->spacing > 1) {
            shade.max_error = fmax(FINER * shade.max_error, 1e-4);
        }
        const vsh_points points = {count, l->position, l->normal, l->texel};
        const vshi_point_rows rows = chosen_rows(l, count);
        result = vshi_shade_ao(l->field, &points, &rows, &shade, run, l->chosen_values, l->chosen_deviation,
                               l->chosen_bent, stats, error);
    }
    if (result == VSH_OK) {
        result = vshi_parallel_for(job, count, 4096, 0, unpack, l, error);
    }
    free(l->chosen_bent);
    free(l->chosen_deviation);
    free(l->chosen_values);
    free(l->texel);
    free(l->normal);
    free(l->position);
    free(l->number);
    return result;
}

static size_t count_known(const lattice *l) {
    size_t known = 0;
    for (size_t i = 0; i < l->origins->count; ++i) {
        known += l->state[i] >= KNOWN;
    }
    return known;
}

static vsh_result run_passes(lattice *l, const vsh_shade_options *options, const vsh_run *run, vshi_job *job,
                             vsh_shade_stats *stats, vsh_error *error) {
    const double all = fmax(1.0, (double)l->origins->count);
    passes progress = {.run = run};
    vsh_run part = *run;
    part.user = &progress;
    part.progress = run->progress != NULL ? tell : NULL;
    part.warning = run->warning != NULL ? warn : NULL;
    vsh_result result = vshi_parallel_for(job, l->origins->count, 4096, 0, find_texels, l, error);
    for (l->spacing = l->texels->ao_spacing; result == VSH_OK && l->spacing > 0; l->spacing /= 2) {
        result = vshi_parallel_for(job, l->blocks, 1, 0, choose, l, error);
        size_t count = 0;
        for (size_t block = 0; result == VSH_OK && block <= l->blocks; ++block) {
            const size_t chosen = l->before[block];
            l->before[block] = count;
            count += block < l->blocks ? chosen : 0;
        }
        progress.done = (double)count_known(l) / all;
        progress.share = (double)count / all;
        if (result == VSH_OK && count > 0) {
            result = shade_pass(l, options, count, &part, job, stats, error);
        }
        if (result == VSH_OK && l->spacing > 1) {
            result = vshi_parallel_for(job, l->blocks, 1, 0, interpolate, l, error);
        }
    }
    return result;
}

/* What was interpolated adds to the squared error, as what was shaded has. */
static void add_errors(const lattice *l, vsh_shade_stats *stats) {
    const vshi_point_rows *rows = &l->origins->rows;
    uint64_t sum = 0;
    for (size_t i = rows->start[rows->first]; i < rows->start[rows->last]; ++i) {
        const double deviation = l->state[i] == BETWEEN ? (double)l->deviation[i] : 0.0;
        sum += deviation > 0.0 ? (uint64_t)(deviation * deviation / VSHI_SQUARE_UNIT) : 0;
    }
    stats->square_error += (double)sum * VSHI_SQUARE_UNIT;
    stats->ao_square_error += (double)sum * VSHI_SQUARE_UNIT;
}

double vshi_lattice_bytes(double samples, double texels, bool bent) {
    return texels * sizeof(uint32_t) +
           samples * (1.0 + 3.0 * sizeof(double) + (bent ? 11.0 : 8.0) * sizeof(float));
}

vsh_result vshi_lattice_ao(const vsh_field *field, const vsh_texels *texels, const vshi_origins *origins,
                           const vsh_points *points, const vsh_shade_options *options, const vsh_run *run,
                           float *values, float *deviation, float *bent, vsh_shade_stats *stats,
                           vsh_error *error) {
    lattice l = {.field = field,
                 .texels = texels,
                 .origins = origins,
                 .points = points,
                 .distance = options->ao_distance / field->voxel_size,
                 .blocks = (origins->count + BLOCK - 1) / BLOCK,
                 .values = values,
                 .bent = bent};
    const char *what = "AO texels";
    vsh_run quiet = *run;
    quiet.progress = NULL;
    vshi_job *job = vshi_job_begin(&quiet, "ao", origins->count);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "ao: the system refused memory");
    }
    vsh_result result = VSH_OK;
    l.at = vshi_take(vshi_texels_held(texels), sizeof *l.at, what, &result, error);
    l.state = vshi_take(origins->count, 1, what, &result, error);
    l.before = vshi_take(l.blocks + 1, sizeof *l.before, what, &result, error);
    l.row_start = vshi_take(origins->rows.count + 1, sizeof *l.row_start, what, &result, error);
    const bool estimates = (vsh_ao_method_traits(options->ao_method) & VSH_METHOD_KEEPS_ERROR) != 0;
    float *own =
        vshi_take(estimates && deviation == NULL ? origins->count : 0, sizeof *own, what, &result, error);
    l.deviation = deviation == NULL && estimates ? own : deviation;
    if (result == VSH_OK) {
        result = run_passes(&l, options, run, job, stats, error);
    }
    if (result == VSH_OK && estimates && stats != NULL) {
        add_errors(&l, stats);
    }
    free(own);
    free(l.row_start);
    free(l.before);
    free(l.state);
    free(l.at);
    vshi_job_end(job);
    return result;
}
