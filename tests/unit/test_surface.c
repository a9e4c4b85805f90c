/* The surface of a field's finest level: against closed forms, and rays against what the cells read. */
#include "shading.h"
#include "testing.h"

#include "field/field.h"
#include "trace/trace.h"
#include "truth/metrics.h"

#define VOXEL 0.04

typedef vshi_surface_quads quads;

static quads quads_of(const vsh_field *field, double height) {
    const vsh_run run = vsh_run_default();
    quads q;
    assert_ok(vshi_surface_quads_make(field, height, &run, &q, &failure));
    assert_true(q.quad_count > 0);
    return q;
}

static const double GROWN = 0.15; /* voxels */
static const float *compared;

static int compare_corners(const void *a, const void *b) {
    return memcmp(compared + 3 * (size_t) * (const uint32_t *)a,
                  compared + 3 * (size_t) * (const uint32_t *)b, 3 * sizeof(float));
}

static int compare_edges(const void *a, const void *b) {
    return memcmp(a, b, 2 * sizeof(uint32_t));
}

/* Gives corners at one place one number: bricks have their own. */
static uint32_t *welded(const quads *q) {
    uint32_t *order = calloc(q->corner_count, sizeof *order), *same = calloc(q->corner_count, sizeof *same);
    for (size_t i = 0; i < q->corner_count; ++i) {
        order[i] = (uint32_t)i;
    }
    compared = q->corners;
    qsort(order, q->corner_count, sizeof *order, compare_corners);
    for (size_t i = 0; i < q->corner_count; ++i) {
        const bool first = i == 0 || compare_corners(&order[i], &order[i - 1]) != 0;
        same[order[i]] = first ? order[i] : same[order[i - 1]];
    }
    free(order);
    return same;
}

static size_t count_open_edges(const quads *q) {
    uint32_t *same = welded(q), (*edges)[2] = calloc(4 * q->quad_count, sizeof *edges);
    size_t count = 0;
    for (size_t i = 0; i < q->quad_count; ++i) {
        for (size_t k = 0; k < 4; ++k) {
            const uint32_t a = same[q->quads[4 * i + k]], b = same[q->quads[4 * i + (k + 1) % 4]];
            if (a != b) { /* the end of a triangle */
                edges[count][0] = a < b ? a : b;
                edges[count++][1] = a < b ? b : a;
            }
        }
    }
    qsort(edges, count, sizeof *edges, compare_edges);
    size_t open = 0;
    for (size_t i = 0; i < count;) {
        size_t end = i + 1;
        while (end < count && compare_edges(edges[i], edges[end]) == 0) {
            ++end;
        }
        open += end - i != 2;
        i = end;
    }
    free(edges);
    free(same);
    return open;
}

/* Pebbles, rods and plates of one to four voxels, on each other: cells are crossed in many ways. */
static vsh_field *rubble(void) {
    truth_solid solids[MAX_SOLIDS];
    uint64_t counter = 3;
    for (int i = 0; i < MAX_SOLIDS; ++i) {
        solids[i] = (truth_solid){.shape = i % 2 ? TRUTH_SPHERE : TRUTH_BOX,
                                  .radius = i % 2 ? between(&counter, 0.6, 2.0) * VOXEL : 0.0};
        for (int axis = 0; axis < 3; ++axis) {
            solids[i].center[axis] = between(&counter, -4.0, 4.0) * VOXEL;
            solids[i].half[axis] = between(&counter, 0.5, 2.0) * VOXEL;
        }
    }
    return field_of((truth_scene){solids, MAX_SOLIDS}, VOXEL, 1.0);
}

TEST(surface_is_closed) {
    const double heights[] = {0.0, GROWN, -1.0};
    OWNED(vsh_field) *seeds = field_of(truth_seeds(), VOXEL, 1.0);
    OWNED(vsh_field) *hollow = hollow_box(VOXEL, 1.1 * VOXEL), *stones = rubble();
    for (size_t i = 0; i < COUNT_OF(heights); ++i) {
        FREED_BY(vshi_surface_quads_free) quads q = quads_of(seeds, heights[i]);
        assert_int_equal(count_open_edges(&q), 0);
        vshi_surface_quads_free(&q);
        q = quads_of(stones, heights[i]);
        assert_int_equal(count_open_edges(&q), 0);
    }
    for (size_t i = 0; i < 2; ++i) { /* its walls are thinner than the third */
        FREED_BY(vshi_surface_quads_free) quads q = quads_of(hollow, heights[i]);
        assert_int_equal(count_open_edges(&q), 0);
    }
}

TEST(corners_lie_on_the_sphere) {
    const truth_solid ball = {.shape = TRUTH_SPHERE, .center = {0.1, 0.2, 0.3}, .radius = 0.5};
    OWNED(vsh_field) *field = field_of((truth_scene){&ball, 1}, VOXEL, 1.0);
    FREED_BY(vshi_surface_quads_free) quads q = quads_of(field, GROWN);
    double worst = 0.0;
    for (size_t i = 0; i < q.corner_count; ++i) {
        const float *c = q.corners + 3 * i;
        const vshi_vec p = vshi_to_world(field, (vshi_vec){(double)c[0], (double)c[1], (double)c[2]});
        const double off = truth_solid_distance(&ball, (double[]){p.x, p.y, p.z}) / VOXEL - GROWN;
        worst = fmax(worst, fabs(off));
    }
    assert_less(worst, 0.02); /* an edge's chord: 1/8 voxel² over the radius of 12.5 */
}

/* The least that the finest level reads along a ray, voxels, by steps of a fiftieth. */
static double least_along(const vsh_field *field, vshi_vec from, vshi_vec d, double far) {
    double least = INFINITY;
    for (double t = 0.0; t < far; t += 0.02) {
        const vshi_vec p = vshi_add(from, vshi_scale(d, t));
        const float at[3] = {(float)p.x, (float)p.y, (float)p.z};
        least = fmin(least, (double)vshi_level_sample(field, 0, at, NULL));
    }
    return least;
}

/* Rays that begin outside are blocked where the cells read less than the height, to `chord` voxels: a quad is
 * flat, and the surface in its cell may bend. */
static void hold_rays(const vsh_field *field, size_t tries, double reach, double chord) {
    uint64_t counter = 11;
    size_t blocked_count = 0, looked = 0;
    double worst = 0.0;
    for (size_t i = 0; i < tries; ++i) {
        double p[3], d[3];
        for (int axis = 0; axis < 3; ++axis) {
            p[axis] = between(&counter, (double)field->bounds_min[axis], (double)field->bounds_max[axis]);
        }
        random_direction(&counter, d);
        const float at[3] = {(float)p[0], (float)p[1], (float)p[2]};
        const double h = (double)vshi_level_sample(field, 0, at, NULL);
        if (h < GROWN || h > 2.0 || !vshi_surface_clears(field, vshi_vec_of(p))) {
            continue;
        }
        const vshi_segment_ray ray = {
            .origin = {p[0], p[1], p[2]}, .direction = {d[0], d[1], d[2]}, .far = reach};
        bool blocked;
        vshi_triangles_blocked(field->surface, &ray, 1, &blocked);
        const double least = least_along(field, vshi_vec_of(p), vshi_vec_of(d), reach) - GROWN;
        worst = fmax(worst, blocked ? least : -least);
        ++looked;
        blocked_count += blocked;
    }
    assert_true(looked > tries / 50 && blocked_count > looked / 20);
    assert_less(worst, chord);
}

/* The same with a surface; frees it. */
static vsh_field *with_surface(vsh_field *field) {
    const vsh_run run = vsh_run_default();
    vshi_job *job = vshi_job_begin(&run, "surface", 1);
    assert_ok(vshi_field_add_surface(field, (vshi_field_budget){&run, 0.0}, job, &failure));
    vshi_job_end(job);
    return field;
}

TEST(rays_meet_the_surface_of_the_cells) {
    const struct {
        vsh_field *field;
        double chord;
    } held[] = {{field_of(truth_seeds(), VOXEL, 1.0), 0.05},
                {hollow_box(VOXEL, 1.1 * VOXEL), 0.05}, /* no ray leaks from the room, or into it */
                {rubble(), 0.25}};
    for (size_t i = 0; i < COUNT_OF(held); ++i) {
        hold_rays(with_surface(held[i].field), 40000, 20.0, held[i].chord);
        vshi_field_free(held[i].field);
    }
}

static vsh_result make(const vsh_grid *grid, const vsh_run *run, vsh_field **field, vsh_error *error) {
    vshi_field_options options = vshi_field_options_default();
    options.reach = 1.0;
    options.surface = 1;
    return vshi_field_create(grid, &options, run, field, error);
}

/* Shadow and AO of the floor by adaptive. */
static void shade_floor(const vsh_field *field, int32_t threads, size_t size, float *shadow, float *ao) {
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    FREED double *positions = calloc(3 * size * size, sizeof *positions);
    FREED float *normals = calloc(3 * size * size, sizeof *normals);
    floor_texels(size, positions, normals);
    const vsh_points points = {size * size, positions, normals, NULL};
    vsh_shade_options options = vsh_shade_options_default();
    options.max_error = 0.01;
    options.ao_distance = 0.6;
    options.method = VSH_SHADOW_ADAPTIVE;
    options.ao_method = VSH_AO_ADAPTIVE;
    const vsh_run run = run_on(threads);
    assert_ok(
        vsh_shade_shadow(occluders_of(field), &points, &light, &options, &run, shadow, NULL, NULL, &failure));
    assert_ok(vsh_shade_ao(occluders_of(field), &points, &options, &run, ao, NULL, NULL, NULL, &failure));
}

TEST(traced_values_are_near_those_of_marched_rays) {
    enum { SIZE = 64, COUNT = SIZE * SIZE };
    static float shadow[3][COUNT], ao[3][COUNT];
    vsh_grid *grid = grid_of(truth_seeds(), VOXEL);
    OWNED(vsh_field) *traced = NULL;
    assert_int_equal(make(grid, NULL, &traced, NULL), VSH_OK);
    OWNED(vsh_field) *marched = field_of_grid(grid, 1.0);
    assert_true(traced->surface != NULL && marched->surface == NULL);
    shade_floor(marched, 1, SIZE, shadow[0], ao[0]);
    shade_floor(traced, 1, SIZE, shadow[1], ao[1]);
    shade_floor(traced, 3, SIZE, shadow[2], ao[2]);
    static float truth[COUNT];
    static double positions[3 * COUNT];
    static float normals[3 * COUNT];
    floor_texels(SIZE, positions, normals);
    const double up[3] = {0.0, 1.0, 0.0};
    assert_int_equal(truth_lights(truth_seeds(), COUNT, positions, up, truth_seeds_sun, truth_seeds_w,
                                  INFINITY, 256, truth),
                     0);
    assert_less(truth_compare(COUNT, shadow[1], truth, NULL).rmse,
                1.25 * truth_compare(COUNT, shadow[0], truth, NULL).rmse);
    assert_less(truth_compare(COUNT, shadow[0], shadow[1], NULL).rmse, 0.015); /* 0.15 voxels are added */
    assert_less(truth_compare(COUNT, ao[0], ao[1], NULL).rmse, 0.01);
    assert_memory_equal(shadow[1], shadow[2], sizeof shadow[1]);
    assert_memory_equal(ao[1], ao[2], sizeof ao[1]);
}

/* Between two lattice planes, which read half a voxel. */
TEST(plate_that_voxels_lose_has_no_surface) {
    const truth_solid plate = {.shape = TRUTH_BOX,
                               .center = {0.0, 0.5 * VOXEL, 0.0},
                               .half = {10.0 * VOXEL, 0.05 * VOXEL, 10.0 * VOXEL}};
    OWNED(vsh_grid) *grid = grid_of((truth_scene){&plate, 1}, VOXEL);
    OWNED(vsh_field) *field = NULL;
    assert_int_equal(make(grid, NULL, &field, NULL), VSH_OK);
    assert_null(field->surface);
}

TEST(surface_keeps_the_limit_and_ends_when_asked) {
    OWNED(vsh_grid) *grid = grid_of(truth_seeds(), VOXEL);
    vsh_field *field = NULL;
    vsh_run run = vsh_run_default();
    OWNED(vsh_field) *plain = field_of(truth_seeds(), VOXEL, 1.0);
    run.memory_limit = 2 * (field_info(plain).bytes + grid_info(grid).bytes);
    assert_fails(make(grid, &run, &field, &failure), VSH_ERROR_LIMIT, "surface");
    assert_null(field);
}
