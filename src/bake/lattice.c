#include "bake/lattice.h"

#include "bake/lattice_cells.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"
#include "shade/ao.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Corners are shaded to this share of max_error: many texels are made of them. */
static const double FINER = 0.5;

enum { BLOCK = VSHI_ORIGIN_BLOCK };

static size_t block_end(const vshi_lattice *l, size_t block) {
    const size_t end = (block + 1) * BLOCK;
    return end < l->origins->count ? end : l->origins->count;
}

static uint32_t column_of(const vshi_lattice *l, size_t i) {
    return l->origins->texel[i] & 0xffff;
}

static uint32_t row_of(const vshi_lattice *l, size_t i) {
    return l->origins->texel[i] >> 16;
}

static void find_texels(void *user, size_t begin, size_t end) {
    const vshi_lattice *l = user;
    for (size_t i = begin; i < end; ++i) {
        const size_t row = row_of(l, i) - (uint32_t)l->texels->band.first;
        l->at[row * (size_t)l->texels->info.width + column_of(l, i)] = (uint32_t)i + 1;
    }
}

/* --- the texels of a pass */

/* Cells of rows that are wanted end in the row of tiles behind, whose own cells matter as far as they tell
 * which of its texels are shaded: at each but the finest lattice. So do, at each but the two finest, those of
 * the row behind that. */
static void find_behind(vshi_lattice *l) {
    const vshi_origins *origins = l->origins;
    for (size_t row = 0; row < origins->rows.count; ++row) {
        const int before = row > 0 ? l->behind[row - 1] : LATTICE_FAR;
        const int behind = before < LATTICE_FAR ? before + 1 : LATTICE_FAR;
        l->behind[row] = origins->needed[row] == VSHI_ROW_WANTED ? 0 : (uint8_t)behind;
    }
}

/* Whether a pass shades anything in the texel's row. */
static bool is_reached(const vshi_lattice *l, size_t i) {
    const size_t row = (row_of(l, i) - (uint32_t)l->texels->band.first) / VSHI_TILE;
    return (l->spacing >> l->behind[row]) > 0;
}

static void choose(void *user, size_t begin, size_t end) {
    const vshi_lattice *l = user;
    for (size_t block = begin; block < end; ++block) {
        size_t count = 0;
        for (size_t i = block * BLOCK; i < block_end(l, block); ++i) {
            if (l->state[i] == LATTICE_UNKNOWN && is_reached(l, i) &&
                vshi_lattice_is_corner(l, column_of(l, i), row_of(l, i))) {
                l->state[i] = LATTICE_CHOSEN;
                ++count;
            }
        }
        l->before[block] = count;
    }
}

static void pack(void *user, size_t begin, size_t end) {
    const vshi_lattice *l = user;
    for (size_t block = begin; block < end; ++block) {
        size_t next = l->before[block];
        for (size_t i = block * BLOCK; i < block_end(l, block); ++i) {
            if (l->state[i] == LATTICE_CHOSEN) {
                memcpy(l->position + 3 * next, l->points->positions + 3 * i, 3 * sizeof(double));
                memcpy(l->normal + 3 * next, l->points->normals + 3 * i, 3 * sizeof(float));
                if (l->face != NULL) {
                    memcpy(l->face + 3 * next, l->origins->face + 3 * i, 3 * sizeof(float));
                }
                l->texel[next] = l->points->texels[i];
                l->number[next++] = (uint32_t)i;
            }
        }
    }
}

/* Where the rows of the origins begin among the chosen. */
static vshi_point_rows chosen_rows(const vshi_lattice *l, size_t count) {
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
    const vshi_lattice *l = user;
    for (size_t n = begin; n < end; ++n) {
        const size_t i = l->number[n];
        l->values[i] = l->chosen_values[n];
        if (l->deviation != NULL) {
            l->deviation[i] = l->chosen_deviation[n];
        }
        if (l->bent != NULL) {
            memcpy(l->bent + 3 * i, l->chosen_bent + 3 * n, 3 * sizeof *l->bent);
        }
        l->state[i] = LATTICE_KNOWN;
    }
}

/* --- values between */

/* Interpolates what lies in good cells. Corners are not among it, so none is read that is being written. */
static void interpolate(void *user, size_t begin, size_t end) {
    const vshi_lattice *l = user;
    const uint32_t s = (uint32_t)l->spacing;
    for (size_t block = begin; block < end; ++block) {
        vshi_cell c = {.column = UINT32_MAX};
        for (size_t i = block * BLOCK; i < block_end(l, block); ++i) {
            if (l->state[i] != LATTICE_UNKNOWN || !is_reached(l, i)) {
                continue;
            }
            const uint32_t column = column_of(l, i), row = row_of(l, i);
            const uint32_t first_column = column & ~(s - 1), first_row = row & ~(s - 1);
            if (c.column != first_column || c.row != first_row) {
                c = vshi_lattice_look_at(l, first_column, first_row);
            }
            if (!c.good) {
                continue;
            }
            const double x = vshi_lattice_part(column, c.left, c.right),
                         y = vshi_lattice_part(row, c.top, c.bottom);
            l->values[i] = vshi_lattice_between(l->values, 1, 0, &c, x, y);
            if (l->deviation != NULL) {
                l->deviation[i] = vshi_lattice_between(l->deviation, 1, 0, &c, x, y);
            }
            for (size_t axis = 0; axis < 3 && l->bent != NULL; ++axis) {
                l->bent[3 * i + axis] = vshi_lattice_between(l->bent, 3, axis, &c, x, y);
            }
            l->state[i] = LATTICE_BETWEEN;
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

/* Adds up what the blocks count; returns the sum. */
static size_t sum_blocks(vshi_lattice *l) {
    size_t count = 0;
    for (size_t block = 0; block <= l->blocks; ++block) {
        const size_t chosen = l->before[block];
        l->before[block] = count;
        count += block < l->blocks ? chosen : 0;
    }
    return count;
}

static vsh_result shade_pass(vshi_lattice *l, const vsh_shade_options *options, size_t count,
                             const vsh_run *run, vshi_job *job, vsh_shade_stats *stats, vsh_error *error) {
    vsh_result result;
    const char *what = "AO texels";
    l->number = l->texel = NULL;
    l->position = NULL;
    l->normal = l->face = l->chosen_values = l->chosen_deviation = l->chosen_bent = NULL;
    VSHI_TRY_DONE(vshi_allocate((void **)&l->number, count, sizeof *l->number, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&l->position, count, 3 * sizeof(double), what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&l->normal, count, 3 * sizeof(float), what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&l->face, l->origins->face != NULL ? count : 0, 3 * sizeof(float),
                                what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&l->texel, count, sizeof *l->texel, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&l->chosen_values, count, sizeof(float), what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&l->chosen_deviation, l->deviation != NULL ? count : 0,
                                sizeof(float), what, error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&l->chosen_bent, l->bent != NULL ? count : 0, 3 * sizeof(float), what, error));
    VSHI_TRY_DONE(vshi_parallel_for(job, l->blocks, 1, 0, pack, l, error));
    vsh_shade_options shade = *options;
    if (l->spacing > 1) {
        shade.max_error = fmax(FINER * shade.max_error, 1e-4);
    }
    const vsh_points points = {count, l->position, l->normal, l->texel};
    const vshi_point_rows rows = chosen_rows(l, count);
    VSHI_TRY_DONE(vshi_shade_ao(l->occluders, &points, l->face, &rows, &shade, run, l->chosen_values,
                                l->chosen_deviation, l->chosen_bent, NULL, stats, error));
    VSHI_TRY_DONE(vshi_parallel_for(job, count, 4096, 0, unpack, l, error));
done:
    free(l->chosen_bent);
    free(l->chosen_deviation);
    free(l->chosen_values);
    free(l->texel);
    free(l->face);
    free(l->normal);
    free(l->position);
    free(l->number);
    return result;
}

static size_t count_known(const vshi_lattice *l) {
    size_t known = 0;
    for (size_t i = 0; i < l->origins->count; ++i) {
        known += l->state[i] >= LATTICE_KNOWN;
    }
    return known;
}

static vsh_result run_passes(vshi_lattice *l, const vsh_shade_options *options, const vsh_run *run,
                             vshi_job *job, vsh_shade_stats *stats, vsh_error *error) {
    const double all = fmax(1.0, (double)l->origins->count);
    passes progress = {.run = run};
    vsh_run part = *run;
    part.user = &progress;
    part.progress = run->progress != NULL ? tell : NULL;
    part.warning = run->warning != NULL ? warn : NULL;
    VSHI_TRY(vshi_parallel_for(job, l->origins->count, 4096, 0, find_texels, l, error));
    for (l->spacing = l->texels->ao_spacing; l->spacing > 0; l->spacing /= 2) {
        VSHI_TRY(vshi_parallel_for(job, l->blocks, 1, 0, choose, l, error));
        const size_t count = sum_blocks(l);
        progress.done = (double)count_known(l) / all;
        progress.share = (double)count / all;
        if (count > 0) {
            VSHI_TRY(shade_pass(l, options, count, &part, job, stats, error));
        }
        if (l->spacing > 1) {
            VSHI_TRY(vshi_parallel_for(job, l->blocks, 1, 0, interpolate, l, error));
        }
    }
    return VSH_OK;
}

/* What was interpolated adds to the squared error, as what was shaded has. */
static void add_errors(const vshi_lattice *l, vsh_shade_stats *stats) {
    const vshi_point_rows *rows = &l->origins->rows;
    uint64_t sum = 0;
    for (size_t i = rows->start[rows->first]; i < rows->start[rows->last]; ++i) {
        const double deviation = l->state[i] == LATTICE_BETWEEN ? (double)l->deviation[i] : 0.0;
        stats->worst_error = fmax(stats->worst_error, deviation);
        sum += deviation > 0.0 ? (uint64_t)(deviation * deviation / VSHI_SQUARE_UNIT) : 0;
    }
    stats->square_error += (double)sum * VSHI_SQUARE_UNIT;
    stats->ao_square_error += (double)sum * VSHI_SQUARE_UNIT;
}

double vshi_lattice_bytes(double samples, double texels, bool bent, bool smooth) {
    return texels * sizeof(uint32_t) +
           samples *
               (1.0 + 3.0 * sizeof(double) + ((bent ? 11.0 : 8.0) + (smooth ? 3.0 : 0.0)) * sizeof(float));
}

vsh_result vshi_lattice_ao(const vsh_occluders *occluders, const vsh_texels *texels,
                           const vshi_origins *origins, const vsh_points *points,
                           const vsh_shade_options *options, const vsh_run *run, float *values,
                           float *deviation, float *bent, vsh_shade_stats *stats, vsh_error *error) {
    vshi_lattice l = {.occluders = occluders,
                      .field = occluders->field,
                      .texels = texels,
                      .origins = origins,
                      .points = points,
                      .distance = options->ao_distance / occluders->field->voxel_size,
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
    vsh_result result;
    float *own = NULL;
    VSHI_TRY_DONE(vshi_allocate((void **)&l.at, vshi_texels_held(texels), sizeof *l.at, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&l.state, origins->count, 1, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&l.before, l.blocks + 1, sizeof *l.before, what, error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&l.row_start, origins->rows.count + 1, sizeof *l.row_start, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&l.behind, origins->rows.count, 1, what, error));
    find_behind(&l);
    const bool estimates = (vsh_ao_method_traits(options->ao_method) & VSH_METHOD_KEEPS_ERROR) != 0;
    VSHI_TRY_DONE(vshi_allocate((void **)&own, estimates && deviation == NULL ? origins->count : 0,
                                sizeof *own, what, error));
    l.deviation = deviation == NULL && estimates ? own : deviation;
    VSHI_TRY_DONE(run_passes(&l, options, run, job, stats, error));
    if (estimates && stats != NULL) {
        add_errors(&l, stats);
    }
done:
    free(own);
    free(l.behind);
    free(l.row_start);
    free(l.before);
    free(l.state);
    free(l.at);
    vshi_job_end(job);
    return result;
}
