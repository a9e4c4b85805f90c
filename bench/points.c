/* Points of the caller's own: one at a time, and a million all over the sample asset in no order, by
 * vsh_shade_shadow() as they come and by a vsh_query. */
#include "bench.h"
#include "casts.h"
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RESOLUTION = 512, MANY = 1000000, SINGLE = 20000, RUNS = 3 };

static const double SUN[3] = {-0.5, 0.8, -0.6};
static const double SUN_ANGLE = 5.0 * 3.14159265358979323846 / 180.0;

/* A number in [0, 1), counted (splitmix64). */
static double uniform(uint64_t *counter) {
    uint64_t z = (*counter += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

static void corner(const vsh_mesh *mesh, size_t triangle, int k, double p[3]) {
    const float *v = mesh->positions + 3 * (size_t)mesh->indices[3 * triangle + (size_t)k];
    for (int axis = 0; axis < 3; ++axis) {
        p[axis] = (double)v[axis];
    }
}

/* Twice the area; the normal of that length. */
static double area(const vsh_mesh *mesh, size_t triangle, double normal[3]) {
    double p[3][3];
    for (int k = 0; k < 3; ++k) {
        corner(mesh, triangle, k, p[k]);
    }
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        normal[a] = (p[1][b] - p[0][b]) * (p[2][c] - p[0][c]) - (p[1][c] - p[0][c]) * (p[2][b] - p[0][b]);
    }
    return sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
}

/* Uniform over the surface, in no order. */
static void place_points(const bench_scene *scene, size_t count, double *positions, float *normals) {
    size_t triangles = 0, n = 0;
    for (size_t m = 0; m < scene->mesh_count; ++m) {
        triangles += scene->meshes[m].triangle_count;
    }
    double *sums = bench_take(triangles * sizeof *sums), sum = 0.0, normal[3];
    const vsh_mesh **mesh = bench_take(triangles * sizeof *mesh);
    size_t *number = bench_take(triangles * sizeof *number);
    for (size_t m = 0; m < scene->mesh_count; ++m) {
        for (size_t t = 0; t < scene->meshes[m].triangle_count; ++t, ++n) {
            mesh[n] = &scene->meshes[m];
            number[n] = t;
            sums[n] = sum += area(mesh[n], t, normal);
        }
    }
    uint64_t counter = 11;
    for (size_t i = 0; i < count; ++i) {
        const double place = uniform(&counter) * sum;
        size_t low = 0, high = triangles - 1;
        while (low < high) {
            const size_t middle = (low + high) / 2;
            if (sums[middle] > place) {
                high = middle;
            } else {
                low = middle + 1;
            }
        }
        const double root = sqrt(uniform(&counter)), v = uniform(&counter);
        const double weights[3] = {1.0 - root, root * (1.0 - v), root * v};
        const double length = area(mesh[low], number[low], normal);
        for (size_t axis = 0; axis < 3; ++axis) {
            positions[3 * i + axis] = 0.0;
            normals[3 * i + axis] = (float)(normal[axis] / length);
        }
        for (int k = 0; k < 3; ++k) {
            double p[3];
            corner(mesh[low], number[low], k, p);
            for (size_t axis = 0; axis < 3; ++axis) {
                positions[3 * i + axis] += weights[k] * p[axis];
            }
        }
    }
    free(sums);
    free(mesh);
    free(number);
}

typedef struct points_bench {
    FILE *csv;
    const vsh_field *field;
    const vsh_light *sun;
    vsh_points points;
    float *values, *reference;
} points_bench;

/* Median seconds of a query's call of `each` points, until `count` are done. */
static double query_seconds(const points_bench *b, const vsh_query *query, size_t count, size_t each,
                            int32_t threads, vsh_shade_stats *stats) {
    double seconds[RUNS];
    vsh_run run = vsh_run_default();
    run.threads = threads;
    vsh_error error;
    for (int r = 0; r < RUNS; ++r) {
        *stats = vsh_shade_stats_zero();
        const double start = bench_seconds();
        for (size_t i = 0; i < count; i += each) {
            const vsh_points points = {each, b->points.positions + 3 * i, b->points.normals + 3 * i, NULL};
            float *const visibility[1] = {b->values + i};
            vsh_query_output output = vsh_query_output_default();
            output.visibility = visibility;
            bench_check(vsh_query_points(query, &points, NULL, &run, &output, stats, &error), &error);
        }
        seconds[r] = bench_seconds() - start;
    }
    return bench_median(seconds, RUNS);
}

/* The same of vsh_shade_shadow(), a point a call. */
static double shade_seconds(const points_bench *b, const vsh_shade_options *shade, size_t count,
                            vsh_shade_stats *stats) {
    double seconds[RUNS];
    vsh_run run = vsh_run_default();
    run.threads = 1;
    vsh_error error;
    for (int r = 0; r < RUNS; ++r) {
        *stats = vsh_shade_stats_zero();
        const double start = bench_seconds();
        for (size_t i = 0; i < count; ++i) {
            const vsh_points points = {1, b->points.positions + 3 * i, b->points.normals + 3 * i, NULL};
            bench_check(vsh_shade_shadow(bench_casts(b->field), &points, b->sun, shade, &run, b->values + i,
                                         NULL, stats, &error),
                        &error);
        }
        seconds[r] = bench_seconds() - start;
    }
    return bench_median(seconds, RUNS);
}

static void row(const points_bench *b, const char *how, int32_t method, size_t count, double seconds,
                const vsh_shade_stats *stats) {
    char what[64];
    const truth_metrics off = truth_compare(count, b->values, b->reference, NULL);
    snprintf(what, sizeof what, "%s %s", how, vsh_get_name(VSH_NAMES_SHADOW, method));
    bench_row(b->csv, "points", what, 1e6 * seconds / (double)count, (double)stats->samples / (double)count,
              0.0, &off);
}

void bench_points(FILE *csv) {
    bench_scene scene;
    bench_scene_make(BENCH_CLOISTER, &scene);
    vsh_field *field = bench_scene_field(&scene, RESOLUTION);
    double *positions = bench_take((size_t)MANY * 3 * sizeof *positions);
    float *normals = bench_take((size_t)MANY * 3 * sizeof *normals);
    float *values = bench_take((size_t)MANY * sizeof *values);
    float *reference = bench_take((size_t)MANY * sizeof *reference);
    place_points(&scene, MANY, positions, normals);
    vsh_light sun = vsh_light_default();
    memcpy(sun.direction, SUN, sizeof sun.direction);
    sun.angle = SUN_ANGLE;
    const points_bench b = {csv, field, &sun, {MANY, positions, normals, NULL}, values, reference};
    puts("points: random places on the sample asset; processor microseconds a point; differences are from "
         "vsh_shade_shadow() of all");
    const int32_t methods[] = {VSH_SHADOW_HARD, VSH_SHADOW_CONE, VSH_SHADOW_ADAPTIVE};
    for (size_t m = 0; m < sizeof methods / sizeof methods[0]; ++m) {
        vsh_shade_options shade = vsh_shade_options_default();
        shade.method = methods[m];
        vsh_query *query = NULL;
        vsh_shade_stats stats;
        vsh_error error;
        bench_check(vsh_query_create(bench_casts(field), &sun, 1, &shade, &query, &error), &error);
        double seconds =
            bench_shadow(RUNS, bench_casts(field), &b.points, &sun, &shade, reference, NULL, &stats);
        memcpy(values, reference, (size_t)MANY * sizeof *values);
        row(&b, "1e6 as they come", methods[m], MANY, seconds, &stats);
        seconds = query_seconds(&b, query, MANY, MANY, 1, &stats);
        row(&b, "1e6 query", methods[m], MANY, seconds, &stats);
        seconds = query_seconds(&b, query, MANY, MANY, 2, &stats);
        row(&b, "1e6 query, 2 threads", methods[m], MANY, seconds, &stats);
        seconds = query_seconds(&b, query, SINGLE, 1, 1, &stats);
        row(&b, "single query", methods[m], SINGLE, seconds, &stats);
        seconds = shade_seconds(&b, &shade, SINGLE, &stats);
        row(&b, "single vsh_shade_shadow", methods[m], SINGLE, seconds, &stats);
        vsh_query_free(query);
    }
    /* one at a time, each next to the one before: what the call costs where memory does not */
    vsh_query *query = NULL;
    vsh_shade_stats stats;
    vsh_error error;
    bench_scene_points(&scene, field, 5, SINGLE, positions, normals, reference);
    bench_check(vsh_query_create(bench_casts(field), &sun, 1, NULL, &query, &error), &error);
    bench_shadow(1, bench_casts(field), &b.points, &sun, NULL, reference, NULL, &stats);
    const double seconds = query_seconds(&b, query, SINGLE, 1, 1, &stats);
    row(&b, "single query, lightmap order", VSH_SHADOW_CONE, SINGLE, seconds, &stats);
    vsh_query_free(query);
    free(positions);
    free(normals);
    free(values);
    free(reference);
    vsh_field_free(field);
    bench_scene_free(&scene);
}
