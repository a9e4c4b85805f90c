/* Finds regions that lost or gained a shadow, and two causes that look like one: noise and a curve.
 *
 * Regions: a texel is off by how far its new value lies outside the range of nearby golden values, or its
 * golden value outside that of nearby new ones (flat dilation and erosion: Serra, "Image Analysis and
 * Mathematical Morphology", 1982). The first finds new shadows, the second lost ones, even one texel wide.
 * Shadows that moved within the reach, or got a little softer, have like values nearby. Touching texels
 * (corners count) that are off by a step or more to one side are a region. Limits: fainter shadows are not
 * seen, and penumbrae that change by many texels are off, too.
 *
 * Noise is what neighbours along an edge do not share. Each value is compared with its two neighbours in the
 * direction in which the two bakes change least, so wider and shifted penumbrae do not count.
 *
 * A curve (gamma, exposure) takes equal golden values to equal new ones, all lighter or all darker. A
 * penumbra of another width gets lighter on one side and darker on the other. */
#include "compare/compare.h"

#include <math.h>

/* --- regions */

/* Finds how far a value of plane `one` lies outside the range of the other plane within `reach`. */
static double find_excess(const vshi_pair *pair, int one, size_t i, size_t reach) {
    const double value = vshi_value_at(pair, one, i);
    double low = vshi_value_at(pair, 1 - one, i), high = low;
    size_t place[3], first[3], last[3];
    vshi_find_place(pair, i, place);
    for (int axis = 0; axis < 3; ++axis) {
        first[axis] = place[axis] > reach ? place[axis] - reach : 0;
        last[axis] = place[axis] + reach < pair->size[axis] ? place[axis] + reach : pair->size[axis] - 1;
    }
    for (size_t z = first[2]; z <= last[2]; ++z) {
        for (size_t y = first[1]; y <= last[1]; ++y) {
            for (size_t x = first[0]; x <= last[0] && (value < low || value > high); ++x) {
                const size_t at = x + y * pair->stride[1] + z * pair->stride[2];
                if (pair->mask[at]) {
                    low = fmin(low, vshi_value_at(pair, 1 - one, at));
                    high = fmax(high, vshi_value_at(pair, 1 - one, at));
                }
            }
        }
    }
    return fmax(0.0, value - high) + fmin(0.0, value - low);
}

/* Measures the region of texel `start`, and clears it in `off`. */
static vsh_region extract_region(const vshi_pair *pair, float *off, uint32_t *stack, size_t start,
                                 double step) {
    const double sign = off[start] > 0.0f ? 1.0 : -1.0;
    vsh_region region = {.worst = start, .by = (double)off[start]};
    size_t height = 0;
    stack[height++] = (uint32_t)start;
    off[start] = 0.0f;
    for (int axis = 0; axis < 3; ++axis) {
        region.min[axis] = INT32_MAX;
        region.max[axis] = INT32_MIN;
    }
    while (height > 0) {
        const size_t at = stack[--height];
        size_t place[3];
        vshi_find_place(pair, at, place);
        ++region.count;
        for (int axis = 0; axis < 3; ++axis) {
            const int32_t p = (int32_t)place[axis];
            region.min[axis] = p < region.min[axis] ? p : region.min[axis];
            region.max[axis] = p > region.max[axis] ? p : region.max[axis];
        }
        for (int k = 0; k < 27; ++k) {
            const int offset[3] = {k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
            size_t to;
            if (vshi_find_offset(pair, place, offset, &to) && sign * (double)off[to] >= step) {
                if (fabs((double)off[to]) > fabs(region.by)) {
                    region.by = (double)off[to];
                    region.worst = to;
                }
                off[to] = 0.0f;
                stack[height++] = (uint32_t)to;
            }
        }
    }
    return region;
}

void vshi_measure_regions(const vshi_pair *pair, const vsh_compare_options *options, void *scratch,
                          vsh_measures *m) {
    float *off = scratch;
    uint32_t *stack = (uint32_t *)(off + pair->count); /* holds no texel twice */
    const double step = options->step + VSHI_NOISE_P99 * fmax(options->noise, m->noise);
    for (size_t i = 0; i < pair->count; ++i) {
        const size_t reach = (size_t)options->reach;
        const double came = pair->mask[i] ? find_excess(pair, VSHI_NEW, i, reach) : 0.0;
        const double went = pair->mask[i] ? -find_excess(pair, VSHI_GOLDEN, i, reach) : 0.0;
        off[i] = (float)(fabs(went) > fabs(came) ? went : came);
    }
    for (size_t i = 0; i < pair->count; ++i) {
        if (fabs((double)off[i]) >= step) {
            vsh_region *largest = off[i] > 0.0f ? &m->lost : &m->gained;
            const vsh_region region = extract_region(pair, off, stack, i, step);
            if (region.count > largest->count) {
                *largest = region;
            }
        }
    }
    m->value[VSH_MEASURE_LOST] = (double)m->lost.count;
    m->value[VSH_MEASURE_GAINED] = (double)m->gained.count;
}

/* --- noise */

/* Squares the difference's deviation from the mean of its two neighbours, along the direction in which the
 * bakes change least. Negative if there are no neighbours. */
static double find_unshared(const vshi_pair *pair, size_t i) {
    double least = INFINITY, unshared = -1.0;
    size_t place[3];
    vshi_find_place(pair, i, place);
    for (int d = 14; d < (pair->size[2] > 1 ? 27 : 18); ++d) { /* half of 3 × 3 × 3: the rest is opposite */
        const int front[3] = {d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1},
                  back[3] = {-front[0], -front[1], -front[2]};
        size_t at[2];
        if (!vshi_find_offset(pair, place, back, &at[0]) || !vshi_find_offset(pair, place, front, &at[1]) ||
            !pair->mask[at[0]] || !pair->mask[at[1]]) {
            continue;
        }
        const double length = front[0] * front[0] + front[1] * front[1] + front[2] * front[2];
        double steps = 0.0;
        for (int which = 0; which < 2; ++which) {
            steps += vshi_value_at(pair, which, at[1]) - vshi_value_at(pair, which, at[0]);
        }
        const double change = steps * steps / length;
        if (change < least) {
            const double own = vshi_difference_at(pair, i) -
                               0.5 * (vshi_difference_at(pair, at[0]) + vshi_difference_at(pair, at[1]));
            least = change;
            unshared = own * own;
        }
    }
    return unshared;
}

void vshi_measure_noise(const vshi_pair *pair, vsh_measures *m) {
    static const double VARIANCE = 1.5; /* 1 of the value, and 1/2 of the mean of its neighbours */
    double sum = 0.0, all = 0.0, count = 0.0;
    for (size_t i = 0; i < pair->count; ++i) {
        const double unshared = pair->mask[i] ? find_unshared(pair, i) : -1.0;
        if (unshared >= 0.0) {
            sum += unshared / VARIANCE;
            all += vshi_difference_at(pair, i) * vshi_difference_at(pair, i);
            count += 1.0;
        }
    }
    m->noise = count > 0.0 ? sqrt(sum / count) : 0.0;
    m->noise_share = all > 0.0 ? fmin(sum / all, 1.0) : 0.0;
}

/* --- a curve */

enum { BINS = 64, FEWEST_BINS = 16 }; /* fewer points fit anything */
static const double LEAST_EXPLAINED = 0.98;
static const double LEAST_RISE = 0.05; /* share of the rise in each half: a lost shadow has none in one */
static const double MOST_MIXED =
    0.1; /* smaller of the sums of lighter and darker, as a share of the larger */

typedef struct curve {
    int count;
    double from[BINS], to[BINS]; /* mean golden and new values of each bin that has any */
} curve;

static double value_on(const curve *c, double v) {
    int i = 1;
    while (i + 1 < c->count && v > c->from[i]) {
        ++i;
    }
    const double t = (v - c->from[i - 1]) / (c->from[i] - c->from[i - 1]);
    return c->to[i - 1] + t * (c->to[i] - c->to[i - 1]);
}

/* Averages values in bins of golden's. */
static void fit_curve(const vshi_pair *pair, curve *c, double counts[BINS]) {
    double low = INFINITY, high = -INFINITY, from[BINS] = {0.0}, to[BINS] = {0.0}, count[BINS] = {0.0};
    for (size_t i = 0; i < pair->count; ++i) {
        if (pair->mask[i]) {
            low = fmin(low, vshi_value_at(pair, VSHI_GOLDEN, i));
            high = fmax(high, vshi_value_at(pair, VSHI_GOLDEN, i));
        }
    }
    for (size_t i = 0; i < pair->count && high > low; ++i) {
        if (pair->mask[i]) {
            const double v = vshi_value_at(pair, VSHI_GOLDEN, i);
            const int bin = (int)fmin((v - low) / (high - low) * BINS, BINS - 1.0);
            from[bin] += v;
            to[bin] += vshi_value_at(pair, VSHI_NEW, i);
            count[bin] += 1.0;
        }
    }
    c->count = 0;
    for (int bin = 0; bin < BINS; ++bin) {
        if (count[bin] > 0.0) {
            c->from[c->count] = from[bin] / count[bin];
            c->to[c->count] = to[bin] / count[bin];
            counts[c->count++] = count[bin];
        }
    }
}

/* Whether the curve rises everywhere, and makes values only lighter or only darker, apart from noise. */
static bool is_tone(const curve *c, const double counts[BINS], double noise) {
    double lighter = 0.0, darker = 0.0;
    for (int i = 0; i < c->count; ++i) {
        const double change = c->to[i] - c->from[i];
        lighter += counts[i] * fmax(0.0, change - noise); /* noise clipped at 0 and 1 has a mean */
        darker += counts[i] * fmax(0.0, -change - noise);
        if (i > 0 && c->to[i] < c->to[i - 1] - noise * (1.0 + 3.0 / sqrt(counts[i]))) {
            return false;
        }
    }
    if (c->count < FEWEST_BINS || fmin(lighter, darker) > MOST_MIXED * fmax(lighter, darker)) {
        return false;
    }
    const double first = c->to[0], last = c->to[c->count - 1], least = LEAST_RISE * (last - first);
    const double middle = value_on(c, 0.5 * (c->from[0] + c->from[c->count - 1]));
    return last > first && middle - first >= least && last - middle >= least;
}

/* Applies the curve to golden, and returns the share of the squared difference that it explains, apart from
 * noise. */
static double map_golden(const vshi_pair *pair, const curve *c, double noise, float *mapped) {
    double before = 0.0, after = 0.0, count = 0.0;
    for (size_t i = 0; i < pair->count; ++i) {
        const double w = value_on(c, vshi_value_at(pair, VSHI_GOLDEN, i));
        mapped[i] = (float)(w / pair->scale);
        if (pair->mask[i]) {
            const double off = vshi_value_at(pair, VSHI_NEW, i) - w;
            before += vshi_difference_at(pair, i) * vshi_difference_at(pair, i);
            after += off * off;
            count += 1.0;
        }
    }
    const double unshared = noise * noise * count;
    return before > 2.0 * unshared ? (before - after) / (before - unshared) : 0.0;
}

bool vshi_follow_curve(vshi_pair *pair, float *mapped, vsh_measures *m) {
    curve c;
    double counts[BINS];
    fit_curve(pair, &c, counts);
    if (!is_tone(&c, counts, m->noise) || map_golden(pair, &c, m->noise, mapped) < LEAST_EXPLAINED) {
        return false;
    }
    for (int k = 0; k < 3; ++k) {
        const double low = c.from[0], high = c.from[c.count - 1];
        m->curve[k][0] = low + 0.25 * (k + 1) * (high - low);
        m->curve[k][1] = value_on(&c, m->curve[k][0]);
    }
    pair->plane[VSHI_GOLDEN] = mapped;
    return true;
}
