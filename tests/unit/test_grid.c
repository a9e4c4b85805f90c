/* Grids of distance callbacks and trees, and unions of grids. test_grid_mesh.c tests grids of meshes. */
#include "fields.h"
#include "grids.h"

#include <sys/resource.h>

TEST(a_sphere_is_exact_and_a_dense_copy_has_every_distance) {
    sphere s = {{0.3, 0, 0}, 1.0, 0};
    const vsh_distance field = sphere_field(&s);
    OWNED(vsh_grid) *grid = grid_from_distance(&field, 0.05);
    const vsh_grid_info info = grid_info(grid);
    assert_float_equal(info.voxel_size, 0.05, 1e-12);
    assert_float_equal(info.half_width, 3.0, 1e-6);
    int32_t size[3], low[3];
    for (int i = 0; i < 3; ++i) {
        const double centre = i == 0 ? 0.3 : 0.0;
        assert_true(info.bounds_min[i] > centre - 1.1 && info.bounds_min[i] < centre - 1.0 + 1e-9);
        assert_true(info.bounds_max[i] < centre + 1.1 && info.bounds_max[i] > centre + 1.0 - 1e-9);
        low[i] = info.index_min[i] - 1;
        size[i] = info.index_max[i] - low[i] + 2;
        assert_in_range(size[i], 2.0 / 0.05 + 4, 2.0 / 0.05 + 9);
    }
    FREED float *values = malloc((size_t)size[0] * (size_t)size[1] * (size_t)size[2] * sizeof *values);
    assert_ok(vsh_grid_copy(grid, low, size, values, &failure));
    const float band = (float)(info.half_width * info.voxel_size);
    size_t at = 0;
    uint64_t active = 0;
    for (int32_t z = 0; z < size[2]; ++z) {
        for (int32_t y = 0; y < size[1]; ++y) {
            for (int32_t x = 0; x < size[0]; ++x, ++at) {
                const double index[3] = {low[0] + x, low[1] + y, low[2] + z};
                double p[3];
                for (int row = 0; row < 3; ++row) {
                    const double *m = info.transform + 4 * row;
                    p[row] = m[0] * index[0] + m[1] * index[1] + m[2] * index[2] + m[3];
                }
                const double truth = sqrt((p[0] - 0.3) * (p[0] - 0.3) + p[1] * p[1] + p[2] * p[2]) - 1.0;
                assert_float_equal(values[at], fmax(-band, fmin(band, truth)), 5e-7);
                const int edge =
                    x == 0 || y == 0 || z == 0 || x == size[0] - 1 || y == size[1] - 1 || z == size[2] - 1;
                assert_true(!edge || values[at] == band);
                active += fabsf(values[at]) < band;
            }
        }
    }
    assert_int_equal(active, info.active_voxels);
    const int32_t none[3] = {1, 0, 1}, last[3] = {INT32_MAX, 0, 0}, two[3] = {2, 1, 1};
    assert_int_equal(vsh_grid_copy(grid, low, none, values, &failure), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_grid_copy(grid, last, two, values, &failure), VSH_ERROR_ARGUMENT);
}

TEST(the_work_follows_the_area) {
    size_t calls[2];
    for (int i = 0; i < 2; ++i) {
        sphere s = {{0, 0, 0}, 1.0, 0};
        const vsh_distance field = sphere_field(&s);
        vsh_grid_free(grid_from_distance(&field, i == 0 ? 0.02 : 0.01));
        calls[i] = s.calls;
    }
    const double voxels = 4.0 * 3.14159265 / (0.01 * 0.01);
    assert_less((double)calls[1], 20.0 * voxels);          /* layers of voxels, of which the band has 6 */
    assert_less((double)calls[1], 4.4 * (double)calls[0]); /* 4: area, 8: volume */
}

TEST(a_room_inside_a_solid_stays_a_room) {
    const vsh_sdf sdf = hollow_sphere();
    OWNED(vsh_grid) *grid = grid_from_sdf(&sdf, 0.03);
    assert_less(worst_error(grid, hollow_truth, 2.9, 2.9), 0.15);
    assert_int_equal(wrong_blocks(grid, hollow_truth, 10), 0);
}

/* A lower bound of the distance, of which only the zero is exact. */
static double squashed(void *user, const double p[3]) {
    const double *slope = user, d = unit_sphere(p);
    return *slope * d / (1.0 + fabs(d));
}

TEST(a_bound_becomes_a_distance) {
    double slopes[] = {0.6, 0.05, 20.0};
    for (int i = 0; i < 3; ++i) {
        const vsh_distance field = {squashed, &slopes[i], slopes[i], 0, {-1, -1, -1}, {1, 1, 1}};
        vsh_grid_options options = with_voxel(0.03);
        options.half_width = 5.0;
        OWNED(vsh_grid) *grid = NULL;
        assert_ok(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure));
        assert_less(worst_error(grid, unit_sphere, 4.9, 4.9), 0.15);
        assert_int_equal(wrong_blocks(grid, unit_sphere, 10), 0);
    }
}

static double hole_in_the_middle(void *user, const double p[3]) {
    const double d = unit_sphere(p);
    return d < -0.02 && d > -0.03 ? NAN : d;
}

static double nowhere_near(void *user, const double p[3]) {
    return 5.0 + 0.1 * p[0];
}

TEST(bad_fields_and_options_are_refused_with_the_reason) {
    sphere s = {{0, 0, 0}, 1.0, 0};
    const vsh_distance good = sphere_field(&s);
    vsh_distance fields[4] = {good, good, good, good};
    fields[0].lipschitz = 0.0;
    fields[1].bounds_max[1] = NAN;
    fields[2].distance = hole_in_the_middle;
    fields[3].distance = nowhere_near;
    static const char *const parts[] = {"lipschitz 0", "bounds[1]", "nan at (", "no surface"};
    vsh_grid_options options = vsh_grid_options_default();
    vsh_grid *grid = NULL;
    options.resolution = 100;
    for (int i = 0; i < 4; ++i) {
        assert_fails(vsh_grid_from_distance(&fields[i], &options, NULL, &grid, &failure),
                     i < 2 ? VSH_ERROR_ARGUMENT : VSH_ERROR_INPUT, parts[i]);
    }
    const struct {
        double voxel, half_width, shell;
        int32_t resolution;
        const char *part;
    } cases[] = {
        {-1.0, 3.0, 2.0, 256, "voxel_size -1"},    {NAN, 3.0, 2.0, 256, "voxel_size nan"},
        {0.0, 3.0, 2.0, 1, "resolution 1"},        {0.0, 2.5, 2.0, 256, "half_width 2.5"},
        {0.0, 3.0, 0.5, 256, "shell_thickness 0"}, {0.0, 101.0, 2.0, 256, "half_width 101"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        options.voxel_size = cases[i].voxel;
        options.half_width = cases[i].half_width;
        options.shell_thickness = cases[i].shell;
        options.resolution = cases[i].resolution;
        assert_fails(vsh_grid_from_distance(&good, &options, NULL, &grid, &failure), VSH_ERROR_ARGUMENT,
                     cases[i].part);
    }
    options = vsh_grid_options_default();
    options.struct_size = 4000;
    assert_fails(vsh_grid_from_distance(&good, &options, NULL, &grid, &failure), VSH_ERROR_ARGUMENT,
                 "struct_size");
    assert_null(grid);
}

TEST(too_small_a_voxel_is_refused_before_memory_is_allocated) {
    sphere s = {{0, 0, 0}, 1.0, 0};
    const vsh_distance field = sphere_field(&s);
    OWNED(vsh_grid) *grid = NULL;
    struct rusage before;
    assert_int_equal(getrusage(RUSAGE_SELF, &before), 0);
    static const struct {
        double voxel;
        const char *part;
    } cases[] = {{1e-9, "voxel size 1e-09"}, {1e-6, "voxel size 1e-06"}, {1.6e-5, "this machine's memory"}};
    vsh_grid_options options;
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        options = with_voxel(cases[i].voxel);
        assert_fails(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure), VSH_ERROR_LIMIT,
                     cases[i].part);
    }
    assert_less(s.calls, 100000);
    struct rusage after;
    assert_int_equal(getrusage(RUSAGE_SELF, &after), 0);
    assert_less(after.ru_maxrss - before.ru_maxrss, 50000); /* KB */
    options = with_voxel(0.005);
    vsh_run run = run_within(10000000);
    assert_fails(vsh_grid_from_distance(&field, &options, &run, &grid, &failure), VSH_ERROR_LIMIT,
                 "over the memory limit of 10 MB");
    run.memory_limit = 500000000;
    assert_ok(vsh_grid_from_distance(&field, &options, &run, &grid, &failure));
    assert_less(grid_info(grid).bytes, run.memory_limit);
}

/* The megabytes that the error names if the limit is one byte. */
static double foretold(const vsh_sdf *sdf, const vsh_grid_instance *instance,
                       const vsh_grid_options *options) {
    vsh_run run = run_within(1);
    vsh_grid *grid = NULL;
    const vsh_result result = sdf != NULL ? vsh_grid_from_sdf(sdf, options, &run, &grid, &failure)
                                          : vsh_grid_unite(instance, 1, options, &run, &grid, &failure);
    assert_int_equal(result, VSH_ERROR_LIMIT);
    const char *need = strstr(failure.message, "): about ");
    assert_non_null(need);
    return atof(need + 9);
}

TEST(the_memory_estimate_includes_the_band_of_re_distancing) {
    const vsh_sdf sdf = hollow_sphere();
    vsh_grid_options options = with_voxel(0.02);
    OWNED(vsh_grid) *source = grid_from_sdf(&sdf, 0.02);
    const double turned[12] = {0.6, -0.8, 0, 0, 0.8, 0.6, 0, 0, 0, 0, 1, 0};
    const vsh_grid_instance instance = {source, turned};
    const double half_widths[] = {3.0, 10.0};
    for (int anew = 0; anew < 2; ++anew) { /* a tree that is no distance, a grid that is turned */
        for (size_t i = 0; i < COUNT_OF(half_widths); ++i) {
            options.half_width = half_widths[i];
            const double need = foretold(anew ? &sdf : NULL, &instance, &options);
            for (int over = 0; over < 2; ++over) {
                vsh_run run = run_within((uint64_t)(need * 1e6 * (over ? 1.2 : 0.95)));
                OWNED(vsh_grid) *grid = NULL;
                assert_fails(anew ? vsh_grid_from_sdf(&sdf, &options, &run, &grid, &failure)
                                  : vsh_grid_unite(&instance, 1, &options, &run, &grid, &failure),
                             over ? VSH_OK : VSH_ERROR_LIMIT, "over the memory limit");
                if (over) { /* distances, and the leaves that are made of them */
                    const double bytes = (double)grid_info(grid).bytes;
                    assert_true(need * 1e6 > 2.0 * bytes && need * 1e6 < 9.0 * bytes);
                }
            }
        }
    }
}

/* --- unions */

static vsh_grid *ball_grid(double x, double radius, double voxel) {
    sphere s = {{x, 0, 0}, radius, 0};
    const vsh_distance field = sphere_field(&s);
    return grid_from_distance(&field, voxel);
}

TEST(one_grid_alone_is_shared_as_it_is) {
    vsh_grid *ball = ball_grid(0.0, 1.0, 0.03);
    const vsh_grid_instance instance = {ball, NULL};
    OWNED(vsh_grid) *same = NULL;
    assert_ok(vsh_grid_unite(&instance, 1, NULL, NULL, &same, &failure));
    assert_same_leaves(ball, same, 0.0f);
    vsh_grid_free(ball);
    assert_less(worst_error(same, unit_sphere, 2.95, 2.95), 1e-4);
}

/* Shifts by whole voxels that are no whole leaves: the values are those of the closed form. */
TEST(grids_on_one_lattice_are_shifted_and_keep_their_values) {
    OWNED(vsh_grid) *ball = ball_grid(0.0, 1.0, 0.03);
    const double aside[12] = {1, 0, 0, 27 * 0.03, 0, 1, 0, 0, 0, 0, 1, 0};
    const vsh_grid_instance instances[2] = {{ball, NULL}, {ball, aside}};
    OWNED(vsh_grid) *both = NULL;
    assert_ok(vsh_grid_unite(instances, 2, NULL, NULL, &both, &failure));
    FREED_BY(free_leaves) leaves all = leaves_of(both);
    for (size_t i = 0; i < 512 * all.count; ++i) {
        double p[3];
        const double value = value_at(&all, i, p), q[3] = {p[0] - 27 * 0.03, p[1], p[2]};
        assert_near(value, fmax(-0.09, fmin(0.09, fmin(unit_sphere(p), unit_sphere(q)))), 1e-6);
    }
}

static double moved_sphere(const double p[3]) { /* twice as large, its middle at 1, 2, 3 */
    const double q[3] = {0.5 * (p[0] - 1.0), 0.5 * (p[1] - 2.0), 0.5 * (p[2] - 3.0)};
    return 2.0 * unit_sphere(q);
}

TEST(a_turned_mirrored_scaled_grid_is_measured_anew) {
    OWNED(vsh_grid) *ball = ball_grid(0.0, 1.0, 0.03);
    const double c = 2.0 * cos(0.5), s = 2.0 * sin(0.5);
    const double turned[12] = {-c, s, 0, 1, s, c, 0, 2, 0, 0, 2, 3};
    const vsh_grid_instance instance = {ball, turned};
    const double voxels[] = {0.0, 0.045, 0.09};
    for (int i = 0; i < 3; ++i) {
        OWNED(vsh_grid) *moved = NULL;
        const vsh_grid_options options = with_voxel(voxels[i]);
        assert_ok(vsh_grid_unite(&instance, 1, &options, NULL, &moved, &failure));
        assert_near(grid_info(moved).voxel_size, i == 0 ? 0.06 : voxels[i], 1e-9);
        assert_less(worst_error(moved, moved_sphere, 2.9, 2.9), 0.15);
        assert_int_equal(wrong_blocks(moved, moved_sphere, 10), 0);
    }
}

TEST(rooms_stay_open_in_a_union_of_different_lattices_for_any_threads) {
    const vsh_sdf sdf = hollow_sphere();
    const vsh_grid_options options = with_voxel(0.03);
    OWNED(vsh_grid) *room = grid_from_sdf(&sdf, 0.03), *ball = ball_grid(0.0, 1.0, 0.05);
    const double turned[12] = {0.12, -0.16, 0, 0, 0.16, 0.12, 0, 0, 0, 0, 0.2, 0};
    const vsh_grid_instance instances[2] = {{ball, turned}, {room, NULL}};
    vsh_grid *both[2];
    for (int i = 0; i < 2; ++i) {
        const vsh_run run = run_on(i == 0 ? 1 : 5);
        assert_ok(vsh_grid_unite(instances, 2, &options, &run, &both[i], &failure));
    }
    assert_same_leaves(both[0], both[1], 0.0f);
    assert_less(worst_error(both[0], room_with_a_ball, 2.9, 2.9), 0.15);
    assert_int_equal(wrong_blocks(both[0], room_with_a_ball, 8), 0);
    vsh_grid_free(both[0]);
    vsh_grid_free(both[1]);
}

TEST(bad_unions_are_refused_with_the_reason) {
    OWNED(vsh_grid) *ball = ball_grid(0.0, 1.0, 0.05);
    static const double uneven[12] = {1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0},
                        sheared[12] = {1, 0.6, 0, 0, 0, 0.8, 0, 0, 0, 0, 1, 0},
                        lost[12] = {1, 0, 0, NAN, 0, 1, 0, 0, 0, 0, 1, 0},
                        far_away[12] = {1, 0, 0, 1e9, 0, 1, 0, 0, 0, 0, 1, 0};
    const struct {
        const double *transform;
        double voxel;
        uint64_t memory_limit;
        vsh_result code;
        const char *part;
    } cases[] = {{uneven, 0.0, 0, VSH_ERROR_ARGUMENT, "length 1, 2, 1"},
                 {sheared, 0.0, 0, VSH_ERROR_ARGUMENT, "instance 1"},
                 {lost, 0.0, 0, VSH_ERROR_ARGUMENT, "instance 1"},
                 {far_away, 0.0, 0, VSH_ERROR_LIMIT, "longest side"},
                 {NULL, 2e-5, 0, VSH_ERROR_LIMIT, "memory"},
                 {NULL, 0.0, 1000000, VSH_ERROR_LIMIT, "limit of 1 MB"}};
    vsh_grid *both = NULL;
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        const vsh_grid_instance instances[2] = {{ball, NULL}, {ball, cases[i].transform}};
        const vsh_grid_options options = with_voxel(cases[i].voxel);
        const vsh_run run = run_within(cases[i].memory_limit);
        assert_fails(vsh_grid_unite(instances, 2, &options, &run, &both, &failure), cases[i].code,
                     cases[i].part);
        assert_null(both);
    }
    assert_fails(vsh_grid_unite(NULL, 0, NULL, NULL, &both, &failure), VSH_ERROR_ARGUMENT, "no grids");
}

typedef struct heard {
    int calls;
    double last;
} heard;

static int32_t hear(void *user, const char *stage, double fraction) {
    heard *h = user;
    ++h->calls;
    h->last = fraction;
    return 0;
}

/* tests/faults/test_cancel.c cancels in the stages that are reported. */
TEST(grids_and_fields_report_progress_up_to_one) {
    sphere s = {{0, 0, 0}, 1.0, 0};
    const vsh_distance distance = sphere_field(&s);
    const vsh_sdf sdf = hollow_sphere();
    const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1},
                 turned[12] = {0.6, -0.8, 0, 0.5, 0.8, 0.6, 0, 0, 0, 0, 1, 0};
    float corners[24];
    const vsh_mesh mesh = box_mesh(corners, low, high);
    OWNED(vsh_grid) *ball = ball_grid(0.0, 1.0, 0.05);
    const vsh_grid_instance instances[2] = {{ball, NULL}, {ball, turned}};
    const vsh_grid_options options = with_voxel(0.05);
    for (int i = 0; i < 5; ++i) {
        heard h = {0, 0.0};
        const vsh_run run = run_watched(hear, &h);
        OWNED(vsh_grid) *grid = NULL;
        OWNED(vsh_field) *field = NULL;
        assert_ok(i == 0   ? vsh_grid_from_sdf(&sdf, &options, &run, &grid, &failure)
                  : i == 1 ? vsh_grid_from_distance(&distance, &options, &run, &grid, &failure)
                  : i == 2 ? vsh_grid_from_meshes(&mesh, 1, &options, &run, &grid, &failure)
                  : i == 3 ? vsh_grid_unite(instances, 2, &options, &run, &grid, &failure)
                           : vshi_field_create(ball, NULL, &run, &field, &failure));
        assert_true(h.calls > 3 && h.last == 1.0);
    }
}

/* --- Trees that are bounds outside of their edges and corners (intersections, subtractions), or inside
 * (unions): their grids are compared with closed forms, near convex and concave corners, wherever they lie on
 * the lattice. docs/accuracy.md has the bounds. */

static const double VOXEL = 0.04;

enum { INTERSECTION, SUBTRACTION, UNION, KINDS };

/* A box with, without and beside another one, of which one corner lies in it; moved along its diagonal. */
typedef struct pair {
    int kind;
    truth_solid a, b;
} pair;

static pair pair_of(int kind, double moved) {
    pair p = {kind,
              {TRUTH_BOX, {0.0, 0.0, 0.0}, {0.6, 0.6, 0.6}, 0.0, 0.0},
              {TRUTH_BOX, {0.8, 0.8, 0.8}, {0.6, 0.6, 0.6}, 0.0, 0.0}};
    for (int axis = 0; axis < 3; ++axis) {
        p.a.center[axis] += moved * (1.0 + 0.3 * axis);
        p.b.center[axis] += moved * (1.0 + 0.3 * axis);
    }
    return p;
}

/* Exact everywhere. */
static double distance_to(void *user, const double at[3]) {
    const pair *p = user;
    const double a = truth_solid_distance(&p->a, at), b = truth_solid_distance(&p->b, at);
    truth_solid part = {TRUTH_BOX, {0, 0, 0}, {0, 0, 0}, 0.0, 0.0};
    double outside = INFINITY;
    if (p->kind == INTERSECTION) { /* a box */
        for (int axis = 0; axis < 3; ++axis) {
            part.center[axis] = 0.5 * (p->a.center[axis] + p->b.center[axis]);
            part.half[axis] = 0.2;
        }
        return truth_solid_distance(&part, at);
    }
    if (p->kind == SUBTRACTION) { /* inside it is exact; outside, of the three boxes that are left */
        const double inside = fmax(a, -b);
        for (int axis = 0; axis < 3; ++axis) {
            for (int k = 0; k < 3; ++k) {
                part.center[k] = p->a.center[k] - (k == axis ? 0.2 : 0.0);
                part.half[k] = k == axis ? 0.4 : 0.6;
            }
            outside = fmin(outside, truth_solid_distance(&part, at));
        }
        return inside < 0.0 ? inside : outside;
    }
    return fmin(a, b); /* outside */
}

/* The largest error of a field within two voxels of the surface, in voxels; of a union, outside of it. */
static double worst_beside(const vsh_field *field, pair *p) {
    uint64_t counter = 17;
    double worst = 0.0;
    const double *middle = p->a.center;
    for (int i = 0; i < 300000; ++i) {
        const double at[3] = {middle[0] + between(&counter, -0.1, 0.8),
                              middle[1] + between(&counter, -0.1, 0.8),
                              middle[2] + between(&counter, -0.1, 0.8)};
        const double truth = distance_to(p, at);
        if (fabs(truth) < 2.0 * VOXEL && (p->kind != UNION || truth > VOXEL)) {
            worst = fmax(worst, fabs((double)distance_at(field, at) - truth) / VOXEL);
        }
    }
    return worst;
}

static vsh_field *field_of_tree(const pair *p) {
    static const int32_t operations[KINDS] = {VSH_SDF_INTERSECTION, VSH_SDF_SUBTRACTION, VSH_SDF_UNION};
    vsh_sdf_node nodes[3] = {box_node(0.6, 0.6, 0.6), box_node(0.6, 0.6, 0.6),
                             operation_node(operations[p->kind], 0, 1)};
    memcpy(nodes[0].translation, p->a.center, sizeof nodes[0].translation);
    memcpy(nodes[1].translation, p->b.center, sizeof nodes[1].translation);
    return field_of_grid(grid_from_sdf(&(vsh_sdf){nodes, 3}, VOXEL), 0.0);
}

static vsh_field *field_of_distances(pair *p, int exact) {
    const vsh_distance distance = {distance_to, p, 1.0, exact, {-0.8, -0.8, -0.8}, {1.6, 1.6, 1.6}};
    return field_of_grid(grid_from_distance(&distance, VOXEL), 0.0);
}

/* A lattice of true distances interpolates edges and corners with an error of its own. One that is measured
 * anew from the zero of a bound is within 0.02 voxels of that: points of its mesh may be off by 0.002. */
TEST(bounds_become_distances_up_to_their_corners) {
    const double phases[] = {0.0, 0.25, 0.5, 0.61};
    for (int kind = 0; kind < KINDS; ++kind) {
        double worst[3] = {0.0, 0.0, 0.0};
        for (int phase = 0; phase < 4; ++phase) {
            pair p = pair_of(kind, phases[phase] * VOXEL);
            vsh_field *fields[3] = {field_of_tree(&p), field_of_distances(&p, 1), field_of_distances(&p, 0)};
            for (int f = 0; f < 3; ++f) {
                worst[f] = fmax(worst[f], worst_beside(fields[f], &p));
                vshi_field_free(fields[f]);
            }
        }
        assert_less(worst[0], worst[1] + 0.02);
        assert_less(worst[2], worst[1] + 0.02);
        assert_less(worst[1], 0.5);
    }
}
