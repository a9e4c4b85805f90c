#include "scene/transform.h"

#include "scene/assets.h"

#include "base/elementary.h"
#include "base/similarity.h"
#include "base/try.h"
#include "base/vec.h"

#include <math.h>
#include <string.h>

/* Shear that numbers written with seven digits leave in a rotation. */
static const double SIMILARITY_TOLERANCE = 1e-5;
static const double SMALLEST_SCALE = 1e-6;
static const double LARGEST_SCALE = 1e6;

vsh_result vshi_read_rotation(vshi_json *reader, const vshi_value *value, void *quaternion) {
    const vshi_key key = {.kind = VSHI_VECTOR, .count = 3, .lowest = -1e6, .highest = 1e6};
    double degrees[3];
    VSHI_TRY(vshi_read_value(reader, value, &key, degrees));
    double s[3], c[3];
    for (int i = 0; i < 3; ++i) {
        const double half = remainder(degrees[i], 720.0) / 360.0 * VSHI_PI;
        s[i] = vshi_sin(half);
        c[i] = vshi_cos(half);
    }
    /* The product of the quaternions about z, y, x, as they act on a vector from the right. */
    double *q = quaternion;
    q[0] = s[0] * c[1] * c[2] - c[0] * s[1] * s[2];
    q[1] = c[0] * s[1] * c[2] + s[0] * c[1] * s[2];
    q[2] = c[0] * c[1] * s[2] - s[0] * s[1] * c[2];
    q[3] = c[0] * c[1] * c[2] + s[0] * s[1] * s[2];
    return VSH_OK;
}

/* One number for all axes, or one for each. */
static vsh_result read_scale(vshi_json *reader, const vshi_value *value, void *member) {
    const vshi_key key = {.kind = json_is_array(value->json) ? VSHI_VECTOR : VSHI_NUMBER,
                          .count = 3,
                          .lowest = SMALLEST_SCALE,
                          .highest = LARGEST_SCALE};
    double *scale = member;
    VSHI_TRY(vshi_read_value(reader, value, &key, scale));
    if (key.kind == VSHI_NUMBER) {
        scale[1] = scale[2] = scale[0];
    }
    return VSH_OK;
}

typedef struct parts {
    double translate[3];
    double rotation[4];
    double scale[3];
    double matrix[12];
} parts;

static const vshi_key transform_keys[] = {
    {.name = "translate",
     .kind = VSHI_VECTOR,
     .offset = offsetof(parts, translate),
     .count = 3,
     .lowest = -VSHI_LARGEST,
     .highest = VSHI_LARGEST},
    {.name = "rotate_deg",
     .kind = VSHI_CUSTOM,
     .offset = offsetof(parts, rotation),
     .read = vshi_read_rotation},
    {.name = "rotate_quat",
     .kind = VSHI_VECTOR,
     .offset = offsetof(parts, rotation),
     .count = 4,
     .lowest = -VSHI_LARGEST,
     .highest = VSHI_LARGEST,
     .flags = VSHI_NONZERO},
    {.name = "scale", .kind = VSHI_CUSTOM, .offset = offsetof(parts, scale), .read = read_scale},
    {.name = "matrix",
     .kind = VSHI_VECTOR,
     .offset = offsetof(parts, matrix),
     .count = 12,
     .lowest = -VSHI_LARGEST,
     .highest = VSHI_LARGEST},
};
static const vshi_table transform_table = VSHI_TABLE(transform_keys);

/* Scale, then rotation, then translation. */
static void compose(const parts *p, double m[12]) {
    double q[4];
    double largest = 0.0;
    for (int i = 0; i < 4; ++i) {
        largest = fmax(largest, fabs(p->rotation[i]));
    }
    for (int i = 0; i < 4; ++i) {
        q[i] = p->rotation[i] / largest;
    }
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    const double length2 = x * x + y * y + z * z + w * w;
    const double rotation[9] = {
        w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z),         2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),         w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),         2.0 * (y * z + w * x),         w * w - x * x - y * y + z * z,
    };
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            m[row * 4 + column] = rotation[row * 3 + column] / length2 * p->scale[column];
        }
        m[row * 4 + 3] = p->translate[row];
    }
}

/* Column of the linear part: where an axis goes. */
static vshi_vec axis(const double m[12], int column) {
    return (vshi_vec){m[column], m[4 + column], m[8 + column]};
}

vsh_result vshi_read_transform(vshi_json *reader, const vshi_value *value, void *matrix) {
    parts p = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 1.0}, {1.0, 1.0, 1.0}, {0.0}};
    VSHI_TRY(vshi_read_object(reader, value, &transform_table, 1, "a transform", &p));
    VSHI_TRY(vshi_reject_both(reader, value, "rotate_deg", "rotate_quat"));
    static const char *const other[] = {"translate", "rotate_deg", "rotate_quat", "scale"};
    for (size_t i = 0; i < sizeof other / sizeof other[0]; ++i) {
        VSHI_TRY(vshi_reject_both(reader, value, "matrix", other[i]));
    }
    double *m = matrix;
    vshi_value given;
    if (!vshi_member(value, "matrix", &given)) {
        compose(&p, m);
        return VSH_OK;
    }
    memcpy(m, p.matrix, sizeof p.matrix);
    if (vshi_transform_flattens(m)) {
        return vshi_json_fail(reader, &given, "flattens: the determinant of its first three columns is 0");
    }
    return VSH_OK;
}

bool vshi_transform_is_similarity(const double m[12]) {
    const vshi_vec a[3] = {axis(m, 0), axis(m, 1), axis(m, 2)};
    const double length2 = vshi_dot(a[0], a[0]);
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        if (fabs(vshi_dot(a[i], a[i]) - length2) > SIMILARITY_TOLERANCE * length2 ||
            fabs(vshi_dot(a[i], a[j])) > SIMILARITY_TOLERANCE * length2) {
            return false;
        }
    }
    return true;
}

void vshi_transform_compose(const double outer[12], const double *inner, double result[12]) {
    if (inner == NULL) {
        memcpy(result, outer, 12 * sizeof *result);
        return;
    }
    for (int row = 0; row < 3; ++row) {
        const double *o = outer + 4 * row;
        for (int column = 0; column < 4; ++column) {
            result[4 * row + column] = o[0] * inner[column] + o[1] * inner[4 + column] +
                                       o[2] * inner[8 + column] + (column == 3 ? o[3] : 0.0);
        }
    }
}
