/* All cores on both sides: `exact` and Embree's rays in their fastest way, for the same error, by the wall
 * clock; and what a second core brings to either. */
#include "bench.h"
#include "casts.h"
#include "scenes.h"
#include "yardstick.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { POINTS = 240000, TRUTH_RAYS = 1024, RESOLUTION = 512, RUNS = 5 };

static const double SUN[3] = {-0.5, 0.8, -0.6};
static const double SUN_ANGLE = 5.0 * 3.14159265358979323846 / 180.0;
static const double LIFT = 1e-5;
static const double ERRORS[] = {0.1, 0.05, 0.02, 0.01};

/* Least wall seconds of a few runs. */
static double ours(const vsh_occluders *occluders, const vsh_points *points, const vsh_light *sun,
                   const vsh_shade_options *shade, int threads, float *values) {
    vsh_error error;
    vsh_run run = vsh_run_default();
    run.threads = threads;
    double least = INFINITY;
    for (int i = 0; i < RUNS; ++i) {
        const double start = bench_wall();
        bench_check(vsh_shade_shadow(occluders, points, sun, shade, &run, values, NULL, NULL, &error),
                    &error);
        least = fmin(least, bench_wall() - start);
    }
    return least;
}

/* How many times as fast all cores trace 16 rays a point as one does: its curve is one core's. */
static double embree_speedup(const truth_mesh *mesh, const truth_question *asked, int packing,
                             float *values) {
    truth_question question = *asked;
    question.rays = 16;
    double least[2] = {INFINITY, INFINITY};
    for (int i = 0; i < RUNS; ++i) {
        for (int all = 0; all < 2; ++all) {
            const double start = bench_wall();
            truth_mesh_packets(mesh, packing, &question, all ? 0 : 1, values);
            least[all] = fmin(least[all], bench_wall() - start);
        }
    }
    return least[0] / least[1];
}

static void measure(FILE *csv, const bench_scene *scene) {
    vsh_error error;
    vsh_triangles *triangles = NULL;
    vsh_field *field = bench_scene_field(scene, RESOLUTION);
    bench_check(vsh_triangles_create(scene->meshes, scene->mesh_count, NULL, &triangles, &error), &error);
    truth_mesh *mesh = truth_mesh_create(scene->meshes, scene->mesh_count);
    if (mesh == NULL) {
        puts("cores: no Embree");
        exit(2);
    }
    double *positions = bench_take((size_t)POINTS * 3 * sizeof *positions);
    double *origins = bench_take((size_t)POINTS * 3 * sizeof *origins);
    float *normals = bench_take((size_t)POINTS * 3 * sizeof *normals);
    float *valid = bench_take(POINTS * sizeof *valid), *truth = bench_take(POINTS * sizeof *truth),
          *values = bench_take(POINTS * sizeof *values);
    bench_scene_points(scene, field, 9, POINTS, positions, normals, valid);
    for (size_t i = 0; i < (size_t)3 * POINTS; ++i) {
        origins[i] = positions[i] + LIFT * (double)normals[i];
    }
    truth_question question = {.count = POINTS,
                               .origins = origins,
                               .normals = normals,
                               .towards = SUN,
                               .w = tan(0.5 * SUN_ANGLE),
                               .rays = TRUTH_RAYS};
    truth_mesh_packets(mesh, TRUTH_NEIGHBOURS_16, &question, 0, truth);
    FILE *nowhere = tmpfile();
    if (nowhere == NULL) {
        perror("cores");
        exit(3);
    }
    const bench_curve curve = bench_embree(nowhere, scene->name, mesh, &question, truth, valid, values);
    fclose(nowhere);
    const double speedup = embree_speedup(mesh, &question, curve.packing, values);

    const vsh_points points = {POINTS, positions, normals, NULL};
    vsh_light sun = vsh_light_default();
    memcpy(sun.direction, SUN, sizeof SUN);
    sun.angle = SUN_ANGLE;
    vsh_shade_options shade = vsh_shade_options_default();
    shade.method = VSH_SHADOW_EXACT;
    for (size_t e = 0; e < sizeof ERRORS / sizeof ERRORS[0]; ++e) {
        shade.max_error = ERRORS[e];
        const double one = ours(bench_traced(field, triangles), &points, &sun, &shade, 1, values),
                     all = ours(bench_traced(field, triangles), &points, &sun, &shade, 0, values);
        const truth_metrics metrics = truth_compare(POINTS, values, truth, valid);
        const double embree = bench_embree_seconds(&curve, metrics.rmse);
        char what[64];
        snprintf(what, sizeof what, "exact %g", ERRORS[e]);
        bench_ratio(csv, "cores", scene->name, what, "Embree, same error", 1, 1e6 * one / POINTS,
                    1e6 * embree / POINTS, metrics.rmse);
        bench_ratio(csv, "cores", scene->name, what, "Embree, same error", 0, 1e6 * all / POINTS,
                    1e6 * embree / speedup / POINTS, metrics.rmse);
        printf("          all cores against one: %.2f, Embree %.2f\n", one / all, speedup);
    }
    free(values);
    free(truth);
    free(valid);
    free(normals);
    free(origins);
    free(positions);
    truth_mesh_free(mesh);
    vsh_triangles_free(triangles);
    vsh_field_free(field);
}

void bench_all_cores(FILE *csv) {
    for (int which = 0; which < BENCH_SCENES; ++which) {
        bench_scene scene;
        bench_scene_make(which, &scene);
        measure(csv, &scene);
        bench_scene_free(&scene);
    }
}
