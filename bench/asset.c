/* The sample asset at 512 voxels on its long side: a 1024² lightmap's valid texels against Embree on its
 * triangles. */
#include "bench.h"
#include "embree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 1024, RESOLUTION = 512, STRIDE = 4, LIGHT_RAYS = 512, AO_RAYS = 1024 };

/* Truth's rays begin this far above the surface, of the asset's size: enough for Embree's floats. */
static const double LIFT = 1e-5;
static const double SUN[3] = {-0.5, 0.8, -0.6};
static const double SUN_ANGLE = 5.0 * 3.14159265358979323846 / 180.0;
static const double AO_DISTANCE = 0.6;

typedef struct receiver {
    size_t count;
    double *positions; /* on the surface */
    double *origins;   /* of the truth's rays */
    float *normals;
    float *valid;
} receiver;

/* Every STRIDE-th sample in both directions of the tiles, so that the truth takes a minute and not an hour.
 */
static receiver take_texels(const vsh_field *field, const vsh_texels *texels) {
    const vsh_texel_samples s = vsh_texels_samples(texels);
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    receiver r = {0, malloc(s.count * 3 * sizeof(double)), malloc(s.count * 3 * sizeof(double)),
                  malloc(s.count * 3 * sizeof(float)), malloc(s.count * sizeof(float))};
    if (r.positions == NULL || r.origins == NULL || r.normals == NULL || r.valid == NULL) {
        exit(4);
    }
    for (size_t i = 0; i < s.count; ++i) {
        if ((s.texel[i] % SIZE) % STRIDE != 0 || (s.texel[i] / SIZE) % STRIDE != 0) {
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
        r.valid[r.count++] = distance >= 0.0f ? 1.0f : 0.0f; /* as the bake judges */
    }
    return r;
}

/* Processor seconds that one Embree occlusion ray takes on this scene and these receivers. */
static double embree_ray_seconds(const truth_mesh *mesh, const receiver *r, float *values) {
    double seconds[BENCH_RUNS];
    const size_t rays = 16;
    for (int run = 0; run < BENCH_RUNS; ++run) {
        const double start = bench_seconds();
        truth_mesh_light(mesh, r->count, r->origins, r->normals, SUN, tan(0.5 * SUN_ANGLE), rays, 1, values);
        seconds[run] = bench_seconds() - start;
    }
    return bench_median(seconds, BENCH_RUNS) / (double)(r->count * rays);
}

void bench_asset(FILE *csv) {
    vsh_error error;
    vsh_run run = vsh_run_default();
    vsh_model *model = NULL;
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    vsh_texels *texels = NULL;
    bench_check(vsh_model_read(VSH_ASSETS "/cloister.glb", &run, &model, &error), &error);
    const size_t mesh_count = vsh_model_mesh_count(model);
    vsh_mesh *meshes = malloc(mesh_count * sizeof *meshes);
    if (meshes == NULL) {
        exit(4);
    }
    for (size_t i = 0; i < mesh_count; ++i) {
        meshes[i] = vsh_model_mesh(model, i, -1);
    }
    vsh_grid_options voxels = vsh_grid_options_default();
    voxels.resolution = RESOLUTION;
    bench_check(vsh_grid_from_meshes(meshes, mesh_count, &voxels, &run, &grid, &error), &error);
    bench_check(vsh_field_create(grid, NULL, &run, &field, &error), &error);
    vsh_lightmap_options size = vsh_lightmap_options_default();
    size.width = size.height = SIZE;
    bench_check(vsh_texels_create(meshes, mesh_count, &size, &run, NULL, &texels, &error), &error);
    truth_mesh *mesh = truth_mesh_create(meshes, mesh_count);
    if (mesh == NULL) {
        puts("asset: no Embree, no truth");
        exit(2);
    }

    receiver r = take_texels(field, texels);
    float *values = malloc(r.count * sizeof *values), *truth = malloc(r.count * sizeof *truth);
    if (values == NULL || truth == NULL) {
        exit(4);
    }
    const double ray = embree_ray_seconds(mesh, &r, values);
    const vsh_points points = {r.count, r.positions, r.normals, NULL};
    vsh_light sun = vsh_light_default();
    memcpy(sun.direction, SUN, sizeof SUN);
    sun.angle = SUN_ANGLE;
    run.threads = 1;

    truth_mesh_light(mesh, r.count, r.origins, r.normals, SUN, tan(0.5 * SUN_ANGLE), LIGHT_RAYS, 0, truth);
    for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
        vsh_shade_options shade = vsh_shade_options_default();
        shade.method = method;
        double seconds[BENCH_RUNS];
        vsh_shade_stats stats;
        for (int i = 0; i < BENCH_RUNS; ++i) {
            stats = vsh_shade_stats_zero();
            const double start = bench_seconds();
            bench_check(vsh_shade_shadow(field, &points, &sun, &shade, &run, values, NULL, &stats, &error),
                        &error);
            seconds[i] = bench_seconds() - start;
        }
        const truth_metrics metrics = truth_compare(r.count, values, truth, r.valid);
        const double each = bench_median(seconds, BENCH_RUNS) / (double)r.count;
        bench_row(csv, "cloister", vsh_shadow_method_name(method), 1e6 * each,
                  (double)stats.samples / (double)r.count, each / ray, &metrics);
    }

    truth_mesh_ao(mesh, r.count, r.origins, r.normals, AO_DISTANCE, AO_RAYS, 0, truth);
    const struct {
        const char *name;
        int32_t method, cones;
    } ladder[] = {{"ao taps", VSH_AO_TAPS, 1},
                  {"ao cones 4", VSH_AO_CONES, 4},
                  {"ao cones 8", VSH_AO_CONES, 8},
                  {"ao cones 16", VSH_AO_CONES, 16},
                  {"ao cones 64", VSH_AO_CONES, 64}};
    for (size_t m = 0; m < sizeof ladder / sizeof ladder[0]; ++m) {
        vsh_shade_options shade = vsh_shade_options_default();
        shade.ao_method = ladder[m].method;
        shade.ao_cones = ladder[m].cones;
        shade.ao_distance = AO_DISTANCE;
        vsh_shade_stats stats = vsh_shade_stats_zero();
        const double start = bench_seconds();
        bench_check(vsh_shade_ao(field, &points, &shade, &run, values, NULL, &stats, &error), &error);
        const double each = (bench_seconds() - start) / (double)r.count;
        const truth_metrics metrics = truth_compare(r.count, values, truth, r.valid);
        bench_row(csv, "cloister", ladder[m].name, 1e6 * each, (double)stats.samples / (double)r.count,
                  each / ray, &metrics);
    }
    free(truth);
    free(values);
    free(r.valid);
    free(r.normals);
    free(r.origins);
    free(r.positions);
    truth_mesh_free(mesh);
    vsh_texels_free(texels);
    vsh_field_free(field);
    vsh_grid_free(grid);
    free(meshes);
    vsh_model_free(model);
}
