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

/* The same numbers on every machine. */
static double next_number(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}

static void corner_of(const vsh_mesh *mesh, uint32_t vertex, double p[3]) {
    const float *v = mesh->positions + 3 * (size_t)vertex;
    const double *m = mesh->transform;
    for (int k = 0; k < 3; ++k) {
        p[k] = m == NULL ? (double)v[k]
                         : m[4 * k] * v[0] + m[4 * k + 1] * v[1] + m[4 * k + 2] * v[2] + m[4 * k + 3];
    }
}

void bench_scene_points(const bench_scene *scene, const vsh_field *field, uint64_t seed, size_t count,
                        double *positions, float *normals, float *valid) {
    const vsh_mesh *meshes = scene->meshes;
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    double total = 0.0, done = 0.0;
    size_t placed = 0;
    uint64_t state = seed;
    for (int pass = 0; pass < 2; ++pass) {
        for (size_t m = 0; m < scene->mesh_count; ++m) {
            for (size_t t = 0; t < meshes[m].triangle_count; ++t) {
                double a[3], b[3], c[3], n[3], length;
                const uint32_t *index = meshes[m].indices + 3 * t;
                corner_of(&meshes[m], index[0], a);
                corner_of(&meshes[m], index[1], b);
                corner_of(&meshes[m], index[2], c);
                for (int k = 0; k < 3; ++k) {
                    b[k] -= a[k];
                    c[k] -= a[k];
                }
                for (int k = 0; k < 3; ++k) {
                    n[k] = b[(k + 1) % 3] * c[(k + 2) % 3] - b[(k + 2) % 3] * c[(k + 1) % 3];
                }
                length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
                if (pass == 0) {
                    total += length;
                    continue;
                }
                done += length;
                for (; placed < count && (double)placed + 0.5 <= done / total * (double)count; ++placed) {
                    const double u = sqrt(next_number(&state)), v = next_number(&state);
                    double probe[3];
                    float distance;
                    for (int k = 0; k < 3; ++k) {
                        const double p = a[k] + u * (1.0 - v) * b[k] + u * v * c[k];
                        positions[3 * placed + (size_t)k] = p;
                        normals[3 * placed + (size_t)k] = (float)(n[k] / length);
                        probe[k] = p + info.voxel_size * n[k] / length;
                    }
                    vsh_field_sample(field, 1, probe, &distance);
                    valid[placed] = distance >= 0.0f ? 1.0f : 0.0f; /* as the bake judges */
                }
            }
        }
    }
}
