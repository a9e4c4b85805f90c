#include "base/vec.h"

#include "base/elementary.h"
#include "base/error.h"

#include <string.h>

/* Relative difference of axis lengths, and cosine between axes, up to which a transform counts as a
 * similarity. Composing a few rotations that were written with six digits leaves such errors. */
static const double SIMILARITY_TOLERANCE = 1e-4;

/* A linear part whose unit columns span less volume than this makes shapes flat: their third direction is
 * mostly rounding. */
static const double FLATTENING_VOLUME = 1e-12;

const double vshi_identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

void vshi_transform_compose(const double outer[12], const double inner[12], double result[12]) {
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 4; ++column) {
            double sum = column == 3 ? outer[4 * row + 3] : 0.0;
            for (int k = 0; k < 3; ++k) {
                sum += outer[4 * row + k] * inner[4 * k + column];
            }
            result[4 * row + column] = sum;
        }
    }
}

double vshi_similarity_scale(const double m[12]) {
    const vshi_vec x = {m[0], m[4], m[8]};
    const vshi_vec y = {m[1], m[5], m[9]};
    const vshi_vec z = {m[2], m[6], m[10]};
    const double scale = vshi_cbrt(fabs(vshi_transform_determinant(m)));
    if (!(scale > 0.0) || !isfinite(scale)) {
        return 0.0;
    }
    const double lengths[3] = {vshi_length(x), vshi_length(y), vshi_length(z)};
    const double cosines[3] = {vshi_dot(x, y), vshi_dot(y, z), vshi_dot(z, x)};
    for (int i = 0; i < 3; ++i) {
        if (!(fabs(lengths[i] / scale - 1.0) <= SIMILARITY_TOLERANCE) ||
            !(fabs(cosines[i]) / (scale * scale) <= SIMILARITY_TOLERANCE)) {
            return 0.0;
        }
    }
    return scale;
}

vsh_result vshi_similarity_check(const double *m, const char *what, double *scale, vsh_error *error) {
    *scale = m != NULL ? vshi_similarity_scale(m) : 1.0;
    if (!(*scale > 0.0) || (m != NULL && !vshi_finite((vshi_vec){m[3], m[7], m[11]}))) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "%s: the transform must be finite and neither shear, scale unevenly nor flatten",
                         what);
    }
    return VSH_OK;
}

bool vshi_transform_flattens(const double m[12]) {
    const vshi_vec x = vshi_unit((vshi_vec){m[0], m[4], m[8]});
    const vshi_vec y = vshi_unit((vshi_vec){m[1], m[5], m[9]});
    const vshi_vec z = vshi_unit((vshi_vec){m[2], m[6], m[10]});
    /* The determinant itself decides about mirroring, so it must not underflow or overflow either. */
    const double determinant = vshi_transform_determinant(m);
    return !(fabs(vshi_dot(x, vshi_cross(y, z))) > FLATTENING_VOLUME) || determinant == 0.0 ||
           !isfinite(determinant);
}

/* Starts from the largest component, so that nothing cancels (S. W. Shepperd, "Quaternion from rotation
 * matrix", 1978). */
void vshi_similarity_rotation(const double m[12], double scale, double q[4]) {
    double r[3][3];
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            r[row][column] = m[4 * row + column] / scale;
        }
    }
    const double trace = r[0][0] + r[1][1] + r[2][2];
    int i = r[1][1] > r[0][0] ? 1 : 0;
    i = r[2][2] > r[i][i] ? 2 : i;
    if (trace >= r[i][i]) {
        const double w = 0.5 * sqrt(fmax(0.0, 1.0 + trace));
        q[0] = 0.25 * (r[2][1] - r[1][2]) / w;
        q[1] = 0.25 * (r[0][2] - r[2][0]) / w;
        q[2] = 0.25 * (r[1][0] - r[0][1]) / w;
        q[3] = w;
        return;
    }
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    const double largest = 0.5 * sqrt(fmax(0.0, 1.0 + r[i][i] - r[j][j] - r[k][k]));
    q[i] = largest;
    q[j] = 0.25 * (r[j][i] + r[i][j]) / largest;
    q[k] = 0.25 * (r[k][i] + r[i][k]) / largest;
    q[3] = 0.25 * (r[k][j] - r[j][k]) / largest;
}

void vshi_quaternion_multiply(const double a[4], const double b[4], double result[4]) {
    const double product[4] = {
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
        a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    };
    memcpy(result, product, sizeof product);
}
