/* AO lightmaps at 512 voxels against Embree's own rays, on an asset, a smooth mesh and a thin structure:
 * whole bakes of 1024², compared at runs of texels all over them; one thread for both sides. */
#include "bench.h"
#include "scenes.h"
#include "yardstick.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 1024, RESOLUTION = 512, RUN = 64, APART = 23, TRUTH_RAYS = 4096 };

static const double AO_DISTANCE = 0.6, LIFT = 1e-5;

typedef struct ladder_step {
    const char *name;
    int32_t method, count; /* of cones or rays */
    double max_error;
    int32_t spacing;
} ladder_step;

static const ladder_step LADDER[] = {{"ao cones 16, 1", VSH_AO_CONES, 16, 1.0, 1},
                                     {"ao cones 8", VSH_AO_CONES, 8, 1.0, 4},
                                     {"ao cones 16", VSH_AO_CONES, 16, 1.0, 4},
                                     {"ao cones 16, 8", VSH_AO_CONES, 16, 1.0, 8},
                                     {"ao cones 32", VSH_AO_CONES, 32, 1.0, 4},
                                     {"ao cones 64", VSH_AO_CONES, 64, 1.0, 4},
                                     {"ao adaptive 0.02", VSH_AO_ADAPTIVE, 4096, 0.02, 4},
                                     {"ao exact 0.05, 1", VSH_AO_EXACT, 4096, 0.05, 1},
                                     {"ao exact 0.05", VSH_AO_EXACT, 4096, 0.05, 4},
                                     {"ao exact 0.02, 1", VSH_AO_EXACT, 4096, 0.02, 1},
                                     {"ao exact 0.02", VSH_AO_EXACT, 4096, 0.02, 4},
                                     {"ao exact 0.02, 8", VSH_AO_EXACT, 4096, 0.02, 8},
                                     {"ao exact 0.01", VSH_AO_EXACT, 4096, 0.01, 4}};

static void measure(FILE *csv, const bench_scene *scene) {
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
    vsh_texels *texels;
    bench_check(vsh_texels_create(scene->meshes, scene->mesh_count, &size, &run, NULL, &texels, &error),
                &error);
    const vsh_texel_samples samples = vsh_texels_samples(texels);
    const size_t most = samples.count / APART + RUN;
    double *origins = bench_take(most * 3 * sizeof *origins);
    float *normals = bench_take(most * 4 * sizeof *normals), *truth = bench_take(most * 3 * sizeof *truth);
    float *values = truth + most, *valid = truth + 2 * most;
    uint32_t *at = bench_take(most * sizeof *at);
    float *ao = bench_take((size_t)2 * SIZE * SIZE * sizeof *ao), *coverage = ao + (size_t)SIZE * SIZE;
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
        at[count++] = samples.texel[i];
    }
    truth_mesh_ao(mesh, count, origins, normals, AO_DISTANCE, TRUTH_RAYS, 0, truth);

    const vsh_lightmap lightmap = {.ao = ao, .coverage = coverage};
    bench_check(vsh_bake_lightmap(field, texels, NULL, 0, NULL, NULL, &lightmap, NULL, &error), &error);
    for (size_t i = 0; i < count; ++i) {
        valid[i] = coverage[at[i]];
    }
    const truth_question question = {
        .count = count, .origins = origins, .normals = normals, .distance = AO_DISTANCE};
    const bench_curve curve = bench_embree(csv, scene->name, mesh, &question, truth, valid, values);
    for (size_t s = 0; s < sizeof LADDER / sizeof LADDER[0]; ++s) {
        vsh_shade_options shade = vsh_shade_options_default();
        shade.ao_method = LADDER[s].method;
        shade.ao_cones = shade.ao_method == VSH_AO_CONES ? LADDER[s].count : shade.ao_cones;
        shade.rays = shade.ao_method == VSH_AO_CONES ? shade.rays : LADDER[s].count;
        shade.max_error = LADDER[s].max_error;
        shade.triangles = triangles;
        shade.ao_distance = AO_DISTANCE;
        size.ao_spacing = LADDER[s].spacing;
        vsh_texels_free(texels);
        bench_check(vsh_texels_create(scene->meshes, scene->mesh_count, &size, &run, NULL, &texels, &error),
                    &error);
        double seconds[BENCH_RUNS];
        vsh_bake_stats stats;
        for (int k = 0; k < 3; ++k) {
            stats = vsh_bake_stats_zero();
            const double start = bench_seconds();
            bench_check(vsh_bake_lightmap(field, texels, NULL, 0, &shade, &run, &lightmap, &stats, &error),
                        &error);
            seconds[k] = bench_seconds() - start;
        }
        const double each = bench_median(seconds, 3) / (double)samples.count;
        for (size_t i = 0; i < count; ++i) {
            values[i] = ao[at[i]];
        }
        const truth_metrics metrics = truth_compare(count, values, truth, valid);
        bench_row(csv, scene->name, LADDER[s].name, 1e6 * each,
                  (double)stats.shade.samples / (double)samples.count, each / curve.ray, &metrics);
        const double embree = bench_embree_seconds(&curve, metrics.rmse) / (double)count;
        printf("          Embree takes %.3f us for this error: %.2f of its time\n", 1e6 * embree,
               each / embree);
    }
    free(ao);
    free(at);
    free(truth);
    free(normals);
    free(origins);
    vsh_texels_free(texels);
    truth_mesh_free(mesh);
    vsh_triangles_free(triangles);
    vsh_field_free(field);
}

void bench_ao_lightmaps(FILE *csv) {
    for (int which = 0; which < BENCH_SCENES; ++which) {
        bench_scene scene;
        bench_scene_make(which, &scene);
        measure(csv, &scene);
        bench_scene_free(&scene);
    }
}
