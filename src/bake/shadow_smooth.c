/* Rays leave noise. Where a penumbra begins, a few rays agree by chance: single texels then jump from 1 to
 * 0.9 and back, and outlines look frayed. So values that rays left open are fitted by parabolas along rows
 * and columns of texels. None is moved by more than its rays may be off. Rows of tiles are smoothed each on
 * its own, so that nothing depends on how a lightmap is cut into bands. On the seeds' scene second
 * differences along penumbrae fall from 2.4 times those of the truth to 1.4, and the error from 0.0058 to
 * 0.0044. */
#include "bake/shadow_smooth.h"

#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"
#include "base/vec.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* Standard errors that a value may be moved by. */
static const double MOST = 2.0;
/* Samples follow each other evenly: a second difference of places is at most this part of the first, and
 * normals are this much alike (cosine). */
static const double BENT = 0.25, ALIKE = 0.98;
/* Values that differ by more within the window belong to a penumbra that is too narrow for it. */
static const double STEEP = 0.65;

enum { ROWS = 8 /* of a tile */, WINDOW = 5 };

/* A parabola through five values by least squares (Savitzky and Golay, 1964), at its first, second and middle
 * place. It keeps what is cubic at the middle. */
static const double WEIGHTS[3][5] = {{31.0 / 35.0, 9.0 / 35.0, -3.0 / 35.0, -5.0 / 35.0, 3.0 / 35.0},
                                     {9.0 / 35.0, 13.0 / 35.0, 12.0 / 35.0, 6.0 / 35.0, -5.0 / 35.0},
                                     {-3.0 / 35.0, 12.0 / 35.0, 17.0 / 35.0, 12.0 / 35.0, -3.0 / 35.0}};

typedef struct smoothing {
    const vshi_origins *origins;
    float *values;
    const float *deviation;
    atomic_bool refused; /* memory */
} smoothing;

/* A row of tiles: which sample each texel has, or NONE; and what is made of the values. */
typedef struct strip {
    const smoothing *of;
    size_t first, count;
    uint32_t column, columns; /* the first, and how many */
    uint32_t *sample;         /* [ROWS][columns] */
    float *across, *smooth;   /* [count] */
} strip;

static const uint32_t NONE = UINT32_MAX;

/* Whether samples first, first + step … in the strip's layout follow each other on one even surface. */
static bool is_even(const strip *s, size_t first, size_t step) {
    const vshi_origins *o = s->of->origins;
    const double *place[WINDOW];
    const float *normal[WINDOW];
    for (size_t k = 0; k < WINDOW; ++k) {
        const uint32_t i = s->sample[first + k * step];
        if (i == NONE) {
            return false;
        }
        place[k] = o->position + 3 * (s->first + i);
        normal[k] = o->normal + 3 * (s->first + i);
    }
    const vshi_vec along = vshi_scale(vshi_sub(vshi_vec_of(place[WINDOW - 1]), vshi_vec_of(place[0])), 0.25);
    for (size_t k = 1; k < WINDOW; ++k) {
        const vshi_vec off = vshi_sub(vshi_sub(vshi_vec_of(place[k]), vshi_vec_of(place[k - 1])), along);
        if (!(vshi_dot(off, off) <= BENT * BENT * vshi_dot(along, along)) ||
            !(vshi_dot(vshi_vec_off(normal[k]), vshi_vec_off(normal[k - 1])) >= ALIKE)) {
            return false;
        }
    }
    return true;
}

/* Smooths `from` along rows, or down columns. */
static void smooth_along(const strip *s, bool down, const float *from, float *to) {
    const size_t step = down ? s->columns : 1, length = down ? ROWS : s->columns;
    for (size_t at = 0; at < ROWS * s->columns; ++at) {
        const uint32_t i = s->sample[at];
        if (i == NONE) {
            continue;
        }
        to[i] = from[i];
        const size_t place = down ? at / s->columns : at % s->columns;
        const size_t begin = place < 2            ? 0
                             : place + 2 < length ? place - 2
                             : length < WINDOW    ? 0
                                                  : length - WINDOW;
        const size_t first = at - (place - begin) * step, in = place - begin;
        if (length < WINDOW || !(s->of->deviation[s->first + i] > 0.0f) || !is_even(s, first, step)) {
            continue;
        }
        double sum = 0.0, low = INFINITY, high = -INFINITY;
        for (size_t k = 0; k < WINDOW; ++k) {
            const double weight = in <= 2 ? WEIGHTS[in][k] : WEIGHTS[4 - in][4 - k];
            const double value = (double)from[s->sample[first + k * step]];
            sum += weight * value;
            low = value < low ? value : low;
            high = value > high ? value : high;
        }
        to[i] = high - low <= STEEP ? (float)sum : from[i];
    }
}

/* Lays the samples out; false where two are of one texel, or none needs it. */
static bool lay_out(strip *s) {
    const uint32_t *texels = s->of->origins->texel + s->first;
    bool open = false;
    memset(s->sample, 0xff, ROWS * (size_t)s->columns * sizeof *s->sample);
    for (size_t i = 0; i < s->count; ++i) {
        uint32_t *at = &s->sample[(vsh_texel_row(texels[i]) % ROWS) * s->columns +
                                  (vsh_texel_column(texels[i]) - s->column)];
        if (*at != NONE) {
            return false;
        }
        *at = (uint32_t)i;
        open = open || s->of->deviation[s->first + i] > 0.0f;
    }
    return open;
}

static void smooth_strip(strip *s) {
    const smoothing *of = s->of;
    if (!lay_out(s)) {
        return;
    }
    smooth_along(s, false, of->values + s->first, s->across);
    smooth_along(s, true, s->across, s->smooth);
    for (size_t i = 0; i < s->count; ++i) {
        const double value = (double)of->values[s->first + i],
                     most = MOST * (double)of->deviation[s->first + i];
        const double by = (double)s->smooth[i] - value;
        if (most > 0.0 && isfinite(by)) {
            const double smoothed = value + (by > most ? most : by < -most ? -most : by);
            of->values[s->first + i] = (float)(smoothed < 0.0 ? 0.0 : smoothed > 1.0 ? 1.0 : smoothed);
        }
    }
}

static void smooth_strips(void *user, size_t begin, size_t end) {
    smoothing *of = user;
    for (size_t row = begin; row < end; ++row) {
        strip s = {.of = of, .first = of->origins->row_start[row]};
        s.count = of->origins->row_start[row + 1] - s.first;
        uint32_t low = UINT32_MAX, high = 0;
        for (size_t i = 0; i < s.count; ++i) {
            const uint32_t column = vsh_texel_column(of->origins->texel[s.first + i]);
            low = column < low ? column : low;
            high = column > high ? column : high;
        }
        s.column = low;
        s.columns = s.count > 0 ? high + 1 - low : 0;
        s.sample = malloc(ROWS * (size_t)s.columns * sizeof *s.sample + 1);
        s.across = malloc(2 * s.count * sizeof *s.across + 1);
        if (s.sample == NULL || s.across == NULL) {
            atomic_store(&of->refused, true);
        } else if (s.count > 0) {
            s.smooth = s.across + s.count;
            smooth_strip(&s);
        }
        free(s.across);
        free(s.sample);
    }
}

vsh_result vshi_shadow_smooth(const vshi_origins *origins, const vsh_run *run, float *values,
                              const float *deviation, vsh_error *error) {
    smoothing of = {.origins = origins, .values = values, .deviation = deviation};
    vshi_job *job = vshi_job_begin(run, "smooth", origins->rows.count);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "smooth: the system refused memory");
    }
    const vsh_result result = vshi_parallel_for(job, origins->rows.count, 1, 1, smooth_strips, &of, error);
    vshi_job_end(job);
    return atomic_load(&of.refused) ? vshi_fail(error, VSH_ERROR_MEMORY, "smooth: the system refused memory")
                                    : result;
}
