/* Least squares over the seams' rows, with limits on each unknown. Accelerated projected gradient: Beck and
 * Teboulle, "A fast iterative shrinkage-thresholding algorithm for linear inverse problems", 2009. It
 * restarts where it overshoots: O'Donoghue and Candès, "Adaptive restart for accelerated gradient schemes",
 * 2015. */
#include "bake/seams.h"

#include <math.h>

/* A solution's projected gradient, relative to the gradient of no change: changes are then known to some
 * 1/1000 of the largest. */
static const double TOLERANCE = 1e-5;

enum { MOST_STEPS = 1000 }; /* some 200 are taken */

void vshi_seam_gradient(const vshi_seam_problem *p, const double *values, double *gradient) {
    for (size_t u = 0; u < p->unknown_count; ++u) {
        gradient[u] = 0.0;
    }
    for (size_t r = 0; r < p->row_count; ++r) {
        const vshi_seam_row *row = &p->rows[r];
        double difference = 0.0;
        for (int k = 0; k < VSHI_SEAM_READS; ++k) {
            difference += (double)row->weight[k] * values[row->unknown[k] - p->first];
        }
        difference *= (double)row->share;
        for (int k = 0; k < VSHI_SEAM_READS; ++k) {
            gradient[row->unknown[k] - p->first] += (double)row->weight[k] * difference;
        }
    }
}

/* No curvature is larger: the largest sum of a column times that of a row, which is 2 at most. */
static double largest_curvature(const vshi_seam_problem *p, double *column) {
    double most = 0.0;
    for (size_t u = 0; u < p->unknown_count; ++u) {
        column[u] = 0.0;
    }
    for (size_t r = 0; r < p->row_count; ++r) {
        const vshi_seam_row *row = &p->rows[r];
        for (int k = 0; k < VSHI_SEAM_READS; ++k) {
            column[row->unknown[k] - p->first] += (double)row->share * fabs((double)row->weight[k]);
        }
    }
    for (size_t u = 0; u < p->unknown_count; ++u) {
        most = fmax(most, 2.0 * column[u] + p->keep[u]);
    }
    return most;
}

int vshi_seam_solve(vshi_seam_problem *p) {
    const size_t count = p->unknown_count;
    double *gradient = p->work, *ahead = gradient + count; /* where the gradient is taken */
    const double step = 1.0 / largest_curvature(p, gradient);
    double enough = 0.0, pace = 1.0;
    for (size_t u = 0; u < count; ++u) {
        p->change[u] = ahead[u] = 0.0;
        enough += p->gradient[u] * p->gradient[u];
    }
    enough *= TOLERANCE * TOLERANCE * step * step;
    int i = 0;
    for (; i < MOST_STEPS && !vshi_job_advance(p->job, 0); ++i) {
        double moved = 0.0, back = 0.0;
        vshi_seam_gradient(p, ahead, gradient);
        for (size_t u = 0; u < count; ++u) { /* the next change, for now in `gradient` */
            const double slope = p->gradient[u] + gradient[u] + p->keep[u] * ahead[u];
            gradient[u] = fmin(fmax(ahead[u] - step * slope, p->low[u]), p->high[u]);
            const double by = gradient[u] - ahead[u];
            moved += by * by;
            back -= by * (gradient[u] - p->change[u]);
        }
        const double next = back > 0.0 ? 1.0 : 0.5 + sqrt(0.25 + pace * pace);
        const double momentum = back > 0.0 ? 0.0 : (pace - 1.0) / next;
        pace = next;
        for (size_t u = 0; u < count; ++u) {
            ahead[u] = gradient[u] + momentum * (gradient[u] - p->change[u]);
            p->change[u] = gradient[u];
        }
        if (moved <= enough) {
            break;
        }
    }
    return i;
}
