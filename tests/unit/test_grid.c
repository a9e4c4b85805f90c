/* Level sets: their values against closed forms, and what is refused. */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <vdbshade/grid.h>

#include "shim/openvdb.h"

/* ---- Helpers: the leaves of a grid with what goes with them ---- */

typedef struct leaves {
    vshi_leaf *leaf;
    size_t count;
    const double *transform;
    vsh_grid_info info;
} leaves;

static leaves leaves_of(const vsh_grid *grid) {
    leaves all;
    all.count = vshi_grid_leaves(grid, NULL, 0);
    all.leaf = malloc((all.count + 1) * sizeof *all.leaf);
    assert_non_null(all.leaf);
    assert_int_equal(vshi_grid_leaves(grid, all.leaf, all.count), all.count);
    all.transform = vshi_grid_transform(grid);
    vsh_grid_get_info(grid, &all.info);
    return all;
}

static void voxel_position(const leaves *all, size_t leaf, int voxel, double position[3]) {
    const int32_t *origin = all->leaf[leaf].origin;
    const double index[3] = {origin[0] + (voxel >> 6), origin[1] + ((voxel >> 3) & 7),
                             origin[2] + (voxel & 7)};
    for (int row = 0; row < 3; ++row) {
        const double *m = all->transform + 4 * row;
        position[row] = m[0] * index[0] + m[1] * index[1] + m[2] * index[2] + m[3];
    }
}

typedef double truth_fn(const double position[3]);

/* Largest error, in voxels, over voxels whose true distance lies in -inside … outside voxels; and the signs
 * of all others that leaves hold. */
static double worst_error(const vsh_grid *grid, truth_fn *truth, double inside, double outside) {
    leaves all = leaves_of(grid);
    const double background = all.info.half_width * all.info.voxel_size;
    double worst = 0.0;
    size_t compared = 0;
    for (size_t i = 0; i < all.count; ++i) {
        for (int v = 0; v < 512; ++v) {
            double p[3];
            voxel_position(&all, i, v, p);
            const double expected = truth(p);
            const double value = (double)all.leaf[i].values[v];
            assert_true(fabs(value) <= background * (1.0 + 1e-6));
            if (expected > -inside * all.info.voxel_size && expected < outside * all.info.voxel_size) {
                worst = fmax(worst, fabs(value - expected) / all.info.voxel_size);
                ++compared;
            } else {
                assert_int_equal(value < 0.0, expected < 0.0);
            }
        }
    }
    free(all.leaf);
    assert_true(compared > 1000);
    return worst;
}

/* Share of blocks over the whole box whose sign is not the truth's, away from the surface. */
static size_t wrong_blocks(const vsh_grid *grid, truth_fn *truth, int32_t reach) {
    leaves all = leaves_of(grid);
    const int32_t origin[3] = {-8 * reach, -8 * reach, -8 * reach};
    const int32_t size[3] = {2 * reach, 2 * reach, 2 * reach};
    const size_t count = (size_t)8 * (size_t)(reach * reach) * (size_t)reach;
    int8_t *signs = malloc(count);
    assert_non_null(signs);
    vshi_grid_block_signs(grid, origin, size, signs);
    size_t wrong = 0;
    for (size_t i = 0; i < count; ++i) {
        const int32_t side = 2 * reach, n = (int32_t)i;
        vshi_leaf block = {{origin[0] + 8 * (n / (side * side)), origin[1] + 8 * (n / side % side),
                            origin[2] + 8 * (n % side)},
                           NULL};
        leaves one = all;
        one.leaf = &block;
        double p[3];
        voxel_position(&one, 0, 0, p);
        const double expected = truth(p);
        wrong += fabs(expected) > 0.5 * all.info.voxel_size && (expected < 0.0) != (signs[i] < 0);
    }
    free(signs);
    free(all.leaf);
    return wrong;
}

static void assert_same_leaves(const vsh_grid *a, const vsh_grid *b, float tolerance) {
    leaves left = leaves_of(a), right = leaves_of(b);
    assert_int_equal(left.count, right.count);
    for (size_t i = 0; i < left.count; ++i) {
        assert_memory_equal(left.leaf[i].origin, right.leaf[i].origin, sizeof left.leaf[i].origin);
        if (tolerance == 0.0f) {
            assert_memory_equal(left.leaf[i].values, right.leaf[i].values, 512 * sizeof(float));
        }
        for (int v = 0; v < 512; ++v) {
            assert_true(fabsf(left.leaf[i].values[v] - right.leaf[i].values[v]) <= tolerance);
        }
    }
    free(left.leaf);
    free(right.leaf);
}

static vsh_error failure;

static void assert_fails(vsh_result result, vsh_result expected, const char *part) {
    if (result != expected || strstr(failure.message, part) == NULL) {
        fail_msg("%s '%s': expected %s '%s'", vsh_result_name(result), failure.message,
                 vsh_result_name(expected), part);
    }
}

static vsh_grid_options with_voxel(double size) {
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = size;
    return options;
}

/* ---- Distance callbacks and trees ---- */

typedef struct sphere {
    double centre[3];
    double radius;
    atomic_size_t calls;
} sphere;

static double sphere_distance(void *user, const double p[3]) {
    sphere *s = user;
    atomic_fetch_add(&s->calls, 1);
    const double x = p[0] - s->centre[0], y = p[1] - s->centre[1], z = p[2] - s->centre[2];
    return sqrt(x * x + y * y + z * z) - s->radius;
}

static vsh_distance sphere_field(sphere *s) {
    vsh_distance field = {sphere_distance, s, 1.0, 1, {0, 0, 0}, {0, 0, 0}};
    for (int i = 0; i < 3; ++i) {
        field.bounds_min[i] = s->centre[i] - s->radius;
        field.bounds_max[i] = s->centre[i] + s->radius;
    }
    return field;
}

static double unit_sphere(const double p[3]) {
    return sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - 1.0;
}

static void a_sphere_is_exact_in_its_band(void **state) {
    (void)state;
    sphere s = {{0, 0, 0}, 1.0, 0};
    const vsh_distance field = sphere_field(&s);
    const vsh_grid_options options = with_voxel(0.02);
    vsh_grid *grid = NULL;
    assert_int_equal(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure), VSH_OK);
    assert_true(worst_error(grid, unit_sphere, 2.999, 2.999) < 1e-5);
    assert_int_equal(wrong_blocks(grid, unit_sphere, 10), 0);
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    assert_float_equal(info.voxel_size, 0.02, 1e-12);
    assert_float_equal(info.half_width, 3.0, 1e-6);
    for (int i = 0; i < 3; ++i) {
        assert_true(info.bounds_min[i] > -1.05 && info.bounds_min[i] < -1.0 + 1e-9);
        assert_true(info.bounds_max[i] < 1.05 && info.bounds_max[i] > 1.0 - 1e-9);
    }
    vsh_grid_free(grid);
}

static void the_work_follows_the_area(void **state) {
    (void)state;
    size_t calls[2];
    for (int i = 0; i < 2; ++i) {
        sphere s = {{0, 0, 0}, 1.0, 0};
        const vsh_distance field = sphere_field(&s);
        const vsh_grid_options options = with_voxel(i == 0 ? 0.02 : 0.01);
        vsh_grid *grid = NULL;
        assert_int_equal(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure), VSH_OK);
        vsh_grid_free(grid);
        calls[i] = s.calls;
    }
    const double voxels = 4.0 * 3.14159265 / (0.01 * 0.01);
    assert_true((double)calls[1] < 20.0 * voxels);          /* layers of voxels, of which the band has 6 */
    assert_true((double)calls[1] < 4.4 * (double)calls[0]); /* 4: area, 8: volume */
}

static void far_from_the_origin_nothing_changes(void **state) {
    (void)state;
    const vsh_grid_options options = with_voxel(0.03125);
    vsh_grid *grids[2];
    for (int i = 0; i < 2; ++i) {
        sphere s = {{0, 0, 0}, 1.0, 0};
        s.centre[0] = i * 1e7;
        s.centre[2] = i * -3e6;
        const vsh_distance field = sphere_field(&s);
        assert_int_equal(vsh_grid_from_distance(&field, &options, NULL, &grids[i], &failure), VSH_OK);
    }
    assert_same_leaves(grids[0], grids[1], 1e-7f);
    assert_float_equal(vshi_grid_transform(grids[1])[3] - vshi_grid_transform(grids[0])[3], 1e7, 0.0);
    vsh_grid_free(grids[0]);
    vsh_grid_free(grids[1]);
}

static vsh_sdf_node hole_nodes[3];

static vsh_sdf hollow_sphere(void) {
    hole_nodes[0] = vsh_sdf_node_default();
    hole_nodes[1] = vsh_sdf_node_default();
    hole_nodes[1].radius = 0.6;
    hole_nodes[2] = vsh_sdf_node_default();
    hole_nodes[2].shape = VSH_SDF_SUBTRACTION;
    hole_nodes[2].left = 0;
    hole_nodes[2].right = 1;
    return (vsh_sdf){hole_nodes, 3};
}

static double hollow_truth(const double p[3]) {
    const double d = unit_sphere(p);
    return fmax(d, -(d + 0.4));
}

static void a_room_inside_a_solid_stays_a_room(void **state) {
    (void)state;
    const vsh_sdf sdf = hollow_sphere();
    const vsh_grid_options options = with_voxel(0.03);
    vsh_grid *grid = NULL;
    assert_int_equal(vsh_grid_from_sdf(&sdf, &options, NULL, &grid, &failure), VSH_OK);
    const double worst = worst_error(grid, hollow_truth, 2.9, 2.9);
    print_message("re-distanced hollow sphere: worst error %.3f voxels\n", worst);
    assert_true(worst < 0.15);
    assert_int_equal(wrong_blocks(grid, hollow_truth, 10), 0);
    vsh_grid_free(grid);
}

/* A bound that is too small by a third, and a cube root's worth of bend: only its zero can be trusted. */
static double squashed(void *user, const double p[3]) {
    (void)user;
    const double d = unit_sphere(p);
    return 0.6 * d / (1.0 + fabs(d));
}

static void a_bound_becomes_a_distance(void **state) {
    (void)state;
    const vsh_distance field = {squashed, NULL, 0.6, 0, {-1, -1, -1}, {1, 1, 1}};
    vsh_grid_options options = with_voxel(0.03);
    options.half_width = 5.0;
    vsh_grid *grid = NULL;
    assert_int_equal(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure), VSH_OK);
    const double worst = worst_error(grid, unit_sphere, 4.9, 4.9);
    print_message("re-distanced sphere: worst error %.3f voxels\n", worst);
    assert_true(worst < 0.15);
    assert_int_equal(wrong_blocks(grid, unit_sphere, 10), 0);
    vsh_grid_free(grid);
}

static void threads_do_not_show(void **state) {
    (void)state;
    const vsh_sdf sdf = hollow_sphere();
    const int32_t threads[3] = {1, 2, 5};
    vsh_grid *grids[3];
    const vsh_grid_options options = with_voxel(0.04);
    for (int i = 0; i < 3; ++i) {
        vsh_run run = vsh_run_default();
        run.threads = threads[i];
        assert_int_equal(vsh_grid_from_sdf(&sdf, &options, &run, &grids[i], &failure), VSH_OK);
    }
    assert_same_leaves(grids[0], grids[1], 0.0f);
    assert_same_leaves(grids[0], grids[2], 0.0f);
    for (int i = 0; i < 3; ++i) {
        vsh_grid_free(grids[i]);
    }
}

static double hole_in_the_middle(void *user, const double p[3]) {
    (void)user;
    const double d = unit_sphere(p);
    return d < -0.02 && d > -0.03 ? NAN : d;
}

static double nowhere_near(void *user, const double p[3]) {
    (void)user;
    return 5.0 + 0.1 * p[0];
}

static void bad_fields_and_options_are_refused_with_the_reason(void **state) {
    (void)state;
    sphere s = {{0, 0, 0}, 1.0, 0};
    const vsh_distance good = sphere_field(&s);
    vsh_distance field = good;
    vsh_grid_options options = vsh_grid_options_default();
    vsh_grid *grid = NULL;
    field.lipschitz = 0.0;
    assert_fails(vsh_grid_from_distance(&field, NULL, NULL, &grid, &failure), VSH_ERROR_ARGUMENT,
                 "lipschitz 0");
    field = good;
    field.bounds_max[1] = NAN;
    assert_fails(vsh_grid_from_distance(&field, NULL, NULL, &grid, &failure), VSH_ERROR_ARGUMENT,
                 "bounds[1]");
    field = good;
    field.distance = hole_in_the_middle;
    options.resolution = 100;
    assert_fails(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure), VSH_ERROR_INPUT,
                 "nan at (");
    field.distance = nowhere_near;
    assert_fails(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure), VSH_ERROR_INPUT,
                 "no surface");
    const struct {
        double voxel, half_width, shell;
        int32_t resolution;
        const char *part;
    } cases[] = {
        {-1.0, 3.0, 2.0, 256, "voxel_size -1"},    {NAN, 3.0, 2.0, 256, "voxel_size nan"},
        {INFINITY, 3.0, 2.0, 256, "voxel_size"},   {0.0, 3.0, 2.0, 1, "resolution 1"},
        {0.0, 2.5, 2.0, 256, "half_width 2.5"},    {0.0, NAN, 2.0, 256, "half_width"},
        {0.0, 3.0, 0.5, 256, "shell_thickness 0"}, {0.0, 101.0, 2.0, 256, "half_width 101"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
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

static void too_small_a_voxel_is_refused_before_memory_is_taken(void **state) {
    (void)state;
    sphere s = {{0, 0, 0}, 1.0, 0};
    const vsh_distance field = sphere_field(&s);
    vsh_grid *grid = NULL;
    vsh_grid_options options = with_voxel(1e-9);
    assert_fails(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure), VSH_ERROR_LIMIT,
                 "voxel size 1e-09");
    options = with_voxel(1e-6);
    assert_fails(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure), VSH_ERROR_LIMIT,
                 "voxel size 1e-06");
    options = with_voxel(1.6e-5);
    assert_fails(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure), VSH_ERROR_LIMIT,
                 "this machine's memory");
    assert_true(s.calls < 100000);
    options = with_voxel(0.005);
    vsh_run run = vsh_run_default();
    run.memory_limit = 10000000;
    assert_fails(vsh_grid_from_distance(&field, &options, &run, &grid, &failure), VSH_ERROR_LIMIT,
                 "over the memory limit of 10 MB");
    run.memory_limit = 500000000;
    assert_int_equal(vsh_grid_from_distance(&field, &options, &run, &grid, &failure), VSH_OK);
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    assert_true(info.bytes < run.memory_limit);
    vsh_grid_free(grid);
}

/* The megabytes that a limit of one byte is told. */
static double foretold(const vsh_sdf *sdf, const vsh_grid_instance *instance,
                       const vsh_grid_options *options) {
    vsh_run run = vsh_run_default();
    run.memory_limit = 1;
    vsh_grid *grid = NULL;
    const vsh_result result = sdf != NULL ? vsh_grid_from_sdf(sdf, options, &run, &grid, &failure)
                                          : vsh_grid_unite(instance, 1, options, &run, &grid, &failure);
    assert_fails(result, VSH_ERROR_LIMIT, "about");
    const char *need = strstr(failure.message, "): about ");
    assert_non_null(need);
    return atof(need + 9);
}

static void re_distancing_is_foretold_with_the_band_that_it_makes(void **state) {
    (void)state;
    const vsh_sdf sdf = hollow_sphere();
    vsh_grid_options options = with_voxel(0.02);
    vsh_grid *source = NULL;
    assert_int_equal(vsh_grid_from_sdf(&sdf, &options, NULL, &source, &failure), VSH_OK);
    const double turned[12] = {0.6, -0.8, 0, 0, 0.8, 0.6, 0, 0, 0, 0, 1, 0};
    const vsh_grid_instance instance = {source, turned};
    const double half_widths[] = {3.0, 10.0, 30.0};
    for (int anew = 0; anew < 2; ++anew) { /* a tree that is no distance, a grid that is turned */
        for (size_t i = 0; i < sizeof half_widths / sizeof half_widths[0]; ++i) {
            options.half_width = half_widths[i];
            const double need = foretold(anew ? &sdf : NULL, &instance, &options);
            for (int over = 0; over < 2; ++over) {
                vsh_run run = vsh_run_default();
                run.memory_limit = (uint64_t)(need * 1e6 * (over ? 1.2 : 0.95));
                vsh_grid *grid = NULL;
                const vsh_result result = anew
                                              ? vsh_grid_from_sdf(&sdf, &options, &run, &grid, &failure)
                                              : vsh_grid_unite(&instance, 1, &options, &run, &grid, &failure);
                if (!over) {
                    assert_fails(result, VSH_ERROR_LIMIT, "over the memory limit");
                    continue;
                }
                assert_int_equal(result, VSH_OK);
                vsh_grid_info info;
                vsh_grid_get_info(grid, &info);
                print_message("half width %g: %g MB foretold, %g MB made\n", half_widths[i], need,
                              (double)info.bytes / 1e6);
                /* distances, nearest polygons, and the next values of both */
                assert_true(need * 1e6 > 3.0 * (double)info.bytes);
                assert_true(need * 1e6 < 9.0 * (double)info.bytes);
                vsh_grid_free(grid);
            }
        }
    }
    vsh_grid_free(source);
}

typedef struct watch {
    double last;
    double stop; /* fraction at which to cancel */
    int calls;
} watch;

static int32_t watch_progress(void *user, const char *stage, double fraction) {
    watch *w = user;
    assert_string_equal(stage, "voxelize");
    assert_true(fraction >= w->last && fraction <= 1.0);
    w->last = fraction;
    ++w->calls;
    return fraction >= w->stop;
}

static void progress_rises_to_one_and_can_cancel(void **state) {
    (void)state;
    const vsh_sdf sdf = hollow_sphere();
    const double stops[] = {2.0, 0.0, 0.1, 0.5, 0.9};
    for (size_t i = 0; i < sizeof stops / sizeof stops[0]; ++i) {
        watch w = {0.0, stops[i], 0};
        vsh_run run = vsh_run_default();
        run.threads = 2;
        run.progress = watch_progress;
        run.user = &w;
        vsh_grid *grid = NULL;
        const vsh_grid_options options = with_voxel(0.04);
        const vsh_result result = vsh_grid_from_sdf(&sdf, &options, &run, &grid, &failure);
        if (i == 0) {
            assert_int_equal(result, VSH_OK);
            assert_float_equal(w.last, 1.0, 0.0);
            assert_true(w.calls > 10);
            vsh_grid_free(grid);
        } else {
            assert_fails(result, VSH_ERROR_CANCELLED, "cancelled");
            assert_null(grid);
        }
    }
}

/* ---- Meshes ---- */

typedef struct model {
    float *positions;
    uint32_t *indices;
    vsh_mesh mesh;
} model;

/* A sphere of `rows` × 2 `rows` quads, halved; outward, or inward where `inverted`. */
static model make_sphere(int rows, double radius, int inverted) {
    const int columns = 2 * rows;
    const size_t vertices = (size_t)(rows - 1) * (size_t)columns + 2;
    const size_t triangles = 2 * (size_t)(rows - 1) * (size_t)columns;
    model m = {malloc(vertices * 3 * sizeof(float)), malloc(triangles * 3 * sizeof(uint32_t)), {0}};
    assert_non_null(m.positions);
    assert_non_null(m.indices);
    float *p = m.positions;
    for (int row = 1; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            const double polar = 3.14159265358979 * row / rows;
            const double around = 3.14159265358979 * column / rows;
            *p++ = (float)(radius * sin(polar) * cos(around));
            *p++ = (float)(radius * cos(polar));
            *p++ = (float)(radius * sin(polar) * sin(around));
        }
    }
    const float poles[6] = {0, (float)radius, 0, 0, (float)-radius, 0};
    memcpy(p, poles, sizeof poles);
    const uint32_t top = (uint32_t)vertices - 2, bottom = (uint32_t)vertices - 1;
    uint32_t *t = m.indices;
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            const uint32_t next = (uint32_t)((column + 1) % columns), here = (uint32_t)column;
            const uint32_t up = (uint32_t)((row - 1) * columns), down = (uint32_t)(row * columns);
            const uint32_t quad[4] = {row == 0 ? top : up + here, row == 0 ? top : up + next,
                                      row == rows - 1 ? bottom : down + next,
                                      row == rows - 1 ? bottom : down + here};
            if (row > 0) {
                *t++ = quad[0];
                *t++ = quad[inverted ? 2 : 1];
                *t++ = quad[inverted ? 1 : 2];
            }
            if (row < rows - 1) {
                *t++ = quad[0];
                *t++ = quad[inverted ? 3 : 2];
                *t++ = quad[inverted ? 2 : 3];
            }
        }
    }
    m.mesh = (vsh_mesh){"ball", m.positions, NULL, NULL, m.indices, vertices, triangles, NULL};
    return m;
}

static void free_model(model *m) {
    free(m->positions);
    free(m->indices);
}

static vsh_grid *grid_of(const vsh_mesh *meshes, size_t count, double voxel, const vsh_run *run) {
    const vsh_grid_options options = with_voxel(voxel);
    vsh_grid *grid = NULL;
    if (vsh_grid_from_meshes(meshes, count, &options, run, &grid, &failure) != VSH_OK) {
        fail_msg("%s", failure.message);
    }
    return grid;
}

static char last_warning[1024];

static void keep_warning(void *user, const char *message) {
    ++*(int *)user;
    snprintf(last_warning, sizeof last_warning, "%s", message);
}

static void a_fine_mesh_of_a_sphere_is_the_sphere(void **state) {
    (void)state;
    for (int inverted = 0; inverted < 2; ++inverted) {
        model ball = make_sphere(150, 1.0, inverted);
        vsh_grid *grid = grid_of(&ball.mesh, 1, 0.03, NULL);
        const double worst = worst_error(grid, unit_sphere, 2.95, 2.95);
        print_message("mesh of a sphere: worst error %.3f voxels\n", worst);
        assert_true(worst < 0.1);
        assert_int_equal(wrong_blocks(grid, unit_sphere, 10), 0);
        vsh_grid_free(grid);
        free_model(&ball);
    }
}

static double unit_cube(const double p[3]) {
    const double x = fabs(p[0]) - 1.0, y = fabs(p[1]) - 1.0, z = fabs(p[2]) - 1.0;
    const double a = fmax(x, 0.0), b = fmax(y, 0.0), c = fmax(z, 0.0);
    return sqrt(a * a + b * b + c * c) + fmin(fmax(x, fmax(y, z)), 0.0);
}

static const float cube_positions[24] = {-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1,
                                         -1, -1, 1,  1, -1, 1,  1, 1, 1,  -1, 1, 1};
static const uint32_t cube_indices[36] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                          3, 6, 2, 3, 7, 6, 0, 4, 7, 0, 7, 3, 1, 2, 6, 1, 6, 5};
static const vsh_mesh cube = {"cube", cube_positions, NULL, NULL, cube_indices, 8, 12, NULL};

static void few_large_triangles_are_exact(void **state) {
    (void)state;
    vsh_grid *grid = grid_of(&cube, 1, 0.03, NULL);
    assert_true(worst_error(grid, unit_cube, 2.95, 2.95) < 0.02);
    assert_int_equal(wrong_blocks(grid, unit_cube, 8), 0);
    vsh_grid_free(grid);
}

static void a_mesh_far_away_and_mirrored_is_the_same(void **state) {
    (void)state;
    const double far_away[12] = {-1, 0, 0, 1e7, 0, 1, 0, 0, 0, 0, 1, -4e6};
    vsh_mesh moved = cube;
    moved.transform = far_away;
    vsh_grid *here = grid_of(&cube, 1, 0.03125, NULL);
    vsh_grid *there = grid_of(&moved, 1, 0.03125, NULL);
    assert_same_leaves(here, there, 1e-6f);
    vsh_grid_free(here);
    vsh_grid_free(there);
}

static double sheet(const double p[3]) {
    return fabs(p[2]) - 0.04;
}

static void an_open_quad_becomes_a_shell_with_a_warning(void **state) {
    (void)state;
    static const float positions[12] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    const vsh_mesh quad = {"sail", positions, NULL, NULL, indices, 4, 2, NULL};
    int warnings = 0;
    vsh_run run = vsh_run_default();
    run.warning = keep_warning;
    run.user = &warnings;
    vsh_grid *grid = NULL;
    vsh_grid_options options = with_voxel(0.02);
    options.shell_thickness = 4.0;
    assert_int_equal(vsh_grid_from_meshes(&quad, 1, &options, &run, &grid, &failure), VSH_OK);
    assert_int_equal(warnings, 1);
    assert_non_null(strstr(last_warning, "mesh 'sail' (1 of 1): 4 open edges: baked as a shell 4 voxels"));
    leaves all = leaves_of(grid);
    assert_float_equal(all.info.shell_thickness, 0.08, 1e-12);
    for (size_t i = 0; i < all.count; ++i) {
        for (int v = 0; v < 512; ++v) {
            double p[3];
            voxel_position(&all, i, v, p);
            if (fabs(p[0]) < 0.99 && fabs(p[1]) < 0.99) {
                const double expected = fmin(sheet(p), 0.06);
                assert_true(fabs((double)all.leaf[i].values[v] - expected) < 0.01 * 0.02);
            }
        }
    }
    free(all.leaf);
    vsh_grid_free(grid);
}

static double grown_sphere(const double p[3]) {
    return unit_sphere(p) - 0.03;
}

static void a_crack_keeps_the_inside(void **state) {
    (void)state;
    model ball = make_sphere(200, 1.0, 0);
    --ball.mesh.triangle_count;
    vsh_grid *grid = grid_of(&ball.mesh, 1, 0.03, NULL);
    assert_int_equal(wrong_blocks(grid, grown_sphere, 8), 0);
    leaves all = leaves_of(grid);
    for (size_t i = 0; i < all.count; ++i) {
        for (int v = 0; v < 512; ++v) {
            double p[3];
            voxel_position(&all, i, v, p);
            if (grown_sphere(p) < -0.1 * 0.03) {
                assert_true(all.leaf[i].values[v] < 0.0f);
            }
        }
    }
    free(all.leaf);
    vsh_grid_free(grid);
    free_model(&ball);
}

static double two_balls(const double p[3]) {
    const double q[3] = {p[0] - 0.8, p[1], p[2]};
    return fmin(unit_sphere(p), unit_sphere(q));
}

static void overlapping_meshes_are_one_solid(void **state) {
    (void)state;
    model ball = make_sphere(100, 1.0, 0);
    static const double aside[12] = {1, 0, 0, 0.8, 0, 1, 0, 0, 0, 0, 1, 0};
    vsh_mesh both[2] = {ball.mesh, ball.mesh};
    both[1].transform = aside;
    vsh_grid *grid = grid_of(both, 2, 0.03, NULL);
    leaves all = leaves_of(grid);
    for (size_t i = 0; i < all.count; ++i) {
        for (int v = 0; v < 512; ++v) {
            double p[3];
            voxel_position(&all, i, v, p);
            const double expected = two_balls(p);
            /* Along the seam the conversion signs a voxel by the nearer triangle: a groove of half a voxel.
             */
            const double q[3] = {p[0] - 0.8, p[1], p[2]};
            const int seam = fabs(unit_sphere(p)) < 0.03 && fabs(unit_sphere(q)) < 0.03;
            if (fabs(expected) > (seam ? 0.5 : 0.1) * 0.03) {
                assert_int_equal(all.leaf[i].values[v] < 0.0f, expected < 0.0);
            }
            if (expected > 0.0 && expected < 2.9 * 0.03) {
                assert_true(fabs((double)all.leaf[i].values[v] - expected) < (seam ? 0.5 : 0.1) * 0.03);
            }
        }
    }
    free(all.leaf);
    vsh_grid_free(grid);
    free_model(&ball);
}

static double room_with_a_ball(const double p[3]) {
    const double q[3] = {p[0] * 5.0, p[1] * 5.0, p[2] * 5.0};
    return fmin(hollow_truth(p), 0.2 * unit_sphere(q));
}

static void a_room_in_a_mesh_stays_open_and_keeps_its_furniture(void **state) {
    (void)state;
    /* One mesh of three shells: a ball, a room in it that faces inward, and a ball in the room. */
    model shells[3] = {make_sphere(100, 1.0, 0), make_sphere(100, 0.6, 1), make_sphere(40, 0.2, 0)};
    for (int turned = 0; turned < 2; ++turned) {
        size_t vertices = 0, indices = 0;
        model all = {malloc(50000 * 3 * sizeof(float)), malloc(100000 * 3 * sizeof(uint32_t)), {0}};
        assert_non_null(all.positions);
        assert_non_null(all.indices);
        for (int i = 0; i < 3; ++i) {
            const vsh_mesh *m = &shells[turned ? 2 - i : i].mesh;
            memcpy(all.positions + 3 * vertices, m->positions, m->vertex_count * 3 * sizeof(float));
            for (size_t j = 0; j < 3 * m->triangle_count; ++j) {
                all.indices[indices++] = m->indices[j] + (uint32_t)vertices;
            }
            vertices += m->vertex_count;
        }
        const double mirrored[12] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0};
        all.mesh = (vsh_mesh){"house",     all.positions, NULL,        NULL,
                              all.indices, vertices,      indices / 3, turned ? mirrored : NULL};
        vsh_grid *grid = grid_of(&all.mesh, 1, 0.03, NULL);
        assert_true(worst_error(grid, room_with_a_ball, 2.9, 2.9) < 0.1);
        assert_int_equal(wrong_blocks(grid, room_with_a_ball, 8), 0);
        vsh_grid_free(grid);
        free_model(&all);
    }
    for (int i = 0; i < 3; ++i) {
        free_model(&shells[i]);
    }
}

static void threads_do_not_show_in_meshes(void **state) {
    (void)state;
    model fine = make_sphere(100, 0.7, 0);
    model coarse = make_sphere(5, 1.0, 0);
    const vsh_mesh sets[2][2] = {{fine.mesh, coarse.mesh}, {coarse.mesh, cube}};
    const int32_t threads[5] = {1, 2, 5, 0, 2};
    for (int set = 0; set < 2; ++set) {
        vsh_grid *first = NULL;
        for (int i = 0; i < 5; ++i) {
            vsh_run run = vsh_run_default();
            run.threads = threads[i];
            vsh_grid *grid = grid_of(sets[set], 2, 0.03, &run);
            if (first == NULL) {
                first = grid;
            } else {
                assert_same_leaves(first, grid, 0.0f);
                vsh_grid_free(grid);
            }
        }
        vsh_grid_free(first);
    }
    free_model(&fine);
    free_model(&coarse);
}

static void bad_meshes_are_refused_with_the_reason(void **state) {
    (void)state;
    vsh_grid *grid = NULL;
    float positions[24];
    uint32_t indices[36];
    vsh_mesh bad = cube;
    bad.positions = positions;
    bad.indices = indices;
    memcpy(positions, cube_positions, sizeof positions);
    memcpy(indices, cube_indices, sizeof indices);
    positions[4] = NAN;
    assert_fails(vsh_grid_from_meshes(&bad, 1, NULL, NULL, &grid, &failure), VSH_ERROR_INPUT, "vertex 1");
    positions[4] = 0.0f;
    indices[7] = 8;
    assert_fails(vsh_grid_from_meshes(&bad, 1, NULL, NULL, &grid, &failure), VSH_ERROR_INPUT, "vertex 8");
    bad = cube;
    bad.triangle_count = 0;
    assert_fails(vsh_grid_from_meshes(&bad, 1, NULL, NULL, &grid, &failure), VSH_ERROR_INPUT,
                 "without a triangle");
    assert_fails(vsh_grid_from_meshes(NULL, 0, NULL, NULL, &grid, &failure), VSH_ERROR_ARGUMENT, "no meshes");
    vsh_grid_options options = with_voxel(1e-9);
    assert_fails(vsh_grid_from_meshes(&cube, 1, &options, NULL, &grid, &failure), VSH_ERROR_LIMIT,
                 "voxel size 1e-09");
    options = with_voxel(2e-5);
    assert_fails(vsh_grid_from_meshes(&cube, 1, &options, NULL, &grid, &failure), VSH_ERROR_LIMIT,
                 "this machine's memory");
    vsh_run run = vsh_run_default();
    run.memory_limit = 1000000;
    assert_fails(vsh_grid_from_meshes(&cube, 1, NULL, &run, &grid, &failure), VSH_ERROR_LIMIT,
                 "limit of 1 MB");
    assert_null(grid);
}

static void meshes_can_be_cancelled(void **state) {
    (void)state;
    model ball = make_sphere(100, 1.0, 0);
    const double stops[] = {0.0, 0.1, 0.5, 0.9};
    for (size_t i = 0; i < sizeof stops / sizeof stops[0]; ++i) {
        watch w = {0.0, stops[i], 0};
        vsh_run run = vsh_run_default();
        run.threads = 2;
        run.progress = watch_progress;
        run.user = &w;
        vsh_grid *grid = NULL;
        const vsh_grid_options options = with_voxel(0.04);
        assert_fails(vsh_grid_from_meshes(&ball.mesh, 1, &options, &run, &grid, &failure),
                     VSH_ERROR_CANCELLED, "cancelled");
        assert_null(grid);
    }
    free_model(&ball);
}

/* ---- Unions ---- */

static vsh_grid *ball_grid(double x, double radius, double voxel) {
    sphere s = {{x, 0, 0}, radius, 0};
    const vsh_distance field = sphere_field(&s);
    const vsh_grid_options options = with_voxel(voxel);
    vsh_grid *grid = NULL;
    assert_int_equal(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure), VSH_OK);
    return grid;
}

static void one_grid_alone_is_shared_as_it_is(void **state) {
    (void)state;
    vsh_grid *ball = ball_grid(0.0, 1.0, 0.03);
    const vsh_grid_instance instance = {ball, NULL};
    vsh_grid *same = NULL;
    assert_int_equal(vsh_grid_unite(&instance, 1, NULL, NULL, &same, &failure), VSH_OK);
    vsh_grid *const given = ball;
    assert_same_leaves(given, same, 0.0f);
    vsh_grid_free(given);
    assert_true(worst_error(same, unit_sphere, 2.95, 2.95) < 1e-4);
    vsh_grid_free(same);
}

/* Shifts by whole voxels that are no whole leaves: the values are those of the closed form. */
static void grids_on_one_lattice_are_shifted_and_keep_their_values(void **state) {
    (void)state;
    vsh_grid *ball = ball_grid(0.0, 1.0, 0.03);
    const double aside[12] = {1, 0, 0, 27 * 0.03, 0, 1, 0, 0, 0, 0, 1, 0};
    const vsh_grid_instance instances[2] = {{ball, NULL}, {ball, aside}};
    vsh_grid *both = NULL;
    assert_int_equal(vsh_grid_unite(instances, 2, NULL, NULL, &both, &failure), VSH_OK);
    leaves all = leaves_of(both);
    for (size_t i = 0; i < all.count; ++i) {
        for (int v = 0; v < 512; ++v) {
            double p[3];
            voxel_position(&all, i, v, p);
            const double q[3] = {p[0] - 27 * 0.03, p[1], p[2]};
            const double expected = fmax(-0.09, fmin(0.09, fmin(unit_sphere(p), unit_sphere(q))));
            assert_true(fabs((double)all.leaf[i].values[v] - expected) < 1e-6);
        }
    }
    free(all.leaf);
    vsh_grid_free(ball);
    vsh_grid_free(both);
}

static double moved_sphere(const double p[3]) { /* twice as large, its middle at 1, 2, 3 */
    const double q[3] = {0.5 * (p[0] - 1.0), 0.5 * (p[1] - 2.0), 0.5 * (p[2] - 3.0)};
    return 2.0 * unit_sphere(q);
}

static void a_turned_mirrored_scaled_grid_is_measured_anew(void **state) {
    (void)state;
    vsh_grid *ball = ball_grid(0.0, 1.0, 0.03);
    const double c = 2.0 * cos(0.5), s = 2.0 * sin(0.5);
    const double turned[12] = {-c, s, 0, 1, s, c, 0, 2, 0, 0, 2, 3};
    const vsh_grid_instance instance = {ball, turned};
    const double voxels[] = {0.0, 0.045, 0.09};
    for (int i = 0; i < 3; ++i) {
        vsh_grid *moved = NULL;
        const vsh_grid_options options = with_voxel(voxels[i]);
        assert_int_equal(vsh_grid_unite(&instance, 1, &options, NULL, &moved, &failure), VSH_OK);
        vsh_grid_info info;
        vsh_grid_get_info(moved, &info);
        assert_float_equal(info.voxel_size, i == 0 ? 0.06 : voxels[i], 1e-9);
        const double worst = worst_error(moved, moved_sphere, 2.9, 2.9);
        print_message("resampled sphere, voxel %g: worst error %.3f voxels\n", info.voxel_size, worst);
        assert_true(worst < 0.15);
        assert_int_equal(wrong_blocks(moved, moved_sphere, 10), 0);
        vsh_grid_free(moved);
    }
    vsh_grid_free(ball);
}

static void rooms_stay_open_in_a_union_of_different_lattices(void **state) {
    (void)state;
    const vsh_sdf sdf = hollow_sphere();
    const vsh_grid_options options = with_voxel(0.03);
    vsh_grid *room = NULL;
    assert_int_equal(vsh_grid_from_sdf(&sdf, &options, NULL, &room, &failure), VSH_OK);
    vsh_grid *ball = ball_grid(0.0, 1.0, 0.05);
    const double turned[12] = {0.12, -0.16, 0, 0, 0.16, 0.12, 0, 0, 0, 0, 0.2, 0};
    const vsh_grid_instance instances[2] = {{ball, turned}, {room, NULL}};
    vsh_grid *both = NULL;
    assert_int_equal(vsh_grid_unite(instances, 2, &options, NULL, &both, &failure), VSH_OK);
    assert_true(worst_error(both, room_with_a_ball, 2.9, 2.9) < 0.15);
    assert_int_equal(wrong_blocks(both, room_with_a_ball, 8), 0);
    vsh_grid_free(both);
    vsh_grid_free(room);
    vsh_grid_free(ball);
}

static void threads_do_not_show_in_unions(void **state) {
    (void)state;
    vsh_grid *ball = ball_grid(0.0, 1.0, 0.05);
    const double turned[12] = {0.6, -0.8, 0, 0.5, 0.8, 0.6, 0, 0, 0, 0, 1, 0.1};
    const vsh_grid_instance instances[2] = {{ball, NULL}, {ball, turned}};
    vsh_grid *first = NULL;
    const int32_t threads[3] = {1, 2, 5};
    for (int i = 0; i < 3; ++i) {
        vsh_run run = vsh_run_default();
        run.threads = threads[i];
        vsh_grid *both = NULL;
        assert_int_equal(vsh_grid_unite(instances, 2, NULL, &run, &both, &failure), VSH_OK);
        if (first != NULL) {
            assert_same_leaves(first, both, 0.0f);
            vsh_grid_free(both);
        } else {
            first = both;
        }
    }
    vsh_grid_free(first);
    vsh_grid_free(ball);
}

static void bad_unions_are_refused_with_the_reason(void **state) {
    (void)state;
    vsh_grid *ball = ball_grid(0.0, 1.0, 0.05);
    const double uneven[12] = {1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0};
    const double sheared[12] = {1, 0.3, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const double lost[12] = {1, 0, 0, NAN, 0, 1, 0, 0, 0, 0, 1, 0};
    const double far_away[12] = {1, 0, 0, 1e9, 0, 1, 0, 0, 0, 0, 1, 0};
    vsh_grid *both = NULL;
    vsh_grid_instance instances[2] = {{ball, NULL}, {ball, uneven}};
    assert_fails(vsh_grid_unite(instances, 2, NULL, NULL, &both, &failure), VSH_ERROR_ARGUMENT,
                 "length 1, 2, 1");
    instances[1].transform = sheared;
    assert_fails(vsh_grid_unite(instances, 2, NULL, NULL, &both, &failure), VSH_ERROR_ARGUMENT, "instance 1");
    instances[1].transform = lost;
    assert_fails(vsh_grid_unite(instances, 2, NULL, NULL, &both, &failure), VSH_ERROR_ARGUMENT, "instance 1");
    instances[1].transform = far_away;
    assert_fails(vsh_grid_unite(instances, 2, NULL, NULL, &both, &failure), VSH_ERROR_LIMIT, "longest side");
    instances[1].grid = NULL;
    assert_fails(vsh_grid_unite(instances, 2, NULL, NULL, &both, &failure), VSH_ERROR_ARGUMENT, "no grid");
    assert_fails(vsh_grid_unite(NULL, 0, NULL, NULL, &both, &failure), VSH_ERROR_ARGUMENT, "no grids");
    const vsh_grid_options options = with_voxel(2e-5);
    assert_fails(vsh_grid_unite(instances, 1, &options, NULL, &both, &failure), VSH_ERROR_LIMIT, "memory");
    vsh_run run = vsh_run_default();
    run.memory_limit = 1000000;
    instances[1] = instances[0];
    assert_fails(vsh_grid_unite(instances, 2, NULL, &run, &both, &failure), VSH_ERROR_LIMIT, "limit of 1 MB");
    assert_null(both);
    vsh_grid_free(ball);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sphere_is_exact_in_its_band),
        cmocka_unit_test(the_work_follows_the_area),
        cmocka_unit_test(far_from_the_origin_nothing_changes),
        cmocka_unit_test(a_room_inside_a_solid_stays_a_room),
        cmocka_unit_test(a_bound_becomes_a_distance),
        cmocka_unit_test(threads_do_not_show),
        cmocka_unit_test(bad_fields_and_options_are_refused_with_the_reason),
        cmocka_unit_test(too_small_a_voxel_is_refused_before_memory_is_taken),
        cmocka_unit_test(re_distancing_is_foretold_with_the_band_that_it_makes),
        cmocka_unit_test(progress_rises_to_one_and_can_cancel),
        cmocka_unit_test(a_fine_mesh_of_a_sphere_is_the_sphere),
        cmocka_unit_test(few_large_triangles_are_exact),
        cmocka_unit_test(a_mesh_far_away_and_mirrored_is_the_same),
        cmocka_unit_test(an_open_quad_becomes_a_shell_with_a_warning),
        cmocka_unit_test(a_crack_keeps_the_inside),
        cmocka_unit_test(overlapping_meshes_are_one_solid),
        cmocka_unit_test(a_room_in_a_mesh_stays_open_and_keeps_its_furniture),
        cmocka_unit_test(threads_do_not_show_in_meshes),
        cmocka_unit_test(bad_meshes_are_refused_with_the_reason),
        cmocka_unit_test(meshes_can_be_cancelled),
        cmocka_unit_test(one_grid_alone_is_shared_as_it_is),
        cmocka_unit_test(grids_on_one_lattice_are_shifted_and_keep_their_values),
        cmocka_unit_test(a_turned_mirrored_scaled_grid_is_measured_anew),
        cmocka_unit_test(rooms_stay_open_in_a_union_of_different_lattices),
        cmocka_unit_test(threads_do_not_show_in_unions),
        cmocka_unit_test(bad_unions_are_refused_with_the_reason),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
