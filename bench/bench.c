#include "bench.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

double bench_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int ascending(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double bench_median(double *seconds, size_t count) {
    qsort(seconds, count, sizeof *seconds, ascending);
    return seconds[count / 2];
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
    } parts[] = {
        {"seeds", bench_seeds}, {"asset", bench_asset}, {"refine", bench_refine}, {"proofs", bench_proofs}};
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; ++i) {
        if (only == NULL || strcmp(only, parts[i].name) == 0) {
            parts[i].run(csv);
        }
    }
    return fclose(csv) == 0 ? 0 : 3;
}
