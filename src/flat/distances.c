#include "flat/distances.h"

#include "base/memory.h"
#include "base/parallel.h"

#include <math.h>

static const double MAX_VALUES = 0x1p31;
/* Of a cell: what counts as met, and the shortest step, so that a ray along a wall gets on. */
static const double MET = 0.01;
static const double SHORTEST_STEP = 0.1;

static void size_of(const vsh_outline *outline, double margin, double cell, double sides[2]) {
    const vshi_outline_node *root = &outline->nodes[0];
    for (int axis = 0; axis < 2; ++axis) {
        sides[axis] = ceil((root->high[axis] - root->low[axis] + 2.0 * margin) / cell) + 2.0;
    }
}

double vshi_flat_grid_bytes(const vsh_outline *outline, double margin, double cell) {
    double sides[2];
    size_of(outline, margin, cell, sides);
    const double values = sides[0] * sides[1];
    return values <= MAX_VALUES ? values * sizeof(float) : INFINITY;
}

typedef struct filling {
    const vsh_outline *outline;
    vshi_flat_grid *grid;
} filling;

static void fill_rows(void *user, size_t begin, size_t end) {
    const filling *f = user;
    const vshi_flat_grid *g = f->grid;
    for (size_t row = begin; row < end; ++row) {
        double bound = INFINITY; /* a neighbour's distance and a step bound the next one's */
        for (size_t column = 0; column < g->columns; ++column) {
            const vshi_point p = {g->low[0] + (double)column * g->cell, g->low[1] + (double)row * g->cell};
            const double distance = sqrt(vshi_outline_square(f->outline, p, bound * bound));
            bound = distance * (1.0 + 1e-9) + 1.001 * g->cell;
            g->values[row * g->columns + column] =
                (float)(vshi_outline_winding(f->outline, p) != 0 ? -distance : distance);
        }
    }
}

vsh_result vshi_flat_grid_make(const vsh_outline *outline, double margin, double cell, const vsh_run *run,
                               vshi_flat_grid *grid, vsh_error *error) {
    double sides[2];
    size_of(outline, margin, cell, sides);
    *grid = (vshi_flat_grid){.cell = cell, .columns = (size_t)sides[0], .rows = (size_t)sides[1]};
    for (int axis = 0; axis < 2; ++axis) {
        grid->low[axis] = outline->nodes[0].low[axis] - margin - 0.5 * cell;
        grid->high[axis] = grid->low[axis] + (sides[axis] - 1.0) * cell;
    }
    void *memory = NULL;
    vsh_result result = vshi_allocate(&memory, grid->columns * grid->rows, sizeof(float), "distances", error);
    grid->values = memory;
    if (result != VSH_OK) {
        return result;
    }
    vshi_job *job = vshi_job_begin(run, "field", grid->rows);
    filling f = {outline, grid};
    result = job != NULL ? vshi_parallel_for(job, grid->rows, 1, 1, fill_rows, &f, error)
                         : vshi_fail(error, VSH_ERROR_MEMORY, "distances: the system refused memory");
    vshi_job_end(job);
    return result;
}

/* Bilinear, in the grid. */
static double sample(const vshi_flat_grid *g, vshi_point p) {
    const double x = fmin(fmax((p.x - g->low[0]) / g->cell, 0.0), (double)(g->columns - 1));
    const double y = fmin(fmax((p.y - g->low[1]) / g->cell, 0.0), (double)(g->rows - 1));
    const size_t i = x < (double)(g->columns - 2) ? (size_t)x : g->columns - 2;
    const size_t k = y < (double)(g->rows - 2) ? (size_t)y : g->rows - 2;
    const double u = x - (double)i, v = y - (double)k;
    const float *at = g->values + k * g->columns + i, *above = at + g->columns;
    return (1.0 - v) * ((1.0 - u) * (double)at[0] + u * (double)at[1]) +
           v * ((1.0 - u) * (double)above[0] + u * (double)above[1]);
}

/* The part of the ray in the grid's rectangle. */
static bool clip_ray(const vshi_flat_grid *g, const vshi_flat_view *v, double *from, double *to) {
    const double origin[2] = {v->point.x, v->point.y}, direction[2] = {v->towards.x, v->towards.y};
    for (int axis = 0; axis < 2; ++axis) {
        if (direction[axis] == 0.0) {
            if (origin[axis] < g->low[axis] || origin[axis] > g->high[axis]) {
                return false;
            }
            continue;
        }
        const double a = (g->low[axis] - origin[axis]) / direction[axis];
        const double b = (g->high[axis] - origin[axis]) / direction[axis];
        *from = fmax(*from, fmin(a, b));
        *to = fmin(*to, fmax(a, b));
    }
    return *from < *to;
}

double vshi_flat_classic(const vshi_flat_grid *g, const vshi_flat_view *v, int32_t max_steps) {
    double t = g->cell, end = v->distance;
    if (!clip_ray(g, v, &t, &end)) {
        return 1.0;
    }
    const double sine =
        isinf(v->distance) ? v->slope / sqrt(1.0 + v->slope * v->slope) : v->radius / v->distance;
    double least = 1.0;
    for (int32_t step = 0; step < max_steps && t < end; ++step) {
        const double h =
            sample(g, (vshi_point){v->point.x + t * v->towards.x, v->point.y + t * v->towards.y});
        if (h < MET * g->cell) {
            return 0.0;
        }
        least = h < least * sine * t ? h / (sine * t) : least;
        t += fmax(h, SHORTEST_STEP * g->cell);
    }
    return least;
}
