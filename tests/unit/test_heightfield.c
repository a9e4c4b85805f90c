/* Heightfields as meshes and as images, and what is wrong with some. */
#include "images.h"
#include "terrain.h"

#include "base/vec.h"
#include "previews.h"

#include <vdbshade/scene.h>

enum { SIDE = 65 };

static void a_solid_is_closed_wound_outwards_and_of_its_volume(void **state) {
    (void)state;
    float *values = hills(SIDE, 40);
    vsh_heights_source source = source_of(values, SIDE, 40, 10.0, 2.0);
    source.base = 0.5;
    vsh_model *model = model_of(&source, VSH_HEIGHTS_SOLID);
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    vsh_mesh_report report;
    assert_int_equal(vsh_mesh_check(&mesh, &report, NULL), VSH_OK);
    assert_int_equal(report.open_edges, 0);
    assert_int_equal(report.flipped_edges, 0);
    assert_int_equal(report.degenerate_triangles, 0);
    double volume = 0.0, lowest = INFINITY;
    for (size_t t = 0; t < mesh.triangle_count; ++t) {
        vshi_vec c[3];
        for (int k = 0; k < 3; ++k) {
            c[k] = vshi_vec_off(mesh.positions + 3 * mesh.indices[3 * t + (size_t)k]);
        }
        volume += vshi_dot(c[0], vshi_cross(c[1], c[2])) / 6.0;
    }
    /* prisms over the two triangles of each cell */
    const double dx = source.size[0] / (SIDE - 1), dz = source.size[1] / 39;
    double expected = 0.0;
    for (int i = 0; i < SIDE * 40; ++i) {
        lowest = fmin(lowest, 2.0 * (double)values[i]);
    }
    for (int i = 0; i < 39; ++i) {
        for (int j = 0; j < SIDE - 1; ++j) {
            const float *h = values + i * SIDE + j;
            const double right = (double)(h[0] + h[1] + h[SIDE + 1]) / 3.0,
                         left = (double)(h[0] + h[SIDE] + h[SIDE + 1]) / 3.0;
            expected += dx * dz * (0.5 * 2.0 * (right + left) - (lowest - 0.5));
        }
    }
    assert_true(fabs(volume - expected) < 1e-4 * expected);
    vsh_model_free(model);
    free(values);
}

static void a_surface_lies_under_its_lightmap_as_the_image_does(void **state) {
    (void)state;
    /* one high sample, in row 1 of 4 and column 3 of 5 */
    float values[20] = {0};
    values[1 * 5 + 3] = 1.0f;
    const vsh_heights_source source = {
        .columns = 5, .rows = 4, .values = values, .size = {8, 6}, .height = 3};
    vsh_model *model = model_of(&source, VSH_HEIGHTS_SURFACE);
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    for (size_t i = 0; i < 20; ++i) {
        const float *p = mesh.positions + 3 * i, *uv = mesh.uvs + 2 * i, *n = mesh.normals + 3 * i;
        const double x = -4.0 + 2.0 * (double)(i % 5), z = -3.0 + 2.0 * (double)(i / 5);
        assert_float_equal(p[0], x, 1e-6);
        assert_float_equal(p[1], i == 8 ? 3.0 : 0.0, 1e-6);
        assert_float_equal(p[2], z, 1e-6);
        assert_float_equal(uv[0], (x + 4.0) / 8.0, 1e-6);
        assert_float_equal(uv[1], 1.0 - (z + 3.0) / 6.0, 1e-6);
        /* the sample to the left of the high one rises by 3 over 4 units */
        assert_float_equal(n[0] / n[1], i == 7 ? -0.75 : i == 9 ? 1.5 : 0.0, 1e-5);
        assert_float_equal(n[2] / n[1], i == 3 ? -1.5 : i == 13 ? 0.75 : 0.0, 1e-5);
    }
    vsh_model_free(model);
}

static int stop_at_once(void *user, const char *stage, double fraction) {
    (void)user, (void)stage, (void)fraction;
    return 1;
}

/* A band of 100 voxels took ten minutes. */
static void a_band_that_would_take_minutes_is_refused_and_the_one_it_names_is_not(void **state) {
    (void)state;
    enum { FINE = 257 };
    float *values = hills(FINE, FINE);
    const vsh_heights_source source = source_of(values, FINE, FINE, 10.0, 2.0);
    vsh_model *model = model_of(&source, VSH_HEIGHTS_SOLID);
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = 24;
    options.half_width = 100.0;
    vsh_grid *grid = NULL;
    vsh_error error = {VSH_OK, ""};
    assert_int_equal(vsh_grid_from_meshes(&mesh, 1, &options, NULL, &grid, &error), VSH_ERROR_LIMIT);
    const char *most = strstr(error.message, "use at most ");
    assert_non_null(strstr(error.message, "half_width 100"));
    assert_non_null(most);
    /* cancelled as soon as it begins */
    options.half_width = atof(most + strlen("use at most "));
    vsh_run run = vsh_run_default();
    run.progress = stop_at_once;
    assert_int_equal(vsh_grid_from_meshes(&mesh, 1, &options, &run, &grid, &error), VSH_ERROR_CANCELLED);
    options.half_width = 12.0;
    run.progress = NULL;
    assert_int_equal(vsh_grid_from_meshes(&mesh, 1, &options, &run, &grid, &error), VSH_OK);
    vsh_grid_free(grid);
    vsh_model_free(model);
    free(values);
}

static void the_field_of_a_heightfield_holds_distances_not_gaps(void **state) {
    (void)state;
    /* a ramp of slope 2 along x: a gap g over it is a distance g / √5 */
    float values[SIDE * 5];
    for (int i = 0; i < SIDE * 5; ++i) {
        values[i] = (float)(i % SIDE) / (SIDE - 1);
    }
    const vsh_heights_source source = {
        .columns = SIDE, .rows = 5, .values = values, .size = {4, 4}, .height = 8, .base = 1};
    vsh_model *model = model_of(&source, VSH_HEIGHTS_SOLID);
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = 0.05;
    options.half_width = 8.0;
    vsh_grid *grid = NULL;
    vsh_error error = {VSH_OK, ""};
    assert_int_equal(vsh_grid_from_meshes(&mesh, 1, &options, NULL, &grid, &error), VSH_OK);
    vsh_field *field = field_of_grid(grid, 0.0);
    for (int i = 0; i < 40; ++i) {
        const double gap = -0.6 + 1.2 * i / 39.0, x = -1.0 + i * 0.05;
        const double position[3] = {x, 2.0 * (x + 2.0) + gap, 0.1};
        float distance = 0.0f;
        vsh_field_sample(field, 1, position, &distance);
        assert_float_equal(distance, gap / sqrt(5.0), 0.01);
    }
    vsh_field_free(field);
    vsh_model_free(model);
}

/* A scene of one heightfield caster over an image in the tests' folder. */
static vsh_result load(const char *path, vsh_assets **assets, vsh_error *error) {
    const vsh_caster caster = {.type = VSH_CASTER_HEIGHTFIELD,
                               .path = path,
                               .transform = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                               .size = {3, 2},
                               .height = 4};
    const vsh_scene scene = {.casters = &caster,
                             .caster_count = 1,
                             .grid = vsh_grid_options_default(),
                             .shade = preview_options()};
    return vsh_assets_load(&scene, NULL, assets, error);
}

/* Heights of the first samples of an image of 4 × 3, written in a format of so many bits. */
static void check_image(const char *name, int32_t bits, int32_t channels, const double expected[12],
                        double tolerance, float scale) {
    static const char *const rgb[] = {"R", "G", "B"}, *const grey[] = {"Y"};
    float planes[3][12];
    const float *views[3] = {planes[0], planes[1], planes[2]};
    for (int c = 0; c < 3; ++c) {
        for (int i = 0; i < 12; ++i) {
            planes[c][i] = scale * (float)(i * (c + 1)) / 36.0f;
        }
    }
    const vsh_image image = {4, 3, channels, channels == 3 ? rgb : grey, views, NULL};
    vsh_image_options options = vsh_image_options_default();
    options.bits = bits;
    options.pack = channels == 3 ? NULL : strstr(name, ".exr") != NULL ? NULL : "R=Y,G=Y,B=Y";
    vsh_error error = {VSH_OK, ""};
    assert_ok(vsh_image_write(at(name), &image, &options, &error), &error);
    vsh_assets *assets = NULL;
    assert_ok(load(at(name), &assets, &error), &error);
    size_t count = 0;
    const vsh_mesh *mesh = vsh_assets_caster(assets, 0, &count);
    assert_int_equal(count, 1);
    for (size_t i = 0; i < 12; ++i) {
        assert_float_equal(mesh->positions[3 * i + 1], 4.0 * (double)scale * expected[i], tolerance);
    }
    vsh_assets_free(assets);
}

static void images_of_8_16_and_32_bits_are_read(void **state) {
    (void)state;
    double grey[12], luminance[12];
    for (int i = 0; i < 12; ++i) {
        grey[i] = i / 36.0;
        luminance[i] = i / 36.0 * (0.2126 + 2 * 0.7152 + 3 * 0.0722);
    }
    check_image("8.png", 8, 1, grey, 4.0 / 510.0 + 1e-6, 1.0f);
    check_image("16.png", 16, 1, grey, 4.0 / 131070.0 + 1e-6, 1.0f);
    check_image("16.tif", 16, 1, grey, 4.0 / 131070.0 + 1e-6, 1.0f);
    check_image("32.exr", 32, 1, grey, 1e-5, 1.0f);
    check_image("large.exr", 32, 1, grey, 1e-2, 1000.0f);
    check_image("below.tif", 32, 1, grey, 1e-4, -7.0f);
    check_image("rgb.png", 16, 3, luminance, 4.0 / 131070.0 + 1e-5, 1.0f);
}

static void bad_images_are_refused_with_their_place(void **state) {
    (void)state;
    static const char *const names[] = {"Y"};
    float values[12] = {0};
    const float *views[1] = {values};
    values[7] = NAN;
    vsh_image image = {4, 3, 1, names, views, NULL};
    vsh_error error = {VSH_OK, ""};
    vsh_assets *assets = NULL;
    assert_ok(vsh_image_write(at("nan.exr"), &image, NULL, &error), &error);
    assert_int_equal(load(at("nan.exr"), &assets, &error), VSH_ERROR_INPUT);
    assert_non_null(strstr(error.message, "nan.exr: row 1, column 3: value"));
    assert_null(assets);
    values[7] = 3e38f; /* finite, but not four times that */
    assert_ok(vsh_image_write(at("huge.exr"), &image, NULL, &error), &error);
    assert_int_equal(load(at("huge.exr"), &assets, &error), VSH_ERROR_INPUT);
    assert_non_null(strstr(error.message, "row 1, column 3"));
    image.height = 1;
    assert_ok(vsh_image_write(at("line.exr"), &image, NULL, &error), &error);
    assert_int_equal(load(at("line.exr"), &assets, &error), VSH_ERROR_INPUT);
    assert_non_null(strstr(error.message, "4 × 1 pixels"));
    assert_int_equal(load(at("none.png"), &assets, &error), VSH_ERROR_READ);
}

static void bad_sources_are_refused(void **state) {
    (void)state;
    static const double shear[12] = {1, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    float values[4] = {0, 1, 2, 3}, nan[4] = {0, 1, NAN, 3};
    const vsh_heights_source good = {
        .columns = 2, .rows = 2, .values = values, .size = {1, 1}, .height = 1, .base = 1};
    struct {
        vsh_heights_source source;
        vsh_result code;
        const char *message;
    } cases[12];
    for (size_t i = 0; i < 12; ++i) {
        cases[i].source = good;
        cases[i].code = VSH_ERROR_ARGUMENT;
    }
    cases[0].source.columns = 1;
    cases[0].message = "columns 1 is out of range 2 … 65536";
    cases[1].source.rows = INT32_MAX;
    cases[1].message = "rows 2.14748e+09 is out of range";
    cases[2].source.size[0] = 0.0;
    cases[2].message = "size[0] 0 is out of range";
    cases[3].source.size[1] = NAN;
    cases[3].message = "size[1] nan is out of range";
    cases[4].source.height = INFINITY;
    cases[4].message = "height inf is out of range";
    cases[5].source.base = -1.0;
    cases[5].message = "base -1 is out of range";
    cases[6].source.values = nan;
    cases[6].code = VSH_ERROR_INPUT;
    cases[6].message = "row 1, column 0: value nan";
    cases[7].source.values = NULL;
    cases[7].message = "values is NULL";
    cases[8].source.size[0] = 1e13;
    cases[8].message = "size[0] 1e+13 is out of range";
    cases[9].source.columns = -4;
    cases[9].message = "columns -4 is out of range";
    cases[10].source.columns = cases[10].source.rows = 0;
    cases[10].message = "columns 0 is out of range";
    cases[11].source.transform = shear; /* a mesh may be sheared */
    cases[11].message = "transform must be finite and neither shear";
    for (size_t i = 0; i < 12; ++i) {
        vsh_heights *heights = NULL;
        vsh_model *model = NULL;
        vsh_error error = {VSH_OK, ""};
        assert_int_equal(vsh_heights_create(&cases[i].source, NULL, &heights, &error), cases[i].code);
        if (strstr(error.message, cases[i].message) == NULL) {
            fail_msg("%zu: %s", i, error.message);
        }
        assert_null(heights);
        if (i != 11) {
            assert_int_equal(
                vsh_model_from_heights(&cases[i].source, VSH_HEIGHTS_SOLID, NULL, &model, &error),
                cases[i].code);
            assert_null(model);
        }
    }
}

static void memory_limits_hold_before_memory_is_taken(void **state) {
    (void)state;
    float *values = hills(SIDE, SIDE);
    const vsh_heights_source source = source_of(values, SIDE, SIDE, 10.0, 2.0);
    vsh_run run = vsh_run_default();
    vsh_error error = {VSH_OK, ""};
    run.memory_limit = 5 * SIDE * SIDE;
    vsh_heights *heights = NULL;
    vsh_model *model = NULL;
    assert_int_equal(vsh_heights_create(&source, &run, &heights, &error), VSH_ERROR_LIMIT);
    assert_int_equal(vsh_model_from_heights(&source, VSH_HEIGHTS_SOLID, &run, &model, &error),
                     VSH_ERROR_LIMIT);
    run.memory_limit = 6 * SIDE * SIDE;
    assert_int_equal(vsh_heights_create(&source, &run, &heights, &error), VSH_OK);
    vsh_heights_info info;
    vsh_heights_get_info(heights, &info);
    assert_true(info.bytes <= run.memory_limit);
    vsh_heights_free(heights);
    free(values);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_solid_is_closed_wound_outwards_and_of_its_volume),
        cmocka_unit_test(a_surface_lies_under_its_lightmap_as_the_image_does),
        cmocka_unit_test(a_band_that_would_take_minutes_is_refused_and_the_one_it_names_is_not),
        cmocka_unit_test(the_field_of_a_heightfield_holds_distances_not_gaps),
        cmocka_unit_test_setup_teardown(images_of_8_16_and_32_bits_are_read, make_folder, remove_folder),
        cmocka_unit_test_setup_teardown(bad_images_are_refused_with_their_place, make_folder, remove_folder),
        cmocka_unit_test(bad_sources_are_refused),
        cmocka_unit_test(memory_limits_hold_before_memory_is_taken),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
