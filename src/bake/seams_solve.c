/* Least squares over the seams' rows with limits on each unknown, by conjugate gradients: modified
 * proportioning with reduced gradient projections (Dostál and Schöberl, "Minimizing quadratic functions
 * subject to bound constraints with the rate of convergence and finite termination", 2005). Conjugate
 * gradients run over the unknowns that are within their limits; a step that leaves them is cut there and
 * followed by a step along the gradient, projected back; where the limits hold back more than is left to be
 * gained between them, they are let go first. */
#include "bake/seams.h"

#include <math.h>

/* The gradient, relative to that of no change, at which changes are known to some 1/1000 of the largest. */
static const double TOLERANCE = 1e-4;

/* Steps are shorter than this over the largest curvature (below 2): the rows' own limit. */
static const double STEP = 1.9;

/* Never met by what a lightmap holds: some 50 are taken. */
enum { MOST_STEPS = 1000 };

static double row_times(const vshi_seam_row *row, uint32_t first, const double *values) {
    double sum = 0.0;
    for (int k = 0; k < VSHI_SEAM_READS; ++k) {
        sum += (double)row->weight[k] * values[row->unknown[k] - first];
    }
    return sum;
}

void vshi_seam_gradient(const vshi_seam_problem *p, const double *values, double *gradient) {
    for (size_t u = 0; u < p->unknown_count; ++u) {
        gradient[u] = 0.0;
    }
    for (size_t r = 0; r < p->row_count; ++r) {
        const vshi_seam_row *row = &p->rows[r];
        const double difference = (double)row->share * row_times(row, p->first, values);
        for (int k = 0; k < VSHI_SEAM_READS; ++k) {
            gradient[row->unknown[k] - p->first] += (double)row->weight[k] * difference;
        }
    }
}

/* The curvature along `values`, applied to them. */
static void multiply(const vshi_seam_problem *p, const double *values, double *product) {
    vshi_seam_gradient(p, values, product);
    for (size_t u = 0; u < p->unknown_count; ++u) {
        product[u] += p->keep[u] * values[u];
    }
}

static double dot(const double *a, const double *b, size_t count) {
    double sum = 0.0;
    for (size_t i = 0; i < count; ++i) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* No curvature is larger: the largest sum of a column times that of a row, which is 2 at most. */
static double largest_curvature(const vshi_seam_problem *p, double *column) {
    double most = 0.0;
    for (size_t u = 0; u < p->unknown_count; ++u) {
        column[u] = 0.0;
    }
    for (size_t r = 0; r < p->row_count; ++r) {
        for (int k = 0; k < VSHI_SEAM_READS; ++k) {
            column[p->rows[r].unknown[k] - p->first] +=
                (double)p->rows[r].share * fabs((double)p->rows[r].weight[k]);
        }
    }
    for (size_t u = 0; u < p->unknown_count; ++u) {
        most = fmax(most, 2.0 * column[u] + p->keep[u]);
    }
    return most;
}

/* What is left to be gained. `free_part` and `held_part` of a gradient: of unknowns within their limits, and
 * of those at one that would go back. */
typedef struct gain {
    double free, held;
} gain;

static double free_part(const vshi_seam_problem *p, const double *gradient, size_t u) {
    return p->change[u] > p->low[u] && p->change[u] < p->high[u] ? gradient[u] : 0.0;
}

static double held_part(const vshi_seam_problem *p, const double *gradient, size_t u) {
    if (p->change[u] > p->low[u]) {
        return p->change[u] < p->high[u] ? 0.0 : fmax(gradient[u], 0.0);
    }
    return p->change[u] < p->high[u] ? fmin(gradient[u], 0.0) : 0.0;
}

/* `free` is of the free part times what of it a step of that length could go. */
static gain gain_of(const vshi_seam_problem *p, const double *gradient, double step, double *free_square) {
    gain left = {0.0, 0.0};
    *free_square = 0.0;
    for (size_t u = 0; u < p->unknown_count; ++u) {
        const double part = free_part(p, gradient, u), held = held_part(p, gradient, u);
        const double room =
            part > 0.0 ? (p->change[u] - p->low[u]) / step : (p->change[u] - p->high[u]) / step;
        left.free += part * (part > 0.0 ? fmin(room, part) : fmax(room, part));
        left.held += held * held;
        *free_square += part * part;
    }
    return left;
}

/* How far one can go against `direction` within the limits. */
static double farthest(const vshi_seam_problem *p, const double *direction) {
    double most = INFINITY;
    for (size_t u = 0; u < p->unknown_count; ++u) {
        if (direction[u] > 0.0) {
            most = fmin(most, (p->change[u] - p->low[u]) / direction[u]);
        } else if (direction[u] < 0.0) {
            most = fmin(most, (p->change[u] - p->high[u]) / direction[u]);
        }
    }
    return most;
}

static void go(vshi_seam_problem *p, const double *direction, double step) {
    for (size_t u = 0; u < p->unknown_count; ++u) {
        p->change[u] = fmin(fmax(p->change[u] - step * direction[u], p->low[u]), p->high[u]);
    }
}

static void subtract(double *from, const double *what, double times, size_t count) {
    for (size_t u = 0; u < count; ++u) {
        from[u] -= times * what[u];
    }
}

static void take_free(const vshi_seam_problem *p, const double *gradient, double *direction) {
    for (size_t u = 0; u < p->unknown_count; ++u) {
        direction[u] = free_part(p, gradient, u);
    }
}

/* The next direction: the free gradient, conjugate to the last. */
static void turn(const vshi_seam_problem *p, const double *gradient, const double *product, double curvature,
                 double *direction) {
    double along = 0.0;
    for (size_t u = 0; u < p->unknown_count; ++u) {
        along += free_part(p, gradient, u) * product[u];
    }
    for (size_t u = 0; u < p->unknown_count; ++u) {
        direction[u] = free_part(p, gradient, u) - along / curvature * direction[u];
    }
}

/* Of the changes as they are: what rounding has left in the sums goes too. */
static void measure(const vshi_seam_problem *p, double *gradient) {
    multiply(p, p->change, gradient);
    for (size_t u = 0; u < p->unknown_count; ++u) {
        gradient[u] += p->gradient[u];
    }
}

int vshi_seam_solve(vshi_seam_problem *p) {
    const size_t count = p->unknown_count;
    double *gradient = p->work, *direction = gradient + count, *product = direction + count;
    for (size_t u = 0; u < count; ++u) {
        p->change[u] = 0.0;
        gradient[u] = p->gradient[u];
    }
    const double enough = TOLERANCE * TOLERANCE * dot(gradient, gradient, count);
    const double step = STEP / largest_curvature(p, product);
    take_free(p, gradient, direction);
    int i = 0;
    for (; i < MOST_STEPS && !vshi_job_advance(p->job, 0); ++i) {
        double free_square;
        const gain left = gain_of(p, gradient, step, &free_square);
        if (free_square + left.held <= enough) {
            break;
        }
        const bool release = left.held > left.free;
        for (size_t u = 0; release && u < count; ++u) {
            direction[u] = held_part(p, gradient, u);
        }
        multiply(p, direction, product);
        const double curvature = dot(direction, product, count);
        if (!(curvature > 0.0)) {
            break; /* nowhere to go */
        }
        const double best = dot(gradient, direction, count) / curvature, most = farthest(p, direction);
        go(p, direction, fmin(best, most));
        if (!release && best <= most) {
            subtract(gradient, product, best, count);
            turn(p, gradient, product, curvature, direction);
            continue;
        }
        if (!release) {
            subtract(gradient, product, most, count);
            take_free(p, gradient, direction);
            go(p, direction, step);
        }
        measure(p, gradient);
        take_free(p, gradient, direction);
    }
    return i;
}
