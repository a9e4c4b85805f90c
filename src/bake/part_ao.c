/* AO that parts left, finished. */
#include "bake/ao_estimate.h"
#include "bake/baking.h"
#include "bake/part.h"
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
    const bool alone =
        planes->ao != NULL && planes->bent == NULL && planes->sky == NULL && planes->irradiance == NULL;
    *left = alone && vshi_ao_is_shared(occluders, &shade, spacing, layered_ao) ? spacing : 1;
    return VSH_OK;
}

/* --- rows that are put together */

static bool is_lattice(uint32_t level, int32_t spacing) {
    return level > 0 && level <= (uint32_t)spacing && (level & (level - 1)) == 0;
}

/* Whether it can be what a bake left. */
static bool is_sound(const vshi_ao_shot *shot, int32_t spacing) {
    enum { MOST_RAYS = 1 << 24 };
    if (shot->level == 0 || shot->level == VSHI_AO_KNOWN_LEVEL) {
        return shot->rays == 0;
    }
    return is_lattice(shot->level, spacing) && shot->rays >= 0 && shot->rays <= MOST_RAYS &&
           (shot->rays == 0 || (shot->shot >= 0.0f && shot->shot <= 1.0f));
}

bool vshi_ao_shot_is_left(const vshi_ao_shot *shot) {
    return shot->level != 0 && shot->level != VSHI_AO_KNOWN_LEVEL;
}

bool vshi_ao_shots_are_sound(const vshi_ao_shot *shots, size_t count, int32_t spacing) {
    bool sound = true;
    for (size_t i = 0; i < count; ++i) {
        sound = sound && is_sound(&shots[i], spacing);
    }
    return sound;
}

/* The texels that have rays or may have had some, as points in rows of tiles. */
typedef struct assembled {
    const vshi_ao_left *left;
    size_t count;
    size_t *start; /* [rows of tiles + 1] */
    double *positions;
    float *normals, *values, *deviation;
    vsh_points points;
    vshi_point_rows rows;
    vsh_shade_options shade;
    vshi_ao_estimates e;
} assembled;

static size_t count_shots(const vshi_ao_left *left, size_t *start) {
    size_t count = 0;
    for (int32_t row = 0; row < left->rows; ++row) {
        for (size_t i = 0; i < (size_t)left->width; ++i) {
            count += left->shots[(size_t)row * (size_t)left->width + i].level != 0;
        }
        start[row / VSHI_TILE + 1] = count;
    }
    return count;
}

static void take_shots(assembled *a) {
    const vshi_ao_left *left = a->left;
    size_t next = 0;
    for (size_t k = 0; k < (size_t)left->width * (size_t)left->rows; ++k) {
        const vshi_ao_shot *shot = &left->shots[k];
        if (shot->level == 0) {
            continue;
        }
        memcpy(a->positions + 3 * next, shot->position, sizeof shot->position);
        memcpy(a->normals + 3 * next, shot->normal, sizeof shot->normal);
        a->e.shot[next] = shot->shot;
        a->e.share.rays[next] = shot->rays;
        a->e.share.level[next] = (uint8_t)shot->level;
        a->e.at[k] = (uint32_t)++next;
    }
}

static vsh_result assemble(assembled *a, const vsh_shade_options *options, vsh_error *error) {
    const vshi_ao_left *left = a->left;
    const char *what = "AO of parts";
    const size_t tiles = ((size_t)left->rows + VSHI_TILE - 1) / VSHI_TILE;
    VSHI_TRY(vshi_shade_options_resolve(options, &a->shade, error));
    VSHI_TRY(vshi_allocate((void **)&a->start, tiles + 1, sizeof *a->start, what, error));
    a->count = count_shots(left, a->start);
    VSHI_TRY(vshi_allocate((void **)&a->positions, a->count, 3 * sizeof *a->positions, what, error));
    VSHI_TRY(vshi_allocate((void **)&a->normals, a->count, 3 * sizeof *a->normals, what, error));
    VSHI_TRY(vshi_allocate((void **)&a->values, a->count, sizeof *a->values, what, error));
    VSHI_TRY(vshi_allocate((void **)&a->deviation, a->count, sizeof *a->deviation, what, error));
    a->points = (vsh_points){a->count, a->positions, a->normals, NULL};
    a->rows = (vshi_point_rows){.count = tiles, .start = a->start, .first = left->first, .last = left->last};
    a->e = (vshi_ao_estimates){.points = &a->points,
                               .options = &a->shade,
                               .rows = &a->rows,
                               .share = {.map = {NULL, left->width, left->rows}, .spacing = left->spacing},
                               .values = a->values,
                               .deviation = a->deviation,
                               .reach = {.rows = tiles}};
    VSHI_TRY(vshi_ao_estimates_open(&a->e, a->count, error));
    memcpy(a->e.reach.wanted, left->wanted, tiles);
    take_shots(a);
    return VSH_OK;
}

/* Values of texels that were left, and what is held against the casters of those that are counted. */
static bool hand_back(const assembled *a, float *ao, float *deviation, vsh_bake_error *sum) {
    const vshi_ao_left *left = a->left;
    bool sound = true;
    for (size_t k = 0; k < (size_t)left->width * (size_t)left->rows; ++k) {
        const size_t tile = k / (size_t)left->width / VSHI_TILE;
        const vshi_ao_shot *shot = &left->shots[k];
        if (!left->wanted[tile] || !vshi_ao_shot_is_left(shot)) {
            continue;
        }
        const size_t i = (size_t)a->e.at[k] - 1;
        ao[k] = a->values[i];
        if (deviation != NULL) {
            deviation[k] = a->deviation[i];
        }
        if (tile >= left->first && tile < left->last && shot->held[0] != 0) {
            sound = vshi_field_error_settle(shot, a->shade.max_error, (double)a->values[i], sum) && sound;
        }
    }
    return sound;
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

vsh_result vshi_ao_finish(const vshi_ao_left *left, const vsh_shade_options *options, const vsh_run *run,
                          float *ao, float *deviation, vsh_shade_stats *shade, vsh_bake_error *sum,
                          vsh_error *error) {
    VSHI_FLOATS;
    assembled a = {.left = left};
    vsh_run quiet = *run;
    quiet.progress = NULL;
    vshi_job *job = vshi_job_begin(&quiet, "ao", (size_t)left->rows);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "AO of parts: the system refused memory");
    }
    vsh_result result;
    VSHI_TRY_DONE(assemble(&a, options, error));
    VSHI_TRY_DONE(vshi_ao_estimate(&a.e, job, error));
    add_stats(&a, shade, sum);
    if (!hand_back(&a, ao, deviation, sum)) {
        result = vshi_fail(error, VSH_ERROR_INPUT, "more rays are free than there were");
    }
done:
    vshi_ao_estimates_close(&a.e);
    free(a.deviation);
    free(a.values);
    free(a.normals);
    free(a.positions);
    free(a.start);
    vshi_job_end(job);
    return result;
}

double vshi_ao_finish_bytes(int32_t width, int32_t rows, int32_t threads) {
    const double texels = (double)width * (double)rows;
    return texels * (sizeof(vshi_ao_shot) + 3.0 * sizeof(double) + 5.0 * sizeof(float)) +
           vshi_ao_estimates_bytes(texels, width, rows, threads);
}
