/* The seeds' scene: 512² floor texels against 256 analytic rays each. */
#include "analytic.h"
#include "bench.h"
#include "casts.h"
#include "scenes.h"

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

void bench_seeds_make(bench_seeds_scene *seeds) {
    vsh_error error;
    vsh_run run = vsh_run_default();
    run.threads = 1;
    vsh_scene *scene = NULL;
    vsh_assets *assets = NULL;
    seeds->count = (size_t)SIDE * SIDE;
    seeds->positions = bench_take(seeds->count * 3 * sizeof *seeds->positions);
    seeds->normals = bench_take(seeds->count * 3 * sizeof *seeds->normals);
    place_texels(seeds->positions, seeds->normals);
    bench_check(vsh_scene_read(VSH_ASSETS "/seeds.json", NULL, &scene, &error), &error);
    bench_check(vsh_assets_load(scene, &run, &assets, &error), &error);
    bench_check(vsh_scene_casters(scene, assets, &run, &seeds->grid, &error), &error);
    vsh_field_options options = vsh_field_options_default();
    const double low[3] = {-2.5, 0.0, -2.5}, high[3] = {2.5, 0.0, 2.5};
    options.reach = vsh_scene_reach(scene, seeds->grid, low, high);
    bench_check(vsh_field_create(seeds->grid, &options, &run, &seeds->field, &error), &error);
    vsh_assets_free(assets);
    vsh_scene_free(scene);
    seeds->sun = vsh_light_default();
    memcpy(seeds->sun.direction, truth_seeds_sun, sizeof seeds->sun.direction);
    seeds->sun.angle = 2.0 * atan(truth_seeds_w);
}

void bench_seeds_free(bench_seeds_scene *seeds) {
    vsh_field_free(seeds->field);
    vsh_grid_free(seeds->grid);
    free(seeds->normals);
    free(seeds->positions);
}

void bench_seeds(FILE *csv) {
    bench_seeds_scene seeds;
    bench_seeds_make(&seeds);
    float *values = bench_take(seeds.count * sizeof *values),
          *truth = bench_take(seeds.count * sizeof *truth);
    truth_lights(truth_seeds(), seeds.count, seeds.positions, NULL, truth_seeds_sun, truth_seeds_w, INFINITY,
                 RAYS, truth);
    const vsh_points points = {seeds.count, seeds.positions, seeds.normals, NULL};
    bench_methods(csv, "seeds", seeds.field, &points, &seeds.sun, 0.0, truth, NULL, values);
    free(truth);
    free(values);
    bench_seeds_free(&seeds);
}
