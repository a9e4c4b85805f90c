/* What the stages cost against texels, lights, triangles, voxels and threads: seconds, and the exponents that
 * a straight line through their logarithms has. tools/plot-scaling draws the rows. */
#include "bench.h"
#include "casts.h"
#include "scenes.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 512, RESOLUTION = 256, MOST_RUNS = 3, MOST_STEPS = 6, MOST_LIGHTS = 8 };

static const double SUN[3] = {-0.5, 0.8, -0.6};
static const double SUN_ANGLE = 5.0 * 3.14159265358979323846 / 180.0;
static const double AO_DISTANCE = 0.6;
static const double LONG_ENOUGH = 2.0; /* seconds: one run will do */

/* The stages; `bytes` stands among them as it grows like them. */
enum { VOXELIZE, FIELD, TREE, TEXELS, SHADOW, AO, EXACT, BYTES, COSTS };
static const char *const NAMES[COSTS] = {"voxelize", "field", "tree",  "texels",
                                         "shadow",   "ao",    "exact", "bytes"};

typedef struct subject {
    const vsh_mesh *meshes;
    size_t mesh_count;
    int32_t resolution, size, threads;
    size_t lights;
    double (*now)(void);
} subject;

typedef struct lightmap {
    const subject *s;
    const vsh_field *field;
    const vsh_charts *charts;
    const vsh_triangles *triangles;
    float *plane[MOST_LIGHTS];
} lightmap;

static double bake(const lightmap *m, int what) {
    vsh_error error;
    vsh_run run = vsh_run_default();
    run.threads = m->s->threads;
    vsh_shade_options shade = vsh_shade_options_default();
    shade.ao_distance = AO_DISTANCE;
    if (what == EXACT) {
        shade.method = VSH_SHADOW_EXACT;
        shade.max_error = 0.05;
    }
    vsh_light lights[MOST_LIGHTS];
    for (size_t i = 0; i < m->s->lights; ++i) {
        lights[i] = vsh_light_default();
        const double turn = 2.0 * 3.14159265358979323846 * (double)i / MOST_LIGHTS;
        lights[i].direction[0] = SUN[0] * cos(turn) - SUN[2] * sin(turn);
        lights[i].direction[1] = SUN[1];
        lights[i].direction[2] = SUN[0] * sin(turn) + SUN[2] * cos(turn);
        lights[i].angle = SUN_ANGLE;
        snprintf(lights[i].name, sizeof lights[i].name, "sun%zu", i);
    }
    const vsh_lightmap planes = {.shadow = what == AO ? NULL : m->plane,
                                 .ao = what == AO ? m->plane[0] : NULL};
    const double start = m->s->now();
    bench_check(vsh_bake_lightmap(bench_traced(m->field, what == EXACT ? m->triangles : NULL), m->charts,
                                  lights, what == AO ? 0 : m->s->lights, &shade, &run, &planes, NULL, &error),
                &error);
    return m->s->now() - start;
}

static double median_bake(const lightmap *m, int what) {
    double seconds[MOST_RUNS];
    size_t runs = 0;
    do {
        seconds[runs] = bake(m, what);
    } while (seconds[runs++] < LONG_ENOUGH && runs < MOST_RUNS);
    return bench_median(seconds, runs);
}

static void measure(const subject *s, double costs[COSTS]) {
    vsh_error error;
    vsh_run run = vsh_run_default();
    run.threads = s->threads;
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    vsh_triangles *triangles = NULL;
    vsh_charts *charts = NULL;
    vsh_grid_options voxels = vsh_grid_options_default();
    voxels.resolution = s->resolution;
    vsh_lightmap_options size = vsh_lightmap_options_default();
    size.width = size.height = s->size;
    double at[5];
    at[0] = s->now();
    bench_check(vsh_grid_from_meshes(s->meshes, s->mesh_count, &voxels, &run, &grid, &error), &error);
    at[1] = s->now();
    bench_check(vsh_field_create(grid, NULL, &run, &field, &error), &error);
    at[2] = s->now();
    if (vsh_triangles_available()) {
        bench_check(vsh_triangles_create(s->meshes, s->mesh_count, &run, &triangles, &error), &error);
    }
    at[3] = s->now();
    bench_check(vsh_charts_create(s->meshes, s->mesh_count, &size, &run, NULL, &charts, &error), &error);
    at[4] = s->now();
    for (int k = 0; k < 4; ++k) {
        costs[VOXELIZE + k] = at[k + 1] - at[k];
    }
    lightmap m = {s, field, charts, triangles, {NULL}};
    for (size_t i = 0; i < s->lights; ++i) {
        m.plane[i] = bench_take((size_t)s->size * (size_t)s->size * sizeof(float));
    }
    costs[SHADOW] = median_bake(&m, SHADOW);
    costs[AO] = median_bake(&m, AO);
    costs[EXACT] = triangles != NULL ? median_bake(&m, EXACT) : 0.0;
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    costs[BYTES] = (double)info.bytes;
    for (size_t i = 0; i < s->lights; ++i) {
        free(m.plane[i]);
    }
    vsh_charts_free(charts);
    vsh_triangles_free(triangles);
    vsh_field_free(field);
    vsh_grid_free(grid);
}

typedef struct axis {
    const char *name;
    size_t steps;
    double value[MOST_STEPS];
    double costs[MOST_STEPS][COSTS];
} axis;

static void add_row(FILE *csv, axis *a, double value, const subject *s) {
    double *costs = a->costs[a->steps];
    a->value[a->steps++] = value;
    measure(s, costs);
    fprintf(csv, "%s,%.0f", a->name, value);
    printf("%-10s %9.0f", a->name, value);
    for (int c = 0; c < COSTS; ++c) {
        fprintf(csv, c == BYTES ? ",%.0f" : ",%.5f", costs[c]);
        printf(c == BYTES ? " %11.0f" : " %9.4f", costs[c]);
    }
    fputs("\n", csv);
    puts("");
    fflush(stdout);
}

/* Slope of the logarithms, least squares: 1 is linear, 2 grows with the square. */
static void print_exponents(FILE *csv, const axis *a) {
    fprintf(csv, "%s,exponent", a->name);
    printf("%-10s %9s", a->name, "exponent");
    for (int c = 0; c < COSTS; ++c) {
        double x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
        const double n = (double)a->steps;
        for (size_t i = 0; i < a->steps; ++i) {
            const double u = log(a->value[i]), v = log(fmax(a->costs[i][c], 1e-9));
            x += u, y += v, xx += u * u, xy += u * v;
        }
        const double slope = (n * xy - x * y) / (n * xx - x * x);
        fprintf(csv, ",%.3f", slope);
        printf(c == BYTES ? " %11.2f" : " %9.2f", slope);
    }
    fputs("\n", csv);
    puts("\n");
}

/* A lobed ring of 2 m² triangles in the upper half of the lightmap, over a plate in the lower half. */
typedef struct ring {
    float *positions, *uvs;
    uint32_t *indices;
    vsh_mesh meshes[2];
} ring;

static const float PLATE[4][3] = {{-2, -0.9f, -2}, {2, -0.9f, -2}, {2, -0.9f, 2}, {-2, -0.9f, 2}};
static const float PLATE_UVS[4][2] = {{0.02f, 0.02f}, {0.02f, 0.48f}, {0.98f, 0.48f}, {0.98f, 0.02f}};
static const uint32_t PLATE_INDICES[6] = {0, 2, 1, 0, 3, 2};

static ring make_ring(size_t edge) {
    const size_t row = edge + 1, vertices = row * row, triangles = 2 * edge * edge;
    ring r = {bench_take(vertices * 3 * sizeof(float)),
              bench_take(vertices * 2 * sizeof(float)),
              bench_take(triangles * 3 * sizeof(uint32_t)),
              {{0}, {0}}};
    for (size_t i = 0; i < vertices; ++i) {
        const double u = (double)(i % row) / (double)edge, v = (double)(i / row) / (double)edge;
        /* the seam's two sides at the very same place */
        const double a = 2.0 * 3.14159265358979323846 * (i % row == edge ? 0.0 : u),
                     b = 2.0 * 3.14159265358979323846 * (i / row == edge ? 0.0 : v);
        const double tube = 0.35 + 0.08 * cos(7.0 * a) * cos(3.0 * b), radius = 1.2 + tube * cos(b);
        r.positions[3 * i] = (float)(radius * cos(a));
        r.positions[3 * i + 1] = (float)(tube * sin(b));
        r.positions[3 * i + 2] = (float)(radius * sin(a));
        r.uvs[2 * i] = (float)(0.02 + 0.96 * u);
        r.uvs[2 * i + 1] = (float)(0.52 + 0.46 * v);
    }
    size_t at = 0;
    for (size_t y = 0; y < edge; ++y) {
        for (size_t x = 0; x < edge; ++x) {
            const uint32_t a = (uint32_t)(y * row + x), c = a + (uint32_t)row;
            const uint32_t quad[6] = {a, c, a + 1, a + 1, c, c + 1};
            memcpy(&r.indices[at], quad, sizeof quad);
            at += 6;
        }
    }
    r.meshes[0] = (vsh_mesh){.name = "ring",
                             .positions = r.positions,
                             .vertex_count = vertices,
                             .indices = r.indices,
                             .triangle_count = triangles,
                             .uvs = r.uvs};
    r.meshes[1] = (vsh_mesh){.name = "plate",
                             .positions = &PLATE[0][0],
                             .vertex_count = 4,
                             .indices = PLATE_INDICES,
                             .triangle_count = 2,
                             .uvs = &PLATE_UVS[0][0]};
    return r;
}

static void free_ring(ring *r) {
    free(r->indices);
    free(r->uvs);
    free(r->positions);
}

void bench_scaling_header(FILE *csv) {
    fputs("axis,value", csv);
    printf("%-10s %9s", "axis", "value");
    for (int c = 0; c < COSTS; ++c) {
        fprintf(csv, c == BYTES ? ",field_%s" : ",%s_s", NAMES[c]);
        printf(c == BYTES ? " %11s" : " %9s", NAMES[c]);
    }
    fputs("\n", csv);
    puts("");
}

void bench_scaling(FILE *csv) {
    bench_scene scene;
    bench_scene_make(BENCH_CLOISTER, &scene);
    const subject usual = {scene.meshes, scene.mesh_count, RESOLUTION, SIZE, 1, 1, bench_seconds};
    axis texels = {.name = "texels"}, lights = {.name = "lights"}, triangles = {.name = "triangles"},
         voxels = {.name = "voxels"}, threads = {.name = "threads"};
    for (int32_t size = 256; size <= 2048; size *= 2) {
        subject s = usual;
        s.size = size;
        add_row(csv, &texels, (double)size * size, &s);
    }
    print_exponents(csv, &texels);
    for (size_t count = 1; count <= MOST_LIGHTS; count *= 2) {
        subject s = usual;
        s.lights = count;
        add_row(csv, &lights, (double)count, &s);
    }
    print_exponents(csv, &lights);
    for (int32_t resolution = 64; resolution <= 512; resolution *= 2) {
        subject s = usual;
        s.resolution = resolution;
        add_row(csv, &voxels, resolution, &s);
    }
    print_exponents(csv, &voxels);
    static const size_t edges[] = {22, 71, 224, 707}; /* 2 edge² = 1e3 … 1e6 */
    for (size_t i = 0; i < sizeof edges / sizeof edges[0]; ++i) {
        ring r = make_ring(edges[i]);
        subject s = usual;
        s.meshes = r.meshes;
        s.mesh_count = 2;
        add_row(csv, &triangles, (double)(r.meshes[0].triangle_count + 2), &s);
        free_ring(&r);
    }
    print_exponents(csv, &triangles);
    for (int32_t count = 1; count <= bench_cores(); count *= 2) {
        subject s = usual;
        s.size = 1024;
        s.threads = count;
        s.now = bench_wall;
        add_row(csv, &threads, count, &s);
    }
    print_exponents(csv, &threads);
    bench_scene_free(&scene);
}
