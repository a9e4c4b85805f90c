/* Finds what explains a difference if no shadow changed: noise, or a curve over the values.
 *
 * Noise is what neighbours along an edge do not share. Each value is compared with its two neighbours in the
 * direction in which the two bakes change least, so that penumbrae that got wider or moved count for nothing.
 *
 * A curve (gamma, exposure) gives equal golden values equal new ones, and makes all of them lighter or all of
 * them darker. A penumbra of another width makes some lighter and some darker; a displacement is measured
 * first and preferred. */
#include "compare/pair.h"

#include <math.h>
#include <string.h>

/* --- noise */

/* Offsets of the neighbours in front; those behind are opposite. */
static const int directions[13][3] = {{1, 0, 0},  {0, 1, 0},  {1, 1, 0},  {1, -1, 0}, {0, 0, 1},
                                      {1, 0, 1},  {1, 0, -1}, {0, 1, 1},  {0, 1, -1}, {1, 1, 1},
                                      {1, 1, -1}, {1, -1, 1}, {1, -1, -1}};

static double difference_at(const vshi_pair *pair, size_t i) {
    return vshi_value_at(pair, VSHI_NEW, i) - vshi_value_at(pair, VSHI_GOLDEN, i);
}

/* Whether both neighbours along a direction are compared; their indices. */
static bool find_neighbours(const vshi_pair *pair, size_t i, const size_t place[3], const int direction[3],
                            size_t neighbour[2]) {
    neighbour[0] = neighbour[1] = i;
    for (int axis = 0; axis < 3; ++axis) {
        if (direction[axis] != 0 && (place[axis] == 0 || place[axis] + 1 >= pair->size[axis])) {
            return false;
        }
        neighbour[0] -= (size_t)direction[axis] * pair->stride[axis]; /* wraps round, and back */
        neighbour[1] += (size_t)direction[axis] * pair->stride[axis];
    }
    return pair->mask[neighbour[0]] && pair->mask[neighbour[1]];
}

/* Squared difference between a value and the mean of its two neighbours, along the direction that changes
 * least; negative if it has no neighbours. */
static double find_unshared(const vshi_pair *pair, size_t i) {
    const int count = pair->size[2] > 1 ? 13 : 4;
    double least = INFINITY, unshared = -1.0;
    size_t place[3];
    vshi_place_of(pair, i, place);
    for (int d = 0; d < count; ++d) {
        size_t at[2];
        if (!find_neighbours(pair, i, place, directions[d], at)) {
            continue;
        }
        double steps = 0.0, length = 0.0;
        for (int axis = 0; axis < 3; ++axis) {
            length += directions[d][axis] * directions[d][axis];
        }
        for (int which = 0; which < 2; ++which) {
            steps += vshi_value_at(pair, which, at[1]) - vshi_value_at(pair, which, at[0]);
        }
        const double change = steps * steps / length;
        if (change < least) {
            const double own =
                difference_at(pair, i) - 0.5 * (difference_at(pair, at[0]) + difference_at(pair, at[1]));
            least = change;
            unshared = own * own;
        }
    }
    return unshared;
}

void vshi_find_noise(const vshi_pair *pair, vsh_measures *m) {
    static const double VARIANCE =
        1.5; /* the variance of a value minus the mean of two others, each of variance 1 */
    double sum = 0.0, all = 0.0, count = 0.0;
    for (size_t i = 0; i < pair->count; ++i) {
        const double unshared = pair->mask[i] ? find_unshared(pair, i) : -1.0;
        if (unshared >= 0.0) {
            sum += unshared / VARIANCE;
            all += difference_at(pair, i) * difference_at(pair, i);
            count += 1.0;
        }
    }
    m->noise = count > 0.0 ? sqrt(sum / count) : 0.0;
    m->noise_share = all > 0.0 ? fmin(sum / all, 1.0) : 0.0;
}

/* --- a curve */

enum { BINS = 64, FEWEST_BINS = 16 }; /* fewer golden values do not tell a curve from anything else */
static const double LEAST_EXPLAINED = 0.98;
static const double LEAST_RISE = 0.05; /* of the curve's, in each half of it: a lost shadow is no curve */
static const double MOST_MIXED = 0.1;  /* of what gets lighter that gets darker, or the other way round */

typedef struct curve {
    int count;
    double from[BINS], to[BINS]; /* mean golden and new values of each bin that has any */
    double lighter, darker;      /* sums over all values */
    bool falls;                  /* somewhere, by more than noise makes */
} curve;

static double value_on(const curve *c, double v) {
    int i = 1;
    while (i + 1 < c->count && v > c->from[i]) {
        ++i;
    }
    const double t = (v - c->from[i - 1]) / (c->from[i] - c->from[i - 1]);
    return c->to[i - 1] + t * (c->to[i] - c->to[i - 1]);
}

static void add_point(curve *c, double from, double to, size_t count, double noise) {
    const double n = (double)count, tolerance = noise * (1.0 + 3.0 / sqrt(n));
    c->lighter += fmax(0.0, to - from - n * noise); /* noise that is cut off at 0 and 1 has a mean */
    c->darker += fmax(0.0, from - to - n * noise);
    c->falls = c->falls || (c->count > 0 && to / n < c->to[c->count - 1] - tolerance);
    c->from[c->count] = from / n;
    c->to[c->count++] = to / n;
}

static void fit_curve(const vshi_pair *pair, double noise, curve *c) {
    double low = INFINITY, high = -INFINITY, from[BINS] = {0.0}, to[BINS] = {0.0};
    size_t count[BINS] = {0};
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
            ++count[bin];
        }
    }
    *c = (curve){.count = 0};
    for (int bin = 0; bin < BINS; ++bin) {
        if (count[bin] > 0) {
            add_point(c, from[bin], to[bin], count[bin], noise);
        }
    }
}

static bool is_tone(const curve *c) {
    if (c->count < FEWEST_BINS || c->falls ||
        fmin(c->lighter, c->darker) > MOST_MIXED * fmax(c->lighter, c->darker)) {
        return false;
    }
    const double first = c->to[0], last = c->to[c->count - 1], least = LEAST_RISE * (last - first);
    const double middle = value_on(c, 0.5 * (c->from[0] + c->from[c->count - 1]));
    return last > first && middle - first >= least && last - middle >= least;
}

/* Golden values on the curve into `mapped`, and the share of the squared difference that is then gone, noise
 * aside. */
static double map_golden(const vshi_pair *pair, const curve *c, double noise, float *mapped) {
    double before = 0.0, after = 0.0, count = 0.0;
    for (size_t i = 0; i < pair->count; ++i) {
        const double w = value_on(c, vshi_value_at(pair, VSHI_GOLDEN, i));
        mapped[i] = (float)(w / pair->scale);
        if (pair->mask[i]) {
            const double off = vshi_value_at(pair, VSHI_NEW, i) - w;
            before += difference_at(pair, i) * difference_at(pair, i);
            after += off * off;
            count += 1.0;
        }
    }
    const double unshared = noise * noise * count;
    return before > 2.0 * unshared ? (before - after) / (before - unshared) : 0.0;
}

bool vshi_follow_curve(vshi_pair *pair, float *mapped, void *scratch, vsh_measures *m) {
    curve c;
    fit_curve(pair, m->noise, &c);
    if (!is_tone(&c) || map_golden(pair, &c, m->noise, mapped) < LEAST_EXPLAINED) {
        return false;
    }
    vshi_measure_shift(pair, NULL, scratch, m);
    if (m->value[VSH_MEASURE_SHIFT] > 0.0) {
        return false; /* as of a straight edge that moved */
    }
    for (int k = 0; k < 3; ++k) {
        const double low = c.from[0], high = c.from[c.count - 1];
        m->curve[k][0] = low + 0.25 * (k + 1) * (high - low);
        m->curve[k][1] = value_on(&c, m->curve[k][0]);
    }
    pair->plane[VSHI_GOLDEN] = mapped;
    return true;
}
