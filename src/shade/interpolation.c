/* Values of texels between anchors in the same square of a lightmap. */
#include "shade/shadow.h"

#include <math.h>
#include <string.h>

enum { SIDE = 8 }; /* texels of the largest square */

/* The anchors of a square: a grid of three by three, or its corners and its middle. */
typedef struct pattern {
    int size;     /* texels along a side */
    int place[3]; /* of the grid, along either side */
    bool edges;   /* whether the middles of sides are anchors too */
    double agree; /* limit of the difference between an anchor and its neighbours' interpolation, as a share
                     of max_error */
    double keeps; /* share of that difference that remains between anchors: curvature falls with the square of
                     a step */
} pattern;

static const pattern LEVELS[VSHI_INTERPOLATION_LEVELS] = {
    {.size = 8, .place = {0, 4, 7}, .edges = true, .agree = 3.0, .keeps = 0.25},
    {.size = 4, .place = {0, 2, 3}, .edges = false, .agree = 2.2, .keeps = 0.33},
};

/* Factor on the remaining difference: at the ends of penumbrae light bends more than a parabola. */
static const double MORE = 2.0;
/* Below FINE anchors must agree better, by the factor FINER. */
static const double FINE = 0.01, FINER = 0.7;

/* Corners may differ by this: the middle does not show an edge between them. */
static const double RANGE = 0.5;
/* Standard errors by which rays may differ. */
static const double SIGMAS = 2.5;
/* Flatness of the points, as a share of the square's size, and cosine between their normals. */
static const double FLAT = 0.1, ALIKE = 0.98;

typedef struct square {
    const vshi_interpolation *interp;
    const pattern *pattern;
    int column, row;         /* of its corner, in the square of SIDE */
    uint16_t at[SIDE][SIDE]; /* of the square of SIDE: place in the piece + 1, 0: none */
} square;

static uint32_t square_of(const vshi_interpolation *interp, size_t k) {
    const uint32_t texel = interp->points->texels[interp->begin + k];
    return (texel & 0xfff8fff8u) >> 3;
}

int32_t vshi_interpolation_rays(double max_error) {
    int32_t rays = 4;
    while (rays < 256 && rays * max_error < 0.16) {
        rays *= 2;
    }
    return rays;
}

void vshi_interpolation_begin(vshi_interpolation *interp) {
    interp->runs = 0;
    for (size_t k = 0; k < interp->count; ++k) {
        if (k == 0 || square_of(interp, k) != square_of(interp, k - 1)) {
            interp->run_begin[interp->runs++] = (uint16_t)k;
        }
    }
    interp->run_begin[interp->runs] = (uint16_t)interp->count;
}

/* Lays out a run's points. False if two share a place, or none is open. */
static bool lay_out(square *s, size_t run) {
    const vshi_interpolation *interp = s->interp;
    bool open = false;
    memset(s->at, 0, sizeof s->at);
    for (size_t k = interp->run_begin[run]; k < interp->run_begin[run + 1]; ++k) {
        const uint32_t texel = interp->points->texels[interp->begin + k];
        uint16_t *at = &s->at[texel >> 16 & (SIDE - 1)][texel & (SIDE - 1)];
        if (*at != 0) {
            return false;
        }
        *at = interp->state[k] != VSHI_INTERPOLATION_GONE ? (uint16_t)(k + 1) : 0;
        open = open || interp->state[k] == VSHI_INTERPOLATION_OPEN;
    }
    return open;
}

static inline size_t point_at(const square *s, int column, int row) {
    return (size_t)s->at[s->row + row][s->column + column] - 1; /* SIZE_MAX: none */
}

static inline bool is_anchor(const pattern *p, int i, int j) {
    return p->edges || (i != 1) == (j != 1);
}

static vshi_vec position_of(const vshi_interpolation *interp, size_t k) {
    return vshi_vec_of(interp->points->positions + 3 * (interp->begin + k));
}

static vshi_vec normal_of(const vshi_interpolation *interp, size_t k) {
    return vshi_unit(vshi_vec_off(interp->points->normals + 3 * (interp->begin + k)));
}

static vshi_vec mix(const vshi_vec p[4], double x, double y) {
    const vshi_vec top = vshi_add(vshi_scale(p[0], 1.0 - x), vshi_scale(p[1], x));
    const vshi_vec bottom = vshi_add(vshi_scale(p[2], 1.0 - x), vshi_scale(p[3], x));
    return vshi_add(vshi_scale(top, 1.0 - y), vshi_scale(bottom, y));
}

/* Whether all anchors exist, some points are open, and the open ones lie in a plane with similar normals. */
static bool is_even(const square *s) {
    const pattern *p = s->pattern;
    const int last = p->size - 1;
    vshi_vec corner[4];
    for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 3; ++i) {
            if (is_anchor(p, i, j) && point_at(s, p->place[i], p->place[j]) == SIZE_MAX) {
                return false;
            }
        }
    }
    for (int k = 0; k < 4; ++k) {
        corner[k] = position_of(s->interp, point_at(s, last * (k & 1), last * (k >> 1)));
    }
    const vshi_vec normal = normal_of(s->interp, point_at(s, 0, 0));
    const vshi_vec across = vshi_sub(corner[3], corner[0]);
    const double most = FLAT * FLAT * vshi_dot(across, across);
    bool open = false;
    for (int row = 0; row <= last; ++row) {
        for (int column = 0; column <= last; ++column) {
            const size_t k = point_at(s, column, row);
            if (k == SIZE_MAX || s->interp->state[k] != VSHI_INTERPOLATION_OPEN) {
                continue;
            }
            open = true;
            const vshi_vec off =
                vshi_sub(position_of(s->interp, k), mix(corner, (double)column / last, (double)row / last));
            if (!(vshi_dot(off, off) <= most) || !(vshi_dot(normal, normal_of(s->interp, k)) >= ALIKE)) {
                return false;
            }
        }
    }
    return open;
}

/* Calls `fn` for every square of a level that has open points. */
static void each_square(vshi_interpolation *interp, int level,
                        void (*fn)(vshi_interpolation *interp, const square *s)) {
    square s = {.interp = interp, .pattern = &LEVELS[level]};
    const int size = s.pattern->size;
    for (size_t run = 0; run < interp->runs; ++run) {
        if (!lay_out(&s, run)) {
            continue;
        }
        for (s.row = 0; s.row < SIDE; s.row += size) {
            for (s.column = 0; s.column < SIDE; s.column += size) {
                if (is_even(&s)) {
                    fn(interp, &s);
                }
            }
        }
    }
}

static void mark_anchors(vshi_interpolation *interp, const square *s) {
    const pattern *p = s->pattern;
    for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 3; ++i) {
            const size_t k = is_anchor(p, i, j) ? point_at(s, p->place[i], p->place[j]) : SIZE_MAX;
            if (k != SIZE_MAX && interp->state[k] == VSHI_INTERPOLATION_OPEN) {
                interp->state[k] = VSHI_INTERPOLATION_WANTED;
            }
        }
    }
}

bool vshi_interpolation_pick(vshi_interpolation *interp, int level) {
    each_square(interp, level, mark_anchors);
    return memchr(interp->state, VSHI_INTERPOLATION_WANTED, interp->count) != NULL;
}

/* --- values between */

typedef struct anchors {
    double value[3][3], variance[3][3];
    double part;    /* place of the middle between its neighbours, 0 … 1 */
    double surplus; /* largest difference between a middle and the corners' interpolation */
} anchors;

static void raise(anchors *a, double difference) {
    a->surplus = fmax(a->surplus, fabs(difference));
}

/* Interpolates the middle of a side from its ends, unless it is known. */
static void fill_side(anchors *a, bool known, double *value, double *variance, const double ends[2],
                      const double variances[2]) {
    const double f = a->part, between = ends[0] * (1.0 - f) + ends[1] * f;
    if (known) {
        raise(a, *value - between);
        return;
    }
    *value = between;
    *variance = variances[0] * (1.0 - f) * (1.0 - f) + variances[1] * f * f;
}

/* Reads the anchors of a square. False if one is not known, or they disagree. */
static bool read(const square *s, anchors *a) {
    const pattern *p = s->pattern;
    const vshi_interpolation *interp = s->interp;
    double low = INFINITY, high = -INFINITY;
    for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 3; ++i) {
            if (!is_anchor(p, i, j)) {
                continue;
            }
            const size_t k = point_at(s, p->place[i], p->place[j]);
            if (interp->state[k] != VSHI_INTERPOLATION_KNOWN) {
                return false;
            }
            const double deviation = (double)interp->deviation[k];
            a->value[j][i] = (double)interp->value[k];
            a->variance[j][i] = deviation * deviation;
            low = fmin(low, a->value[j][i]);
            high = fmax(high, a->value[j][i]);
        }
    }
    a->part = (double)p->place[1] / p->place[2];
    a->surplus = 0.0;
    double(*v)[3] = a->value, (*w)[3] = a->variance;
    const double f = a->part;
    const double top = v[0][0] * (1.0 - f) + v[0][2] * f, bottom = v[2][0] * (1.0 - f) + v[2][2] * f;
    raise(a, v[1][1] - (top * (1.0 - f) + bottom * f));
    raise(a, 0.5 * (v[0][0] - v[0][2] - v[2][0] + v[2][2])); /* the middle hardly shows a single corner */
    for (int e = 0; e < 3; e += 2) {
        fill_side(a, p->edges, &v[e][1], &w[e][1], (double[]){v[e][0], v[e][2]},
                  (double[]){w[e][0], w[e][2]});
        fill_side(a, p->edges, &v[1][e], &w[1][e], (double[]){v[0][e], v[2][e]},
                  (double[]){w[0][e], w[2][e]});
    }
    const double agree = interp->max_error < FINE ? FINER * p->agree : p->agree;
    return high - low <= RANGE && a->surplus <= agree * interp->max_error;
}

/* Values and variances of a square's open points, in the order of rows. */
typedef struct between {
    size_t count, point[SIDE * SIDE];
    double value[SIDE * SIDE], variance[SIDE * SIDE];
} between;

static void mix_open(const square *s, const anchors *a, between *found) {
    const pattern *p = s->pattern;
    const double left = MORE * p->keeps * a->surplus;
    found->count = 0;
    for (int row = 0; row < p->size; ++row) {
        for (int column = 0; column < p->size; ++column) {
            const size_t k = point_at(s, column, row);
            if (k == SIZE_MAX || s->interp->state[k] != VSHI_INTERPOLATION_OPEN) {
                continue;
            }
            const int i = column >= p->place[1], j = row >= p->place[1];
            const double x = (double)(column - p->place[i]) / (p->place[i + 1] - p->place[i]);
            const double y = (double)(row - p->place[j]) / (p->place[j + 1] - p->place[j]);
            const double weight[2][2] = {{(1.0 - x) * (1.0 - y), x * (1.0 - y)}, {(1.0 - x) * y, x * y}};
            double value = 0.0, variance = 0.0;
            for (int b = 0; b < 4; ++b) {
                const double w = weight[b >> 1][b & 1];
                value += w * a->value[j + (b >> 1)][i + (b & 1)];
                variance += w * w * a->variance[j + (b >> 1)][i + (b & 1)];
            }
            found->point[found->count] = k;
            found->value[found->count] = fmin(fmax(value, 0.0), 1.0);
            found->variance[found->count++] =
                fmin(variance + left * left, fmax(variance, s->interp->max_error * s->interp->max_error));
        }
    }
}

/* Whether the open points' own rays agree, each and on average. */
static bool rays_agree(const vshi_interpolation *interp, const between *found) {
    double sum = 0.0, variance = 0.0;
    for (size_t n = 0; n < found->count; ++n) {
        const int lit = interp->lit[found->point[n]];
        const double error = vshi_rays_deviation(interp->sampler, lit, interp->rays, found->value[n]);
        const double off = (double)lit / (double)interp->rays - found->value[n];
        if (fabs(off) > SIGMAS * error + interp->max_error) {
            return false;
        }
        sum += off;
        variance += error * error;
    }
    return fabs(sum) <= SIGMAS * sqrt(variance) + interp->max_error * (double)found->count;
}

static void interpolate(vshi_interpolation *interp, const square *s) {
    anchors a;
    between found;
    if (!read(s, &a)) {
        return;
    }
    mix_open(s, &a, &found);
    if (!rays_agree(interp, &found)) {
        return;
    }
    for (size_t n = 0; n < found.count; ++n) {
        const size_t k = found.point[n];
        interp->state[k] = VSHI_INTERPOLATION_KNOWN;
        interp->value[k] = (float)found.value[n];
        interp->deviation[k] = (float)sqrt(found.variance[n]);
    }
}

void vshi_interpolation_fill(vshi_interpolation *interp, int level) {
    each_square(interp, level, interpolate);
}
