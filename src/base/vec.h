/* Vectors of three doubles, and transforms of three rows of four. A similarity rotates, moves, mirrors and
 * scales evenly. */
#pragma once

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <vdbshade/base.h>

VSH_BEGIN_C

typedef struct vshi_vec {
    double x, y, z;
} vshi_vec;

static inline vshi_vec vshi_vec_of(const double v[3]) {
    return (vshi_vec){v[0], v[1], v[2]};
}
static inline vshi_vec vshi_vec_off(const float v[3]) {
    return (vshi_vec){v[0], v[1], v[2]};
}
static inline void vshi_vec_to_floats(vshi_vec v, float to[3]) {
    to[0] = (float)v.x;
    to[1] = (float)v.y;
    to[2] = (float)v.z;
}
static inline void vshi_vec_to_doubles(vshi_vec v, double to[3]) {
    to[0] = v.x;
    to[1] = v.y;
    to[2] = v.z;
}
static inline vshi_vec vshi_add(vshi_vec a, vshi_vec b) {
    return (vshi_vec){a.x + b.x, a.y + b.y, a.z + b.z};
}
static inline vshi_vec vshi_sub(vshi_vec a, vshi_vec b) {
    return (vshi_vec){a.x - b.x, a.y - b.y, a.z - b.z};
}
static inline vshi_vec vshi_scale(vshi_vec a, double s) {
    return (vshi_vec){a.x * s, a.y * s, a.z * s};
}
static inline double vshi_dot(vshi_vec a, vshi_vec b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
static inline vshi_vec vshi_cross(vshi_vec a, vshi_vec b) {
    return (vshi_vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline double vshi_length(vshi_vec a) {
    return sqrt(vshi_dot(a, a));
}

/* Rounds to three digits, and above 1000 to a whole number. Up to 1e10 "%.10g" reads back as the
 * same double. */
static inline double vshi_round_digits(double value) {
    double scale = 1.0; /* powers of ten are exact up to 1e22 */
    while (value * scale < 100.0 && scale < 1e22) {
        scale *= 10.0;
    }
    return floor(value * scale + 0.5) / scale;
}

/* Returns the AO distance of `auto` for casters and receivers in a box: a twelfth of its diagonal. 0 for a
 * point, and for an empty box. */
static inline double vshi_auto_ao_distance(const double min[3], const double max[3]) {
    enum { PART = 12 };
    const vshi_vec diagonal = vshi_sub(vshi_vec_of(max), vshi_vec_of(min));
    return min[0] <= max[0] ? vshi_round_digits(vshi_length(diagonal) / PART) : 0.0;
}
static inline bool vshi_finite(vshi_vec a) {
    return isfinite(a.x) && isfinite(a.y) && isfinite(a.z);
}

/* Unit vector along a, or zero if a has no direction. Squares of very small and large vectors leave the range
 * of doubles, so these are scaled first. */
static inline vshi_vec vshi_unit(vshi_vec a) {
    const double square = vshi_dot(a, a);
    if (square > 1e-200 && square < 1e200) {
        return vshi_scale(a, 1.0 / sqrt(square));
    }
    const double largest = fmax(fabs(a.x), fmax(fabs(a.y), fabs(a.z)));
    if (!(largest > 0.0) || !isfinite(largest)) {
        return (vshi_vec){0.0, 0.0, 0.0};
    }
    a = (vshi_vec){a.x / largest, a.y / largest, a.z / largest};
    return vshi_scale(a, 1.0 / vshi_length(a));
}

/* Two more axes of a right-handed frame with unit vector n (Duff and others, "Building an orthonormal basis,
 * revisited", 2017). */
static inline void vshi_frame(vshi_vec n, vshi_vec *tangent, vshi_vec *bitangent) {
    const double sign = n.z < 0.0 ? -1.0 : 1.0;
    const double a = -1.0 / (sign + n.z);
    const double b = n.x * n.y * a;
    *tangent = (vshi_vec){1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x};
    *bitangent = (vshi_vec){b, sign + n.y * n.y * a, -n.y};
}

extern const double vshi_identity[12];

/* Point through a transform [12] of three rows of four; NULL is the identity. */
static inline vshi_vec vshi_transform_point(const double *m, vshi_vec p) {
    if (m == NULL) {
        return p;
    }
    return (vshi_vec){m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3],
                      m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7],
                      m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]};
}

/* Direction through the linear part. */
static inline vshi_vec vshi_transform_vector(const double *m, vshi_vec v) {
    if (m == NULL) {
        return v;
    }
    return (vshi_vec){m[0] * v.x + m[1] * v.y + m[2] * v.z, m[4] * v.x + m[5] * v.y + m[6] * v.z,
                      m[8] * v.x + m[9] * v.y + m[10] * v.z};
}

/* Determinant of the linear part: negative if the transform mirrors. */
static inline double vshi_transform_determinant(const double *m) {
    if (m == NULL) {
        return 1.0;
    }
    return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
           m[2] * (m[4] * m[9] - m[5] * m[8]);
}

/* Normal through the cofactors of the linear part, which handle mirroring and uneven scales; not
 * normalised. */
static inline vshi_vec vshi_transform_normal(const double *m, vshi_vec n) {
    if (m == NULL) {
        return n;
    }
    const double sign = vshi_transform_determinant(m) < 0.0 ? -1.0 : 1.0;
    return (vshi_vec){
        sign * ((m[5] * m[10] - m[6] * m[9]) * n.x + (m[6] * m[8] - m[4] * m[10]) * n.y +
                (m[4] * m[9] - m[5] * m[8]) * n.z),
        sign * ((m[2] * m[9] - m[1] * m[10]) * n.x + (m[0] * m[10] - m[2] * m[8]) * n.y +
                (m[1] * m[8] - m[0] * m[9]) * n.z),
        sign * ((m[1] * m[6] - m[2] * m[5]) * n.x + (m[2] * m[4] - m[0] * m[6]) * n.y +
                (m[0] * m[5] - m[1] * m[4]) * n.z),
    };
}

/* result = outer × inner; `result` must be neither. */
void vshi_transform_compose(const double outer[12], const double inner[12], double result[12]);

/* Uniform scale of a transform [12]; 0 for one that shears, scales unevenly or flattens. */
double vshi_similarity_scale(const double m[12]);

/* Finds the scale of a similarity (NULL: identity). Errors: VSH_ERROR_ARGUMENT, naming `what`, for any other
 * transform, and for one that is not finite. */
vsh_result vshi_similarity_check(const double *m, const char *what, double *scale, vsh_error *error);

/* Whether a finite transform flattens all shapes. */
bool vshi_transform_flattens(const double m[12]);

/* Quaternion x, y, z, w of the rotation in a similarity of that scale, which must not mirror. */
void vshi_similarity_rotation(const double m[12], double scale, double q[4]);

/* a × b: rotates by b, then by a. `result` may be a or b. */
void vshi_quaternion_multiply(const double a[4], const double b[4], double result[4]);

/* Empties the box low … high: an empty box has low > high. */
static inline void vshi_empty_box(double low[3], double high[3]) {
    for (int axis = 0; axis < 3; ++axis) {
        low[axis] = INFINITY;
        high[axis] = -INFINITY;
    }
}

/* Grows a box by a point. */
static inline void vshi_grow_box(double low[3], double high[3], vshi_vec p) {
    const double at[3] = {p.x, p.y, p.z};
    for (int axis = 0; axis < 3; ++axis) {
        low[axis] = at[axis] < low[axis] ? at[axis] : low[axis];
        high[axis] = at[axis] > high[axis] ? at[axis] : high[axis];
    }
}

/* Grows a box by another box, transformed. */
static inline void vshi_grow_box_by(double low[3], double high[3], const double *m, const double from[3],
                                    const double to[3]) {
    for (int i = 0; i < 8; ++i) {
        const vshi_vec corner = {i & 1 ? to[0] : from[0], i & 2 ? to[1] : from[1], i & 4 ? to[2] : from[2]};
        vshi_grow_box(low, high, vshi_transform_point(m, corner));
    }
}

/* The normal of a triangle, twice its area long. */
static inline vshi_vec vshi_triangle_normal(const vshi_vec corner[3]) {
    return vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0]));
}

static inline double vshi_triangle_area(const vshi_vec corner[3]) {
    return 0.5 * vshi_length(vshi_triangle_normal(corner));
}

/* A point of a triangle; u and v of 0 … 1 spread evenly give points spread evenly over its area. */
static inline vshi_vec vshi_triangle_point(const vshi_vec corner[3], double u, double v) {
    if (u + v > 1.0) {
        u = 1.0 - u;
        v = 1.0 - v;
    }
    return vshi_add(corner[0], vshi_add(vshi_scale(vshi_sub(corner[1], corner[0]), u),
                                        vshi_scale(vshi_sub(corner[2], corner[0]), v)));
}

/* Limits the part from … to of a ray to low … high along one axis; a part without a point has to < from.
 * Compares instead of calling fmin() and fmax(), which handle NaN and are not inlined. */
static inline void vshi_clip_axis(double origin, double along, double low, double high, double *from,
                                  double *to) {
    if (along == 0.0) {
        *to = origin >= low && origin <= high ? *to : -1.0;
        return;
    }
    const double a = (low - origin) / along, b = (high - origin) / along;
    const double first = a < b ? a : b, last = a < b ? b : a;
    *from = first > *from ? first : *from;
    *to = last < *to ? last : *to;
}

/* A piece of a ray in world space, from `origin` up to `far` along the unit `direction`. */
typedef struct vshi_segment_ray {
    double origin[3];
    double direction[3];
    double far; /* may be infinite */
} vshi_segment_ray;

VSH_END_C
