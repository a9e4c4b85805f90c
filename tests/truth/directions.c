#include "directions.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

truth_frame truth_frame_around(const double direction[3]) {
    truth_frame frame;
    const double length =
        sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
    int least = 0;
    for (int i = 0; i < 3; i++) {
        frame.n[i] = direction[i] / length;
        least = fabs(frame.n[i]) < fabs(frame.n[least]) ? i : least;
    }
    /* u: the axis that n leans on least, made perpendicular; safe for every direction. */
    double square = 0.0;
    for (int i = 0; i < 3; i++) {
        frame.u[i] = (i == least ? 1.0 : 0.0) - frame.n[least] * frame.n[i];
        square += frame.u[i] * frame.u[i];
    }
    for (int i = 0; i < 3; i++) {
        frame.u[i] /= sqrt(square);
    }
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        frame.v[i] = frame.n[j] * frame.u[k] - frame.n[k] * frame.u[j];
    }
    return frame;
}

/* Point `index` of `count` in the unit disc, uniform in area: Vogel's spiral ("A better way to construct the
 * sunflower head", 1979), radii √((i+½)/n) so that every ring has its share. */
static void disc_point(size_t index, size_t count, double point[2]) {
    static const double golden_turn = 0.38196601125010515; /* 2 - φ, of a full turn */
    const double radius = sqrt(((double)index + 0.5) / (double)count);
    const double angle = 2.0 * pi * fmod((double)index * golden_turn, 1.0);
    point[0] = radius * cos(angle);
    point[1] = radius * sin(angle);
}

void truth_to_world(const truth_frame *frame, const double local[3], double direction[3]) {
    for (int i = 0; i < 3; i++) {
        direction[i] = local[0] * frame->u[i] + local[1] * frame->v[i] + local[2] * frame->n[i];
    }
}

void truth_light_direction(const truth_frame *frame, double w, size_t index, size_t count,
                           double direction[3]) {
    double point[2];
    disc_point(index, count, point);
    const double scale = 1.0 / sqrt(1.0 + w * w * (point[0] * point[0] + point[1] * point[1]));
    truth_to_world(frame, (double[]){scale * w * point[0], scale * w * point[1], scale}, direction);
}

void truth_cosine_direction(const truth_frame *frame, size_t index, size_t count, double direction[3]) {
    double point[2];
    disc_point(index, count, point);
    const double up = sqrt(fmax(0.0, 1.0 - point[0] * point[0] - point[1] * point[1]));
    truth_to_world(frame, (double[]){point[0], point[1], up}, direction);
}

double truth_disc_share(double x) {
    x = fmin(1.0, fmax(-1.0, x));
    return 0.5 + (x * sqrt(1.0 - x * x) + asin(x)) / pi;
}
