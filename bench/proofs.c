/* Proofs that are wrong: points whose light a cone has certified as fully seen or fully hidden, checked with
 * rays against the triangles. Nothing here is timed. */
#include "bench.h"
#include "casts.h"
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define RADIANS(degrees) ((degrees)*3.14159265358979323846 / 180.0)

/* RAYS over the disc of every certified point, MORE where a light WIDER times as wide is not certified: wrong
 * proofs would be there first. */
enum { POINTS = 80000, RAYS = 256, MORE = 4096, SHOWN = 5 };
static const double WIDER = 1.3;
static const double LIFT = 1e-5;

typedef struct light_case {
    const char *name;
    double direction[3]; /* of a sun; of a lamp: its place, of the scene's size from its middle */
    double size;         /* degrees; of a lamp: its radius, of the scene's size */
    int lamp;
} light_case;

static const light_case LIGHTS[] = {
    {"sun 5", {-0.5, 0.8, -0.6}, 5.0, 0},       {"narrow 0.5", {0.3, 0.7, 0.45}, 0.5, 0},
    {"wide 30", {0.2, 0.9, -0.3}, 30.0, 0},     {"overhead 2", {0.0, 1.0, 0.0}, 2.0, 0},
    {"grazing 0.5", {0.9, 0.13, 0.43}, 0.5, 0}, {"grazing 10", {-0.7, 0.2, 0.68}, 10.0, 0},
    {"lamp", {0.13, 0.3, 0.08}, 0.02, 1},       {"large lamp", {-0.3, 0.7, 0.5}, 0.12, 1}};
enum { LIGHT_COUNT = sizeof LIGHTS / sizeof LIGHTS[0] };
static const int32_t RESOLUTIONS[] = {512, 128, 64, 32};

static vsh_light light_of(const light_case *c, const vsh_field_info *info, double wider) {
    vsh_light light = vsh_light_default();
    double size = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        size = fmax(size, info->bounds_max[axis] - info->bounds_min[axis]);
    }
    if (c->lamp) {
        light.type = VSH_LIGHT_SPHERE;
        light.radius = wider * c->size * size;
        for (int axis = 0; axis < 3; ++axis) {
            light.position[axis] =
                0.5 * (info->bounds_min[axis] + info->bounds_max[axis]) + c->direction[axis] * size;
        }
    } else {
        memcpy(light.direction, c->direction, sizeof light.direction);
        light.angle = wider * RADIANS(c->size);
    }
    return light;
}

typedef struct points {
    double *positions, *chosen_positions;
    float *normals, *chosen_normals, *valid, *values, *deviation, *wide_values, *wide_deviation, *truth;
    size_t *chosen;
} points;

static void *room(size_t count, size_t size) {
    void *memory = malloc(count * size);
    if (memory == NULL) {
        exit(4);
    }
    return memory;
}

/* Whether a part of the light is over the point's horizon: the rest is dark by that, and no proof. */
static int over_horizon(const vsh_light *light, const double *position, const float *normal) {
    double along = 0.0, length = 0.0, normal_length = 0.0;
    for (int k = 0; k < 3; ++k) {
        const double to =
            light->type == VSH_LIGHT_DIRECTIONAL ? light->direction[k] : light->position[k] - position[k];
        along += to * (double)normal[k];
        length += to * to;
        normal_length += (double)normal[k] * (double)normal[k];
    }
    const double sine =
        light->type == VSH_LIGHT_DIRECTIONAL ? sin(0.5 * light->angle) : light->radius / sqrt(length);
    return along / sqrt(length * normal_length) > -sine;
}

typedef struct tally {
    size_t valid, proved, free, near, wrong;
    size_t above; /* of the wrong ones, those that are so too from where the field's rays begin */
} tally;

/* Traces the chosen points; counts and shows those whose value is not what was proved. */
static void trace(const points *p, size_t count, const vsh_triangles *triangles, const vsh_light *light,
                  int32_t rays, double offset, tally *t, truth_metrics *worst) {
    vsh_error error;
    for (size_t i = 0; i < count; ++i) {
        memcpy(p->chosen_positions + 3 * i, p->positions + 3 * p->chosen[i], 3 * sizeof(double));
        memcpy(p->chosen_normals + 3 * i, p->normals + 3 * p->chosen[i], 3 * sizeof(float));
    }
    bench_check(vsh_trace_shadow(triangles, NULL, count, p->chosen_positions, p->chosen_normals, LIFT, light,
                                 rays, NULL, p->truth, &error),
                &error);
    for (size_t i = 0; i < count; ++i) {
        const float proved = p->values[p->chosen[i]];
        const double off = fabs((double)p->truth[i] - (double)proved);
        worst->max = fmax(worst->max, off);
        worst->rmse += off * off;
        worst->bias += (double)proved - (double)p->truth[i];
        if (!(off > 0.0)) {
            continue;
        }
        const double *at = p->chosen_positions + 3 * i;
        const float *n = p->chosen_normals + 3 * i;
        float lifted;
        bench_check(vsh_trace_shadow(triangles, NULL, 1, at, n, offset, light, rays, NULL, &lifted, &error),
                    &error);
        t->above += lifted != proved;
        if (++t->wrong <= SHOWN) {
            printf("          wrong: %g proved, %.5f traced, %.5f from where rays begin, at (%.17g, %.17g, "
                   "%.17g), normal (%.9g, %.9g, %.9g)\n",
                   (double)proved, (double)p->truth[i], (double)lifted, at[0], at[1], at[2], (double)n[0],
                   (double)n[1], (double)n[2]);
        }
    }
}

static void prove(const vsh_field *field, const vsh_triangles *triangles, const points *p,
                  const vsh_light *light, float *values, float *deviation) {
    vsh_error error;
    vsh_shade_options shade = vsh_shade_options_default();
    shade.method = VSH_SHADOW_EXACT;
    shade.rays = 8;
    shade.max_error = 1.0; /* only what is proved has no error left */
    const vsh_points all = {POINTS, p->positions, p->normals, NULL};
    bench_check(vsh_shade_shadow(bench_traced(field, triangles), &all, light, &shade, NULL, values, deviation,
                                 NULL, &error),
                &error);
}

static tally check(FILE *csv, const char *scene, int32_t resolution, const light_case *c,
                   const vsh_field *field, const vsh_triangles *triangles, const points *p) {
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    const vsh_light light = light_of(c, &info, 1.0), wider = light_of(c, &info, WIDER);
    prove(field, triangles, p, &light, p->values, p->deviation);
    prove(field, triangles, p, &wider, p->wide_values, p->wide_deviation);
    tally t = {0, 0, 0, 0, 0, 0};
    truth_metrics metrics;
    memset(&metrics, 0, sizeof metrics);
    for (int near = 0; near < 2; ++near) {
        size_t count = 0;
        for (size_t i = 0; i < POINTS; ++i) {
            if (!(p->valid[i] > 0.0f)) {
                continue;
            }
            t.valid += !near;
            if (p->deviation[i] != 0.0f || !over_horizon(&light, p->positions + 3 * i, p->normals + 3 * i)) {
                continue;
            }
            const int far = p->wide_deviation[i] == 0.0f && p->wide_values[i] == p->values[i];
            if (far == !near) {
                t.free += p->values[i] == 1.0f;
                p->chosen[count++] = i;
            }
        }
        t.proved += count;
        t.near += near ? count : 0;
        trace(p, count, triangles, &light, near ? MORE : RAYS, 0.25 * info.voxel_size, &t, &metrics);
    }
    metrics.rmse = t.proved > 0 ? sqrt(metrics.rmse / (double)t.proved) : 0.0;
    metrics.bias = t.proved > 0 ? metrics.bias / (double)t.proved : 0.0;
    char what[64];
    snprintf(what, sizeof what, "proofs %d %s", resolution, c->name);
    bench_row(csv, scene, what, 0.0, 0.0, 0.0, &metrics);
    printf("          %zu of %zu valid points proved (%.1f %%), %zu free, %zu near the margin; %zu wrong, "
           "%zu of "
           "them from where rays begin too\n",
           t.proved, t.valid, 100.0 * (double)t.proved / (double)t.valid, t.free, t.near, t.wrong, t.above);
    return t;
}

void bench_proofs(FILE *csv) {
    points p = {
        room(POINTS, 3 * sizeof(double)), room(POINTS, 3 * sizeof(double)), room(POINTS, 3 * sizeof(float)),
        room(POINTS, 3 * sizeof(float)),  room(POINTS, sizeof(float)),      room(POINTS, sizeof(float)),
        room(POINTS, sizeof(float)),      room(POINTS, sizeof(float)),      room(POINTS, sizeof(float)),
        room(POINTS, sizeof(float)),      room(POINTS, sizeof(size_t))};
    tally all = {0, 0, 0, 0, 0, 0};
    for (int which = 0; which < BENCH_SCENES; ++which) {
        vsh_error error;
        bench_scene scene;
        vsh_triangles *triangles = NULL;
        bench_scene_make(which, &scene);
        bench_check(vsh_triangles_create(scene.meshes, scene.mesh_count, NULL, &triangles, &error), &error);
        for (size_t r = 0; r < sizeof RESOLUTIONS / sizeof RESOLUTIONS[0]; ++r) {
            vsh_grid *grid = NULL;
            vsh_field *field = NULL;
            vsh_grid_options voxels = vsh_grid_options_default();
            voxels.resolution = RESOLUTIONS[r];
            bench_check(vsh_grid_from_meshes(scene.meshes, scene.mesh_count, &voxels, NULL, &grid, &error),
                        &error);
            bench_check(vsh_field_create(grid, NULL, NULL, &field, &error), &error);
            bench_scene_points(&scene, field, 77 + r, POINTS, p.positions, p.normals, p.valid);
            for (int l = 0; l < LIGHT_COUNT; ++l) {
                const tally t = check(csv, scene.name, RESOLUTIONS[r], &LIGHTS[l], field, triangles, &p);
                all.valid += t.valid;
                all.proved += t.proved;
                all.wrong += t.wrong;
                all.above += t.above;
            }
            vsh_field_free(field);
            vsh_grid_free(grid);
        }
        vsh_triangles_free(triangles);
        bench_scene_free(&scene);
    }
    printf("proofs: %zu of %zu valid points proved, %zu wrong, %zu of them from where rays begin too\n",
           all.proved, all.valid, all.wrong, all.above);
    void *memory[] = {p.positions, p.chosen_positions, p.normals,        p.chosen_normals, p.valid, p.values,
                      p.deviation, p.wide_values,      p.wide_deviation, p.truth,          p.chosen};
    for (size_t i = 0; i < sizeof memory / sizeof memory[0]; ++i) {
        free(memory[i]);
    }
}
