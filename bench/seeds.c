/* The seeds' scene: 512² floor texels against 256 analytic rays each; bands and grain of penumbrae against so
 * many that their noise is no part of it. */
#include "analytic.h"
#include "bench.h"
#include "casts.h"
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 512, TILE = 8, RAYS = 256, SMOOTH_RAYS = 16384 };

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

void bench_penumbra_header(FILE *csv) {
    fputs("scene,what,us_per_texel,penumbra_rmse,bias,second_differences,off_contact\n", csv);
    printf("%-9s %-10s %9s %9s %9s %19s %12s\n", "scene", "what", "us/texel", "penumbra", "bias",
           "second differences", "off contact");
}

/* Texels' values row by row. */
static void in_rows(const bench_seeds_scene *seeds, const float *values, float *rows) {
    for (size_t i = 0; i < seeds->count; ++i) {
        const double column = (seeds->positions[3 * i] + 2.5) / 5.0 * SIDE,
                     row = (seeds->positions[3 * i + 2] + 2.5) / 5.0 * SIDE;
        rows[(size_t)row * SIDE + (size_t)column] = values[i];
    }
}

/* Root of the sum of the squares of second differences along rows and columns, at texels of penumbrae; of
 * those that are `clear` of the casters, where these are not NULL. */
static double second_differences(const float *rows, const float *truth, const float *clear) {
    double squares = 0.0;
    for (size_t i = SIDE; i < (size_t)SIDE * (SIDE - 1); ++i) {
        if (truth[i] >= 0.02f && truth[i] <= 0.98f && (clear == NULL || clear[i] > 0.1f)) {
            const double along = (double)rows[i - 1] + (double)rows[i + 1] - 2.0 * (double)rows[i],
                         across = (double)rows[i - SIDE] + (double)rows[i + SIDE] - 2.0 * (double)rows[i];
            squares += along * along + across * across;
        }
    }
    return sqrt(squares);
}

void bench_penumbra(FILE *csv) {
    bench_seeds_scene seeds;
    bench_seeds_make(&seeds);
    float *planes[5];
    for (size_t k = 0; k < sizeof planes / sizeof planes[0]; ++k) {
        planes[k] = bench_take(seeds.count * sizeof *planes[k]);
    }
    float *values = planes[0], *truth = planes[1], *rows = planes[2], *true_rows = planes[3],
          *clear = planes[4];
    truth_lights(truth_seeds(), seeds.count, seeds.positions, NULL, truth_seeds_sun, truth_seeds_w, INFINITY,
                 RAYS, truth);
    const truth_scene casters = {truth_seeds().solids + 1, truth_seeds().count - 1}; /* without the floor */
    for (size_t i = 0; i < seeds.count; ++i) {
        if (truth[i] > 0.0f && truth[i] < 1.0f) {
            truth_lights(truth_seeds(), 1, seeds.positions + 3 * i, NULL, truth_seeds_sun, truth_seeds_w,
                         INFINITY, SMOOTH_RAYS, truth + i);
        }
        values[i] = (float)truth_distance(casters, seeds.positions + 3 * i);
    }
    in_rows(&seeds, truth, true_rows);
    in_rows(&seeds, values, clear);
    const vsh_points points = {seeds.count, seeds.positions, seeds.normals, NULL};
    for (int32_t method = VSH_SHADOW_SMOOTH; method <= VSH_SHADOW_CONE; ++method) {
        vsh_shade_options shade = vsh_shade_options_default();
        shade.method = method;
        vsh_shade_stats stats;
        const double each = bench_shadow(BENCH_RUNS, bench_casts(seeds.field), &points, &seeds.sun, &shade,
                                         values, NULL, &stats) /
                            (double)seeds.count;
        const truth_metrics e = truth_compare(seeds.count, values, truth, NULL);
        in_rows(&seeds, values, rows);
        const double all = second_differences(rows, true_rows, NULL) /
                           second_differences(true_rows, true_rows, NULL),
                     off = second_differences(rows, true_rows, clear) /
                           second_differences(true_rows, true_rows, clear);
        fprintf(csv, "seeds,%s,%.4f,%.5f,%.5f,%.3f,%.3f\n", vsh_shadow_method_name(method), 1e6 * each,
                e.penumbra_rmse, e.bias, all, off);
        printf("%-9s %-10s %9.3f %9.4f %9.4f %19.3f %12.3f\n", "seeds", vsh_shadow_method_name(method),
               1e6 * each, e.penumbra_rmse, e.bias, all, off);
    }
    for (size_t k = 0; k < sizeof planes / sizeof planes[0]; ++k) {
        free(planes[k]);
    }
    bench_seeds_free(&seeds);
}
