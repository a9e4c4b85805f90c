/* How far values are from the truth. RMSE alone hides lost penumbrae, so the rest stands beside it. */
#include "cli/message.h"
#include "trade.h"

#include <math.h>
#include <stdlib.h>

static int compare(const void *a, const void *b) {
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Nearest rank: the smallest error that a share of all errors does not pass. */
static double percentile(const float *sorted, size_t count, double share) {
    const size_t rank = (size_t)ceil(share * (double)count);
    return (double)sorted[rank > 0 ? rank - 1 : 0];
}

/* Texels of one row or column. */
typedef struct scan {
    const float *truth, *values;
    const uint8_t *mask;
    size_t stride;
    size_t count;
} scan;

static bool valid_at(const scan *s, size_t i) {
    return s->mask[i * s->stride] != 0;
}

/* Length, in texels, that a line of values from texel `begin` to `end` spends between 0.1 and 0.9. */
static double between(const scan *s, const float *values, size_t begin, size_t end) {
    double length = 0.0;
    for (size_t i = begin; i < end; ++i) {
        const double a = (double)values[i * s->stride], b = (double)values[(i + 1) * s->stride];
        const double low = fmax(fmin(a, b), 0.1), high = fmin(fmax(a, b), 0.9);
        if (a == b) {
            length += a > 0.1 && a < 0.9 ? 1.0 : 0.0;
        } else if (high > low) {
            length += (high - low) / fabs(b - a);
        }
    }
    return length;
}

/* Adds the penumbrae that a scan crosses from end to end, and what the values make of their widths. */
static void add_widths(const scan *s, double *truth, double *off) {
    size_t last = 0; /* the last texel that was all lit or all dark */
    int side = 0;    /* which of the two it was; 0: none yet */
    for (size_t i = 0; i < s->count; ++i) {
        if (!valid_at(s, i)) {
            side = 0;
            continue;
        }
        const double v = (double)s->truth[i * s->stride];
        const int now = v <= 0.1 ? -1 : v >= 0.9 ? 1 : 0;
        if (now == 0) {
            continue;
        }
        if (side != 0 && now != side) {
            const size_t reach = i - last + 1; /* a wrong penumbra may be wider: look as far again */
            size_t begin = last, end = i;
            for (size_t k = 0; k < reach && begin > 0 && valid_at(s, begin - 1); ++k) {
                --begin;
            }
            for (size_t k = 0; k < reach && end + 1 < s->count && valid_at(s, end + 1); ++k) {
                ++end;
            }
            const double width = between(s, s->truth, begin, end);
            *truth += width;
            *off += fabs(between(s, s->values, begin, end) - width);
        }
        side = now;
        last = i;
    }
}

static double width_error(const trade_work *work, const trade_subject *subject, const float *values) {
    double truth = 0.0, off = 0.0;
    for (size_t plane = 0; plane < subject->planes; ++plane) {
        for (size_t r = 0; r < work->receiver_count; ++r) {
            const trade_receiver *receiver = &work->receivers[r];
            const size_t width = (size_t)receiver->info.width, height = (size_t)receiver->info.height;
            const float *t = subject->truth + plane * work->texels + receiver->first;
            const float *v = values + plane * work->texels + receiver->first;
            const uint8_t *mask = work->common + receiver->first;
            for (size_t row = 0; row < height; ++row) {
                const scan s = {t + row * width, v + row * width, mask + row * width, 1, width};
                add_widths(&s, &truth, &off);
            }
            for (size_t column = 0; column < width; ++column) {
                const scan s = {t + column, v + column, mask + column, width, height};
                add_widths(&s, &truth, &off);
            }
        }
    }
    return truth > 0.0 ? off / truth : NAN;
}

/* RMSE over the texels of a mask. */
static double rmse_over(const trade_work *work, const trade_subject *subject, const float *values,
                        const uint8_t *mask, size_t count) {
    double squares = 0.0;
    for (size_t i = 0; i < subject->planes * work->texels; ++i) {
        const double error = (double)values[i] - (double)subject->truth[i];
        squares += mask[i % work->texels] ? error * error : 0.0;
    }
    return count > 0 ? sqrt(squares / (double)(subject->planes * count)) : 0.0;
}

int trade_compare(const trade_work *work, const trade_subject *subject, const uint8_t *mask, size_t valid,
                  trade_run *run) {
    trade_metrics m = {0};
    float *errors = calloc(subject->planes * work->common_count + 1, sizeof *errors);
    if (errors == NULL) {
        return cli_out_of_memory("errors");
    }
    double squares = 0.0, penumbra_squares = 0.0, sum = 0.0;
    for (size_t i = 0; i < subject->planes * work->texels; ++i) {
        if (!work->common[i % work->texels]) {
            continue;
        }
        const double truth = (double)subject->truth[i], error = (double)run->values[i] - truth;
        errors[m.count++] = (float)fabs(error);
        squares += error * error;
        sum += error;
        if (truth >= 0.02 && truth <= 0.98) {
            ++m.penumbra;
            penumbra_squares += error * error;
        }
    }
    if (m.count > 0) {
        qsort(errors, m.count, sizeof *errors, compare);
        m.rmse = sqrt(squares / (double)m.count);
        m.bias = sum / (double)m.count;
        m.p95 = percentile(errors, m.count, 0.95);
        m.p99 = percentile(errors, m.count, 0.99);
        m.max = (double)errors[m.count - 1];
        m.penumbra_rmse = m.penumbra > 0 ? sqrt(penumbra_squares / (double)m.penumbra) : 0.0;
    }
    m.width_error = width_error(work, subject, run->values);
    free(errors);
    run->metrics = m;
    run->rate = 1e6 * run->bake_s / (double)(subject->planes * run->valid);
    run->valid_rmse = rmse_over(work, subject, run->values, mask, valid);
    return CLI_OK;
}
