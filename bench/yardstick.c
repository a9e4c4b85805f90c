#include "yardstick.h"

#include "bench.h"

#include <math.h>
#include <stdlib.h>

enum { STANDARD = 16 };

static double seconds_of(const truth_mesh *mesh, int packing, const truth_question *question, int runs,
                         float *values) {
    double seconds[BENCH_RUNS];
    for (int i = 0; i < runs; ++i) {
        const double start = bench_seconds();
        if (truth_mesh_packets(mesh, packing, question, 1, values) != 0) {
            fputs("bench: Embree refused\n", stderr);
            exit(2);
        }
        seconds[i] = bench_seconds() - start;
    }
    return bench_median(seconds, (size_t)runs);
}

/* The fastest way for a number of rays: few rays of a point do not fill a packet. */
static int fastest(const truth_mesh *mesh, const truth_question *question, int runs, double *least,
                   double each[TRUTH_PACKINGS], float *values) {
    int best = 0;
    for (int packing = 0; packing < TRUTH_PACKINGS; ++packing) {
        each[packing] = seconds_of(mesh, packing, question, runs, values);
        best = each[packing] < each[best] ? packing : best;
    }
    *least = each[best];
    return best;
}

bench_curve bench_embree(FILE *csv, const char *scene, const truth_mesh *mesh, const truth_question *asked,
                         const float *truth, const float *valid, float *values) {
    truth_question question = *asked;
    bench_curve curve;
    double each[TRUTH_PACKINGS];
    const double count = (double)question.count;
    question.rays = STANDARD;
    curve.packing = fastest(mesh, &question, BENCH_RUNS, &curve.ray, each, values);
    curve.ray /= count * STANDARD;
    printf("%-9s Embree, ns a ray:", scene);
    for (int packing = 0; packing < TRUTH_PACKINGS; ++packing) {
        printf("%s %.1f %s", packing > 0 ? "," : "", 1e9 * each[packing] / (count * STANDARD),
               truth_packing_name(packing));
    }
    printf("; fastest: %s\n", truth_packing_name(curve.packing));
    for (int i = 0; i < BENCH_CURVE; ++i) {
        question.rays = (size_t)1 << (2 * i);
        const int packing = fastest(mesh, &question, i < 3 ? BENCH_RUNS : 1, &curve.seconds[i], each, values);
        truth_mesh_packets(mesh, packing, &question, 0, values);
        const truth_metrics metrics = truth_compare(question.count, values, truth, valid);
        curve.error[i] = metrics.rmse;
        char what[64];
        snprintf(what, sizeof what, "embree %s%zu", question.towards == NULL ? "ao " : "", question.rays);
        bench_row(csv, scene, what, 1e6 * curve.seconds[i] / count, 0.0, curve.seconds[i] / count / curve.ray,
                  &metrics);
    }
    return curve;
}

double bench_embree_seconds(const bench_curve *curve, double error) {
    int i = 0;
    while (i + 2 < BENCH_CURVE && curve->error[i + 1] > error) {
        ++i;
    }
    const double part = log(error / curve->error[i]) / log(curve->error[i + 1] / curve->error[i]);
    return curve->seconds[i] * pow(curve->seconds[i + 1] / curve->seconds[i], part);
}
