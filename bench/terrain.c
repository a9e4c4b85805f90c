/* Compares a heightfield of 4096² that is marched as it is, and 10^4 spheres in closed form, with the same
 * solids voxelised and with rays. */
#include "bench.h"
#include "casts.h"
#include "field/field.h"
#include "yardstick.h"

#include "analytic.h"
#include "base/hash.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The crop is a part of the whole that all shadows on the receivers in its middle come from. */
enum { SIDE = 4096, CROP = 769, FIRST = 1700, RECEIVERS = 256, INNER = 128, COUNT = RECEIVERS * RECEIVERS };
enum { TRUTH_RAYS = 1024 };

static const double SUN[3] = {-0.7, 0.45, 0.3};
static const double SUN_ANGLE = 5.0 * 3.14159265358979323846 / 180.0;
static const double AO_DISTANCE = 20.0;
static const double RELIEF = 260.0; /* cells */

static double lattice(int i, int j, int octave) {
    const uint64_t key = (uint64_t)(uint32_t)i << 32 | (uint32_t)j;
    return (double)(vshi_mix(key + UINT64_C(0x9e3779b97f4a7c15) * (uint64_t)(octave + 1)) >> 11) * 0x1p-53;
}

static double noise(double x, double z, int octave) {
    const int i = (int)floor(x), j = (int)floor(z);
    double u = x - i, v = z - j;
    u = u * u * (3.0 - 2.0 * u);
    v = v * v * (3.0 - 2.0 * v);
    const double a = lattice(i, j, octave) * (1.0 - u) + lattice(i + 1, j, octave) * u;
    const double b = lattice(i, j + 1, octave) * (1.0 - u) + lattice(i + 1, j + 1, octave) * u;
    return a + v * (b - a);
}

/* Ridges of four octaves, 0 … 1, of 50 cells at the least: a survey's land, which its samples resolve. */
static float land(int row, int column) {
    double sum = 0.0, weight = 0.5, size = 400.0, x = column, z = row;
    for (int octave = 0; octave < 4; ++octave) {
        const double level = 2.0 * noise(x / size, z / size, octave) - 1.0;
        sum += weight * (1.0 - sqrt(level * level + 0.01));
        weight *= 0.5;
        size *= 0.5;
        const double turned = 0.8 * x - 0.6 * z; /* no octave's squares lie over another's */
        z = 0.6 * x + 0.8 * z;
        x = turned;
    }
    return (float)sum;
}

typedef struct terrain {
    float *values, *crop;
    vsh_heights *heights;
    vsh_model *model;
    truth_mesh *truth;
    double *positions;
    float *normals;
} terrain;

/* In units of a cell, the whole grid's corner at the origin. */
static vsh_heights_source source_of(const float *values, int side, int first, double transform[12]) {
    const double middle = first + 0.5 * (side - 1);
    const double places[12] = {1, 0, 0, middle, 0, 1, 0, 0, 0, 0, 1, middle};
    memcpy(transform, places, sizeof places);
    return (vsh_heights_source){.columns = side,
                                .rows = side,
                                .values = values,
                                .size = {side - 1, side - 1},
                                .height = RELIEF,
                                .base = 1.0,
                                .transform = transform};
}

/* A receiver in each half of a cell of the crop's middle, lifted by a thousandth of a cell. */
static void place_receivers(terrain *t) {
    size_t i = 0;
    const int first = FIRST + (CROP - INNER) / 2;
    for (int y = 0; y < RECEIVERS; ++y) {
        for (int x = 0; x < RECEIVERS; ++x, ++i) {
            const int column = first + x / 2, row = first + y / 2;
            const float *h = t->values + (size_t)row * SIDE + column;
            const double u = x % 2 == 0 ? 0.2 : 0.7, v = y % 2 == 0 ? 0.3 : 0.6;
            const double h00 = RELIEF * (double)h[0], h01 = RELIEF * (double)h[1],
                         h10 = RELIEF * (double)h[SIDE], h11 = RELIEF * (double)h[SIDE + 1];
            const double du = u >= v ? h01 - h00 : h11 - h10, dv = u >= v ? h11 - h01 : h10 - h00;
            const double length = sqrt(1.0 + du * du + dv * dv),
                         n[3] = {-du / length, 1.0 / length, -dv / length};
            const double p[3] = {column + u, h00 + u * du + v * dv, row + v};
            for (size_t axis = 0; axis < 3; ++axis) {
                t->normals[3 * i + axis] = (float)n[axis];
                t->positions[3 * i + axis] = p[axis] + 1e-3 * n[axis];
            }
        }
    }
}

static terrain make(void) {
    terrain t;
    vsh_error error;
    double whole[12], part[12];
    t.values = bench_take((size_t)SIDE * SIDE * sizeof *t.values);
    t.crop = bench_take((size_t)CROP * CROP * sizeof *t.crop);
    t.positions = bench_take(3 * (size_t)COUNT * sizeof *t.positions);
    t.normals = bench_take(3 * (size_t)COUNT * sizeof *t.normals);
    for (int row = 0; row < SIDE; ++row) {
        for (int column = 0; column < SIDE; ++column) {
            t.values[(size_t)row * SIDE + (size_t)column] = land(row, column);
        }
    }
    for (int row = 0; row < CROP; ++row) {
        memcpy(t.crop + (size_t)row * CROP, t.values + (size_t)(FIRST + row) * SIDE + FIRST,
               CROP * sizeof *t.crop);
    }
    place_receivers(&t);
    const vsh_heights_source all = source_of(t.values, SIDE, 0, whole),
                             crop = source_of(t.crop, CROP, FIRST, part);
    double start = bench_seconds();
    bench_check(vsh_heights_create(&all, NULL, &t.heights, &error), &error);
    vsh_heights_info info;
    vsh_heights_get_info(t.heights, &info);
    printf("terrain: pyramid over %d² samples: %.2f s, %.1f bytes a sample\n", SIDE, bench_seconds() - start,
           (double)info.bytes / ((double)SIDE * SIDE));
    bench_check(vsh_model_from_heights(&crop, VSH_HEIGHTS_SOLID, NULL, &t.model, &error), &error);
    const vsh_mesh mesh = vsh_model_mesh(t.model, 0, -1);
    start = bench_seconds();
    t.truth = truth_mesh_create(&mesh, 1);
    printf("terrain: Embree's tree over the %d² of the crop: %.2f s\n", CROP, bench_seconds() - start);
    return t;
}

static void row(FILE *csv, const char *scene, const char *what, double seconds, size_t count, double ray,
                const vsh_shade_stats *stats, const float *values, const float *truth) {
    const truth_metrics m = truth_compare(count, values, truth, NULL);
    const double each = seconds / (double)count;
    bench_row(csv, scene, what, 1e6 * each, (double)stats->samples / (double)count,
              ray > 0.0 ? each / ray : 0.0, &m);
}

/* A field of the crop, and how long it took. */
static vsh_field *voxelise(const terrain *t, double voxel) {
    const vsh_mesh mesh = vsh_model_mesh(t->model, 0, -1);
    vsh_grid_options options = vsh_grid_options_default();
    vsh_field_options reach = vsh_field_options_default();
    vsh_run run = vsh_run_default();
    run.threads = 1;
    vsh_grid *grid;
    vsh_field *field;
    vsh_error error;
    options.voxel_size = voxel;
    reach.reach = AO_DISTANCE;
    const double start = bench_seconds();
    bench_check(vsh_grid_from_meshes(&mesh, 1, &options, &run, &grid, &error), &error);
    bench_check(vsh_field_create(grid, &reach, &run, &field, &error), &error);
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    printf("terrain: crop in voxels of %g cells: %.1f s, %.1f MB\n", voxel, bench_seconds() - start,
           (double)info.bytes / 1e6);
    vsh_grid_free(grid);
    return field;
}

/* Methods against voxels. */
static void bench_voxels(FILE *csv, const terrain *t, const vsh_points *points, const vsh_light *light,
                         double ray, const float *truth, float *values) {
    static const double voxels[] = {1.0, 0.5};
    for (size_t v = 0; v < 2; ++v) {
        vsh_field *field = voxelise(t, voxels[v]);
        static const int32_t methods[] = {VSH_SHADOW_CONE, VSH_SHADOW_ADAPTIVE};
        for (size_t m = 0; m < (light != NULL ? 2 : 1); ++m) {
            vsh_shade_options shade = vsh_shade_options_default();
            vsh_shade_stats stats;
            shade.method = methods[m];
            shade.ao_distance = AO_DISTANCE;
            const double seconds =
                light != NULL
                    ? bench_shadow(1, bench_casts(field), points, light, &shade, values, NULL, &stats)
                    : bench_ao(1, bench_casts(field), points, &shade, values, &stats);
            char what[40];
            snprintf(what, sizeof what, "%s %g",
                     light != NULL ? vsh_shadow_method_name(methods[m]) : "ao cones", voxels[v]);
            row(csv, "terrain", what, seconds, COUNT, ray, &stats, values, truth);
        }
        vsh_field_free(field);
    }
}

static void bench_heights(FILE *csv) {
    terrain t = make();
    const vsh_points points = {COUNT, t.positions, t.normals, NULL};
    float *truth = bench_take(COUNT * sizeof *truth), *values = bench_take(COUNT * sizeof *values);
    vsh_light sun = vsh_light_default();
    memcpy(sun.direction, SUN, sizeof SUN);
    sun.angle = SUN_ANGLE;
    vsh_error error;
    vsh_field *empty;
    bench_check(vshi_field_create_empty(1e-6, &empty, &error), &error);
    vsh_layer layer = vsh_layer_default();
    layer.heights = t.heights;
    vsh_shade_options shade = vsh_shade_options_default();
    shade.ao_distance = AO_DISTANCE;
    for (int ao = 0; ao < 2; ++ao) {
        double ray = 0.0;
        const double w = tan(0.5 * SUN_ANGLE);
        if (t.truth != NULL) {
            const truth_question question = {COUNT, t.positions, t.normals, ao ? NULL : SUN,
                                             w,     AO_DISTANCE, 1};
            if (ao) {
                truth_mesh_ao(t.truth, COUNT, t.positions, t.normals, AO_DISTANCE, TRUTH_RAYS, 0, truth);
            } else {
                truth_mesh_light(t.truth, COUNT, t.positions, t.normals, SUN, w, TRUTH_RAYS, 0, truth);
            }
            ray = bench_embree(csv, "terrain", t.truth, &question, truth, NULL, values).ray;
        }
        static const int32_t marches[] = {VSH_SHADOW_HARD, VSH_SHADOW_CLASSIC};
        for (size_t m = 0; m < 2 && !ao; ++m) {
            vsh_shade_stats stats;
            char what[40];
            layer.method = marches[m];
            const double seconds = bench_shadow(BENCH_RUNS, bench_layered(empty, &layer), &points, &sun,
                                                &shade, values, NULL, &stats);
            snprintf(what, sizeof what, "direct %s", vsh_shadow_method_name(marches[m]));
            row(csv, "terrain", what, seconds, COUNT, ray, &stats, values, truth);
        }
        bench_voxels(csv, &t, &points, ao ? NULL : &sun, ray, truth, values);
    }
    vsh_field_free(empty);
    truth_mesh_free(t.truth);
    vsh_model_free(t.model);
    vsh_heights_free(t.heights);
    free(values);
    free(truth);
    free(t.normals);
    free(t.positions);
    free(t.crop);
    free(t.values);
}

/* --- spheres over a floor */

enum { SPHERES = 10000, TEXELS = 48, SPHERE_RAYS = 256 };

static double random_in(uint64_t *counter, double low, double high) {
    return low + (high - low) * (double)(vshi_mix(++*counter) >> 11) * 0x1p-53;
}

static void sphere_row(FILE *csv, const char *what, const vsh_occluders *occluders, const vsh_points *points,
                       const vsh_light *light, const vsh_shade_options *shade, const float *truth,
                       float *values) {
    vsh_shade_stats stats;
    const double seconds =
        light != NULL ? bench_shadow(BENCH_RUNS, occluders, points, light, shade, values, NULL, &stats)
                      : bench_ao(BENCH_RUNS, occluders, points, shade, values, &stats);
    row(csv, "spheres", what, seconds, points->count, 0.0, &stats, values, truth);
}

static void bench_balls(FILE *csv) {
    enum { FLOOR = TEXELS * TEXELS };
    double(*spheres)[4] = bench_take(SPHERES * sizeof *spheres);
    truth_solid *solids = bench_take(SPHERES * sizeof *solids);
    static double positions[3 * FLOOR];
    static float normals[3 * FLOOR], truth[FLOOR], analytic[FLOOR], values[FLOOR];
    static const double up[3] = {0.0, 1.0, 0.0};
    uint64_t counter = 1;
    for (size_t i = 0; i < SPHERES; ++i) {
        double *s = spheres[i];
        s[3] = random_in(&counter, 0.01, 0.06);
        s[0] = random_in(&counter, -3.0, 3.0);
        s[1] = s[3] + random_in(&counter, 0.02, 1.5);
        s[2] = random_in(&counter, -3.0, 3.0);
        solids[i] = (truth_solid){.shape = TRUTH_SPHERE, .center = {s[0], s[1], s[2]}, .radius = s[3]};
    }
    for (size_t i = 0; i < FLOOR; ++i) {
        positions[3 * i] = -3.0 + 6.0 * ((double)(i % TEXELS) + 0.5) / TEXELS;
        positions[3 * i + 2] = -3.0 + 6.0 * ((double)(i / TEXELS) + 0.5) / TEXELS;
        normals[3 * i + 1] = 1.0f;
    }
    vsh_error error;
    vsh_spheres *made;
    vsh_field *empty;
    double start = bench_seconds();
    bench_check(vsh_spheres_create(spheres[0], SPHERES, NULL, NULL, &made, &error), &error);
    printf("spheres: bounds over %d: %.4f s\n", SPHERES, bench_seconds() - start);
    bench_check(vshi_field_create_empty(1e-6, &empty, &error), &error);
    const vsh_points points = {FLOOR, positions, normals, NULL};
    vsh_light sun = vsh_light_default();
    memcpy(sun.direction, SUN, sizeof SUN);
    sun.angle = SUN_ANGLE;
    const truth_scene scene = {solids, SPHERES};
    vsh_layer layer = vsh_layer_default();
    layer.spheres = made;
    vsh_shade_options shade = vsh_shade_options_default();
    shade.ao_distance = 0.5;
    static const double voxel = 0.01;
    const vsh_caster caster = {.type = VSH_CASTER_SPHERES,
                               .spheres = spheres[0],
                               .sphere_count = SPHERES,
                               .voxelised = 1,
                               .transform = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
    vsh_scene voxels = {.casters = &caster, .caster_count = 1, .grid = vsh_grid_options_default()};
    voxels.grid.voxel_size = voxel;
    vsh_run run = vsh_run_default();
    run.threads = 1;
    vsh_assets *assets;
    vsh_grid *grid;
    vsh_field *field;
    vsh_field_options reach = vsh_field_options_default();
    reach.reach = 0.5;
    start = bench_seconds();
    bench_check(vsh_assets_load(&voxels, &run, &assets, &error), &error);
    bench_check(vsh_scene_casters(&voxels, assets, &run, &grid, &error), &error);
    bench_check(vsh_field_create(grid, &reach, &run, &field, &error), &error);
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    printf("spheres: voxels of %g: %.1f s, %.1f MB\n", voxel, bench_seconds() - start,
           (double)info.bytes / 1e6);
    for (int ao = 0; ao < 2; ++ao) {
        start = bench_seconds();
        if (ao) {
            for (size_t i = 0; i < FLOOR; ++i) {
                truth[i] = (float)truth_ao(scene, positions + 3 * i, up, shade.ao_distance, SPHERE_RAYS);
            }
        } else {
            truth_lights(scene, FLOOR, positions, up, SUN, tan(0.5 * SUN_ANGLE), INFINITY, SPHERE_RAYS,
                         truth);
        }
        printf("spheres: truth, %d rays a texel against each: %.1f s\n", SPHERE_RAYS,
               bench_seconds() - start);
        sphere_row(csv, ao ? "analytic ao" : "analytic", bench_layered(empty, &layer), &points,
                   ao ? NULL : &sun, &shade, truth, analytic);
        vsh_shade_options by_voxels = vsh_shade_options_default();
        by_voxels.ao_distance = shade.ao_distance;
        sphere_row(csv, ao ? "ao cones 0.01" : "cone 0.01", bench_casts(field), &points, ao ? NULL : &sun,
                   &by_voxels, truth, values);
        by_voxels.method = VSH_SHADOW_ADAPTIVE;
        by_voxels.ao_method = VSH_AO_ADAPTIVE;
        sphere_row(csv, ao ? "ao adaptive 0.01" : "adaptive 0.01", bench_casts(field), &points,
                   ao ? NULL : &sun, &by_voxels, truth, values);
        const truth_metrics apart = truth_compare(FLOOR, analytic, values, NULL);
        truth_metrics_print("  analytic from it", &apart);
    }
    vsh_field_free(field);
    vsh_grid_free(grid);
    vsh_assets_free(assets);
    vsh_field_free(empty);
    vsh_spheres_free(made);
    free(solids);
    free(spheres);
}

void bench_terrain(FILE *csv) {
    bench_heights(csv);
    bench_balls(csv);
}
