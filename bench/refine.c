/* adaptive against rays on its own field, and exact against Embree's rays, on an asset, a smooth mesh and a
 * thin structure (tools/make_bench_scenes.py): receivers are runs of texels all over the lightmaps, one
 * thread for both sides. */
#include "bench.h"
#include "casts.h"
#include "embree.h"
#include "scenes.h"
#include "yardstick.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { POINTS = 60000, TRUTH_RAYS = 1024, RESOLUTION = 512 };

static const double SUN[3] = {-0.5, 0.8, -0.6};
static const double SUN_ANGLE = 5.0 * 3.14159265358979323846 / 180.0;
static const double LIFT = 1e-5;

typedef struct receivers {
    double *positions, *origins;
    float *normals, *valid, *truth, *values, *reference, *deviation;
} receivers;

static void measure(FILE *csv, const bench_scene *scene) {
    vsh_error error;
    vsh_triangles *triangles = NULL;
    const char *name = scene->name;
    vsh_field *field = bench_scene_field(scene, RESOLUTION);
    bench_check(vsh_triangles_create(scene->meshes, scene->mesh_count, NULL, &triangles, &error), &error);
    truth_mesh *mesh = truth_mesh_create(scene->meshes, scene->mesh_count);
    if (mesh == NULL) {
        puts("refine: no Embree, no truth");
        exit(2);
    }
    float *memory = bench_take((size_t)POINTS * 8 * sizeof *memory);
    double *places = bench_take((size_t)POINTS * 6 * sizeof *places);
    receivers r = {places,
                   places + 3 * POINTS,
                   memory,
                   memory + 3 * POINTS,
                   memory + 4 * POINTS,
                   memory + 5 * POINTS,
                   memory + 6 * POINTS,
                   memory + 7 * POINTS};
    bench_scene_points(scene, field, 9, POINTS, r.positions, r.normals, r.valid);
    for (size_t i = 0; i < (size_t)3 * POINTS; ++i) {
        r.origins[i] = r.positions[i] + LIFT * (double)r.normals[i];
    }
    const double w = tan(0.5 * SUN_ANGLE);
    truth_mesh_light(mesh, POINTS, r.origins, r.normals, SUN, w, TRUTH_RAYS, 0, r.truth);

    const truth_question question = {
        .count = POINTS, .origins = r.origins, .normals = r.normals, .towards = SUN, .w = w};
    const bench_curve curve = bench_embree(csv, name, mesh, &question, r.truth, r.valid, r.values);
    char what[64];

    const vsh_points points = {POINTS, r.positions, r.normals, NULL};
    vsh_light sun = vsh_light_default();
    memcpy(sun.direction, SUN, sizeof SUN);
    sun.angle = SUN_ANGLE;
    vsh_shade_options shade = vsh_shade_options_default();
    shade.method = VSH_SHADOW_RAYS;
    shade.rays = TRUTH_RAYS;
    bench_check(
        vsh_shade_shadow(bench_casts(field), &points, &sun, &shade, NULL, r.reference, NULL, NULL, &error),
        &error);
    const double asked[] = {0.1, 0.05, 0.02, 0.01};
    for (int exact = 0; exact < 2; ++exact) {
        for (size_t e = 0; e < sizeof asked / sizeof asked[0]; ++e) {
            shade.method = exact ? VSH_SHADOW_EXACT : VSH_SHADOW_ADAPTIVE;
            shade.max_error = asked[e];
            vsh_shade_stats stats;
            const double each = bench_shadow(3, bench_traced(field, triangles), &points, &sun, &shade,
                                             r.values, r.deviation, &stats) /
                                POINTS;
            const truth_metrics metrics =
                truth_compare(POINTS, r.values, exact ? r.truth : r.reference, r.valid);
            snprintf(what, sizeof what, "%s %g", exact ? "exact" : "adaptive", asked[e]);
            bench_row(csv, name, what, 1e6 * each, (double)stats.samples / POINTS, each / curve.ray,
                      &metrics);
            size_t proved = 0, wrong = 0, valid = 0;
            for (size_t i = 0; i < POINTS; ++i) {
                if (r.valid[i] > 0.0f) {
                    ++valid;
                    proved += r.deviation[i] == 0.0f;
                    wrong += r.deviation[i] == 0.0f && r.values[i] != r.truth[i];
                }
            }
            printf("          estimated %.4f; %.1f %% proved, %zu of %zu wrong; %.2f rays a point",
                   sqrt(stats.square_error / POINTS), 100.0 * (double)proved / (double)valid, wrong, proved,
                   (double)stats.rays / POINTS);
            if (exact) {
                const double embree = bench_embree_seconds(&curve, metrics.rmse) / POINTS;
                printf("; Embree takes %.3f us for this error: %.2f of its time", 1e6 * embree,
                       each / embree);
            }
            puts("");
        }
    }
    free(places);
    free(memory);
    truth_mesh_free(mesh);
    vsh_triangles_free(triangles);
    vsh_field_free(field);
}

void bench_refine(FILE *csv) {
    for (int which = 0; which < BENCH_SCENES; ++which) {
        bench_scene scene;
        bench_scene_make(which, &scene);
        measure(csv, &scene);
        bench_scene_free(&scene);
    }
}
