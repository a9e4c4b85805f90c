/* A disc's slices by azimuth. In the plane that touches the unit sphere at the light's centre, directions of
 * one azimuth lie on a line through the zenith's image, cot(elevation) above the centre, and area between two
 * such lines grows with the distance from there. Chords at the nodes of Gauss and Chebyshev's quadrature (of
 * the second kind, whose weight √(1 - x²) is a chord's length) then integrate over the disc. Where the zenith
 * is within the disc, slices are sectors around it. */
#include "heightfield/slices.h"

#include "base/elementary.h"

#include <math.h>

static const double PI = 3.14159265358979323846;
static const double STEEP = 1e18; /* a slope beyond all others, that floats still multiply */

static double clamp_slope(double slope) {
    return fmin(fmax(slope, -STEEP), STEEP);
}

static double slope_at(const vshi_slices *s, double u, double v) {
    const double along = s->cosine - v * s->sine, up = s->sine + v * s->cosine;
    return clamp_slope(up / fmax(sqrt(along * along + u * u), 1.0 / STEEP));
}

static void set_chord(vshi_slices *s, int k, double radius) {
    const double angle = PI * (k + 1) / (VSHI_FAN + 1), x = vshi_cos(angle), tangent = s->sine / s->cosine;
    vshi_slice *slice = &s->slice[k];
    slice->sine = radius * x * tangent;
    slice->cosine = sqrt((1.0 - slice->sine) * (1.0 + slice->sine));
    slice->middle = radius * x * slice->sine;
    slice->half = radius * vshi_sin(angle);
    slice->spread = slice->half * tangent / slice->cosine;
    slice->weight = vshi_sin(angle) * vshi_sin(angle) * 2.0 / (VSHI_FAN + 1);
    const double u = radius * x * slice->cosine, along = s->cosine - slice->middle * s->sine;
    const double length = sqrt(along * along + u * u);
    slice->azimuth = along / length;
    s->x[k] = along / length;
    s->z[k] = u / length;
    const double across = slice->half * slice->sine, up = slice->half * slice->cosine;
    slice->top = slope_at(s, u - across, slice->middle + up);
    slice->bottom = slope_at(s, u + across, slice->middle - up);
}

static void set_sector(vshi_slices *s, int k, double radius) {
    const double angle = 2.0 * PI * (k + 0.5) / VSHI_FAN, zenith = s->cosine / s->sine;
    vshi_slice *slice = &s->slice[k];
    slice->sine = vshi_sin(angle);
    slice->cosine = vshi_cos(angle);
    const double across = zenith * slice->sine;
    slice->half = zenith * slice->cosine + sqrt(fmax(radius * radius - across * across, 0.0));
    slice->weight = slice->half * slice->half / (VSHI_FAN * radius * radius);
    const double along = s->sine * slice->cosine;
    slice->azimuth = sqrt(along * along + slice->sine * slice->sine);
    s->x[k] = along / slice->azimuth;
    s->z[k] = slice->sine / slice->azimuth;
    const double edge = (1.0 / s->sine - slice->half * slice->cosine * s->cosine) /
                        fmax(slice->half * slice->azimuth, 1.0 / STEEP);
    slice->top = s->sine > 0.0 ? STEEP : clamp_slope(edge);
    slice->bottom = s->sine > 0.0 ? clamp_slope(edge) : -STEEP;
}

double vshi_slice_above(const vshi_slices *s, int k, double slope) {
    const vshi_slice *slice = &s->slice[k];
    if (slope <= slice->bottom) {
        return 1.0;
    }
    if (slope >= slice->top) {
        return 0.0;
    }
    if (s->polar) {
        const double fall = s->sine * (slope * slice->azimuth + slice->cosine * s->cosine);
        const double part = fall > 0.0 ? fmin(1.0 / (fall * slice->half), 1.0) : 1.0;
        return s->sine > 0.0 ? part * part : 1.0 - part * part;
    }
    const double v =
        (slope * s->cosine - s->sine * slice->azimuth) / (slice->azimuth * s->cosine + slope * s->sine);
    const double q = fmin(fmax((slice->middle - v) / (slice->cosine * slice->half), -1.0), 1.0);
    return 0.5 * (q + 1.0) + 0.25 * slice->spread * (q * q - 1.0);
}

/* How far along the ground a slice's directions go within `far`: those of its middle. */
static double ground(const vshi_slices *s, int k, double far) {
    const vshi_slice *slice = &s->slice[k];
    double slope = slice->bottom;
    if (!s->polar) {
        const double top = slice->top < STEEP ? slice->top : slice->bottom;
        slope = 0.5 * (top + slice->bottom);
    }
    return far / sqrt(1.0 + slope * slope);
}

void vshi_slices_make(vshi_vec axis, double radius, double far, vshi_slices *s) {
    const double level = sqrt(axis.x * axis.x + axis.z * axis.z);
    const double ax = level > 0.0 ? axis.x / level : 1.0, az = level > 0.0 ? axis.z / level : 0.0;
    double total = 0.0;
    s->sine = axis.y;
    s->cosine = level;
    s->hard = !(radius > 0.0);
    s->polar = !s->hard && radius * fabs(axis.y) >= level;
    s->fan.range = 0.0f;
    for (int k = 0; k < VSHI_FAN; ++k) {
        vshi_slice *slice = &s->slice[k];
        if (s->hard) {
            *slice = (vshi_slice){.weight = k == 0 ? 1.0 : 0.0};
            slice->top = slice->bottom = clamp_slope(axis.y / fmax(level, 1.0 / STEEP));
            s->x[k] = 1.0;
            s->z[k] = 0.0;
        } else if (s->polar) {
            set_sector(s, k, radius);
        } else {
            set_chord(s, k, radius);
        }
        total += slice->weight;
        const double x = ax * s->x[k] - az * s->z[k], z = az * s->x[k] + ax * s->z[k];
        s->x[k] = x;
        s->z[k] = z;
        vshi_fan_set(&s->fan, k, x, z);
        s->fan.far[k] = s->hard && k > 0 ? -1.0f : (float)fmin(ground(s, k, far), STEEP);
        s->fan.slope[k] = (float)slice->bottom;
        s->fan.enough[k] = s->hard ? nextafterf((float)slice->top, INFINITY) : (float)slice->top;
    }
    for (int k = 0; k < VSHI_FAN; ++k) {
        s->slice[k].weight /= total;
    }
}
