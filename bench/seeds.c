/* The seeds' scene: 512² floor texels against 256 analytic rays each. */
#include "analytic.h"
#include "bench.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 512, TILE = 8, RAYS = 256 };

/* Texels of the floor in tiles, each in Morton's order, as a lightmap's samples are. */
static void place_texels(double *positions, float *normals) {
    size_t i = 0;
    for (int tile = 0; tile < (SIDE / TILE) * (SIDE / TILE); ++tile) {
        for (int t = 0; t < TILE * TILE; ++t, ++i) {
            const int x = (t & 1) | (t >> 1 & 2) | (t >> 2 & 4),
                      y = (t >> 1 & 1) | (t >> 2 & 2) | (t >> 3 & 4);
            const int row = tile / (SIDE / TILE) * TILE + y, column = tile % (SIDE / TILE) * TILE + x;
            positions[3 * i] = -2.5 + 5.0 * (column + 0.5) / SIDE;
            positions[3 * i + 1] = 0.001;
            positions[3 * i + 2] = -2.5 + 5.0 * (row + 0.5) / SIDE;
            normals[3 * i] = normals[3 * i + 2] = 0.0f;
            normals[3 * i + 1] = 1.0f;
        }
    }
}

void bench_seeds(FILE *csv) {
    const size_t count = (size_t)SIDE * SIDE;
    double *positions = bench_take(count * 3 * sizeof *positions);
    float *normals = bench_take(count * 3 * sizeof *normals);
    float *values = bench_take(count * sizeof *values), *truth = bench_take(count * sizeof *truth);
    vsh_error error;
    vsh_scene *scene = NULL;
    vsh_assets *assets = NULL;
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    place_texels(positions, normals);
    truth_lights(truth_seeds(), count, positions, NULL, truth_seeds_sun, truth_seeds_w, INFINITY, RAYS,
                 truth);

    vsh_run run = vsh_run_default();
    run.threads = 1;
    bench_check(vsh_scene_read(VSH_ASSETS "/seeds.json", &scene, &error), &error);
    bench_check(vsh_assets_load(scene, &run, &assets, &error), &error);
    bench_check(vsh_scene_casters(scene, assets, &run, &grid, &error), &error);
    vsh_field_options options = vsh_field_options_default();
    const double low[3] = {-2.5, 0.0, -2.5}, high[3] = {2.5, 0.0, 2.5};
    options.reach = vsh_scene_reach(scene, grid, low, high);
    bench_check(vsh_field_create(grid, &options, &run, &field, &error), &error);

    const vsh_points points = {count, positions, normals, NULL};
    vsh_light sun = vsh_light_default();
    memcpy(sun.direction, truth_seeds_sun, sizeof sun.direction);
    sun.angle = 2.0 * atan(truth_seeds_w);
    bench_methods(csv, "seeds", field, &points, &sun, 0.0, truth, NULL, values);
    vsh_field_free(field);
    vsh_grid_free(grid);
    vsh_assets_free(assets);
    vsh_scene_free(scene);
    free(truth);
    free(values);
    free(normals);
    free(positions);
}
