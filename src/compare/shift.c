/* How far new values stand from golden ones: registration by least squares on the gradient (Lucas and Kanade,
 * "An iterative image registration technique with an application to stereo vision", 1981), with the mean of
 * both gradients, which makes each step exact to the second order, and the new values moved back before the
 * next.
 *
 * Penumbrae of another width and a shadow that is missing are even about their edges and cancel. A
 * displacement counts only where undoing it takes a quarter of the squared difference away. Limits: it finds
 * what is nearest, within about the width of the penumbrae and SHIFT_LARGEST texels; edges along one
 * direction tell nothing of a displacement along themselves, which is then taken for 0. */
#include "compare/pair.h"

#include <math.h>

enum { STEPS = 10 };

static const double SHIFT_LARGEST = 8.0; /* texels: beyond it the values are simply others */
static const double SMALL_STEP = 1e-3;   /* texels, after which it has settled */
static const double LEAST_EXPLAINED = 0.25;
static const double NOTHING =
    0.01; /* added to the sums of squared gradients: an edge of less decides nothing */

typedef struct registration {
    const vshi_pair *pair;
    float *moved;   /* the new values, moved back */
    uint8_t *valid; /* where all that they are made of is masked in */
    int axes;       /* that have more than one value */
} registration;

/* New values at p + shift, interpolated, into moved[p]: the weights are the same everywhere. */
static void move_back(registration *r, const double shift[3]) {
    const vshi_pair *pair = r->pair;
    ptrdiff_t base[3];
    double part[3];
    for (int axis = 0; axis < 3; ++axis) {
        base[axis] = (ptrdiff_t)floor(shift[axis]);
        part[axis] = shift[axis] - (double)base[axis];
    }
    for (size_t i = 0; i < pair->count; ++i) {
        size_t place[3];
        vshi_place_of(pair, i, place);
        double sum = 0.0;
        bool good = pair->mask[i] != 0;
        for (int corner = 0; corner < 8 && good; ++corner) {
            double weight = 1.0;
            size_t at = 0;
            for (int axis = 0; axis < 3; ++axis) {
                const int up = corner >> axis & 1;
                const ptrdiff_t k = (ptrdiff_t)place[axis] + base[axis] + up;
                weight *= up ? part[axis] : 1.0 - part[axis];
                good = good && (weight == 0.0 || (k >= 0 && k < (ptrdiff_t)pair->size[axis]));
                at += weight == 0.0 ? 0 : (size_t)k * pair->stride[axis];
            }
            if (weight != 0.0 && good) {
                good = pair->mask[at] != 0;
                sum += weight * vshi_value_at(pair, VSHI_NEW, at);
            }
        }
        r->valid[i] = good;
        r->moved[i] = good ? (float)sum : 0.0f;
    }
}

/* Normal equations of one step, and the squared difference over the values that are in them. */
typedef struct sums {
    double matrix[3][3], right[3], squares, count;
} sums;

static bool add_value(const registration *r, size_t i, sums *s) {
    const vshi_pair *pair = r->pair;
    size_t place[3];
    vshi_place_of(pair, i, place);
    double slope[3] = {0.0, 0.0, 0.0};
    for (int axis = 0; axis < 3; ++axis) {
        const size_t step = pair->stride[axis];
        if (pair->size[axis] == 1) {
            continue;
        }
        if (place[axis] == 0 || place[axis] + 1 == pair->size[axis] || !r->valid[i - step] ||
            !r->valid[i + step]) {
            return false;
        }
        slope[axis] =
            0.25 * (vshi_value_at(pair, VSHI_GOLDEN, i + step) - vshi_value_at(pair, VSHI_GOLDEN, i - step) +
                    (double)r->moved[i + step] - (double)r->moved[i - step]);
    }
    const double difference = (double)r->moved[i] - vshi_value_at(pair, VSHI_GOLDEN, i);
    for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) {
            s->matrix[a][b] += slope[a] * slope[b];
        }
        s->right[a] -= slope[a] * difference;
    }
    s->squares += difference * difference;
    s->count += 1.0;
    return true;
}

static sums add_up(const registration *r) {
    sums s = {{{0.0}}, {0.0}, 0.0, 0.0};
    for (size_t i = 0; i < r->pair->count; ++i) {
        if (r->valid[i]) {
            add_value(r, i, &s);
        }
    }
    for (int axis = 0; axis < 3; ++axis) {
        s.matrix[axis][axis] += NOTHING;
    }
    return s;
}

/* Solves by Gauss's elimination; the matrix is positive definite. */
static void solve(sums *s, double result[3]) {
    for (int a = 0; a < 3; ++a) {
        for (int b = a + 1; b < 3; ++b) {
            const double factor = s->matrix[b][a] / s->matrix[a][a];
            for (int c = a; c < 3; ++c) {
                s->matrix[b][c] -= factor * s->matrix[a][c];
            }
            s->right[b] -= factor * s->right[a];
        }
    }
    for (int a = 2; a >= 0; --a) {
        result[a] = s->right[a];
        for (int c = a + 1; c < 3; ++c) {
            result[a] -= s->matrix[a][c] * result[c];
        }
        result[a] /= s->matrix[a][a];
    }
}

static double length(const double v[3]) {
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

bool vshi_measure_shift(const vshi_pair *pair, const vsh_compare_options *options, void *scratch,
                        vsh_measures *m) {
    (void)options;
    registration r = {.pair = pair, .moved = scratch};
    r.valid = (uint8_t *)(r.moved + pair->count);
    double shift[3] = {0.0, 0.0, 0.0}, step[3] = {INFINITY, 0.0, 0.0}, best[3] = {0.0, 0.0, 0.0};
    double before = 0.0, least = 0.0; /* mean squared difference where nothing is moved, and at the best */
    for (int i = 0; i < STEPS && length(step) > SMALL_STEP && length(shift) <= SHIFT_LARGEST; ++i) {
        move_back(&r, shift);
        sums s = add_up(&r);
        const double mean = s.count > 0.0 ? s.squares / s.count : 0.0;
        if (i == 0) {
            before = least = mean;
        } else if (mean < least) {
            least = mean;
            for (int axis = 0; axis < 3; ++axis) {
                best[axis] = shift[axis];
            }
        }
        solve(&s, step);
        for (int axis = 0; axis < 3; ++axis) {
            shift[axis] += step[axis];
        }
    }
    m->explained = before > 0.0 ? 1.0 - least / before : 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        m->shift[axis] = m->explained >= LEAST_EXPLAINED ? best[axis] : 0.0;
    }
    m->value[VSH_MEASURE_SHIFT] = length(m->shift);
    return true;
}
