#include "bench.h"
#include "casts.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

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

void bench_ratio(FILE *csv, const char *part, const char *scene, const char *what, const char *other,
                 int threads, double ours, double theirs, double difference) {
    const char *on = threads == 1 ? "one" : "all";
    fprintf(csv, "%s,%s,%s,%s,%s,%.5f,%.5f,%.2f,%.6f\n", part, scene, what, other, on, ours, theirs,
            theirs / ours, difference);
    printf("%-9s %-16s %-24s %-5s %10.4f %10.4f %8.1f %10.5f\n", scene, what, other, on, ours, theirs,
           theirs / ours, difference);
    fflush(stdout);
}

/* Light NULL: AO. */
static double shade_seconds(int runs, const vsh_occluders *occluders, const vsh_points *points,
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
                ? vsh_shade_shadow(occluders, points, light, shade, &run, values, deviation, stats, &error)
                : vsh_shade_ao(occluders, points, shade, &run, values, deviation, NULL, stats, &error),
            &error);
        seconds[i] = bench_seconds() - start;
    }
    return bench_median(seconds, (size_t)runs);
}

double bench_shadow(int runs, const vsh_occluders *occluders, const vsh_points *points,
                    const vsh_light *light, const vsh_shade_options *shade, float *values, float *deviation,
                    vsh_shade_stats *stats) {
    return shade_seconds(runs, occluders, points, light, shade, values, deviation, stats);
}

double bench_ao(int runs, const vsh_occluders *occluders, const vsh_points *points,
                const vsh_shade_options *shade, float *values, vsh_shade_stats *stats) {
    return shade_seconds(runs, occluders, points, NULL, shade, values, NULL, stats);
}

void bench_methods(FILE *csv, const char *scene, const vsh_field *field, const vsh_points *points,
                   const vsh_light *light, double ray, const float *truth, const float *valid,
                   float *values) {
    for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
        vsh_shade_options shade = vsh_shade_options_default();
        shade.method = method;
        vsh_shade_stats stats;
        const double each =
            bench_shadow(BENCH_RUNS, bench_casts(field), points, light, &shade, values, NULL, &stats) /
            (double)points->count;
        const truth_metrics metrics = truth_compare(points->count, values, truth, valid);
        bench_row(csv, scene, vsh_get_name(VSH_NAMES_SHADOW, method), 1e6 * each,
                  (double)stats.samples / (double)points->count, ray > 0.0 ? each / ray : 0.0, &metrics);
    }
}

static void ratio_header(FILE *csv) {
    fputs("part,scene,what,other,cores,us,other_us,ratio,difference\n", csv);
    printf("%-9s %-16s %-24s %-5s %10s %10s %8s %10s\n", "scene", "what", "other", "cores", "us", "other us",
           "ratio", "difference");
}

/* Parts whose rows have other columns have a file of their own: FILE.csv's name with the suffix before its
 * last dot. */
typedef struct table {
    const char *suffix;
    void (*header)(FILE *csv);
    FILE *csv; /* NULL: not begun */
} table;

static table tables[] = {{"", bench_header, NULL},
                         {"-ratios", ratio_header, NULL},
                         {"-scaling", bench_scaling_header, NULL},
                         {"-features", bench_features_header, NULL},
                         {"-read", bench_read_header, NULL},
                         {"-levelset", bench_levelset_header, NULL}};

static table *table_of(const char *part) {
    static const struct {
        const char *part, *suffix;
    } others[] = {{"intersector", "-ratios"}, {"nanovdb", "-ratios"},    {"cores", "-ratios"},
                  {"scaling", "-scaling"},    {"features", "-features"}, {"read", "-read"},
                  {"levelset", "-levelset"}};
    const char *suffix = "";
    for (size_t i = 0; i < sizeof others / sizeof others[0]; ++i) {
        suffix = strcmp(part, others[i].part) == 0 ? others[i].suffix : suffix;
    }
    size_t t = 0;
    while (strcmp(tables[t].suffix, suffix) != 0) {
        ++t;
    }
    return &tables[t];
}

static FILE *begin_table(table *t, const char *path) {
    char name[4096];
    if (t->csv == NULL && path != NULL) {
        const char *dot = strrchr(path, '.'), *slash = strrchr(path, '/');
        const size_t stem =
            dot != NULL && (slash == NULL || dot > slash) ? (size_t)(dot - path) : strlen(path);
        snprintf(name, sizeof name, "%.*s%s%s", (int)stem, path, t->suffix, path + stem);
    }
    const bool begun = t->csv != NULL;
    t->csv = begun ? t->csv : path != NULL ? fopen(name, "w") : tmpfile();
    if (t->csv == NULL) {
        perror(path != NULL ? name : "bench");
        exit(3);
    }
    if (!begun) {
        t->header(t->csv);
    }
    return t->csv;
}

int main(int argc, char **argv) {
    const int served = vsh_reader_serve(argc, argv);
    if (served >= 0) {
        _exit(served);
    }
    const char *path = argc > 1 ? argv[1] : NULL;
    const char *only = argc > 2 ? argv[2] : NULL; /* one of the parts */
    if (argc == 3 && strcmp(argv[1], BENCH_FEATURE) == 0) {
        return bench_feature(atoi(argv[2]));
    }
    puts("One core; medians of 5 runs. 'Embree rays': how many Embree occlusion rays take the same time.");
    const struct {
        const char *name;
        void (*run)(FILE *csv);
    } parts[] = {{"seeds", bench_seeds},
                 {"asset", bench_asset},
                 {"shadow", bench_shadow_lightmaps},
                 {"ao", bench_ao_lightmaps},
                 {"refine", bench_refine},
                 {"proofs", bench_proofs},
                 {"points", bench_points},
                 {"intersector", bench_intersector},
                 {"nanovdb", bench_nanovdb},
                 {"cores", bench_all_cores},
                 {"scaling", bench_scaling},
                 {"features", bench_features},
                 {"read", bench_read},
                 {"levelset", bench_levelset}};
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; ++i) {
        if (only == NULL || strcmp(only, parts[i].name) == 0) {
            parts[i].run(begin_table(table_of(parts[i].name), path));
        }
    }
    bool written = true;
    for (size_t t = 0; t < sizeof tables / sizeof tables[0]; ++t) {
        written = (tables[t].csv == NULL || fclose(tables[t].csv) == 0) && written;
    }
    return written ? 0 : 3;
}
