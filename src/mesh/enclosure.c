/* Generalized winding numbers (A. Jacobson, L. Kavan, O. Sorkine-Hornung, "Robust inside-outside segmentation
 * using generalized winding numbers", 2013): the sum of the triangles' solid angles over the whole sphere's.
 */
#include "mesh/solidity_parts.h"

#include "base/elementary.h"

static const double PI = 3.14159265358979323846;

/* Points of a surface that its enclosing is told from; fewer where it has many open edges, so that no more
 * solid angles are summed than this. */
enum { MOST_SAMPLES = 128, FEWEST_SAMPLES = 16, MOST_ANGLES = 1 << 21 };

void vshi_part_corners(const vshi_surface_part *part, size_t at, vshi_vec corner[3]) {
    const uint32_t i = part->list[at];
    vshi_mesh_triangle(part->mesh, i, corner);
    if (part->turned[i]) {
        const vshi_vec swapped = corner[1];
        corner[1] = corner[2];
        corner[2] = swapped;
    }
}

/* A. van Oosterom and J. Strackee, "The solid angle of a plane triangle", 1983. */
double vshi_solid_angle(const vshi_vec corner[3], vshi_vec point) {
    const vshi_vec a = vshi_sub(corner[0], point), b = vshi_sub(corner[1], point),
                   c = vshi_sub(corner[2], point);
    const double la = vshi_length(a), lb = vshi_length(b), lc = vshi_length(c);
    const double over = vshi_dot(a, vshi_cross(b, c));
    if (over == 0.0) { /* in its plane: on it, half of the sphere on either side */
        return 0.0;
    }
    return 2.0 *
           vshi_atan2(over, la * lb * lc + vshi_dot(a, b) * lc + vshi_dot(b, c) * la + vshi_dot(c, a) * lb);
}

double vshi_winding(const vshi_surface_part *part, vshi_vec point) {
    double sum = 0.0;
    for (size_t at = 0; at < part->count; ++at) {
        vshi_vec corner[3];
        vshi_part_corners(part, at, corner);
        sum += vshi_solid_angle(corner, point);
    }
    return sum / (4.0 * PI);
}

/* The fractions of the additive sequence of the plastic number (M. Roberts, 2018). */
vshi_vec vshi_point_in(const vshi_vec corner[3], size_t number) {
    double u = 0.5 + 0.7548776662466927 * (double)number, v = 0.5 + 0.5698402909980532 * (double)number;
    u -= floor(u);
    v -= floor(v);
    if (u + v > 1.0) {
        u = 1.0 - u;
        v = 1.0 - v;
    }
    return vshi_add(corner[0], vshi_add(vshi_scale(vshi_sub(corner[1], corner[0]), u),
                                        vshi_scale(vshi_sub(corner[2], corner[0]), v)));
}

void vshi_part_samples(const vshi_surface_part *part, double area, size_t count, vshi_vec *samples) {
    double reached = 0.0;
    size_t next = 0;
    vshi_vec corner[3] = {{0.0, 0.0, 0.0}};
    for (size_t at = 0; at < part->count && next < count; ++at) {
        vshi_part_corners(part, at, corner);
        reached +=
            0.5 * vshi_length(vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0])));
        while (next < count && reached >= area * ((double)next + 0.5) / (double)count) {
            samples[next] = vshi_point_in(corner, next);
            ++next;
        }
    }
    for (; next < count; ++next) { /* rounding */
        samples[next] = vshi_point_in(corner, next);
    }
}

/* A surface and what closes it go around a point a whole number of times, so that what the surface itself
 * lacks of one is what its caps go around it: only those need to be summed. */
double vshi_part_encloses(const vshi_surface_part *part, double area, const vshi_vec (*caps)[3],
                          size_t cap_count) {
    if (cap_count == 0) {
        return 1.0;
    }
    vshi_vec samples[MOST_SAMPLES];
    size_t count = MOST_ANGLES / cap_count;
    count = count < FEWEST_SAMPLES ? FEWEST_SAMPLES : count > MOST_SAMPLES ? MOST_SAMPLES : count;
    vshi_part_samples(part, area, count, samples);
    double lacking = 0.0;
    for (size_t i = 0; i < count; ++i) {
        double sum = 0.0;
        for (size_t k = 0; k < cap_count; ++k) {
            sum += vshi_solid_angle(caps[k], samples[i]);
        }
        sum /= 4.0 * PI;
        lacking += fabs(sum - floor(sum + 0.5));
    }
    return 1.0 - lacking / (double)count;
}
