/* adaptive against rays on its own field, and exact against Embree's rays, on an asset, a smooth mesh and a
 * thin structure: receivers are points all over the meshes, one thread for both sides. */
#include "bench.h"
#include "embree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { POINTS = 60000, TRUTH_RAYS = 1024, RESOLUTION = 512, SMOOTH_RINGS = 112, SMOOTH_SIDES = 224 };

static const double SUN[3] = {-0.5, 0.8, -0.6};
static const double SUN_ANGLE = 5.0 * 3.14159265358979323846 / 180.0;
static const double LIFT = 1e-5;

/* --- meshes */

typedef struct shape {
    float *positions;
    uint32_t *indices;
    size_t vertices, triangles;
} shape;

static uint32_t add_vertex(shape *s, double x, double y, double z) {
    float *p = s->positions + 3 * s->vertices;
    p[0] = (float)x;
    p[1] = (float)y;
    p[2] = (float)z;
    return (uint32_t)s->vertices++;
}

static void add_triangle(shape *s, uint32_t a, uint32_t b, uint32_t c) {
    uint32_t *t = s->indices + 3 * s->triangles++;
    t[0] = a;
    t[1] = b;
    t[2] = c;
}

static void add_box(shape *s, const double centre[3], const double half[3]) {
    static const int SIDES[6][4] = {{0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1},
                                    {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 6, 7, 5}};
    uint32_t corner[8];
    for (int i = 0; i < 8; ++i) {
        corner[i] =
            add_vertex(s, centre[0] + (i & 1 ? half[0] : -half[0]), centre[1] + (i & 2 ? half[1] : -half[1]),
                       centre[2] + (i & 4 ? half[2] : -half[2]));
    }
    for (int f = 0; f < 6; ++f) {
        add_triangle(s, corner[SIDES[f][0]], corner[SIDES[f][2]], corner[SIDES[f][1]]);
        add_triangle(s, corner[SIDES[f][0]], corner[SIDES[f][3]], corner[SIDES[f][2]]);
    }
}

static shape new_shape(size_t vertices, size_t triangles) {
    shape s = {malloc(vertices * 3 * sizeof(float)), malloc(triangles * 3 * sizeof(uint32_t)), 0, 0};
    if (s.positions == NULL || s.indices == NULL) {
        exit(4);
    }
    return s;
}

/* A lobed ring of some 50 000 triangles over a plate. */
static shape smooth_shape(void) {
    const double turn = 2.0 * 3.14159265358979323846;
    shape s =
        new_shape((size_t)SMOOTH_RINGS * SMOOTH_SIDES + 8, (size_t)2 * SMOOTH_RINGS * SMOOTH_SIDES + 12);
    for (int i = 0; i < SMOOTH_SIDES; ++i) {
        for (int j = 0; j < SMOOTH_RINGS; ++j) {
            const double a = turn * i / SMOOTH_SIDES, b = turn * j / SMOOTH_RINGS;
            const double tube = 0.28 + 0.08 * sin(5.0 * a + 2.0 * b), ring = 0.9 + tube * cos(b);
            add_vertex(&s, ring * cos(a), 0.8 + tube * sin(b) + 0.15 * sin(3.0 * a), ring * sin(a));
        }
    }
    for (uint32_t i = 0; i < SMOOTH_SIDES; ++i) {
        for (uint32_t j = 0; j < SMOOTH_RINGS; ++j) {
            const uint32_t in = (i + 1) % SMOOTH_SIDES, jn = (j + 1) % SMOOTH_RINGS;
            const uint32_t p = i * SMOOTH_RINGS + j, q = in * SMOOTH_RINGS + j;
            const uint32_t r = in * SMOOTH_RINGS + jn, t = i * SMOOTH_RINGS + jn;
            add_triangle(&s, p, t, r);
            add_triangle(&s, p, r, q);
        }
    }
    add_box(&s, (const double[]){0.0, -0.1, 0.0}, (const double[]){2.0, 0.1, 2.0});
    return s;
}

/* Posts, slats and a sheet for a roof, over a floor. */
static shape thin_shape(void) {
    shape s = new_shape(8 * 64, 12 * 64);
    add_box(&s, (const double[]){0.0, -0.1, 0.0}, (const double[]){2.0, 0.1, 2.0});
    for (int i = 0; i < 12; ++i) {
        const double x = -1.5 + 1.0 * (i % 4), z = -1.2 + 1.2 * (i / 4);
        add_box(&s, (const double[]){x, 0.75, z}, (const double[]){0.03, 0.73, 0.03});
    }
    for (int i = 0; i < 24; ++i) {
        add_box(&s, (const double[]){-1.6 + 0.06 * i, 1.55, 0.0}, (const double[]){0.012, 0.04, 1.4});
    }
    add_box(&s, (const double[]){1.0, 1.6, 0.0}, (const double[]){0.8, 0.012, 1.4});
    return s;
}

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

static void measure(FILE *csv, const char *name, const vsh_mesh *meshes, size_t mesh_count) {
    vsh_error error;
    vsh_run run = vsh_run_default();
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    vsh_triangles *triangles = NULL;
    vsh_grid_options voxels = vsh_grid_options_default();
    voxels.resolution = RESOLUTION;
    bench_check(vsh_grid_from_meshes(meshes, mesh_count, &voxels, &run, &grid, &error), &error);
    bench_check(vsh_field_create(grid, NULL, &run, &field, &error), &error);
    bench_check(vsh_triangles_create(meshes, mesh_count, &run, &triangles, &error), &error);
    truth_mesh *mesh = truth_mesh_create(meshes, mesh_count);
    float *memory = malloc((size_t)POINTS * 8 * sizeof *memory);
    double *places = malloc((size_t)POINTS * 6 * sizeof *places);
    if (mesh == NULL || memory == NULL || places == NULL) {
        puts("refine: no Embree, or no memory");
        exit(2);
    }
    receivers r = {places,
                   places + 3 * POINTS,
                   memory,
                   memory + 3 * POINTS,
                   memory + 4 * POINTS,
                   memory + 5 * POINTS,
                   memory + 6 * POINTS,
                   memory + 7 * POINTS};
    place_points(meshes, mesh_count, field, &r);
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
    run.threads = 1;
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
            double seconds[3];
            vsh_shade_stats stats;
            for (int k = 0; k < 3; ++k) {
                stats = vsh_shade_stats_zero();
                const double start = bench_seconds();
                bench_check(vsh_shade_shadow(field, &points, &sun, &shade, &run, r.values, r.deviation,
                                             &stats, &error),
                            &error);
                seconds[k] = bench_seconds() - start;
            }
            const double each = bench_median(seconds, 3) / POINTS;
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
    vsh_field_free(field);
    vsh_grid_free(grid);
}

static vsh_mesh view(const char *name, const shape *s) {
    return (vsh_mesh){.name = name,
                      .positions = s->positions,
                      .indices = s->indices,
                      .vertex_count = s->vertices,
                      .triangle_count = s->triangles};
}

void bench_refine(FILE *csv) {
    vsh_error error;
    vsh_run run = vsh_run_default();
    vsh_model *model = NULL;
    bench_check(vsh_model_read(VSH_ASSETS "/cloister.glb", &run, &model, &error), &error);
    const size_t mesh_count = vsh_model_mesh_count(model);
    vsh_mesh *meshes = malloc(mesh_count * sizeof *meshes);
    if (meshes == NULL) {
        exit(4);
    }
    for (size_t i = 0; i < mesh_count; ++i) {
        meshes[i] = vsh_model_mesh(model, i, -1);
    }
    measure(csv, "cloister", meshes, mesh_count);
    free(meshes);
    vsh_model_free(model);
    shape shapes[] = {smooth_shape(), thin_shape()};
    const char *names[] = {"smooth", "thin"};
    for (int i = 0; i < 2; ++i) {
        const vsh_mesh mesh = view(names[i], &shapes[i]);
        measure(csv, names[i], &mesh, 1);
        free(shapes[i].positions);
        free(shapes[i].indices);
    }
}
