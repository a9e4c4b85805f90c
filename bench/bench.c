#include "bench.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

double bench_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

void *bench_take(size_t bytes) {
    void *memory = malloc(bytes > 0 ? bytes : 1);
    if (memory == NULL) {
        fputs("bench: the system refused memory\n", stderr);
        exit(4);
    }
    return memory;
}

static int ascending(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double bench_median(double *seconds, size_t count) {
    qsort(seconds, count, sizeof *seconds, ascending);
    return seconds[count / 2];
}

double bench_seconds_for(double error, const double *errors, const double *seconds, size_t count) {
    size_t i = 0;
    while (i + 2 < count && errors[i + 1] > error) {
        ++i;
    }
    const double part = log(error / errors[i]) / log(errors[i + 1] / errors[i]);
    return seconds[i] * pow(seconds[i + 1] / seconds[i], part);
}

void bench_check(vsh_result result, const vsh_error *error) {
    if (result != VSH_OK) {
        fprintf(stderr, "bench: %s: %s\n", vsh_result_name(result), error->message);
        exit(2);
    }
}

void bench_header(FILE *csv) {
    fprintf(csv, "scene,what,us_per_texel,samples_per_texel,embree_rays,rmse,penumbra_rmse,bias,p99,max\n");
    printf("%-9s %-20s %9s %9s %12s %8s %8s %8s %7s %7s\n", "scene", "what", "us/texel", "samples",
           "Embree rays", "rmse", "penumbra", "bias", "p99", "max");
}

void bench_row(FILE *csv, const char *scene, const char *what, double microseconds, double samples,
               double embree_rays, const truth_metrics *e) {
    fprintf(csv, "%s,%s,%.4f,%.1f,%.2f,%.5f,%.5f,%.5f,%.4f,%.4f\n", scene, what, microseconds, samples,
            embree_rays, e->rmse, e->penumbra_rmse, e->bias, e->p99, e->max);
    printf("%-9s %-20s %9.3f %9.1f %12.2f %8.4f %8.4f %8.4f %7.3f %7.3f\n", scene, what, microseconds,
           samples, embree_rays, e->rmse, e->penumbra_rmse, e->bias, e->p99, e->max);
    fflush(stdout);
}

/* Light NULL: AO. */
static double shade_seconds(int runs, const vsh_field *field, const vsh_points *points,
                            const vsh_light *light, const vsh_shade_options *shade, float *values,
                            float *deviation, vsh_shade_stats *stats) {
    double seconds[BENCH_RUNS];
    vsh_run run = vsh_run_default();
    run.threads = 1;
    vsh_error error;
    for (int i = 0; i < runs; ++i) {
        *stats = vsh_shade_stats_zero();
        const double start = bench_seconds();
        bench_check(
            light != NULL
                ? vsh_shade_shadow(field, points, light, shade, &run, values, deviation, stats, &error)
                : vsh_shade_ao(field, points, shade, &run, values, deviation, stats, &error),
            &error);
        seconds[i] = bench_seconds() - start;
    }
    return bench_median(seconds, (size_t)runs);
}

double bench_shadow(int runs, const vsh_field *field, const vsh_points *points, const vsh_light *light,
                    const vsh_shade_options *shade, float *values, float *deviation, vsh_shade_stats *stats) {
    return shade_seconds(runs, field, points, light, shade, values, deviation, stats);
}

double bench_ao(int runs, const vsh_field *field, const vsh_points *points, const vsh_shade_options *shade,
                float *values, vsh_shade_stats *stats) {
    return shade_seconds(runs, field, points, NULL, shade, values, NULL, stats);
}

void bench_methods(FILE *csv, const char *scene, const vsh_field *field, const vsh_points *points,
                   const vsh_light *light, double ray, const float *truth, const float *valid,
                   float *values) {
    for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
        vsh_shade_options shade = vsh_shade_options_default();
        shade.method = method;
        vsh_shade_stats stats;
        const double each = bench_shadow(BENCH_RUNS, field, points, light, &shade, values, NULL, &stats) /
                            (double)points->count;
        const truth_metrics metrics = truth_compare(points->count, values, truth, valid);
        bench_row(csv, scene, vsh_shadow_method_name(method), 1e6 * each,
                  (double)stats.samples / (double)points->count, ray > 0.0 ? each / ray : 0.0, &metrics);
    }
}

int main(int argc, char **argv) {
    FILE *csv = argc > 1 ? fopen(argv[1], "w") : tmpfile();
    const char *only = argc > 2 ? argv[2] : NULL; /* one of the parts */
    if (csv == NULL) {
        perror(argc > 1 ? argv[1] : "bench");
        return 3;
    }
    puts("One core; medians of 5 runs. 'Embree rays': how many Embree occlusion rays take the same time.");
    bench_header(csv);
    const struct {
        const char *name;
        void (*run)(FILE *csv);
    } parts[] = {{"seeds", bench_seeds},
                 {"asset", bench_asset},
                 {"ao", bench_ao_lightmaps},
                 {"refine", bench_refine},
                 {"proofs", bench_proofs},
                 {"points", bench_points}};
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; ++i) {
        if (only == NULL || strcmp(only, parts[i].name) == 0) {
            parts[i].run(csv);
        }
    }
    return fclose(csv) == 0 ? 0 : 3;
}
