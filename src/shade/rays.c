/* Chunks of cones on their way to the kernel, and the errors of rays. */
#include "shade/shade.h"

#include "base/job.h"

#include <math.h>

/* Rays begin a sixteenth of a voxel on. The field is not known better, so h / t means nothing before. */
static const double FIRST_STEP = 0.0625;
/* Clipping cones shorter than this, voxels, costs more than it saves. */
static const double SHORT = 32.0;
/* Cones wider than the reach by no more than this part do not count as beyond it. Their closeness reads at
 * least 1 / 1.03, which is 0.997 of the light instead of 1. Their last voxels do not count either. A field
 * reaches the farthest corner of casters and receivers, and marches begin and end a few voxels outside. */
static const double BEYOND = 0.03;
static const double LAST_STRETCH = 4.0;
/* The bounds are those of lattice points next to the surface; half a voxel covers the float rounding. */
static const double BOUNDS_MARGIN = 0.5;

const vshi_kernel *vshi_kernel_of(int32_t isa) {
    return VSHI_KERNEL_OF(vshi_kernel, isa);
}

static void push_cone(vshi_chunk *chunk, const vshi_cone *cone, uint32_t owner) {
    const size_t i = chunk->count++;
    chunk->origin[0][i] = (float)cone->origin.x;
    chunk->origin[1][i] = (float)cone->origin.y;
    chunk->origin[2][i] = (float)cone->origin.z;
    chunk->direction[0][i] = (float)cone->direction.x;
    chunk->direction[1][i] = (float)cone->direction.y;
    chunk->direction[2][i] = (float)cone->direction.z;
    chunk->begin[i] = (float)cone->begin;
    chunk->end[i] = (float)cone->end;
    chunk->sine[i] = (float)cone->sine;
    chunk->stop[i] = (float)cone->stop;
    chunk->close[i] = (float)cone->close;
    chunk->horizon[i] = (float)cone->horizon;
    chunk->wide[i] = (float)cone->wide;
    chunk->deeper[i] = (float)cone->deeper;
    chunk->owner[i] = owner;
}

/* Narrows [begin, end] to where slope × t ≥ bound. */
static inline void clip(double slope, double bound, double *begin, double *end) {
    const double t = bound / slope;
    *begin = slope > 0.0 && t > *begin ? t : *begin;
    *end = slope < 0.0 && t < *end ? t : *end;
    *end = slope == 0.0 && bound > 0.0 ? -1.0 : *end;
}

/* The part of a cone from *begin to *end that can meet the casters' bounds. */
static void clip_to_bounds(const vsh_field *field, const vshi_cone *cone, double *begin, double *end) {
    const double o[3] = {cone->origin.x, cone->origin.y, cone->origin.z};
    const double d[3] = {cone->direction.x, cone->direction.y, cone->direction.z};
    const double margin = BOUNDS_MARGIN + cone->wide;
    /* A point at distance r, at an angle f off the axis, is closest by h / t at t = r / cos f. Later minima
     * are not the cone's. */
    double farthest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = fabs(o[axis] - (double)field->bounds_min[axis]);
        const double high = fabs(o[axis] - (double)field->bounds_max[axis]);
        const double side = low > high ? low : high;
        farthest += side * side;
    }
    const double last = sqrt(farthest / (1.0 - cone->sine * cone->sine)) + margin;
    *end = last < *end ? last : *end;
    /* a ball of radius t sin b can meet the box only while its centre is that close to each side */
    for (int axis = 0; axis < 3; ++axis) {
        clip(d[axis] + cone->sine, (double)field->bounds_min[axis] - margin - o[axis], begin, end);
        clip(cone->sine - d[axis], o[axis] - (double)field->bounds_max[axis] - margin, begin, end);
    }
}

/* Whether a cone begins inside the bounds, so that they do not delay its begin. */
static bool within_bounds(const vsh_field *field, const vshi_cone *cone) {
    const double o[3] = {cone->origin.x, cone->origin.y, cone->origin.z};
    const double margin = BOUNDS_MARGIN + cone->wide;
    bool within = true;
    for (int axis = 0; axis < 3; ++axis) {
        within = within && o[axis] >= (double)field->bounds_min[axis] - margin &&
                 o[axis] <= (double)field->bounds_max[axis] + margin;
    }
    return within;
}

bool vshi_chunk_add(vshi_chunk *chunk, const vsh_field *field, const vshi_cone *cone, uint32_t owner,
                    vsh_shade_stats *stats) {
    double begin = cone->begin > FIRST_STEP ? cone->begin : FIRST_STEP, end = cone->end;
    if (!(begin < end)) {
        return false;
    }
    /* A proof must not change where a cone begins. Otherwise values would depend on the neighbours. */
    if (end > SHORT || (cone->whole > SHORT && !within_bounds(field, cone))) {
        clip_to_bounds(field, cone, &begin, &end);
        if (!(begin < end)) {
            return false;
        }
    }
    if (field->unknown) {
        return true; /* a march would prove no more than that it misses the casters' box */
    }
    push_cone(chunk, cone, owner);
    chunk->begin[chunk->count - 1] = (float)begin;
    chunk->end[chunk->count - 1] = (float)end;
    ++stats->marches;
    const double band = field->levels[field->level_count - 1].band;
    /* beams that are wider than their cones say nothing about these */
    if (!(cone->deeper > 0.0) && cone->sine * (end - LAST_STRETCH) > (1.0 + BEYOND) * band) {
        ++stats->beyond_reach;
    }
    return true;
}

void vshi_chunk_march(vshi_chunk *chunk, const vshi_kernel *kernel, const vsh_field *field, int32_t kind,
                      int32_t max_steps, vsh_shade_stats *stats) {
    vshi_march_stats work = {0, 0};
    kernel->march(field, chunk, kind, max_steps, &work);
    stats->samples += work.samples;
    stats->unfinished += kind == VSHI_MARCH_PROOF || kind == VSHI_MARCH_BEAM ? 0 : work.unfinished;
}

/* The series of asin for |z| ≤ 1/2. 14 terms leave 1e-11. */
static double asin_small(double z) {
    const double square = z * z;
    double term = z, sum = z;
    for (int k = 1; k < 14; ++k) {
        term *= square * (2 * k - 1) / (2 * k);
        sum += term / (2 * k + 1);
    }
    return sum;
}

/* Fraction of a disc light that is seen past a straight edge at x of its radius from the centre, for x in
 * [-1, 1]: the circular segment 1/2 + (x √(1 - x²) + asin x) / π. It uses no libm, whose bits differ. */
static double segment_share(double x) {
    static const double PI = 3.14159265358979323846;
    if (!(x > -1.0)) {
        return 0.0;
    }
    if (x >= 1.0) {
        return 1.0;
    }
    const double size = fabs(x);
    const double arc = size <= 0.5 ? asin_small(size) : 0.5 * PI - 2.0 * asin_small(sqrt(0.5 * (1.0 - size)));
    const double share = (size * sqrt(1.0 - x * x) + arc) / PI;
    return x < 0.0 ? 0.5 - share : 0.5 + share;
}

double vshi_cone_visibility(double closeness, double sine) {
    if (closeness >= sine) {
        return 1.0;
    }
    if (closeness <= -sine) {
        return 0.0;
    }
    return segment_share(closeness / sine * sqrt((1.0 - sine * sine) / (1.0 - closeness * closeness)));
}

/* --- errors of a point's rays, by how many were lit and by the rays of the points around it */

/* Variances of an edge through the middle of the disc, in units of n^-3/2 and n^-1: see vshi_rays_error().
 * UNSEEN is the variance of a part that no ray has met, over the square of its expected size. A geometric
 * distribution has 2. */
static const double SOBOL = 0.2, BLUE = 0.12, UNSEEN = 1.5;

double vshi_rays_deviation(int32_t sampler, int32_t lit, int32_t taken, double expected) {
    /* Smoothed by one ray of the expected share (Jeffreys' prior for a half), so that a few agreeing rays
     * prove nothing. */
    const double n = taken, p = (lit + expected) / (n + 1.0);
    const double root = sqrt(n);
    const double white = 1.0 / root, low = 1.0 / (root * sqrt(root));
    const double spread = sampler == VSH_SAMPLER_WHITE ? white
                          : sampler == VSH_SAMPLER_BLUE
                              ? (1.6 * low > 0.56 * white ? 1.6 * low : 0.56 * white)
                              : 1.04 * low;
    return spread * sqrt(p * (1.0 - p));
}

double vshi_rays_error(int32_t sampler, int32_t lit, int32_t taken, double lit_around, double taken_around) {
    const double n = taken;
    const int32_t fewer = lit < taken - lit ? lit : taken - lit;
    const double around = fewer == lit ? lit_around : taken_around - lit_around;
    /* the smaller part, expected as large as around the point, smoothed by Laplace's rule of succession */
    const double p = fmin(0.5, (fewer + 1.0) / (n + (taken_around + 2.0) / (around + 1.0)));
    if (fewer == 0) {
        return sqrt(UNSEEN) * p;
    }
    /* a power a little below a third, by roots, which have the same bits everywhere */
    const double white = p * (1.0 - p) / n, fourth = sqrt(sqrt(4.0 * p * (1.0 - p)));
    const double edge = fourth * sqrt(sqrt(fourth));
    const double even = sampler == VSH_SAMPLER_SOBOL  ? SOBOL * edge / (n * sqrt(n))
                        : sampler == VSH_SAMPLER_BLUE ? BLUE * edge * edge / n
                                                      : white;
    return sqrt(even < white || sampler == VSH_SAMPLER_BLUE ? even : white);
}
