/* Runs of the unwrapper: threads, pages, densities, instances, UVs that are kept, cancelling, limits, bad
 * input. */
#include "unwraps.h"

static const double ORIGIN[3] = {0, 0, 0};

/* A lumpy ball, so that charts are of many shapes. */
static shape *lump(uint32_t around) {
    shape *s = shape_new();
    shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, around);
    for (size_t v = 0; v < s->vertices; ++v) {
        float *p = s->positions[v];
        const float k =
            1.0F + 0.2F * (float)sin(5 * (double)p[0]) * (float)cos(4 * (double)p[1] + (double)p[2]);
        for (int i = 0; i < 3; ++i) {
            p[i] *= k;
        }
    }
    return s;
}

static void same_atlases(const vsh_atlas *a, const vsh_atlas *b) {
    assert_int_equal(vsh_atlas_chart_count(a), vsh_atlas_chart_count(b));
    assert_memory_equal(vsh_atlas_charts(a), vsh_atlas_charts(b),
                        vsh_atlas_chart_count(a) * sizeof(vsh_atlas_chart));
    for (size_t m = 0; m < vsh_atlas_mesh_count(a); ++m) {
        const vsh_atlas_mesh x = vsh_atlas_mesh_view(a, m), y = vsh_atlas_mesh_view(b, m);
        assert_int_equal(x.vertex_count, y.vertex_count);
        assert_memory_equal(x.uvs, y.uvs, x.vertex_count * 2 * sizeof *x.uvs);
        assert_memory_equal(x.indices, y.indices, x.triangle_count * 3 * sizeof *x.indices);
        assert_memory_equal(x.charts, y.charts, x.triangle_count * sizeof *x.charts);
    }
}

static void the_same_bits_for_any_number_of_threads(void **state) {
    (void)state;
    shape *s[2] = {lump(40), lump(64)};
    const vsh_mesh meshes[2] = {shape_mesh(s[0], "one"), shape_mesh(s[1], "two")};
    const vsh_unwrap_options o = unwrap_into(256);
    vsh_run run = vsh_run_default();
    vsh_atlas *first = NULL;
    for (int32_t threads = 1; threads <= 8; ++threads) {
        vsh_atlas *atlas = NULL;
        run.threads = threads;
        assert_int_equal(vsh_unwrap(meshes, 2, &o, &run, &atlas, NULL), VSH_OK);
        if (first == NULL) {
            first = atlas;
            continue;
        }
        same_atlases(first, atlas);
        vsh_atlas_free(atlas);
    }
    vsh_atlas_free(first);
    free(s[0]);
    free(s[1]);
}

/* Twelve boxes of several sizes. */
enum { BOXES = 12 };

static void make_boxes(shape *s[BOXES], vsh_mesh meshes[BOXES]) {
    for (int i = 0; i < BOXES; ++i) {
        s[i] = shape_new();
        shape_box(s[i], ORIGIN, (double[3]){1 + 0.1 * i, 2 - 0.1 * i, 1}, ALL_SIDES);
        meshes[i] = shape_mesh(s[i], "box");
    }
}

static void free_boxes(shape *s[BOXES]) {
    for (int i = 0; i < BOXES; ++i) {
        free(s[i]);
    }
}

static void each_mesh_is_on_one_page_where_it_fits(void **state) {
    (void)state;
    shape *s[BOXES];
    vsh_mesh meshes[BOXES];
    make_boxes(s, meshes);
    vsh_unwrap_options o = unwrap_into(128);
    o.max_pages = 6;
    o.texels_per_unit = 20;
    vsh_atlas *atlas = NULL;
    const vsh_atlas_info info = unwrap_well(meshes, BOXES, &o, &atlas);
    assert_in_range(info.pages, 2, 6);
    assert_true(info.texels_per_unit == 20);
    uint32_t page[BOXES];
    memset(page, 0xff, sizeof page);
    for (size_t c = 0; c < info.charts; ++c) {
        const vsh_atlas_chart chart = vsh_atlas_chart_view(atlas, c);
        assert_true(page[chart.mesh] == UINT32_MAX || page[chart.mesh] == chart.page);
        page[chart.mesh] = chart.page;
    }
    vsh_atlas_free(atlas);
    /* a mesh that is larger than a page is spread over several */
    o.texels_per_unit = 55;
    o.max_pages = 3;
    assert_in_range(unwrap_well(meshes, 1, &o, NULL).pages, 2, 3);
    /* the greatest density for all pages is greater than that for one */
    o.texels_per_unit = 0;
    o.max_pages = 1;
    const double one = unwrap_well(meshes, BOXES, &o, NULL).texels_per_unit;
    o.max_pages = 4;
    const double four = unwrap_well(meshes, BOXES, &o, NULL).texels_per_unit;
    assert_true(four > 1.7 * one);
    free_boxes(s);
}

static void a_density_that_does_not_fit_is_refused_and_one_named_that_does(void **state) {
    (void)state;
    shape *s[BOXES];
    vsh_mesh meshes[BOXES];
    make_boxes(s, meshes);
    vsh_unwrap_options o = unwrap_into(128);
    vsh_atlas *atlas = NULL;
    vsh_error error = {0};
    o.texels_per_unit = 1000;
    assert_int_equal(vsh_unwrap(meshes, BOXES, &o, NULL, &atlas, &error), VSH_ERROR_LIMIT);
    assert_null(atlas);
    const char *named = strstr(error.message, "texels a unit: ");
    assert_non_null(named);
    assert_non_null(strstr(error.message, "1000"));
    o.texels_per_unit = atof(named + strlen("texels a unit: ")) * 0.999; /* of four digits */
    assert_true(o.texels_per_unit > 5 && o.texels_per_unit < 100);
    unwrap_well(meshes, BOXES, &o, NULL);
    /* more charts than texels */
    o = unwrap_into(8);
    assert_int_equal(vsh_unwrap(meshes, BOXES, &o, NULL, &atlas, &error), VSH_ERROR_LIMIT);
    assert_non_null(strstr(error.message, "at any density"));
    free_boxes(s);
}

/* Area of a mesh in texels. */
static double texels_of(const vsh_atlas *atlas, size_t mesh) {
    const vsh_atlas_mesh m = vsh_atlas_mesh_view(atlas, mesh);
    vsh_atlas_info info;
    vsh_atlas_get_info(atlas, &info);
    double sum = 0;
    for (size_t i = 0; i < m.triangle_count; ++i) {
        const corner_uvs c = uvs_of(&m, &info, i);
        sum += 0.5 * doubled_area(&c);
    }
    return sum;
}

static void density_is_as_asked_and_by_mesh(void **state) {
    (void)state;
    shape *s[2] = {lump(32), lump(32)};
    const vsh_mesh meshes[2] = {shape_mesh(s[0], "one"), shape_mesh(s[1], "two")};
    const double factors[2] = {1.0, 0.5};
    vsh_unwrap_options o = unwrap_into(256);
    o.density = factors;
    o.texels_per_unit = 30;
    vsh_atlas *atlas = NULL;
    vsh_mesh_report report;
    unwrap_well(meshes, 2, &o, &atlas);
    assert_int_equal(vsh_mesh_check(&meshes[0], &report, NULL), VSH_OK);
    assert_true(fabs(texels_of(atlas, 0) / (900 * report.area) - 1) < 0.01);
    assert_true(fabs(texels_of(atlas, 1) / (225 * report.area) - 1) < 0.01);
    vsh_atlas_free(atlas);
    free(s[0]);
    free(s[1]);
}

/* Turned, moved, mirrored and doubled: one layout, places of their own. One that is scaled unevenly is a
 * shape of its own. */
static void instances_share_their_charts(void **state) {
    (void)state;
    shape *s = lump(32);
    static const double transforms[4][12] = {{0, -1, 0, 5, 1, 0, 0, 0, 0, 0, 1, 0},
                                             {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 9},
                                             {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                                             {1, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1, 0}};
    vsh_mesh meshes[5];
    for (int i = 0; i < 5; ++i) {
        meshes[i] = shape_mesh(s, "lump");
        meshes[i].transform = i > 0 ? transforms[i - 1] : NULL;
    }
    vsh_unwrap_options o = unwrap_into(512);
    o.texels_per_unit = 20;
    vsh_atlas *atlas = NULL;
    const vsh_atlas_info info = unwrap_well(meshes, 5, &o, &atlas);
    assert_int_equal(info.shared, 3);
    const vsh_atlas_mesh first = vsh_atlas_mesh_view(atlas, 0), turned = vsh_atlas_mesh_view(atlas, 1);
    assert_ptr_equal(first.indices, turned.indices);
    assert_true(vsh_atlas_mesh_view(atlas, 4).indices != first.indices);
    assert_true(fabs(texels_of(atlas, 1) / texels_of(atlas, 0) - 1) < 1e-3);
    assert_true(fabs(texels_of(atlas, 2) / texels_of(atlas, 0) - 4) < 1e-2);
    assert_true(fabs(texels_of(atlas, 3) / texels_of(atlas, 0) - 1) < 1e-3);
    vsh_atlas_free(atlas);
    free(s);
}

/* The mesh with the UVs of an atlas; free both arrays. */
static vsh_mesh with_uvs(const vsh_mesh *mesh, const vsh_atlas *atlas, float **positions, float **uvs) {
    const vsh_atlas_mesh m = vsh_atlas_mesh_view(atlas, 0);
    *positions = calloc(m.vertex_count, 3 * sizeof(float));
    *uvs = calloc(m.vertex_count, 2 * sizeof(float));
    assert_true(*positions != NULL && *uvs != NULL);
    for (size_t v = 0; v < m.vertex_count; ++v) {
        memcpy(*positions + 3 * v, mesh->positions + 3 * (size_t)m.sources[v], 3 * sizeof(float));
    }
    memcpy(*uvs, m.uvs, m.vertex_count * 2 * sizeof(float));
    return (vsh_mesh){.name = mesh->name,
                      .positions = *positions,
                      .uvs = *uvs,
                      .indices = m.indices,
                      .vertex_count = m.vertex_count,
                      .triangle_count = m.triangle_count};
}

static void uvs_that_can_serve_are_kept(void **state) {
    (void)state;
    shape *s = lump(48);
    const vsh_mesh mesh = shape_mesh(s, "lump");
    vsh_unwrap_options o = unwrap_into(256);
    vsh_atlas *atlas = NULL, *again = NULL;
    const vsh_atlas_info info = unwrap_well(&mesh, 1, &o, &atlas);
    float *positions, *uvs;
    vsh_mesh own = with_uvs(&mesh, atlas, &positions, &uvs);
    int32_t usable = 0;
    assert_int_equal(vsh_uvs_usable(&own, NULL, &usable, NULL), VSH_OK);
    assert_int_equal(usable, 1);
    o.keep_uvs = VSH_UNWRAP_KEEP;
    o.width = o.height = 200;
    const vsh_atlas_info kept = unwrap_well(&own, 1, &o, &again);
    assert_int_equal(kept.kept, 1);
    assert_int_equal(kept.charts, info.charts);
    /* lengths of edges are those of the UVs, by one factor */
    const vsh_atlas_mesh m = vsh_atlas_mesh_view(again, 0);
    double least = INFINITY, most = 0;
    for (size_t i = 0; i < m.triangle_count; ++i) {
        for (size_t k = 0; k < 3; ++k) {
            double squares[2] = {0, 0};
            for (size_t d = 0; d < 2; ++d) {
                const size_t a = 3 * i + k, b = 3 * i + (k + 1) % 3;
                const double x = (double)m.uvs[2 * m.indices[a] + d] - (double)m.uvs[2 * m.indices[b] + d];
                const double y = (double)uvs[2 * own.indices[a] + d] - (double)uvs[2 * own.indices[b] + d];
                squares[0] += x * x;
                squares[1] += y * y;
            }
            if (squares[1] > 1e-6) {
                least = fmin(least, sqrt(squares[0] / squares[1]));
                most = fmax(most, sqrt(squares[0] / squares[1]));
            }
        }
    }
    assert_true(most / least < 1.001);
    vsh_atlas_free(again);

    /* and none of these can */
    const float first[2] = {uvs[0], uvs[1]};
    const size_t far = own.indices[3 * (own.triangle_count - 1)];
    for (int i = 0; i < 4; ++i) {
        uvs[0] = i == 0 ? NAN : i == 1 ? 1.5F : i == 2 ? -0.1F : uvs[2 * far];
        uvs[1] = i == 3 ? uvs[2 * far + 1] : first[1];
        assert_int_equal(vsh_uvs_usable(&own, NULL, &usable, NULL), VSH_OK);
        assert_int_equal(usable, 0);
        assert_int_equal(unwrap_well(&own, 1, &o, NULL).kept, 0);
        uvs[0] = first[0];
        uvs[1] = first[1];
    }
    for (size_t v = 0; v < own.vertex_count; ++v) { /* two halves over each other */
        uvs[2 * v] = uvs[2 * v] > 0.5F ? uvs[2 * v] - 0.5F : uvs[2 * v];
    }
    assert_int_equal(vsh_uvs_usable(&own, NULL, &usable, NULL), VSH_OK);
    assert_int_equal(usable, 0);
    free(uvs);
    free(positions);
    vsh_atlas_free(atlas);
    free(s);
}

typedef struct stopper {
    const char *stage;
    double at, last;
    int stopped;
} stopper;

static int32_t stop(void *user, const char *stage, double fraction) {
    stopper *s = user;
    assert_true(fraction >= 0 && fraction <= 1);
    if (strcmp(stage, s->stage) == 0) {
        assert_true(fraction >= s->last);
        s->last = fraction;
        s->stopped |= fraction >= s->at;
    }
    return s->stopped;
}

static void it_stops_where_it_is_told(void **state) {
    (void)state;
    shape *s = lump(64);
    const vsh_mesh mesh = shape_mesh(s, "lump");
    const vsh_unwrap_options o = unwrap_into(256);
    static const stopper where[] = {
        {"unwrap", 0.0, 0.0, 0}, {"unwrap", 0.3, 0.0, 0}, {"unwrap", 0.7, 0.0, 0}, {"pack", 0.0, 0.0, 0}};
    for (size_t i = 0; i < sizeof where / sizeof where[0]; ++i) {
        stopper stopping = where[i];
        vsh_run run = vsh_run_default();
        vsh_atlas *atlas = (void *)&run;
        vsh_error error = {0};
        run.progress = stop;
        run.user = &stopping;
        assert_int_equal(vsh_unwrap(&mesh, 1, &o, &run, &atlas, &error), VSH_ERROR_CANCELLED);
        assert_null(atlas);
        if (strstr(error.message, where[i].stage) == NULL) {
            fail_msg("%s at %g: '%s'", where[i].stage, where[i].at, error.message);
        }
    }
    stopper never = {"pack", 2.0, 0.0, 0};
    vsh_run run = vsh_run_default();
    vsh_atlas *atlas = NULL;
    run.progress = stop;
    run.user = &never;
    assert_int_equal(vsh_unwrap(&mesh, 1, &o, &run, &atlas, NULL), VSH_OK);
    assert_true(never.last == 1.0);
    vsh_atlas_free(atlas);
    free(s);
}

static void memory_is_kept_within_its_limit(void **state) {
    (void)state;
    shape *s = lump(64);
    const vsh_mesh mesh = shape_mesh(s, "lump");
    vsh_unwrap_options o = unwrap_into(256);
    vsh_run run = vsh_run_default();
    vsh_atlas *atlas = NULL;
    vsh_error error = {0};
    run.memory_limit = 100000;
    assert_int_equal(vsh_unwrap(&mesh, 1, &o, &run, &atlas, &error), VSH_ERROR_LIMIT);
    run.memory_limit = 100000000;
    assert_int_equal(vsh_unwrap(&mesh, 1, &o, &run, &atlas, &error), VSH_OK);
    vsh_atlas_free(atlas);
    o.width = o.height = VSH_MAX_PAGE_SIZE; /* half a gigabyte of bits */
    assert_int_equal(vsh_unwrap(&mesh, 1, &o, &run, &atlas, &error), VSH_ERROR_LIMIT);
    free(s);
}

static void refused(const vsh_mesh *mesh, size_t count, const vsh_unwrap_options *o, vsh_result code,
                    const char *word) {
    vsh_atlas *atlas = (void *)&code;
    vsh_error error = {0};
    const vsh_result result = vsh_unwrap(mesh, count, o, NULL, &atlas, &error);
    if (result != code || strstr(error.message, word) == NULL || atlas != NULL) {
        fail_msg("%s '%s', expected %s with '%s'", vsh_result_name(result), error.message,
                 vsh_result_name(code), word);
    }
}

static void bad_options_are_refused_by_name(void **state) {
    (void)state;
    shape *s = shape_new();
    shape_box(s, ORIGIN, (double[3]){1, 1, 1}, ALL_SIDES);
    const vsh_mesh mesh = shape_mesh(s, "box");
    const double bad[5] = {0, -1, NAN, INFINITY, 0};
    vsh_unwrap_options o;
#define WITH(member, value, word)                                                                            \
    o = unwrap_into(64);                                                                                     \
    o.member = (value);                                                                                      \
    refused(&mesh, 1, &o, VSH_ERROR_ARGUMENT, word)
    WITH(width, 0, "width");
    WITH(height, 65537, "height");
    WITH(max_pages, 0, "max_pages");
    WITH(max_pages, 1025, "max_pages");
    WITH(padding, -1, "padding");
    WITH(padding, 4097, "padding");
    WITH(texels_per_unit, -1, "texels_per_unit");
    WITH(texels_per_unit, NAN, "texels_per_unit");
    WITH(texels_per_unit, INFINITY, "texels_per_unit");
    WITH(max_stretch, 1.0, "max_stretch");
    WITH(max_stretch, NAN, "max_stretch");
    WITH(keep_uvs, 2, "keep_uvs");
    WITH(atlas, 2, "atlas");
    WITH(fit_pages, 1, "fit_pages");
    WITH(struct_size, 0, "vsh_unwrap_options");
    for (int i = 0; i < 4; ++i) {
        WITH(density, bad + i, "density");
    }
    o = unwrap_into(64);
    refused(&mesh, 0, &o, VSH_ERROR_ARGUMENT, "meshes");
    refused(NULL, 1, &o, VSH_ERROR_ARGUMENT, "meshes");
    free(s);
}

static void bad_meshes_are_refused(void **state) {
    (void)state;
    shape *s = shape_new();
    shape_box(s, ORIGIN, (double[3]){1, 1, 1}, ALL_SIDES);
    vsh_mesh mesh = shape_mesh(s, "box");
    const vsh_unwrap_options o = unwrap_into(64);
    s->positions[3][1] = NAN;
    refused(&mesh, 1, &o, VSH_ERROR_INPUT, "vertex 3");
    s->positions[3][1] = 0;
    s->indices[5][2] = 10000;
    refused(&mesh, 1, &o, VSH_ERROR_INPUT, "triangle 5");
    s->indices[5][2] = 0;
    const double flattens[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0};
    mesh.transform = flattens;
    refused(&mesh, 1, &o, VSH_ERROR_INPUT, "transform");
    mesh.transform = NULL;
    mesh.triangle_count = 0;
    refused(&mesh, 1, &o, VSH_ERROR_INPUT, "has area");
    mesh.triangle_count = 3;
    memset(s->indices, 0, 9 * sizeof(uint32_t));
    refused(&mesh, 1, &o, VSH_ERROR_INPUT, "has area");
    free(s);
}

/* A million units in one direction and one in the others; corners of floats' whole range. */
static void wild_numbers_do_no_harm(void **state) {
    (void)state;
    shape *s = shape_new();
    uint64_t seed = 11;
    for (int i = 0; i < 60; ++i) {
        shape_vertex(s, pow(10, 60 * next_number(&seed) - 30), pow(10, 20 * next_number(&seed) - 10),
                     next_number(&seed) - 0.5);
    }
    for (int i = 0; i < 100; ++i) {
        shape_triangle(s, (uint32_t)(60 * next_number(&seed)), (uint32_t)(60 * next_number(&seed)),
                       (uint32_t)(60 * next_number(&seed)));
    }
    const vsh_mesh mesh = shape_mesh(s, "wild");
    const vsh_unwrap_options o = unwrap_into(256);
    vsh_atlas *atlas = NULL;
    vsh_error error = {0};
    const vsh_result result = vsh_unwrap(&mesh, 1, &o, NULL, &atlas, &error);
    assert_true(result == VSH_OK || result == VSH_ERROR_LIMIT);
    vsh_atlas_free(atlas);
    free(s);
}

/* A rectangle of 1 × 2 units that fills the square: along v a texel is twice as long as along u. */
static void density_and_stretch_of_uvs_are_those_of_their_derivatives(void **state) {
    (void)state;
    static const float positions[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 2, 0}, {0, 2, 0}};
    static const float uvs[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    vsh_mesh mesh = {.name = "rectangle",
                     .positions = positions[0],
                     .uvs = uvs[0],
                     .indices = indices,
                     .vertex_count = 4,
                     .triangle_count = 2};
    vsh_uvs_measures measures;
    assert_int_equal(vsh_uvs_measure(&mesh, 64, 64, &measures, NULL), VSH_OK);
    assert_true(fabs(measures.texels_per_unit - 64.0 / sqrt(2.0)) < 1e-9);
    assert_true(fabs(measures.stretch - sqrt(1.25)) < 1e-9);
    assert_int_equal(vsh_uvs_measure(&mesh, 64, 128, &measures, NULL), VSH_OK);
    assert_true(fabs(measures.texels_per_unit - 64.0) < 1e-9 && fabs(measures.stretch - 1.0) < 1e-9);
    mesh.uvs = NULL;
    assert_int_equal(vsh_uvs_measure(&mesh, 64, 64, &measures, NULL), VSH_OK);
    assert_true(measures.texels_per_unit == 0.0 && measures.stretch == 0.0);
    assert_int_equal(vsh_uvs_measure(&mesh, 0, 64, &measures, NULL), VSH_ERROR_ARGUMENT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_same_bits_for_any_number_of_threads),
        cmocka_unit_test(density_and_stretch_of_uvs_are_those_of_their_derivatives),
        cmocka_unit_test(each_mesh_is_on_one_page_where_it_fits),
        cmocka_unit_test(a_density_that_does_not_fit_is_refused_and_one_named_that_does),
        cmocka_unit_test(density_is_as_asked_and_by_mesh),
        cmocka_unit_test(instances_share_their_charts),
        cmocka_unit_test(uvs_that_can_serve_are_kept),
        cmocka_unit_test(it_stops_where_it_is_told),
        cmocka_unit_test(memory_is_kept_within_its_limit),
        cmocka_unit_test(bad_options_are_refused_by_name),
        cmocka_unit_test(bad_meshes_are_refused),
        cmocka_unit_test(wild_numbers_do_no_harm),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
