#include "scenes.h"

#include "bench.h"

#include <math.h>
#include <stdlib.h>

void bench_scene_make(int which, bench_scene *scene) {
    static const struct {
        const char *name, *path;
    } files[BENCH_SCENES] = {[BENCH_CLOISTER] = {"cloister", VSH_ASSETS "/cloister.glb"},
                             [BENCH_SMOOTH] = {"smooth", VSH_ASSETS "/smooth.glb"},
                             [BENCH_THIN] = {"thin", VSH_ASSETS "/thin.glb"}};
    vsh_error error;
    scene->name = files[which].name;
    bench_check(vsh_model_read(files[which].path, NULL, &scene->model, &error), &error);
    scene->mesh_count = vsh_model_mesh_count(scene->model);
    scene->meshes = bench_take(scene->mesh_count * sizeof *scene->meshes);
    for (size_t i = 0; i < scene->mesh_count; ++i) {
        scene->meshes[i] = vsh_model_mesh(scene->model, i, -1);
    }
}

void bench_scene_free(bench_scene *scene) {
    free(scene->meshes);
    vsh_model_free(scene->model);
}

vsh_field *bench_scene_field(const bench_scene *scene, int32_t resolution) {
    vsh_error error;
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    vsh_grid_options voxels = vsh_grid_options_default();
    voxels.resolution = resolution;
    bench_check(vsh_grid_from_meshes(scene->meshes, scene->mesh_count, &voxels, NULL, &grid, &error), &error);
    bench_check(vsh_field_create(grid, NULL, NULL, &field, &error), &error);
    vsh_grid_free(grid);
    return field;
}

void bench_scene_points(const bench_scene *scene, const vsh_field *field, uint64_t seed, size_t count,
                        double *positions, float *normals, float *valid) {
    enum { SIZE = 1024, RUN = 64 };
    static const double CLEAR = 0.25; /* voxels, as the bake judges (src/bake/origins.c) */
    vsh_error error;
    vsh_charts *charts = NULL;
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = SIZE;
    bench_check(vsh_charts_create(scene->meshes, scene->mesh_count, &options, NULL, NULL, &charts, &error),
                &error);
    vsh_texels *texels = bench_texels(charts);
    const vsh_texel_samples samples = vsh_texels_samples(texels);
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    const size_t runs = samples.count / RUN, wanted = (count + RUN - 1) / RUN;
    for (size_t i = 0; i < count; ++i) {
        const size_t run = (i / RUN * runs / wanted + (size_t)seed) % runs, from = run * RUN + i % RUN;
        double probe[3];
        float distance;
        for (size_t k = 0; k < 3; ++k) {
            positions[3 * i + k] = samples.positions[3 * from + k];
            normals[3 * i + k] = samples.geometric_normals[3 * from + k];
            probe[k] = positions[3 * i + k] + info.voxel_size * (double)normals[3 * i + k];
        }
        vsh_field_sample(field, 1, probe, &distance);
        valid[i] = (double)distance >= CLEAR * info.voxel_size ? 1.0f : 0.0f;
    }
    vsh_texels_free(texels);
    vsh_charts_free(charts);
}
