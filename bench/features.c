/* What each feature of a bake adds where it is on, and that it adds nothing where it is off: the cloister at
 * 512² and 256 voxels, one thread, each row in a process of its own. */
#include "bench.h"
#include "casts.h"
#include "scenes.h"

#include <malloc.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SIZE = 512, RESOLUTION = 256, MOST_LIGHTS = 2 };

static const double SUN[3] = {-0.5, 0.8, -0.6};
static const double SUN_ANGLE = 5.0 * 3.14159265358979323846 / 180.0;

typedef struct feature {
    const char *name;
    size_t lights;
    int32_t method, supersample, padding;
    double max_error;
    bool no_shadow, lamp, ao, error, irradiance, coverage, triangles;
    bool idle; /* options of everything that is off are set as if it were on: they may not matter */
} feature;

/* clang-format off */
static const feature FEATURES[] = {
    {.name = "baseline: one sun, cone", .lights = 1, .method = VSH_SHADOW_CONE},
    {.name = "same, options of all that is off", .lights = 1, .method = VSH_SHADOW_CONE, .idle = true},
    {.name = "nothing asked for", .lights = 1, .method = VSH_SHADOW_CONE, .no_shadow = true},
    {.name = "+ second sun", .lights = 2, .method = VSH_SHADOW_CONE},
    {.name = "a lamp instead", .lights = 1, .method = VSH_SHADOW_CONE, .lamp = true},
    {.name = "+ AO, 16 cones", .lights = 1, .method = VSH_SHADOW_CONE, .ao = true},
    {.name = "+ error plane", .lights = 1, .method = VSH_SHADOW_CONE, .error = true},
    {.name = "+ irradiance", .lights = 1, .method = VSH_SHADOW_CONE, .irradiance = true},
    {.name = "+ coverage", .lights = 1, .method = VSH_SHADOW_CONE, .coverage = true},
    {.name = "+ padding 16", .lights = 1, .method = VSH_SHADOW_CONE, .padding = 16},
    {.name = "+ supersample 2", .lights = 1, .method = VSH_SHADOW_CONE, .supersample = 2},
    {.name = "adaptive 0.02 instead", .lights = 1, .method = VSH_SHADOW_ADAPTIVE, .max_error = 0.02},
    {.name = "exact 0.02 instead", .lights = 1, .method = VSH_SHADOW_EXACT, .max_error = 0.02, .triangles = true},
    {.name = "exact 0.02, error plane", .lights = 1, .method = VSH_SHADOW_EXACT, .max_error = 0.02,
     .triangles = true, .error = true},
};
/* clang-format on */

/* Bytes of a line of /proc/self/status; 0 where there is none. */
static double status_bytes(const char *key) {
    FILE *file = fopen("/proc/self/status", "r");
    char line[256];
    double kilobytes = 0.0;
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        if (strncmp(line, key, strlen(key)) == 0) {
            kilobytes = atof(line + strlen(key) + 1);
        }
    }
    if (file != NULL) {
        fclose(file);
    }
    return 1024.0 * kilobytes;
}

/* Forgets the peak so far. */
static void reset_peak(void) {
    malloc_trim(0);
    FILE *file = fopen("/proc/self/clear_refs", "w");
    if (file != NULL) {
        fputs("5", file);
        fclose(file);
    }
}

static float *plane(size_t values) {
    float *memory = calloc(values, sizeof *memory); /* not touched yet: the bake's own memory counts it */
    if (memory == NULL) {
        exit(4);
    }
    return memory;
}

int bench_feature(int index) {
    const feature *f = &FEATURES[index];
    vsh_error error;
    vsh_run run = vsh_run_default();
    run.threads = 1;
    bench_scene scene;
    bench_scene_make(BENCH_CLOISTER, &scene);
    vsh_field *field = bench_scene_field(&scene, RESOLUTION);
    vsh_triangles *triangles = NULL;
    vsh_charts *charts = NULL;
    vsh_lightmap_options size = vsh_lightmap_options_default();
    size.width = size.height = SIZE;
    size.supersample = f->supersample > 0 ? f->supersample : 1;
    size.padding = f->padding;
    reset_peak();
    const double before = status_bytes("VmRSS:"), begin = bench_seconds();
    if (f->triangles) {
        bench_check(vsh_triangles_create(scene.meshes, scene.mesh_count, &run, &triangles, &error), &error);
    }
    const double tree = bench_seconds();
    bench_check(vsh_charts_create(scene.meshes, scene.mesh_count, &size, &run, NULL, &charts, &error),
                &error);
    const double rastered = bench_seconds();

    vsh_shade_options shade = vsh_shade_options_default();
    shade.method = f->method;
    shade.max_error = f->max_error > 0.0 ? f->max_error : shade.max_error;
    shade.ao_distance = 0.6;
    if (f->idle) {
        shade.ao_method = VSH_AO_RAYS;
        shade.ao_cones = 256;
        shade.rays = 4096;
        shade.max_error = 1e-4;
        shade.ao_distance = 1000.0;
    }
    vsh_light lights[MOST_LIGHTS] = {vsh_light_default(), vsh_light_default()};
    for (size_t i = 0; i < MOST_LIGHTS; ++i) {
        memcpy(lights[i].direction, SUN, sizeof SUN);
        lights[i].angle = SUN_ANGLE;
        snprintf(lights[i].name, sizeof lights[i].name, "light%zu", i);
        if (f->lamp) { /* where the sun is, ten units off, as wide as it */
            lights[i].type = VSH_LIGHT_SPHERE;
            lights[i].radius = 0.44;
            for (int k = 0; k < 3; ++k) {
                lights[i].position[k] = 10.0 * SUN[k] / 1.118033988749895;
            }
        }
    }
    lights[1].direction[2] = -lights[1].direction[2];
    const size_t values = (size_t)SIZE * SIZE;
    float *shadow[MOST_LIGHTS] = {plane(values), plane(values)}, *errors[MOST_LIGHTS] = {plane(values), NULL};
    const vsh_lightmap planes = {.shadow = f->no_shadow ? NULL : shadow,
                                 .ao = f->ao ? plane(values) : NULL,
                                 .irradiance = f->irradiance ? plane(3 * values) : NULL,
                                 .coverage = f->coverage ? plane(values) : NULL,
                                 .shadow_error = f->error ? errors : NULL};
    double seconds[BENCH_RUNS];
    double peak = 0.0;
    vsh_bake_stats stats;
    for (int i = 0; i < BENCH_RUNS; ++i) {
        stats = vsh_bake_stats_zero();
        const double start = bench_seconds();
        bench_check(vsh_bake_lightmap(bench_traced(field, triangles), charts, lights, f->lights, &shade, &run,
                                      &planes, &stats, &error),
                    &error);
        seconds[i] = bench_seconds() - start;
        peak = i == 0 ? status_bytes("VmHWM:") - before : peak;
    }
    printf("%.5f %.5f %.5f %.0f %llu %llu %llu\n", tree - begin, rastered - tree,
           bench_median(seconds, BENCH_RUNS), peak, (unsigned long long)stats.shade.marches,
           (unsigned long long)stats.shade.samples, (unsigned long long)stats.shade.rays);
    return 0; /* the process ends: its memory with it */
}

void bench_features_header(FILE *csv) {
    fputs("what,tree_s,texels_s,bake_s,bake_to_baseline,peak_bytes,marches,samples,rays\n", csv);
    printf("%-34s %8s %8s %8s %8s %10s %9s %10s %9s\n", "what", "tree s", "texels s", "bake s", "ratio",
           "peak MiB", "marches", "samples", "rays");
}

void bench_features(FILE *csv) {
    char self[4096], command[4352];
    const ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    if (length <= 0) {
        puts("features: this system does not tell where the program is: left out");
        return;
    }
    self[length] = '\0';
    double baseline = 0.0;
    unsigned long long base_marches = 0, base_samples = 0;
    for (size_t i = 0; i < sizeof FEATURES / sizeof FEATURES[0]; ++i) {
        if (FEATURES[i].triangles && !vsh_triangles_available()) {
            continue;
        }
        snprintf(command, sizeof command, "'%s' " BENCH_FEATURE " %zu", self, i);
        FILE *child = popen(command, "r");
        double tree, texels, bake, peak;
        unsigned long long marches, samples, rays;
        if (child == NULL || fscanf(child, "%lf %lf %lf %lf %llu %llu %llu", &tree, &texels, &bake, &peak,
                                    &marches, &samples, &rays) != 7) {
            fprintf(stderr, "features: %s failed\n", command);
            exit(2);
        }
        pclose(child);
        if (i == 0) {
            baseline = bake;
            base_marches = marches;
            base_samples = samples;
        }
        fprintf(csv, "\"%s\",%.5f,%.5f,%.5f,%.3f,%.0f,%llu,%llu,%llu\n", FEATURES[i].name, tree, texels, bake,
                bake / baseline, peak, marches, samples, rays);
        printf("%-34s %8.3f %8.3f %8.3f %8.2f %10.1f %9llu %10llu %9llu%s\n", FEATURES[i].name, tree, texels,
               bake, bake / baseline, peak / 1048576.0, marches, samples, rays,
               marches == base_marches && samples == base_samples ? "  as the baseline" : "");
        fflush(stdout);
    }
}
