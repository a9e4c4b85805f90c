/* Lightmaps at 512 voxels against Embree's own rays, on an asset, a smooth mesh and a thin structure: whole
 * bakes of 1024², of the sun's shadow and of AO, compared at runs of texels all over them; one thread for
 * both sides. */
#include "bench.h"
#include "casts.h"
#include "scenes.h"
#include "yardstick.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 1024, RESOLUTION = 512, RUN = 64, APART = 23, TRUTH_RAYS = 4096 };

static const double AO_DISTANCE = 0.6, LIFT = 1e-5;

static const double SUN[3] = {-0.5, 0.8, -0.6};
static const double SUN_ANGLE = 5.0 * 3.14159265358979323846 / 180.0;

typedef struct ladder_step {
    const char *name;
    int32_t method, count; /* of AO's cones, or rays */
    double max_error;
    int32_t spacing; /* of AO */
} ladder_step;

static const ladder_step SHADOW[] = {{"cone", VSH_SHADOW_CONE, 1, 1.0, 1},
                                     {"adaptive 0.05", VSH_SHADOW_ADAPTIVE, 4096, 0.05, 1},
                                     {"adaptive 0.01", VSH_SHADOW_ADAPTIVE, 4096, 0.01, 1},
                                     {"exact 0.1", VSH_SHADOW_EXACT, 4096, 0.1, 1},
                                     {"exact 0.05", VSH_SHADOW_EXACT, 4096, 0.05, 1},
                                     {"exact 0.02", VSH_SHADOW_EXACT, 4096, 0.02, 1},
                                     {"exact 0.01", VSH_SHADOW_EXACT, 4096, 0.01, 1}};

static const ladder_step AO[] = {{"ao cones 16, 1", VSH_AO_CONES, 16, 1.0, 1},
                                 {"ao cones 8", VSH_AO_CONES, 8, 1.0, 4},
                                 {"ao cones 16", VSH_AO_CONES, 16, 1.0, 4},
                                 {"ao cones 16, 8", VSH_AO_CONES, 16, 1.0, 8},
                                 {"ao cones 32", VSH_AO_CONES, 32, 1.0, 4},
                                 {"ao cones 64", VSH_AO_CONES, 64, 1.0, 4},
                                 {"ao adaptive 0.02", VSH_AO_ADAPTIVE, 4096, 0.02, 4},
                                 {"ao exact 0.2", VSH_AO_EXACT, 4096, 0.2, 4},
                                 {"ao exact 0.2, 8", VSH_AO_EXACT, 4096, 0.2, 8},
                                 {"ao exact 0.1", VSH_AO_EXACT, 4096, 0.1, 4},
                                 {"ao exact 0.1, 8", VSH_AO_EXACT, 4096, 0.1, 8},
                                 {"ao exact 0.05, 1", VSH_AO_EXACT, 4096, 0.05, 1},
                                 {"ao exact 0.05", VSH_AO_EXACT, 4096, 0.05, 4},
                                 {"ao exact 0.02, 1", VSH_AO_EXACT, 4096, 0.02, 1},
                                 {"ao exact 0.02", VSH_AO_EXACT, 4096, 0.02, 4},
                                 {"ao exact 0.02, 8", VSH_AO_EXACT, 4096, 0.02, 8},
                                 {"ao exact 0.01", VSH_AO_EXACT, 4096, 0.01, 4}};

/* Of the sun's shadow, or of AO. */
static void measure(FILE *csv, const bench_scene *scene, bool sunlit, const ladder_step *ladder,
                    size_t steps) {
    vsh_error error;
    vsh_field *field = bench_scene_field(scene, RESOLUTION);
    vsh_triangles *triangles = NULL;
    bench_check(vsh_triangles_create(scene->meshes, scene->mesh_count, NULL, &triangles, &error), &error);
    truth_mesh *mesh = truth_mesh_create(scene->meshes, scene->mesh_count);
    if (mesh == NULL) {
        puts("ao: no Embree, no truth");
        exit(2);
    }
    vsh_lightmap_options size = vsh_lightmap_options_default();
    size.width = size.height = SIZE;
    vsh_run run = vsh_run_default();
    run.threads = 1;
    vsh_charts *charts;
    bench_check(vsh_charts_create(scene->meshes, scene->mesh_count, &size, &run, NULL, &charts, &error),
                &error);
    vsh_texels *texels = bench_texels(charts);
    const vsh_texel_samples samples = vsh_texels_samples(texels);
    const size_t most = samples.count / APART + RUN;
    double *origins = bench_take(most * 3 * sizeof *origins);
    float *normals = bench_take(most * 4 * sizeof *normals), *truth = bench_take(most * 3 * sizeof *truth);
    float *values = truth + most, *valid = truth + 2 * most;
    uint32_t *at = bench_take(most * sizeof *at);
    float *plane = bench_take((size_t)3 * SIZE * SIZE * sizeof *plane);
    float *coverage = plane + (size_t)SIZE * SIZE, *deviation = plane + (size_t)2 * SIZE * SIZE;
    size_t count = 0;
    for (size_t i = 0; i < samples.count; ++i) {
        if (i / RUN % APART != 0) {
            continue;
        }
        for (size_t k = 0; k < 3; ++k) {
            normals[3 * count + k] = samples.normals[3 * i + k];
            origins[3 * count + k] =
                samples.positions[3 * i + k] + LIFT * (double)samples.geometric_normals[3 * i + k];
        }
        at[count++] = (uint32_t)vsh_texel_place(samples.texels[i], SIZE);
    }
    vsh_light sun = vsh_light_default();
    memcpy(sun.direction, SUN, sizeof SUN);
    sun.angle = SUN_ANGLE;
    const double w = tan(0.5 * SUN_ANGLE);
    if (sunlit) {
        truth_mesh_light(mesh, count, origins, normals, SUN, w, TRUTH_RAYS, 0, truth);
    } else {
        truth_mesh_ao(mesh, count, origins, normals, AO_DISTANCE, TRUTH_RAYS, 0, truth);
    }

    float *const shadow[1] = {plane}, *const shadow_error[1] = {deviation};
    vsh_lightmap lightmap = {.coverage = coverage};
    lightmap.shadow = sunlit ? shadow : NULL;
    lightmap.shadow_error = sunlit ? shadow_error : NULL;
    lightmap.ao = sunlit ? NULL : plane;
    lightmap.ao_error = sunlit ? NULL : deviation;
    const size_t lights = sunlit ? 1 : 0;
    bench_check(
        vsh_bake_lightmap(bench_casts(field), charts, &sun, lights, NULL, NULL, &lightmap, NULL, &error),
        &error);
    for (size_t i = 0; i < count; ++i) {
        valid[i] = coverage[at[i]];
    }
    const truth_question question = {.count = count,
                                     .origins = origins,
                                     .normals = normals,
                                     .towards = sunlit ? SUN : NULL,
                                     .w = w,
                                     .distance = AO_DISTANCE};
    const bench_curve curve = bench_embree(csv, scene->name, mesh, &question, truth, valid, values);
    for (size_t s = 0; s < steps; ++s) {
        const ladder_step *step = &ladder[s];
        vsh_shade_options shade = vsh_shade_options_default();
        const bool cones = !sunlit && step->method == VSH_AO_CONES;
        *(sunlit ? &shade.method : &shade.ao_method) = step->method;
        *(cones ? &shade.ao_cones : &shade.rays) = step->count;
        shade.max_error = step->max_error;
        shade.ao_distance = AO_DISTANCE;
        size.ao_spacing = step->spacing;
        vsh_charts_free(charts);
        bench_check(vsh_charts_create(scene->meshes, scene->mesh_count, &size, &run, NULL, &charts, &error),
                    &error);
        double seconds[BENCH_RUNS];
        vsh_bake_stats stats;
        for (int k = 0; k < 3; ++k) {
            stats = vsh_bake_stats_zero();
            const double start = bench_seconds();
            bench_check(vsh_bake_lightmap(bench_traced(field, triangles), charts, &sun, lights, &shade, &run,
                                          &lightmap, &stats, &error),
                        &error);
            seconds[k] = bench_seconds() - start;
        }
        const double each = bench_median(seconds, 3) / (double)samples.count;
        for (size_t i = 0; i < count; ++i) {
            values[i] = plane[at[i]];
        }
        const truth_metrics metrics = truth_compare(count, values, truth, valid);
        bench_row(csv, scene->name, step->name, 1e6 * each,
                  (double)stats.shade.samples / (double)samples.count, each / curve.ray, &metrics);
        const double embree = bench_embree_seconds(&curve, metrics.rmse) / (double)count;
        size_t proved = 0, wrong = 0;
        for (size_t i = 0; i < count; ++i) {
            const bool sure = stats.shade.square_error > 0.0 && valid[i] > 0.0f && deviation[at[i]] == 0.0f;
            proved += sure;
            wrong += sure && values[i] != truth[i];
        }
        printf("          estimated %.4f; %.1f %% proved, %zu wrong; %.2f rays a texel; Embree takes %.3f us "
               "for "
               "this error: %.2f of its time\n",
               sqrt(stats.shade.square_error / (double)samples.count), 100.0 * (double)proved / (double)count,
               wrong, (double)stats.shade.rays / (double)samples.count, 1e6 * embree, each / embree);
    }
    free(plane);
    free(at);
    free(truth);
    free(normals);
    free(origins);
    vsh_texels_free(texels);
    vsh_charts_free(charts);
    truth_mesh_free(mesh);
    vsh_triangles_free(triangles);
    vsh_field_free(field);
}

static void measure_all(FILE *csv, bool sunlit, const ladder_step *ladder, size_t steps) {
    for (int which = 0; which < BENCH_SCENES; ++which) {
        bench_scene scene;
        bench_scene_make(which, &scene);
        measure(csv, &scene, sunlit, ladder, steps);
        bench_scene_free(&scene);
    }
}

void bench_shadow_lightmaps(FILE *csv) {
    measure_all(csv, true, SHADOW, sizeof SHADOW / sizeof SHADOW[0]);
}

void bench_ao_lightmaps(FILE *csv) {
    measure_all(csv, false, AO, sizeof AO / sizeof AO[0]);
}
