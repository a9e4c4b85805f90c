/* AO that parts left, finished. */
#include "bake/ao_estimate.h"
#include "bake/average.h"
#include "bake/baking.h"
#include "bake/bent_normals.h"
#include "bake/part.h"
#include "bake/planes.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/try.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

vsh_result vshi_part_spacing(const vsh_occluders *occluders, const vsh_shade_options *options,
                             const vsh_lightmap *planes, int32_t spacing, int32_t *left, vsh_error *error) {
    vsh_shade_options shade;
    bool layered_ao = false;
    *left = 1;
    VSHI_TRY(vshi_shade_options_resolve(options, &shade, error));
    for (size_t i = 0; i < occluders->layer_count; ++i) {
        layered_ao = layered_ao || occluders->layers[i].ao != 0;
    }
    if (vshi_part_kinds(planes) != 0 && vshi_ao_is_shared(&shade, spacing, layered_ao)) {
        *left = spacing;
    }
    return VSH_OK;
}

uint32_t vshi_part_kinds(const vsh_lightmap *planes) {
    const bool bent = planes->bent != NULL, turned = bent && planes->bent_space == VSH_BENT_TANGENT;
    return (planes->ao != NULL || planes->ao_error != NULL || bent ? VSHI_KEEPS_AO : 0u) |
           (planes->sky != NULL ? VSHI_KEEPS_SKY : 0u) | (bent ? VSHI_KEEPS_OPEN : 0u) |
           (turned ? VSHI_KEEPS_TANGENT : 0u);
}

/* --- rows that are put together */

/* The texels that have rays or may have had some, as points in rows of tiles. */
typedef struct assembled {
    const vshi_ao_left *left;
    const vsh_lightmap *planes;
    bool sky;   /* its rays, not those of AO */
    bool bends; /* bent normals too */
    double up[3];
    size_t count;
    size_t *start; /* [rows of tiles + 1] */
    double *positions;
    float *normals, *values, *deviation, *bent;
    vsh_points points;
    vshi_point_rows rows;
    vsh_shade_options shade;
    vshi_ao_estimates e;
} assembled;

static vshi_ao_kept row_of(const assembled *a, int32_t row) {
    return vshi_ao_kept_row(a->left->kinds, (size_t)a->left->width, a->left->kept, (size_t)row);
}

static const vshi_ao_shot *shots_of(const assembled *a, const vshi_ao_kept *kept) {
    return a->sky ? kept->sky : kept->ao;
}

static size_t count_shots(const assembled *a, size_t *start) {
    size_t count = 0;
    for (int32_t row = 0; row < a->left->rows; ++row) {
        const vshi_ao_kept kept = row_of(a, row);
        for (size_t i = 0; i < (size_t)a->left->width; ++i) {
            count += shots_of(a, &kept)[i].level != 0;
        }
        start[row / VSHI_TILE + 1] = count;
    }
    return count;
}

static void take_shots(assembled *a) {
    const size_t width = (size_t)a->left->width;
    size_t next = 0;
    for (int32_t row = 0; row < a->left->rows; ++row) {
        const vshi_ao_kept kept = row_of(a, row);
        for (size_t i = 0; i < width; ++i) {
            const vshi_ao_shot *shot = &shots_of(a, &kept)[i];
            if (shot->level == 0) {
                continue;
            }
            memcpy(a->positions + 3 * next, kept.position + VSHI_KEPT_POSITION * i, VSHI_KEPT_POSITION);
            memcpy(a->normals + 3 * next, kept.normal + 3 * i, 3 * sizeof *a->normals);
            if (a->bends) {
                memcpy(a->e.open + 3 * next, kept.open + 3 * i, 3 * sizeof *a->e.open);
            }
            a->e.shot[next] = shot->shot;
            a->e.share.rays[next] = shot->rays;
            a->e.share.level[next] = (uint8_t)shot->level;
            a->e.at[(size_t)row * width + i] = (uint32_t)++next;
        }
    }
}

static vsh_result assemble(assembled *a, const vsh_shade_options *options, vsh_error *error) {
    const vshi_ao_left *left = a->left;
    const char *what = "AO of parts";
    const size_t tiles = ((size_t)left->rows + VSHI_TILE - 1) / VSHI_TILE;
    VSHI_TRY(vshi_shade_options_resolve(options, &a->shade, error));
    VSHI_TRY(vshi_allocate((void **)&a->start, tiles + 1, sizeof *a->start, what, error));
    a->count = count_shots(a, a->start);
    const size_t bends = a->bends ? a->count : 0;
    VSHI_TRY(vshi_allocate((void **)&a->positions, a->count, 3 * sizeof *a->positions, what, error));
    VSHI_TRY(vshi_allocate((void **)&a->normals, a->count, 3 * sizeof *a->normals, what, error));
    VSHI_TRY(vshi_allocate((void **)&a->values, a->count, sizeof *a->values, what, error));
    VSHI_TRY(vshi_allocate((void **)&a->deviation, a->count, sizeof *a->deviation, what, error));
    VSHI_TRY(vshi_allocate((void **)&a->bent, bends, 3 * sizeof *a->bent, what, error));
    a->points = (vsh_points){a->count, a->positions, a->normals, NULL};
    a->rows = (vshi_point_rows){.count = tiles, .start = a->start, .first = left->first, .last = left->last};
    a->e = (vshi_ao_estimates){.points = &a->points,
                               .options = &a->shade,
                               .rows = &a->rows,
                               .share = {.map = {NULL, left->width, left->rows}, .spacing = left->spacing},
                               .values = a->values,
                               .deviation = a->deviation,
                               .bent = a->bends ? a->bent : NULL,
                               .reach = {.rows = tiles}};
    VSHI_TRY(vshi_allocate((void **)&a->e.open, bends, 3 * sizeof *a->e.open, what, error));
    VSHI_TRY(vshi_ao_estimates_open(&a->e, a->count, error));
    memcpy(a->e.reach.wanted, left->wanted, tiles);
    take_shots(a);
    return VSH_OK;
}

static void put(float *plane, size_t k, float value) {
    if (plane != NULL) {
        plane[k] = vshi_average_of_one(value);
    }
}

/* Texel k of the planes, point i of those assembled; `tangent` may be NULL. Returns its value. */
static float put_texel(const assembled *a, size_t k, size_t i, const float *tangent) {
    const vsh_lightmap *planes = a->planes;
    const float *normal = a->normals + 3 * i;
    if (a->sky) {
        const float seen = vshi_sky_weighed(normal, a->up, a->values[i]);
        put(planes->sky, k, seen);
        return seen;
    }
    put(planes->ao, k, a->values[i]);
    put(planes->ao_error, k, a->deviation[i]);
    if (a->bends) {
        vshi_bent_normal(normal, tangent, a->bent + 3 * i);
        memcpy(planes->bent + 3 * k, a->bent + 3 * i, 3 * sizeof *planes->bent);
    }
    return a->values[i];
}

/* Values of texels that were left, and what is held against the casters of those that are counted. */
static void hand_back(const assembled *a, vsh_bake_error *sum) {
    const vshi_ao_left *left = a->left;
    const size_t width = (size_t)left->width;
    for (int32_t row = 0; row < left->rows; ++row) {
        const vshi_ao_kept kept = row_of(a, row);
        const size_t tile = (size_t)row / VSHI_TILE;
        for (size_t column = 0; left->wanted[tile] && column < width; ++column) {
            const vshi_ao_shot *shot = &shots_of(a, &kept)[column];
            if (!vshi_ao_is_left(shot)) {
                continue;
            }
            const size_t k = (size_t)row * width + column;
            const float value = put_texel(a, k, (size_t)a->e.at[k] - 1,
                                          kept.tangent != NULL ? kept.tangent + 4 * column : NULL);
            if (tile >= left->first && tile < left->last && shot->held[0] != 0) {
                vshi_field_error_settle(shot, a->shade.max_error, (double)value, sum);
            }
        }
    }
}

static void add_stats(const assembled *a, vsh_shade_stats *shade, vsh_bake_error *sum) {
    vsh_shade_stats stats = vsh_shade_stats_zero();
    vshi_ao_estimate_add(&a->e, &stats);
    shade->rays += stats.rays;
    shade->refined += stats.refined;
    shade->square_error += stats.square_error;
    shade->ao_square_error += stats.ao_square_error;
    shade->worst_error = fmax(shade->worst_error, stats.worst_error);
    sum->square_error += stats.square_error;
    sum->worst = fmax(sum->worst, stats.worst_error);
}

static vsh_result finish(assembled *a, const vsh_shade_options *options, const vsh_run *run,
                         vsh_shade_stats *shade, vsh_bake_error *sum, vsh_error *error) {
    vsh_run quiet = *run;
    quiet.progress = NULL;
    vshi_job *job = vshi_job_begin(&quiet, "ao", (size_t)a->left->rows);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "AO of parts: the system refused memory");
    }
    vsh_result result;
    VSHI_TRY_DONE(assemble(a, options, error));
    VSHI_TRY_DONE(vshi_ao_estimate(&a->e, job, error));
    add_stats(a, shade, sum);
    hand_back(a, sum);
done:
    vshi_ao_estimates_close(&a->e);
    free(a->e.open);
    free(a->bent);
    free(a->deviation);
    free(a->values);
    free(a->normals);
    free(a->positions);
    free(a->start);
    vshi_job_end(job);
    return result;
}

vsh_result vshi_ao_finish(const vshi_ao_left *left, const vsh_shade_options *options, const vsh_run *run,
                          const vsh_lightmap *planes, vsh_shade_stats *shade, vsh_bake_error *errors,
                          vsh_error *error) {
    VSHI_FLOATS;
    if ((left->kinds & VSHI_KEEPS_AO) != 0) {
        assembled ao = {.left = left, .planes = planes, .bends = planes->bent != NULL};
        VSHI_TRY(finish(&ao, options, run, shade, &errors[0], error));
    }
    if ((left->kinds & VSHI_KEEPS_SKY) != 0) {
        assembled sky = {.left = left, .planes = planes, .sky = true};
        vshi_sky_up(planes->asked.sky, sky.up);
        VSHI_TRY(finish(&sky, options, run, shade, &errors[1], error));
    }
    return VSH_OK;
}

double vshi_ao_finish_bytes(int32_t width, int32_t rows, int32_t threads, uint32_t kinds) {
    const double texels = (double)width * (double)rows;
    const double point = 3.0 * sizeof(double) + 5.0 * sizeof(float);
    const double planes = 2.0 + ((kinds & VSHI_KEEPS_SKY) != 0 ? 1.0 : 0.0);
    const double bent = (kinds & VSHI_KEEPS_OPEN) != 0 ? 9.0 : 0.0; /* what is open, bent, and their plane */
    return texels * ((double)vshi_ao_kept_bytes(kinds) + point + (planes + bent) * sizeof(float)) +
           vshi_ao_estimates_bytes(texels, width, rows, threads);
}
