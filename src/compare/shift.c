/* Measures how far new values are shifted, by registration (Lucas and Kanade, "An iterative image
 * registration technique with an application to stereo vision", 1981): least squares on the gradient. The
 * mean of both gradients makes each step exact to the second order. Each step moves the new values back
 * first.
 *
 * Edges along one direction do not show a shift along themselves: an edge of slope 0.1 that moves across
 * itself by 0.02 texels looks the same as one that moves by 0.2 along x. So shifts are only sought along
 * eigenvectors of golden's structure tensor (Förstner and Gülch 1987) with large eigenvalues: the shortest
 * shift that fits.
 *
 * Penumbrae of another width and missing shadows are even about their edges and cancel. A shift counts
 * only if undoing it removes a quarter of the squared difference. Values that would come from outside the
 * image do not count as explained. Limits: it finds shifts within the width of the penumbrae, and up to
 * MOST_SHIFT texels. */
#include "compare/compare.h"

#include <math.h>

enum { STEPS = 10 };
enum { SWEEPS = 8 }; /* of Jacobi's method; five are enough for 3 × 3 */

static const double MOST_SHIFT = 8.0;  /* texels: beyond it, the values have nothing in common */
static const double SMALL_STEP = 1e-3; /* texels: then it has converged */
static const double LEAST_EXPLAINED = 0.25;
static const double NOTHING = 0.01; /* added to sums of squared slopes, so that weaker edges decide nothing */

/* Directions with a smaller share of the largest eigenvalue do not count. The stairs of a hard straight edge
 * reach 0.055 (at slope 0.3), and those of an edge one texel wide 0.002. */
static const double LEAST_DETERMINED = 0.07;

typedef struct registration {
    const vshi_pair *pair;
    float *moved;            /* the new values, moved back */
    uint8_t *valid;          /* 1: interpolated from values in the mask */
    int count;               /* of directions */
    double directions[3][3]; /* unit vectors along which edges show a shift */
} registration;

/* --- directions */

/* Golden's slope at a value, smoothed by 1 2 1 across each axis (Sobel), which removes most of the stairs of
 * hard edges. False if a neighbour is missing. */
static bool smooth_slope(const vshi_pair *pair, const size_t place[3], double slope[3]) {
    const bool flat = pair->size[2] == 1;
    slope[0] = slope[1] = slope[2] = 0.0;
    for (int k = flat ? 9 : 0; k < (flat ? 18 : 27); ++k) {
        const int offset[3] = {k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
        double weight[3]; /* across each axis */
        bool there = true;
        for (int axis = 0; axis < 3; ++axis) {
            there = there && (pair->size[axis] > 1 || offset[axis] == 0);
            weight[axis] = pair->size[axis] == 1 ? 1.0 : offset[axis] == 0 ? 0.5 : 0.25;
        }
        size_t at;
        if (!there) {
            continue;
        }
        if (!vshi_find_offset(pair, place, offset, &at) || !pair->mask[at]) {
            return false;
        }
        for (int axis = 0; axis < 3; ++axis) {
            slope[axis] += 0.5 * offset[axis] * weight[(axis + 1) % 3] * weight[(axis + 2) % 3] *
                           vshi_value_at(pair, VSHI_GOLDEN, at);
        }
    }
    return true;
}

/* Turns the axes a and b so that matrix[a][b] vanishes (Jacobi 1846); the columns of `axes` turn along. */
static void turn_axes(double matrix[3][3], double axes[3][3], int a, int b) {
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

/* Fills `directions`. */
static void find_directions(registration *r) {
    double tensor[3][3] = {{0.0}}, axes[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    for (size_t i = 0; i < r->pair->count; ++i) {
        size_t place[3];
        double slope[3];
        vshi_find_place(r->pair, i, place);
        if (r->pair->mask[i] && smooth_slope(r->pair, place, slope)) {
            for (int k = 0; k < 9; ++k) {
                tensor[k / 3][k % 3] += slope[k / 3] * slope[k % 3];
            }
        }
    }
    for (int sweep = 0; sweep < SWEEPS; ++sweep) {
        turn_axes(tensor, axes, 0, 1);
        turn_axes(tensor, axes, 0, 2);
        turn_axes(tensor, axes, 1, 2);
    }
    const double largest = fmax(tensor[0][0], fmax(tensor[1][1], tensor[2][2]));
    for (int e = 0; e < 3; ++e) {
        if (tensor[e][e] > LEAST_DETERMINED * largest) {
            for (int axis = 0; axis < 3; ++axis) {
                r->directions[r->count][axis] = axes[axis][e];
            }
            ++r->count;
        }
    }
}

/* --- steps */

/* Interpolates the new values at p + shift into moved[p]. */
static void move_back(registration *r, const double shift[3]) {
    const vshi_pair *pair = r->pair;
    int base[3];
    double part[3];
    for (int axis = 0; axis < 3; ++axis) {
        base[axis] = (int)floor(shift[axis]);
        part[axis] = shift[axis] - (double)base[axis];
    }
    for (size_t i = 0; i < pair->count; ++i) {
        size_t place[3], at;
        vshi_find_place(pair, i, place);
        double sum = 0.0;
        bool good = pair->mask[i] != 0;
        for (int corner = 0; corner < 8 && good; ++corner) {
            double weight = 1.0;
            int offset[3];
            for (int axis = 0; axis < 3; ++axis) {
                const int up = corner >> axis & 1;
                weight *= up ? part[axis] : 1.0 - part[axis];
                offset[axis] = base[axis] + up;
            }
            if (weight != 0.0) {
                good = vshi_find_offset(pair, place, offset, &at) && pair->mask[at] != 0;
                sum += good ? weight * vshi_value_at(pair, VSHI_NEW, at) : 0.0;
            }
        }
        r->valid[i] = good;
        r->moved[i] = good ? (float)sum : 0.0f;
    }
}

/* Sums of one step: for each direction, slope² and slope × difference. The directions are nearly independent,
 * being eigenvectors, so each has an equation of its own. */
typedef struct sums {
    double slopes[3], products[3];
    double squares, before; /* squared differences, now and before any shift */
} sums;

static void add_value(const registration *r, size_t i, sums *s) {
    const vshi_pair *pair = r->pair;
    size_t place[3];
    vshi_find_place(pair, i, place);
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
    for (int d = 0; d < r->count; ++d) {
        const double *u = r->directions[d];
        const double along = u[0] * slope[0] + u[1] * slope[1] + u[2] * slope[2];
        s->slopes[d] += along * along;
        s->products[d] += along * difference;
    }
    const double was = vshi_difference_at(pair, i);
    s->squares += difference * difference;
    s->before += was * was;
}

static sums add_up(const registration *r) {
    sums s = {{NOTHING, NOTHING, NOTHING}, {0.0}, 0.0, 0.0};
    for (size_t i = 0; i < r->pair->count; ++i) {
        if (r->valid[i]) {
            add_value(r, i, &s);
        }
    }
    return s;
}

static double length(const double v[3]) {
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

void vshi_measure_shift(const vshi_pair *pair, void *scratch, vsh_measures *m) {
    registration r = {.pair = pair, .moved = scratch};
    r.valid = (uint8_t *)(r.moved + pair->count);
    find_directions(&r);
    double shift[3] = {0.0, 0.0, 0.0}, step[3] = {INFINITY, 0.0, 0.0}, best[3] = {0.0, 0.0, 0.0};
    double all = 0.0, least = 1.0, explained = 0.0; /* squared difference, and the share left of it */
    for (int i = 0; i < STEPS && length(step) > SMALL_STEP && length(shift) <= MOST_SHIFT; ++i) {
        move_back(&r, shift);
        const sums s = add_up(&r);
        all = i == 0 ? s.before : all;
        if (s.squares < least * s.before) {
            least = s.squares / s.before;
            explained = (s.before - s.squares) / all;
            for (int axis = 0; axis < 3; ++axis) {
                best[axis] = shift[axis];
            }
        }
        for (int axis = 0; axis < 3; ++axis) {
            step[axis] = 0.0;
            for (int d = 0; d < r.count; ++d) {
                step[axis] -= r.directions[d][axis] * s.products[d] / s.slopes[d];
            }
            shift[axis] += step[axis];
        }
    }
    m->explained = explained;
    for (int axis = 0; axis < 3; ++axis) {
        m->shift[axis] = m->explained >= LEAST_EXPLAINED ? best[axis] : 0.0;
    }
    m->value[VSH_MEASURE_SHIFT] = length(m->shift);
}
