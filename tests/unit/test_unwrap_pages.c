/* Pages of an atlas: one for each object, and as small as what lies on them allows. */
#include "unwraps.h"

static const double ORIGIN[3] = {0, 0, 0};

enum { MESHES = 5, OBJECTS = 4 };

/* Four objects, the second of two meshes; the last is without a number, as all were one by one. */
typedef struct level {
    shape *shapes[MESHES];
    vsh_mesh meshes[MESHES];
} level;

static const uint32_t object_of[MESHES] = {0, 1, 1, 2, 3};

static void make_level(level *l) {
    static const double sides[MESHES][3] = {{1, 1, 1}, {2, 1, 0.5}, {0.3, 0.4, 3}, {0, 0, 0}, {6, 1, 5}};
    static const char *const names[MESHES] = {"crate", "door", "handle", "ball", "wall"};
    for (int i = 0; i < MESHES; ++i) {
        l->shapes[i] = shape_new();
        if (i == 3) {
            shape_ball(l->shapes[i], ORIGIN, 1.0, -1.0, 1.0, 20);
        } else {
            shape_box(l->shapes[i], ORIGIN, sides[i], ALL_SIDES);
        }
        l->meshes[i] = shape_mesh(l->shapes[i], names[i]);
    }
    l->meshes[1].object = l->meshes[2].object = 7;
    l->meshes[1].object_name = l->meshes[2].object_name = "door with handle";
}

static void free_level(level *l) {
    for (int i = 0; i < MESHES; ++i) {
        free(l->shapes[i]);
    }
}

static vsh_unwrap_options of_objects(int32_t size) {
    vsh_unwrap_options o = unwrap_into(size);
    o.atlas = VSH_ATLAS_OBJECTS;
    return o;
}

static void same_uvs(const vsh_atlas *a, size_t m, const vsh_atlas *b, size_t n) {
    const vsh_atlas_mesh x = vsh_atlas_mesh_view(a, m), y = vsh_atlas_mesh_view(b, n);
    assert_int_equal(x.vertex_count, y.vertex_count);
    assert_memory_equal(x.uvs, y.uvs, x.vertex_count * 2 * sizeof *x.uvs);
}

static void each_object_is_packed_as_if_it_were_alone(void **state) {
    (void)state;
    level l;
    make_level(&l);
    const vsh_unwrap_options o = of_objects(128), alone = unwrap_into(128);
    vsh_atlas *atlas = NULL, *one = NULL;
    const vsh_atlas_info info = unwrap_well(l.meshes, MESHES, &o, &atlas);
    assert_int_equal(info.pages, OBJECTS);
    for (size_t c = 0; c < info.charts; ++c) {
        const vsh_atlas_chart chart = vsh_atlas_chart_view(atlas, c);
        assert_int_equal(chart.page, object_of[chart.mesh]);
    }
    for (size_t m = 0, count; m < MESHES; m += count) {
        count = m == 1 ? 2 : 1;
        const vsh_atlas_info own = unwrap_well(l.meshes + m, count, &alone, &one);
        const vsh_atlas_page page = vsh_atlas_page_view(atlas, object_of[m]);
        assert_int_equal(page.first_mesh, m);
        assert_true(page.texels_per_unit == own.texels_per_unit);
        assert_true(info.texels_per_unit <= own.texels_per_unit);
        for (size_t k = 0; k < count; ++k) {
            same_uvs(atlas, m + k, one, k);
        }
        vsh_atlas_free(one);
    }
    vsh_atlas_free(atlas);
    free_level(&l);
}

static void objects_that_are_instances_are_packed_alike(void **state) {
    (void)state;
    shape *s = shape_new();
    shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, 24);
    /* as it is, turned and moved, mirrored and twice as large, pressed */
    static const double transforms[4][12] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                                             {0, 0, 1, 5, 0, 1, 0, 0, -1, 0, 0, 2},
                                             {-2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 9},
                                             {1, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1, 0}};
    vsh_mesh meshes[4];
    for (int i = 0; i < 4; ++i) {
        meshes[i] = shape_mesh(s, "ball");
        meshes[i].transform = transforms[i];
    }
    vsh_unwrap_options o = of_objects(128);
    vsh_atlas *atlas = NULL;
    assert_int_equal(unwrap_well(meshes, 4, &o, &atlas).pages, 4);
    same_uvs(atlas, 0, atlas, 1);
    same_uvs(atlas, 0, atlas, 2);
    const double first = vsh_atlas_page_view(atlas, 0).texels_per_unit,
                 large = vsh_atlas_page_view(atlas, 2).texels_per_unit;
    assert_true(fabs(first - 2 * large) < 1e-9 * first);
    vsh_atlas_free(atlas);
    /* at one density the larger one takes more texels */
    o.texels_per_unit = 10;
    unwrap_well(meshes, 4, &o, &atlas);
    same_uvs(atlas, 0, atlas, 1);
    assert_true(vsh_atlas_page_view(atlas, 2).covered > 3 * vsh_atlas_page_view(atlas, 0).covered);
    assert_true(vsh_atlas_page_view(atlas, 2).texels_per_unit == 10);
    vsh_atlas_free(atlas);
    free(s);
}

static int is_power(int32_t x) {
    return (x & (x - 1)) == 0;
}

/* Whether meshes fit one page of a size at a density. */
static int fits(const vsh_mesh *meshes, size_t count, double density, int32_t width, int32_t height) {
    vsh_unwrap_options o = unwrap_into(width);
    vsh_atlas *atlas = NULL;
    o.height = height;
    o.texels_per_unit = density;
    const vsh_result result = vsh_unwrap(meshes, count, &o, NULL, &atlas, NULL);
    vsh_atlas_free(atlas);
    assert_true(result == VSH_OK || result == VSH_ERROR_LIMIT);
    return result == VSH_OK;
}

static void pages_are_the_smallest_that_the_density_fits(void **state) {
    (void)state;
    level l;
    make_level(&l);
    vsh_unwrap_options o = of_objects(256);
    o.texels_per_unit = 12;
    o.fit_pages = 1;
    vsh_atlas *atlas = NULL;
    assert_int_equal(unwrap_well(l.meshes, MESHES, &o, &atlas).pages, OBJECTS);
    int32_t least = 256, most = 0;
    for (size_t m = 0, count; m < MESHES; m += count) {
        count = m == 1 ? 2 : 1;
        const vsh_atlas_page page = vsh_atlas_page_view(atlas, object_of[m]);
        const int32_t w = page.width, h = page.height;
        assert_true(is_power(w) && is_power(h) && w <= 2 * h && h <= 2 * w);
        assert_true(page.texels_per_unit == 12);
        assert_true(fits(l.meshes + m, count, 12, w, h));
        assert_false(fits(l.meshes + m, count, 12, w > h ? w / 2 : w, w > h ? h : h / 2));
        assert_false(fits(l.meshes + m, count, 12, w / 2, h));
        least = w < least ? w : least;
        most = w > most ? w : most;
    }
    assert_true(most > least);
    vsh_atlas_free(atlas);
    /* of a shared atlas the last page is smaller than those before */
    o.atlas = VSH_ATLAS_SHARED;
    o.width = o.height = 64;
    o.max_pages = 20;
    o.texels_per_unit = 8;
    const vsh_atlas_info info = unwrap_well(l.meshes, MESHES, &o, &atlas);
    assert_in_range(info.pages, 2, 20);
    assert_true(info.width == 64 && info.height == 64);
    const vsh_atlas_page last = vsh_atlas_page_view(atlas, info.pages - 1);
    assert_true(last.width * last.height < 64 * 64);
    vsh_atlas_free(atlas);
    /* and a single one is not wider than it has to be */
    o.width = 1000;
    o.height = 700;
    const vsh_atlas_info single = unwrap_well(l.meshes, MESHES, &o, NULL);
    assert_int_equal(single.pages, 1);
    assert_true(is_power(single.width) && is_power(single.height) && single.width <= 256);
    free_level(&l);
}

static void an_object_that_does_not_fit_is_named(void **state) {
    (void)state;
    level l;
    make_level(&l);
    vsh_unwrap_options o = of_objects(64);
    vsh_atlas *atlas = NULL;
    vsh_error error = {0};
    o.texels_per_unit = 9;
    assert_int_equal(vsh_unwrap(l.meshes, MESHES, &o, NULL, &atlas, &error), VSH_ERROR_LIMIT);
    if (strstr(error.message, "'wall'") == NULL || strstr(error.message, "would fit") == NULL) {
        fail_msg("'%s'", error.message);
    }
    o.texels_per_unit = 15;
    assert_int_equal(vsh_unwrap(l.meshes, 3, &o, NULL, &atlas, &error), VSH_ERROR_LIMIT);
    if (strstr(error.message, "'door with handle'") == NULL) {
        fail_msg("'%s'", error.message);
    }
    o = of_objects(64);
    o.max_pages = 2;
    assert_int_equal(vsh_unwrap(l.meshes, MESHES, &o, NULL, &atlas, &error), VSH_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "max_pages"));
    free_level(&l);
}

/* An object without area has no page. */
static void pages_and_bits_are_those_of_any_number_of_threads(void **state) {
    (void)state;
    level l;
    make_level(&l);
    memset(l.shapes[0]->indices, 0, l.meshes[0].triangle_count * 3 * sizeof(uint32_t));
    vsh_unwrap_options o = of_objects(256);
    vsh_run run = vsh_run_default();
    vsh_atlas *one = NULL, *four = NULL;
    o.texels_per_unit = 12;
    o.fit_pages = 1;
    run.threads = 1;
    assert_int_equal(vsh_unwrap(l.meshes, MESHES, &o, &run, &one, NULL), VSH_OK);
    run.threads = 4;
    assert_int_equal(vsh_unwrap(l.meshes, MESHES, &o, &run, &four, NULL), VSH_OK);
    assert_int_equal(vsh_atlas_page_count(one), OBJECTS - 1);
    assert_int_equal(vsh_atlas_page_view(one, 0).first_mesh, 1);
    for (size_t page = 0; page + 1 < OBJECTS; ++page) {
        const vsh_atlas_page a = vsh_atlas_page_view(one, page), b = vsh_atlas_page_view(four, page);
        assert_true(a.width == b.width && a.height == b.height && a.covered == b.covered);
    }
    for (size_t m = 0; m < MESHES; ++m) {
        same_uvs(one, m, four, m);
    }
    vsh_atlas_free(one);
    vsh_atlas_free(four);
    free_level(&l);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_object_is_packed_as_if_it_were_alone),
        cmocka_unit_test(objects_that_are_instances_are_packed_alike),
        cmocka_unit_test(pages_are_the_smallest_that_the_density_fits),
        cmocka_unit_test(an_object_that_does_not_fit_is_named),
        cmocka_unit_test(pages_and_bits_are_those_of_any_number_of_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
