/* Error and time of every method at points: the seeds' scene against analytic rays, and valid texels of the
 * sample asset against Embree's rays. One core; medians of runs. "Embree rays" is the number of Embree rays
 * that take the same time, traced in the fastest way (rtcOccluded1, 8, 16).
 *
 *   vsh_methods FILE.csv */
#include "analytic.h"
#include "common.h"
#include "field/field.h"
#include "lightmap/texels.h"
#include "metrics.h"
#include "packets.h"
#include "scene/assets.h"
#include "shade/occluders.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { RUNS = 5, STANDARD = 16 };

static double processor_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int ascending(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *seconds, size_t count) {
    qsort(seconds, count, sizeof *seconds, ascending);
    return seconds[count / 2];
}

static void write_header(FILE *csv) {
    fprintf(csv, "scene,what,us_per_texel,samples_per_texel,embree_rays,rmse,penumbra_rmse,bias,p99,max\n");
    printf("%-9s %-20s %9s %9s %12s %8s %8s %8s %7s %7s\n", "scene", "what", "us/texel", "samples",
           "Embree rays", "rmse", "penumbra", "bias", "p99", "max");
}

/* Prints one row: scene, method, µs and samples a texel, number of Embree rays, error. */
static void write_row(FILE *csv, const char *scene, const char *what, double microseconds, double samples,
                      double embree_rays, const truth_metrics *e) {
    fprintf(csv, "%s,%s,%.4f,%.1f,%.2f,%.5f,%.5f,%.5f,%.4f,%.4f\n", scene, what, microseconds, samples,
            embree_rays, e->rmse, e->penumbra_rmse, e->bias, e->p99, e->max);
    printf("%-9s %-20s %9.3f %9.1f %12.2f %8.4f %8.4f %8.4f %7.3f %7.3f\n", scene, what, microseconds,
           samples, embree_rays, e->rmse, e->penumbra_rmse, e->bias, e->p99, e->max);
    fflush(stdout);
}

/* Median seconds of calls on one thread; AO without a light. */
static double shade_seconds(int runs, const vsh_occluders *occluders, const vsh_points *points,
                            const vsh_light *light, const vsh_shade_options *shade, float *values,
                            vsh_shade_stats *stats) {
    double seconds[RUNS];
    vsh_run run = vsh_run_default();
    run.threads = 1;
    vsh_error error;
    for (int i = 0; i < runs; ++i) {
        *stats = vsh_shade_stats_zero();
        const double start = processor_seconds();
        bench_check(light != NULL
                        ? vsh_shade_shadow(occluders, points, light, shade, &run, values, NULL, stats, &error)
                        : vsh_shade_ao(occluders, points, shade, &run, values, NULL, NULL, stats, &error),
                    &error);
        seconds[i] = processor_seconds() - start;
    }
    return median(seconds, (size_t)runs);
}

static vsh_occluders *make_occluders(const vsh_field *field, const vshi_triangles *triangles) {
    vsh_error error;
    vsh_occluders *occluders = NULL;
    vshi_occluder_parts parts = {.field = NULL};
    parts.field = field;
    parts.triangles = triangles;
    bench_check(vshi_occluders_make(&parts, NULL, &occluders, &error), &error);
    return occluders;
}

/* Prints a row for each method that marches one ray or cone. `ray`: seconds of an Embree ray, or 0. */
static void measure_methods(FILE *csv, const char *scene, const vsh_occluders *occluders,
                            const vsh_points *points, const vsh_light *light, double ray, const float *truth,
                            const float *valid, float *values) {
    for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
        vsh_shade_options shade = vsh_shade_options_default();
        shade.method = method;
        vsh_shade_stats stats;
        const double each =
            shade_seconds(RUNS, occluders, points, light, &shade, values, &stats) / (double)points->count;
        const truth_metrics metrics = truth_compare(points->count, values, truth, valid);
        write_row(csv, scene, vsh_get_name(VSH_NAMES_SHADOW, method), 1e6 * each,
                  (double)stats.samples / (double)points->count, ray > 0.0 ? each / ray : 0.0, &metrics);
    }
}

/* --- the seeds' scene: 512² floor texels against 256 analytic rays each */

enum { SIDE = 512, TILE = 8, SEEDS_RAYS = 256 };

/* Texels of the floor in the order of a lightmap's samples: tiles, each in Morton order. */
static void place_seeds_texels(double *positions, float *normals) {
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

static vsh_field *make_seeds_field(void) {
    vsh_error error;
    vsh_run run = vsh_run_default();
    run.threads = 1;
    vsh_scene *scene = NULL;
    vsh_assets *assets = NULL;
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    bench_check(vsh_scene_read(VSH_ASSETS "/seeds.json", NULL, &scene, &error), &error);
    bench_check(vsh_assets_load(scene, &run, &assets, &error), &error);
    bench_check(vsh_scene_casters(scene, assets, &run, &grid, &error), &error);
    vshi_field_options options = vshi_field_options_default();
    const double low[3] = {-2.5, 0.0, -2.5}, high[3] = {2.5, 0.0, 2.5};
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    double square = 0.0;
    for (int k = 0; k < 3; ++k) {
        const double side = fmax(info.bounds_max[k], high[k]) - fmin(info.bounds_min[k], low[k]);
        square += side * side;
    }
    options.reach = truth_seeds_w * sqrt(square); /* the sun's cone across the scene */
    bench_check(vshi_field_create(grid, &options, &run, &field, &error), &error);
    vsh_grid_free(grid);
    vsh_assets_free(assets);
    vsh_scene_free(scene);
    return field;
}

static void measure_seeds(FILE *csv) {
    const size_t count = (size_t)SIDE * SIDE;
    vsh_field *field = make_seeds_field();
    double *positions = bench_take(count * 3 * sizeof *positions);
    float *normals = bench_take(count * 3 * sizeof *normals);
    float *values = bench_take(count * sizeof *values), *truth = bench_take(count * sizeof *truth);
    place_seeds_texels(positions, normals);
    vsh_light sun = vsh_light_default();
    memcpy(sun.direction, truth_seeds_sun, sizeof sun.direction);
    sun.angle = 2.0 * atan(truth_seeds_w);
    truth_lights(truth_seeds(), count, positions, NULL, truth_seeds_sun, truth_seeds_w, INFINITY, SEEDS_RAYS,
                 truth);
    const vsh_points points = {count, positions, normals, NULL};
    vsh_occluders *occluders = make_occluders(field, NULL);
    measure_methods(csv, "seeds", occluders, &points, &sun, 0.0, truth, NULL, values);
    vsh_occluders_free(occluders);
    free(truth);
    free(values);
    free(normals);
    free(positions);
    vshi_field_free(field);
}

/* --- Embree's time */

static double seconds_of(const truth_mesh *mesh, int packing, const truth_question *question, int runs,
                         float *values) {
    double seconds[RUNS];
    for (int i = 0; i < runs; ++i) {
        const double start = processor_seconds();
        if (truth_mesh_packets(mesh, packing, question, 1, values) != 0) {
            fputs("bench: Embree refused\n", stderr);
            exit(2);
        }
        seconds[i] = processor_seconds() - start;
    }
    return median(seconds, (size_t)runs);
}

/* Finds the fastest way for a number of rays: few rays of a point do not fill a packet. */
static int fastest(const truth_mesh *mesh, const truth_question *question, int runs, double *least,
                   double each[TRUTH_PACKINGS], float *values) {
    int best = 0;
    for (int packing = 0; packing < TRUTH_PACKINGS; ++packing) {
        each[packing] = seconds_of(mesh, packing, question, runs, values);
        best = each[packing] < each[best] ? packing : best;
    }
    *least = each[best];
    return best;
}

/* Rows of errors and seconds for each number of rays. Returns processor seconds of a ray in the fastest way,
 * with 16 rays a point. */
static double measure_embree(FILE *csv, const char *scene, const truth_mesh *mesh,
                             const truth_question *asked, const float *truth, const float *valid,
                             float *values) {
    truth_question question = *asked;
    double each[TRUTH_PACKINGS], ray, seconds;
    const double count = (double)question.count;
    question.rays = STANDARD;
    const int best = fastest(mesh, &question, RUNS, &ray, each, values);
    ray /= count * STANDARD;
    printf("%-9s Embree, ns a ray:", scene);
    for (int packing = 0; packing < TRUTH_PACKINGS; ++packing) {
        printf("%s %.1f %s", packing > 0 ? "," : "", 1e9 * each[packing] / (count * STANDARD),
               truth_packing_name(packing));
    }
    printf("; fastest: %s\n", truth_packing_name(best));
    for (size_t rays = 1; rays <= 256; rays *= 4) {
        question.rays = rays;
        const int packing = fastest(mesh, &question, rays <= 16 ? RUNS : 1, &seconds, each, values);
        truth_mesh_packets(mesh, packing, &question, 0, values);
        const truth_metrics metrics = truth_compare(question.count, values, truth, valid);
        char what[64];
        snprintf(what, sizeof what, "embree %s%zu", question.towards == NULL ? "ao " : "", rays);
        write_row(csv, scene, what, 1e6 * seconds / count, 0.0, seconds / count / ray, &metrics);
    }
    return ray;
}

/* --- the sample asset at 512 voxels: every fourth texel of a 1024² lightmap in both directions */

enum { SIZE = 1024, RESOLUTION = 512, STRIDE = 4, LIGHT_RAYS = 512, AO_RAYS = 4096, AO_RUNS = 3 };

/* Height of the truth's origins above the surface, as a share of the asset's size: enough for Embree's
 * floats. */
static const double LIFT = 1e-5;
static const double SUN[3] = {-0.5, 0.8, -0.6};
static const double SUN_ANGLE = 5.0 * 3.14159265358979323846 / 180.0;
static const double AO_DISTANCE = 0.6;

typedef struct receiver {
    size_t count;
    double *positions; /* on the surface */
    double *lifted;    /* origins of a bake's rays */
    double *origins;   /* origins of the truth's rays */
    float *normals;
    float *valid;
} receiver;

/* Voxels. As in src/lightmap/origins.c, rays begin a voxel above the surface if another surface is closer
 * than CREASE, and samples closer than CLEAR are not shaded. */
static const double CREASE = 0.75, CLEAR = 0.25;

/* The texels of an asset on their way into a receiver. */
typedef struct taking {
    const vsh_field *field;
    receiver *receiver;
} taking;

/* Takes every STRIDE-th sample in both directions, so that the truth takes a minute, not an hour. */
static void take_samples(void *user, const vshi_samples *s) {
    const taking *t = user;
    receiver *r = t->receiver;
    vsh_field_info info;
    vsh_field_get_info(t->field, &info);
    for (size_t i = 0; i < s->count; ++i) {
        if (vsh_texel_column(s->texel[i]) % STRIDE != 0 || vsh_texel_row(s->texel[i]) % STRIDE != 0) {
            continue;
        }
        double probe[3];
        float distance;
        for (size_t k = 0; k < 3; ++k) {
            const double p = s->position[3 * i + k], n = (double)s->geometric[3 * i + k];
            r->positions[3 * r->count + k] = p;
            r->origins[3 * r->count + k] = p + LIFT * n;
            r->normals[3 * r->count + k] = s->normal[3 * i + k];
            probe[k] = p + info.voxel_size * n;
        }
        vsh_field_sample(t->field, 1, probe, &distance);
        const double clear = (double)distance / info.voxel_size;
        const double offset = vsh_shade_options_default().start_offset;
        for (size_t k = 0; k < 3; ++k) {
            r->lifted[3 * r->count + k] = s->position[3 * i + k] + (clear < CREASE ? 1.0 : offset) *
                                                                       info.voxel_size *
                                                                       (double)s->geometric[3 * i + k];
        }
        r->valid[r->count++] = clear >= CLEAR ? 1.0f : 0.0f;
    }
}

static receiver take_texels(const vsh_field *field, const vsh_charts *charts) {
    vsh_error error;
    const size_t most = (size_t)charts->info.samples, triples = most * 3 * sizeof(double);
    receiver r = {0,
                  bench_take(triples),
                  bench_take(triples),
                  bench_take(triples),
                  bench_take(most * 3 * sizeof(float)),
                  bench_take(most * sizeof(float))};
    taking t = {field, &r};
    for (size_t tile = 0; tile < vshi_charts_tiles(&charts->sorted); ++tile) {
        bench_check(vshi_tile_visit(charts, tile, false, take_samples, &t, &error), &error);
    }
    return r;
}

static void measure_asset(FILE *csv) {
    vsh_error error;
    vsh_run run = vsh_run_default();
    vsh_charts *charts = NULL;
    vsh_model *model = NULL;
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    vshi_triangles *triangles = NULL;
    bench_check(vsh_model_read(VSH_ASSETS "/cloister.glb", NULL, &model, &error), &error);
    const size_t mesh_count = vsh_model_mesh_count(model);
    vsh_mesh *meshes = bench_take(mesh_count * sizeof *meshes);
    for (size_t i = 0; i < mesh_count; ++i) {
        meshes[i] = vsh_model_mesh(model, i, -1);
    }
    vsh_grid_options voxels = vsh_grid_options_default();
    voxels.resolution = RESOLUTION;
    bench_check(vsh_grid_from_meshes(meshes, mesh_count, &voxels, NULL, &grid, &error), &error);
    bench_check(vshi_field_create(grid, NULL, NULL, &field, &error), &error);
    vsh_lightmap_options size = vsh_lightmap_options_default();
    size.width = size.height = SIZE;
    bench_check(vsh_charts_create(meshes, mesh_count, &size, &run, NULL, &charts, &error), &error);
    vsh_occluders *marched = make_occluders(field, NULL);
    truth_mesh *mesh = truth_mesh_create(meshes, mesh_count);
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
    double ray = measure_embree(csv, "cloister", mesh, &question, truth, r.valid, values);
    measure_methods(csv, "cloister", marched, &points, &sun, ray, truth, r.valid, values);

    truth_mesh_ao(mesh, r.count, r.origins, r.normals, AO_DISTANCE, AO_RAYS, 0, truth);
    question.towards = NULL;
    question.distance = AO_DISTANCE;
    ray = measure_embree(csv, "cloister", mesh, &question, truth, r.valid, values);
    bench_check(vshi_triangles_create(meshes, mesh_count, NULL, &run, &triangles, &error), &error);
    vsh_occluders *traced = make_occluders(field, triangles);
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
        const double each =
            shade_seconds(AO_RUNS, traced, &from, NULL, &shade, values, &stats) / (double)r.count;
        const truth_metrics metrics = truth_compare(r.count, values, truth, r.valid);
        write_row(csv, "cloister", ladder[m].name, 1e6 * each, (double)stats.samples / (double)r.count,
                  each / ray, &metrics);
    }
    vsh_occluders_free(traced);
    vsh_occluders_free(marched);
    vshi_triangles_free(triangles);
    free(truth);
    free(values);
    free(r.valid);
    free(r.normals);
    free(r.origins);
    free(r.lifted);
    free(r.positions);
    truth_mesh_free(mesh);
    vsh_charts_free(charts);
    vshi_field_free(field);
    vsh_grid_free(grid);
    free(meshes);
    vsh_model_free(model);
}

int main(int argc, char **argv) {
    FILE *csv = argc == 2 ? fopen(argv[1], "w") : NULL;
    if (csv == NULL) {
        fputs("usage: vsh_methods FILE.csv\n", stderr);
        return 2;
    }
    write_header(csv);
    measure_seeds(csv);
    measure_asset(csv);
    return fclose(csv) == 0 ? 0 : 3;
}
