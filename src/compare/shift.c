/* How far new values stand from golden ones: registration by least squares on the gradient (Lucas and Kanade,
 * "An iterative image registration technique with an application to stereo vision", 1981), with the mean of
 * both gradients, which makes each step exact to the second order, and the new values moved back before the
 * next.
 *
 * Edges along one direction tell nothing of a displacement along themselves: of an edge of slope 0.1 that
 * moves by 0.02 texels, one of 0.2 along x says as much. So the golden values' structure tensor (Förstner and
 * Gülch 1987; the sum of products of the gradients) is taken apart first, and only along the axes in which it
 * is not small is anything looked for: the shortest displacement that fits.
 *
 * Penumbrae of another width and a shadow that is missing are even about their edges and cancel. A
 * displacement counts only where undoing it takes a quarter of the squared difference away; values that
 * would come from outside are none that it explains. Limits: it finds what is nearest, within about the width
 * of the penumbrae and SHIFT_LARGEST texels; of a shadow much longer than wide (LEAST_DETERMINED) none along
 * itself. */
#include "compare/pair.h"

#include <math.h>

enum { STEPS = 10 };
enum { SWEEPS = 8 }; /* of Jacobi's; five are enough for 3 × 3 */

static const double SHIFT_LARGEST = 8.0; /* texels: beyond it the values are simply others */
static const double SMALL_STEP = 1e-3;   /* texels, after which it has settled */
static const double LEAST_EXPLAINED = 0.25;
static const double NOTHING =
    0.01; /* added to the sums of squared gradients: an edge of less decides nothing */

/* Of the largest eigenvalue. The stairs that a hard straight edge makes of its slope come to 0.055 at the
 * most (slope 0.3, the gradients below), those of one a texel wide to 0.002. */
static const double LEAST_DETERMINED = 0.07;

typedef struct registration {
    const vshi_pair *pair;
    float *moved;      /* the new values, moved back */
    uint8_t *valid;    /* where all that they are made of is masked in */
    double onto[3][3]; /* projects onto the directions along which edges tell of a displacement */
} registration;

/* --- directions */

/* The golden values' change along an axis at a value, smoothed by 1 2 1 across it (Sobel), which takes most
 * of an edge's stairs away. False where a neighbour is missing. */
static bool smooth_slope(const vshi_pair *pair, size_t i, const size_t place[3], double slope[3]) {
    slope[0] = slope[1] = slope[2] = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        if (pair->size[axis] > 1 && (place[axis] == 0 || place[axis] + 1 == pair->size[axis])) {
            return false;
        }
    }
    const bool flat = pair->size[2] == 1;
    for (int corner = flat ? 9 : 0; corner < (flat ? 18 : 27); ++corner) {
        const int off[3] = {corner % 3 - 1, corner / 3 % 3 - 1, corner / 9 - 1};
        size_t at = i;
        double weight[3]; /* across each axis; an axis of one value has no other neighbours */
        bool there = true;
        for (int axis = 0; axis < 3; ++axis) {
            there = there && (pair->size[axis] > 1 || off[axis] == 0);
            at += (size_t)off[axis] * pair->stride[axis]; /* wraps round where it is negative, and back */
            weight[axis] = pair->size[axis] == 1 ? 1.0 : off[axis] == 0 ? 0.5 : 0.25;
        }
        if (!there) {
            continue;
        }
        if (!pair->mask[at]) {
            return false;
        }
        const double v = vshi_value_at(pair, VSHI_GOLDEN, at);
        for (int axis = 0; axis < 3; ++axis) {
            const double across = weight[(axis + 1) % 3] * weight[(axis + 2) % 3];
            slope[axis] += 0.5 * off[axis] * across * v;
        }
    }
    return true;
}

/* Turns the axes a and b so that matrix[a][b] vanishes (Jacobi 1846); the columns of `axes` turn along. */
static void turn(double matrix[3][3], double axes[3][3], int a, int b) {
    if (matrix[a][b] == 0.0) {
        return;
    }
    const double ratio = (matrix[b][b] - matrix[a][a]) / (2.0 * matrix[a][b]);
    const double tangent = (ratio < 0.0 ? -1.0 : 1.0) / (fabs(ratio) + sqrt(ratio * ratio + 1.0));
    const double c = 1.0 / sqrt(tangent * tangent + 1.0), s = tangent * c;
    for (int k = 0; k < 3; ++k) {
        const double p = matrix[k][a], q = matrix[k][b];
        matrix[k][a] = c * p - s * q;
        matrix[k][b] = s * p + c * q;
    }
    for (int k = 0; k < 3; ++k) {
        const double p = matrix[a][k], q = matrix[b][k];
        matrix[a][k] = c * p - s * q;
        matrix[b][k] = s * p + c * q;
        const double u = axes[k][a], v = axes[k][b];
        axes[k][a] = c * u - s * v;
        axes[k][b] = s * u + c * v;
    }
}

/* Fills `onto`. */
static void find_directions(registration *r) {
    double tensor[3][3] = {{0.0}}, axes[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    for (size_t i = 0; i < r->pair->count; ++i) {
        size_t place[3];
        double slope[3];
        vshi_place_of(r->pair, i, place);
        if (r->pair->mask[i] && smooth_slope(r->pair, i, place, slope)) {
            for (int k = 0; k < 9; ++k) {
                tensor[k / 3][k % 3] += slope[k / 3] * slope[k % 3];
            }
        }
    }
    for (int sweep = 0; sweep < SWEEPS; ++sweep) {
        turn(tensor, axes, 0, 1);
        turn(tensor, axes, 0, 2);
        turn(tensor, axes, 1, 2);
    }
    const double largest = fmax(tensor[0][0], fmax(tensor[1][1], tensor[2][2]));
    for (int e = 0; e < 3; ++e) {
        const bool determined = tensor[e][e] > LEAST_DETERMINED * largest;
        for (int k = 0; k < 9 && determined; ++k) {
            r->onto[k / 3][k % 3] += axes[k / 3][e] * axes[k % 3][e];
        }
    }
}

/* --- steps */

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

/* Normal equations of one step, and the squared differences over the values that are in them: as moved back,
 * and as they were. */
typedef struct sums {
    double matrix[3][3], right[3], squares, before;
} sums;

static void add_value(const registration *r, size_t i, sums *s) {
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
            return;
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
    const double was = vshi_value_at(pair, VSHI_NEW, i) - vshi_value_at(pair, VSHI_GOLDEN, i);
    s->squares += difference * difference;
    s->before += was * was;
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

/* Leaves of the equations what is along the directions that count; along the others the solution is 0. */
static void project(const registration *r, sums *s) {
    double half[3][3] = {{0.0}}, matrix[3][3] = {{0.0}}, right[3] = {0.0};
    for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) {
            for (int c = 0; c < 3; ++c) {
                half[a][b] += s->matrix[a][c] * r->onto[c][b];
            }
            right[a] += r->onto[a][b] * s->right[b];
        }
    }
    for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) {
            for (int c = 0; c < 3; ++c) {
                matrix[a][b] += r->onto[a][c] * half[c][b];
            }
            s->matrix[a][b] = matrix[a][b] + (a == b ? 1.0 : 0.0) - r->onto[a][b];
        }
        s->right[a] = right[a];
    }
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
    find_directions(&r);
    double shift[3] = {0.0, 0.0, 0.0}, step[3] = {INFINITY, 0.0, 0.0}, best[3] = {0.0, 0.0, 0.0};
    double all = 0.0, least = 1.0, explained = 0.0; /* squared difference; the share of it that is left */
    for (int i = 0; i < STEPS && length(step) > SMALL_STEP && length(shift) <= SHIFT_LARGEST; ++i) {
        move_back(&r, shift);
        sums s = add_up(&r);
        all = i == 0 ? s.before : all;
        if (s.squares < least * s.before) {
            least = s.squares / s.before;
            explained = (s.before - s.squares) / all;
            for (int axis = 0; axis < 3; ++axis) {
                best[axis] = shift[axis];
            }
        }
        project(&r, &s);
        solve(&s, step);
        for (int axis = 0; axis < 3; ++axis) {
            shift[axis] += step[axis];
        }
    }
    m->explained = explained;
    for (int axis = 0; axis < 3; ++axis) {
        m->shift[axis] = m->explained >= LEAST_EXPLAINED ? best[axis] : 0.0;
    }
    m->value[VSH_MEASURE_SHIFT] = length(m->shift);
    return true;
}
