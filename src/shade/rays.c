#include "shade/rays.h"

#include <math.h>

/* Rays begin half a voxel on, where h / t starts to mean something: the field itself is not known better. */
static const double FIRST_STEP = 0.0625;
/* The bounds are those of lattice points next to the surface; half a voxel covers the float rounding. */
static const double BOUNDS_MARGIN = 0.5;

void vshi_chunk_clear(vshi_chunk *chunk, bool proof) {
    float *lane[12];
    for (int i = 0; i < 12; ++i) {
        lane[i] = chunk->memory[i];
    }
    chunk->rays = (vshi_rays){.count = 0,
                              .origin = {lane[0], lane[1], lane[2]},
                              .direction = {lane[3], lane[4], lane[5]},
                              .begin = lane[6],
                              .end = lane[7],
                              .sine = lane[8],
                              .stop = lane[9],
                              .close = lane[10],
                              .horizon = proof ? lane[11] : NULL,
                              .proof = proof ? chunk->proof : NULL};
}

/* Narrows [begin, end] to where slope × t ≥ bound. */
static inline void clip(double slope, double bound, double *begin, double *end) {
    if (slope > 0.0) {
        const double t = bound / slope;
        *begin = t > *begin ? t : *begin;
    } else if (slope < 0.0) {
        const double t = bound / slope;
        *end = t < *end ? t : *end;
    } else if (bound > 0.0) {
        *end = -1.0;
    }
}

bool vshi_chunk_add(vshi_chunk *chunk, const vsh_field *field, const vshi_cone *cone, uint32_t owner,
                    vsh_shade_stats *stats) {
    const double o[3] = {cone->origin.x, cone->origin.y, cone->origin.z};
    const double d[3] = {cone->direction.x, cone->direction.y, cone->direction.z};
    double begin = FIRST_STEP, end = cone->end;
    /* a point r away and f off the axis comes closest, by h / t, at t = r / cos f: later minima are not the
     * cone's */
    double farthest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = fabs(o[axis] - (double)field->bounds_min[axis]);
        const double high = fabs(o[axis] - (double)field->bounds_max[axis]);
        const double side = low > high ? low : high;
        farthest += side * side;
    }
    const double last = sqrt(farthest / (1.0 - cone->sine * cone->sine)) + BOUNDS_MARGIN;
    end = last < end ? last : end;
    /* a ball of radius t sin b can meet the box only while its centre is within that of each side */
    for (int axis = 0; axis < 3; ++axis) {
        clip(d[axis] + cone->sine, (double)field->bounds_min[axis] - BOUNDS_MARGIN - o[axis], &begin, &end);
        clip(cone->sine - d[axis], o[axis] - (double)field->bounds_max[axis] - BOUNDS_MARGIN, &begin, &end);
    }
    if (!(begin < end)) {
        return false;
    }
    const size_t i = chunk->rays.count++;
    for (int axis = 0; axis < 3; ++axis) {
        chunk->rays.origin[axis][i] = (float)o[axis];
        chunk->rays.direction[axis][i] = (float)d[axis];
    }
    chunk->rays.begin[i] = (float)begin;
    chunk->rays.end[i] = (float)end;
    chunk->rays.sine[i] = (float)cone->sine;
    chunk->rays.stop[i] = (float)cone->stop;
    chunk->rays.close[i] = (float)cone->close;
    if (chunk->rays.proof != NULL) {
        chunk->rays.horizon[i] = (float)cone->horizon;
    }
    chunk->owner[i] = owner;
    ++stats->marches;
    if (cone->sine * end > field->levels[field->level_count - 1].band) {
        ++stats->beyond_reach;
    }
    return true;
}

/* asin by its series for |z| ≤ 1/2, where 14 terms leave 1e-11. */
static double asin_small(double z) {
    const double square = z * z;
    double term = z, sum = z;
    for (int k = 1; k < 14; ++k) {
        term *= square * (2 * k - 1) / (2 * k);
        sum += term / (2 * k + 1);
    }
    return sum;
}

double vshi_segment(double x) {
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
    return vshi_segment(closeness / sine * sqrt((1.0 - sine * sine) / (1.0 - closeness * closeness)));
}
