/* adaptive against rays on its own field, and exact against Embree's rays, on an asset, a smooth mesh and a
 * thin structure (tools/make_bench_scenes.py): receivers are points all over the meshes, one thread for both
 * sides. */
#include "bench.h"
#include "embree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { POINTS = 60000, TRUTH_RAYS = 1024, RESOLUTION = 512 };

static const double SUN[3] = {-0.5, 0.8, -0.6};
static const double SUN_ANGLE = 5.0 * 3.14159265358979323846 / 180.0;
static const double LIFT = 1e-5;

/* --- receivers */

typedef struct receivers {
    double *positions, *origins;
    float *normals, *valid, *truth, *values, *reference, *deviation;
} receivers;

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

/* Points uniform in area over all triangles. */
static void place_points(const vsh_mesh *meshes, size_t mesh_count, const vsh_field *field, receivers *r) {
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    double total = 0.0, done = 0.0;
    size_t placed = 0;
    uint64_t state = 9;
    for (int pass = 0; pass < 2; ++pass) {
        for (size_t m = 0; m < mesh_count; ++m) {
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
                for (; placed < POINTS && (double)placed + 0.5 <= done / total * POINTS; ++placed) {
                    const double u = sqrt(next_number(&state)), v = next_number(&state);
                    double probe[3];
                    float distance;
                    for (int k = 0; k < 3; ++k) {
                        const double p = a[k] + u * (1.0 - v) * b[k] + u * v * c[k];
                        r->positions[3 * placed + (size_t)k] = p;
                        r->normals[3 * placed + (size_t)k] = (float)(n[k] / length);
                        r->origins[3 * placed + (size_t)k] = p + LIFT * n[k] / length;
                        probe[k] = p + info.voxel_size * n[k] / length;
                    }
                    vsh_field_sample(field, 1, probe, &distance);
                    r->valid[placed] = distance >= 0.0f ? 1.0f : 0.0f; /* as the bake judges */
                }
            }
        }
    }
}

/* --- the measurement */

/* Seconds that a curve of falling errors takes for an error, between its points by powers and beyond them
 * likewise. */
static double seconds_for(double error, const double *errors, const double *seconds, size_t count) {
    size_t i = 0;
    while (i + 2 < count && errors[i + 1] > error) {
        ++i;
    }
    const double part = log(error / errors[i]) / log(errors[i + 1] / errors[i]);
    return seconds[i] * pow(seconds[i + 1] / seconds[i], part);
}

static void measure(FILE *csv, const char *name, const char *path) {
    vsh_error error;
    vsh_triangles *triangles = NULL;
    bench_scene scene = bench_load(path, RESOLUTION);
    const vsh_field *field = scene.field;
    bench_check(vsh_triangles_create(scene.meshes, scene.mesh_count, NULL, &triangles, &error), &error);
    truth_mesh *mesh = truth_mesh_create(scene.meshes, scene.mesh_count);
    if (mesh == NULL) {
        puts("refine: no Embree, no truth");
        exit(2);
    }
    float *memory = bench_take((size_t)POINTS * 8 * sizeof *memory);
    double *places = bench_take((size_t)POINTS * 6 * sizeof *places);
    receivers r = {places,
                   places + 3 * POINTS,
                   memory,
                   memory + 3 * POINTS,
                   memory + 4 * POINTS,
                   memory + 5 * POINTS,
                   memory + 6 * POINTS,
                   memory + 7 * POINTS};
    place_points(scene.meshes, scene.mesh_count, field, &r);
    const double w = tan(0.5 * SUN_ANGLE);
    truth_mesh_light(mesh, POINTS, r.origins, r.normals, SUN, w, TRUTH_RAYS, 0, r.truth);

    /* Embree's own curve, rays one by one in its fastest order: error and seconds of 1, 4 … rays */
    enum { CURVE = 5 };
    double curve_error[CURVE], curve_seconds[CURVE];
    char what[64];
    double ray = 0.0;
    for (int i = 0; i < CURVE; ++i) {
        double seconds[BENCH_RUNS];
        const size_t rays = (size_t)1 << (2 * i);
        for (int k = 0; k < (i < 3 ? BENCH_RUNS : 1); ++k) {
            const double start = bench_seconds();
            truth_mesh_light(mesh, POINTS, r.origins, r.normals, SUN, w, rays, 1, r.values);
            seconds[k] = bench_seconds() - start;
        }
        const truth_metrics metrics = truth_compare(POINTS, r.values, r.truth, r.valid);
        curve_seconds[i] = bench_median(seconds, i < 3 ? BENCH_RUNS : 1);
        curve_error[i] = metrics.rmse;
        ray = curve_seconds[i] / POINTS / (double)rays;
        snprintf(what, sizeof what, "embree %zu", rays);
        bench_row(csv, name, what, 1e6 * curve_seconds[i] / POINTS, 0.0, curve_seconds[i] / POINTS / ray,
                  &metrics);
    }

    const vsh_points points = {POINTS, r.positions, r.normals, NULL};
    vsh_light sun = vsh_light_default();
    memcpy(sun.direction, SUN, sizeof SUN);
    sun.angle = SUN_ANGLE;
    vsh_shade_options shade = vsh_shade_options_default();
    shade.method = VSH_SHADOW_RAYS;
    shade.rays = TRUTH_RAYS;
    bench_check(vsh_shade_shadow(field, &points, &sun, &shade, NULL, r.reference, NULL, NULL, &error),
                &error);
    const double asked[] = {0.1, 0.05, 0.02, 0.01};
    for (int exact = 0; exact < 2; ++exact) {
        for (size_t e = 0; e < sizeof asked / sizeof asked[0]; ++e) {
            shade.method = exact ? VSH_SHADOW_EXACT : VSH_SHADOW_ADAPTIVE;
            shade.max_error = asked[e];
            shade.triangles = triangles;
            vsh_shade_stats stats;
            const double each =
                bench_shadow(3, field, &points, &sun, &shade, r.values, r.deviation, &stats) / POINTS;
            const truth_metrics metrics =
                truth_compare(POINTS, r.values, exact ? r.truth : r.reference, r.valid);
            snprintf(what, sizeof what, "%s %g", exact ? "exact" : "adaptive", asked[e]);
            bench_row(csv, name, what, 1e6 * each, (double)stats.samples / POINTS, each / ray, &metrics);
            size_t proved = 0, wrong = 0, valid = 0;
            for (size_t i = 0; i < POINTS; ++i) {
                if (r.valid[i] > 0.0f) {
                    ++valid;
                    proved += r.deviation[i] == 0.0f;
                    wrong += r.deviation[i] == 0.0f && r.values[i] != r.truth[i];
                }
            }
            printf("          estimated %.4f; %.1f %% proved, %zu of %zu wrong; %.2f rays a point",
                   sqrt(stats.square_error / POINTS), 100.0 * (double)proved / (double)valid, wrong, proved,
                   (double)stats.rays / POINTS);
            if (exact) {
                const double embree = seconds_for(metrics.rmse, curve_error, curve_seconds, CURVE) / POINTS;
                printf("; Embree takes %.3f us for this error: %.2f of its time", 1e6 * embree,
                       each / embree);
            }
            puts("");
        }
    }
    free(places);
    free(memory);
    truth_mesh_free(mesh);
    vsh_triangles_free(triangles);
    bench_unload(&scene);
}

void bench_refine(FILE *csv) {
    measure(csv, "cloister", VSH_ASSETS "/cloister.glb");
    measure(csv, "smooth", VSH_ASSETS "/smooth.glb");
    measure(csv, "thin", VSH_ASSETS "/thin.glb");
}
