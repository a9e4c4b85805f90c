#include "scenes.h"

#include "bench.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SMOOTH_RINGS = 112, SMOOTH_SIDES = 224 };

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

void bench_scene_make(int which, bench_scene *scene) {
    memset(scene, 0, sizeof *scene);
    if (which == BENCH_CLOISTER) {
        vsh_error error;
        scene->name = "cloister";
        bench_check(vsh_model_read(VSH_ASSETS "/cloister.glb", NULL, &scene->model, &error), &error);
        scene->mesh_count = vsh_model_mesh_count(scene->model);
    } else {
        const shape s = which == BENCH_SMOOTH ? smooth_shape() : thin_shape();
        scene->name = which == BENCH_SMOOTH ? "smooth" : "thin";
        scene->positions = s.positions;
        scene->indices = s.indices;
        scene->mesh_count = 1;
        scene->one = (vsh_mesh){.name = scene->name,
                                .positions = s.positions,
                                .indices = s.indices,
                                .vertex_count = s.vertices,
                                .triangle_count = s.triangles};
    }
    scene->meshes = malloc(scene->mesh_count * sizeof *scene->meshes);
    if (scene->meshes == NULL) {
        exit(4);
    }
    for (size_t i = 0; i < scene->mesh_count; ++i) {
        scene->meshes[i] = scene->model != NULL ? vsh_model_mesh(scene->model, i, -1) : scene->one;
    }
}

void bench_scene_free(bench_scene *scene) {
    free(scene->meshes);
    free(scene->positions);
    free(scene->indices);
    vsh_model_free(scene->model);
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
