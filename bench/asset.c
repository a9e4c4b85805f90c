/* The sample asset at 512 voxels on its long side: a 1024² lightmap's valid texels against Embree on its
 * triangles. */
#include "bench.h"
#include "casts.h"
#include "embree.h"
#include "scenes.h"
#include "yardstick.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 1024, RESOLUTION = 512, STRIDE = 4, LIGHT_RAYS = 512, AO_RAYS = 4096, AO_RUNS = 3 };

/* Truth's rays begin this far above the surface, of the asset's size: enough for Embree's floats. */
static const double LIFT = 1e-5;
static const double SUN[3] = {-0.5, 0.8, -0.6};
static const double SUN_ANGLE = 5.0 * 3.14159265358979323846 / 180.0;
static const double AO_DISTANCE = 0.6;

typedef struct receiver {
    size_t count;
    double *positions; /* on the surface */
    double *lifted;    /* where a bake's rays begin */
    double *origins;   /* of the truth's rays */
    float *normals;
    float *valid;
} receiver;

/* A bake's rays begin a voxel above the surface where it is nearer than CREASE to another surface there, and
 * a sample is not shaded at all where it is nearer than CLEAR (src/bake/origins.c); voxels. */
static const double CREASE = 0.75, CLEAR = 0.25;

/* Every STRIDE-th sample in both directions of the tiles, so that the truth takes a minute and not an hour.
 */
static receiver take_texels(const vsh_field *field, const vsh_charts *charts) {
    vsh_texels *texels = bench_texels(charts);
    const vsh_texel_samples s = vsh_texels_samples(texels);
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    const size_t triples = s.count * 3 * sizeof(double);
    receiver r = {0,
                  bench_take(triples),
                  bench_take(triples),
                  bench_take(triples),
                  bench_take(s.count * 3 * sizeof(float)),
                  bench_take(s.count * sizeof(float))};
    for (size_t i = 0; i < s.count; ++i) {
        if (vsh_texel_column(s.texels[i]) % STRIDE != 0 || vsh_texel_row(s.texels[i]) % STRIDE != 0) {
            continue;
        }
        double probe[3];
        float distance;
        for (size_t k = 0; k < 3; ++k) {
            const double p = s.positions[3 * i + k], n = (double)s.geometric_normals[3 * i + k];
            r.positions[3 * r.count + k] = p;
            r.origins[3 * r.count + k] = p + LIFT * n;
            r.normals[3 * r.count + k] = s.normals[3 * i + k];
            probe[k] = p + info.voxel_size * n;
        }
        vsh_field_sample(field, 1, probe, &distance);
        const double clear = (double)distance / info.voxel_size;
        const double offset = vsh_shade_options_default().start_offset;
        for (size_t k = 0; k < 3; ++k) {
            r.lifted[3 * r.count + k] = s.positions[3 * i + k] + (clear < CREASE ? 1.0 : offset) *
                                                                     info.voxel_size *
                                                                     (double)s.geometric_normals[3 * i + k];
        }
        r.valid[r.count++] = clear >= CLEAR ? 1.0f : 0.0f;
    }
    vsh_texels_free(texels);
    return r;
}

void bench_asset(FILE *csv) {
    vsh_error error;
    vsh_run run = vsh_run_default();
    vsh_charts *charts = NULL;
    bench_scene scene;
    bench_scene_make(BENCH_CLOISTER, &scene);
    vsh_field *field = bench_scene_field(&scene, RESOLUTION);
    vsh_lightmap_options size = vsh_lightmap_options_default();
    size.width = size.height = SIZE;
    bench_check(vsh_charts_create(scene.meshes, scene.mesh_count, &size, &run, NULL, &charts, &error),
                &error);
    truth_mesh *mesh = truth_mesh_create(scene.meshes, scene.mesh_count);
    if (mesh == NULL) {
        puts("asset: no Embree, no truth");
        exit(2);
    }

    receiver r = take_texels(field, charts);
    float *values = bench_take(r.count * sizeof *values), *truth = bench_take(r.count * sizeof *truth);
    const vsh_points points = {r.count, r.positions, r.normals, NULL};
    vsh_light sun = vsh_light_default();
    memcpy(sun.direction, SUN, sizeof SUN);
    sun.angle = SUN_ANGLE;

    truth_mesh_light(mesh, r.count, r.origins, r.normals, SUN, tan(0.5 * SUN_ANGLE), LIGHT_RAYS, 0, truth);
    truth_question question = {.count = r.count,
                               .origins = r.origins,
                               .normals = r.normals,
                               .towards = SUN,
                               .w = tan(0.5 * SUN_ANGLE)};
    bench_curve embree = bench_embree(csv, "cloister", mesh, &question, truth, r.valid, values);
    bench_methods(csv, "cloister", field, &points, &sun, embree.ray, truth, r.valid, values);

    truth_mesh_ao(mesh, r.count, r.origins, r.normals, AO_DISTANCE, AO_RAYS, 0, truth);
    question.towards = NULL;
    question.distance = AO_DISTANCE;
    embree = bench_embree(csv, "cloister", mesh, &question, truth, r.valid, values);
    vsh_triangles *triangles = NULL;
    bench_check(vsh_triangles_create(scene.meshes, scene.mesh_count, &run, &triangles, &error), &error);
    const struct {
        const char *name;
        int32_t method, count; /* of cones or rays */
        double max_error;
    } ladder[] = {{"ao taps", VSH_AO_TAPS, 1, 1.0},
                  {"ao cones 4", VSH_AO_CONES, 4, 1.0},
                  {"ao cones 8", VSH_AO_CONES, 8, 1.0},
                  {"ao cones 16", VSH_AO_CONES, 16, 1.0},
                  {"ao cones 64", VSH_AO_CONES, 64, 1.0},
                  {"ao rays 16", VSH_AO_RAYS, 16, 1.0},
                  {"ao rays 64", VSH_AO_RAYS, 64, 1.0},
                  {"ao rays 256", VSH_AO_RAYS, 256, 1.0},
                  {"ao adaptive 0.05", VSH_AO_ADAPTIVE, 4096, 0.05},
                  {"ao adaptive 0.02", VSH_AO_ADAPTIVE, 4096, 0.02},
                  {"ao adaptive 0.01", VSH_AO_ADAPTIVE, 4096, 0.01},
                  {"ao exact 0.05", VSH_AO_EXACT, 4096, 0.05},
                  {"ao exact 0.02", VSH_AO_EXACT, 4096, 0.02},
                  {"ao exact 0.01", VSH_AO_EXACT, 4096, 0.01}};
    for (size_t m = 0; m < sizeof ladder / sizeof ladder[0]; ++m) {
        const bool exact = ladder[m].method == VSH_AO_EXACT;
        const vsh_points from = {r.count, exact ? r.positions : r.lifted, r.normals, NULL};
        vsh_shade_options shade = vsh_shade_options_default();
        shade.ao_method = ladder[m].method;
        if (shade.ao_method == VSH_AO_CONES) {
            shade.ao_cones = ladder[m].count;
        } else {
            shade.rays = ladder[m].count;
        }
        shade.max_error = ladder[m].max_error;
        shade.ao_distance = AO_DISTANCE;
        shade.start_offset = 0.0;
        vsh_shade_stats stats;
        const double each = bench_ao(AO_RUNS, bench_traced(field, triangles), &from, &shade, values, &stats) /
                            (double)r.count;
        const truth_metrics metrics = truth_compare(r.count, values, truth, r.valid);
        bench_row(csv, "cloister", ladder[m].name, 1e6 * each, (double)stats.samples / (double)r.count,
                  each / embree.ray, &metrics);
        const double same = bench_embree_seconds(&embree, metrics.rmse) / (double)r.count;
        printf("          Embree takes %.3f us for this error: %.2f of its time\n", 1e6 * same, each / same);
    }
    vsh_triangles_free(triangles);
    free(truth);
    free(values);
    free(r.valid);
    free(r.normals);
    free(r.origins);
    free(r.lifted);
    free(r.positions);
    truth_mesh_free(mesh);
    vsh_charts_free(charts);
    vsh_field_free(field);
    bench_scene_free(&scene);
}
