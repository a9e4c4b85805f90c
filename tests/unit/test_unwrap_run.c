/* Runs of the unwrapper: threads, pages, densities, instances, objects, kept UVs, limits, bad input. */
#include "testing.h"
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

static void assert_same_uvs(const vsh_atlas *a, size_t m, const vsh_atlas *b, size_t n) {
    const vsh_atlas_mesh x = vsh_atlas_mesh_view(a, m), y = vsh_atlas_mesh_view(b, n);
    assert_int_equal(x.vertex_count, y.vertex_count);
    assert_memory_equal(x.uvs, y.uvs, x.vertex_count * 2 * sizeof *x.uvs);
    assert_memory_equal(x.indices, y.indices, x.triangle_count * 3 * sizeof *x.indices);
}

/* Unwraps with one to eight threads; returns the atlas. */
static vsh_atlas *assert_same_bits(const vsh_mesh *meshes, size_t count, const vsh_unwrap_options *o) {
    vsh_run run = run_on(1);
    vsh_atlas *first = NULL;
    assert_ok(vsh_unwrap(meshes, count, o, &run, &first, &failure));
    for (run.threads = 2; run.threads <= 8; ++run.threads) {
        OWNED(vsh_atlas) *atlas = NULL;
        assert_ok(vsh_unwrap(meshes, count, o, &run, &atlas, &failure));
        assert_int_equal(vsh_atlas_chart_count(first), vsh_atlas_chart_count(atlas));
        assert_memory_equal(vsh_atlas_charts(first), vsh_atlas_charts(atlas),
                            vsh_atlas_chart_count(first) * sizeof(vsh_atlas_chart));
        assert_int_equal(vsh_atlas_page_count(first), vsh_atlas_page_count(atlas));
        for (size_t page = 0; page < vsh_atlas_page_count(first); ++page) {
            const vsh_atlas_page a = vsh_atlas_page_view(first, page), b = vsh_atlas_page_view(atlas, page);
            assert_true(a.width == b.width && a.height == b.height && a.covered == b.covered);
        }
        for (size_t m = 0; m < count; ++m) {
            const vsh_atlas_mesh x = vsh_atlas_mesh_view(first, m), y = vsh_atlas_mesh_view(atlas, m);
            assert_same_uvs(first, m, atlas, m);
            assert_memory_equal(x.charts, y.charts, x.triangle_count * sizeof *x.charts);
        }
    }
    return first;
}

enum { BOXES = 12, MESHES = 5, OBJECTS = 4 };

/* Meshes of several sizes. */
typedef struct level {
    shape *shapes[BOXES];
    vsh_mesh meshes[BOXES];
} level;

static void free_level(level *l) {
    for (int i = 0; i < BOXES; ++i) {
        free(l->shapes[i]);
    }
}

static void add_box(level *l, int i, const double size[3], const char *name) {
    l->shapes[i] = shape_new();
    shape_box(l->shapes[i], ORIGIN, size, ALL_SIDES);
    l->meshes[i] = shape_mesh(l->shapes[i], name);
}

static level make_boxes(void) {
    level l = {.shapes = {NULL}};
    for (int i = 0; i < BOXES; ++i) {
        add_box(&l, i, (double[3]){1 + 0.1 * i, 2 - 0.1 * i, 1}, "box");
    }
    return l;
}

TEST(each_mesh_is_on_one_page_where_it_fits) {
    FREED_BY(free_level) level l = make_boxes();
    vsh_unwrap_options o = unwrap_into(128);
    o.max_pages = 6;
    o.texels_per_unit = 20;
    OWNED(vsh_atlas) *atlas = NULL;
    const vsh_atlas_info info = unwrap_well(l.meshes, BOXES, &o, &atlas);
    assert_in_range(info.pages, 2, 6);
    assert_true(info.texels_per_unit == 20);
    uint32_t page[BOXES];
    memset(page, 0xff, sizeof page);
    for (size_t c = 0; c < info.charts; ++c) {
        const vsh_atlas_chart chart = vsh_atlas_charts(atlas)[c];
        assert_true(page[chart.mesh] == UINT32_MAX || page[chart.mesh] == chart.page);
        page[chart.mesh] = chart.page;
    }
    /* a mesh that is larger than a page is spread over several */
    o.texels_per_unit = 55;
    o.max_pages = 3;
    assert_in_range(unwrap_well(l.meshes, 1, &o, NULL).pages, 2, 3);
    /* the greatest density for all pages is greater than that for one */
    o.texels_per_unit = 0;
    o.max_pages = 1;
    const double one = unwrap_well(l.meshes, BOXES, &o, NULL).texels_per_unit;
    o.max_pages = 4;
    const double four = unwrap_well(l.meshes, BOXES, &o, NULL).texels_per_unit;
    assert_true(four > 1.7 * one);
}

TEST(a_density_that_does_not_fit_is_refused_and_one_named_that_does) {
    FREED_BY(free_level) level l = make_boxes();
    vsh_unwrap_options o = unwrap_into(128);
    vsh_atlas *atlas = NULL;
    o.texels_per_unit = 1000;
    assert_fails(vsh_unwrap(l.meshes, BOXES, &o, NULL, &atlas, &failure), VSH_ERROR_LIMIT, "1000");
    assert_null(atlas);
    const char *named = strstr(failure.message, "texels a unit: ");
    assert_non_null(named);
    o.texels_per_unit = atof(named + strlen("texels a unit: ")) * 0.999; /* of four digits */
    assert_true(o.texels_per_unit > 5 && o.texels_per_unit < 100);
    unwrap_well(l.meshes, BOXES, &o, NULL);
    /* more charts than texels */
    o = unwrap_into(8);
    assert_fails(vsh_unwrap(l.meshes, BOXES, &o, NULL, &atlas, &failure), VSH_ERROR_LIMIT, "at any density");
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

TEST(density_is_as_asked_and_by_mesh) {
    FREED shape *one = lump(32), *two = lump(32);
    const vsh_mesh meshes[2] = {shape_mesh(one, "one"), shape_mesh(two, "two")};
    const double factors[2] = {1.0, 0.5};
    vsh_unwrap_options o = unwrap_into(256);
    o.density = factors;
    o.texels_per_unit = 30;
    OWNED(vsh_atlas) *atlas = NULL;
    vsh_mesh_report report;
    unwrap_well(meshes, 2, &o, &atlas);
    assert_ok(vsh_mesh_check(&meshes[0], &report, &failure));
    assert_true(fabs(texels_of(atlas, 0) / (900 * report.area) - 1) < 0.01);
    assert_true(fabs(texels_of(atlas, 1) / (225 * report.area) - 1) < 0.01);
}

/* Turned, moved, mirrored and doubled: one layout, places of their own. One that is scaled unevenly is a
 * shape of its own. */
TEST(instances_share_their_charts) {
    FREED shape *s = lump(32);
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
    OWNED(vsh_atlas) *atlas = NULL;
    const vsh_atlas_info info = unwrap_well(meshes, 5, &o, &atlas);
    assert_int_equal(info.shared, 3);
    const vsh_atlas_mesh first = vsh_atlas_mesh_view(atlas, 0), turned = vsh_atlas_mesh_view(atlas, 1);
    assert_ptr_equal(first.indices, turned.indices);
    assert_true(vsh_atlas_mesh_view(atlas, 4).indices != first.indices);
    assert_true(fabs(texels_of(atlas, 1) / texels_of(atlas, 0) - 1) < 1e-3);
    assert_true(fabs(texels_of(atlas, 2) / texels_of(atlas, 0) - 4) < 1e-2);
    assert_true(fabs(texels_of(atlas, 3) / texels_of(atlas, 0) - 1) < 1e-3);
}

/* --- pages of objects */

static const uint32_t object_of[MESHES] = {0, 1, 1, 2, 3};

/* Four objects, the second of two meshes; the last is without a number, as all were one by one. */
static level make_level(void) {
    static const double sides[MESHES][3] = {{1, 1, 1}, {2, 1, 0.5}, {0.3, 0.4, 3}, {0, 0, 0}, {6, 1, 5}};
    static const char *const names[MESHES] = {"crate", "door", "handle", "ball", "wall"};
    level l = {.shapes = {NULL}};
    for (int i = 0; i < MESHES; ++i) {
        add_box(&l, i, sides[i], names[i]);
    }
    l.shapes[3]->vertices = l.shapes[3]->triangles = 0;
    shape_ball(l.shapes[3], ORIGIN, 1.0, -1.0, 1.0, 20);
    l.meshes[3] = shape_mesh(l.shapes[3], names[3]);
    l.meshes[1].object = l.meshes[2].object = 7;
    l.meshes[1].object_name = l.meshes[2].object_name = "door with handle";
    return l;
}

static vsh_unwrap_options of_objects(int32_t size) {
    vsh_unwrap_options o = unwrap_into(size);
    o.atlas = VSH_ATLAS_OBJECTS;
    return o;
}

TEST(each_object_is_packed_as_if_it_were_alone) {
    FREED_BY(free_level) level l = make_level();
    const vsh_unwrap_options o = of_objects(128), alone = unwrap_into(128);
    OWNED(vsh_atlas) *atlas = NULL;
    const vsh_atlas_info info = unwrap_well(l.meshes, MESHES, &o, &atlas);
    assert_int_equal(info.pages, OBJECTS);
    for (size_t c = 0; c < info.charts; ++c) {
        const vsh_atlas_chart chart = vsh_atlas_charts(atlas)[c];
        assert_int_equal(chart.page, object_of[chart.mesh]);
    }
    for (size_t m = 0, count; m < MESHES; m += count) {
        count = m == 1 ? 2 : 1;
        OWNED(vsh_atlas) *one = NULL;
        const vsh_atlas_info own = unwrap_well(l.meshes + m, count, &alone, &one);
        const vsh_atlas_page page = vsh_atlas_page_view(atlas, object_of[m]);
        assert_int_equal(page.first_mesh, m);
        assert_true(page.texels_per_unit == own.texels_per_unit);
        assert_true(info.texels_per_unit <= own.texels_per_unit);
        for (size_t k = 0; k < count; ++k) {
            assert_same_uvs(atlas, m + k, one, k);
        }
    }
}

TEST(objects_that_are_instances_are_packed_alike) {
    FREED shape *s = shape_new();
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
    OWNED(vsh_atlas) *atlas = NULL;
    assert_int_equal(unwrap_well(meshes, 4, &o, &atlas).pages, 4);
    assert_same_uvs(atlas, 0, atlas, 1);
    assert_same_uvs(atlas, 0, atlas, 2);
    const double first = vsh_atlas_page_view(atlas, 0).texels_per_unit,
                 large = vsh_atlas_page_view(atlas, 2).texels_per_unit;
    assert_true(fabs(first - 2 * large) < 1e-9 * first);
    vsh_atlas_free(atlas);
    /* at one density the larger one takes more texels */
    o.texels_per_unit = 10;
    unwrap_well(meshes, 4, &o, &atlas);
    assert_same_uvs(atlas, 0, atlas, 1);
    assert_true(vsh_atlas_page_view(atlas, 2).covered > 3 * vsh_atlas_page_view(atlas, 0).covered);
    assert_true(vsh_atlas_page_view(atlas, 2).texels_per_unit == 10);
}

static int is_power(int32_t x) {
    return (x & (x - 1)) == 0;
}

/* Whether meshes fit one page of a size at a density. */
static int fits(const vsh_mesh *meshes, size_t count, double density, int32_t width, int32_t height) {
    vsh_unwrap_options o = unwrap_into(width);
    OWNED(vsh_atlas) *atlas = NULL;
    o.height = height;
    o.texels_per_unit = density;
    const vsh_result result = vsh_unwrap(meshes, count, &o, NULL, &atlas, NULL);
    assert_true(result == VSH_OK || result == VSH_ERROR_LIMIT);
    return result == VSH_OK;
}

TEST(pages_are_the_smallest_that_the_density_fits) {
    FREED_BY(free_level) level l = make_level();
    vsh_unwrap_options o = of_objects(256);
    o.texels_per_unit = 12;
    o.fit_pages = 1;
    OWNED(vsh_atlas) *atlas = NULL;
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
    /* the last page of a shared atlas is smaller than the others */
    o.atlas = VSH_ATLAS_SHARED;
    o.width = o.height = 64;
    o.max_pages = 20;
    o.texels_per_unit = 8;
    const vsh_atlas_info info = unwrap_well(l.meshes, MESHES, &o, &atlas);
    assert_in_range(info.pages, 2, 20);
    assert_true(info.width == 64 && info.height == 64);
    const vsh_atlas_page last = vsh_atlas_page_view(atlas, info.pages - 1);
    assert_true(last.width * last.height < 64 * 64);
    /* and a single one is not wider than it has to be */
    o.width = 1000;
    o.height = 700;
    const vsh_atlas_info single = unwrap_well(l.meshes, MESHES, &o, NULL);
    assert_int_equal(single.pages, 1);
    assert_true(is_power(single.width) && is_power(single.height) && single.width <= 256);
}

TEST(an_object_that_does_not_fit_is_named) {
    FREED_BY(free_level) level l = make_level();
    vsh_unwrap_options o = of_objects(64);
    vsh_atlas *atlas = NULL;
    o.texels_per_unit = 9;
    assert_fails(vsh_unwrap(l.meshes, MESHES, &o, NULL, &atlas, &failure), VSH_ERROR_LIMIT, "'wall'");
    assert_non_null(strstr(failure.message, "would fit"));
    o.texels_per_unit = 15;
    assert_fails(vsh_unwrap(l.meshes, 3, &o, NULL, &atlas, &failure), VSH_ERROR_LIMIT, "'door with handle'");
    o = of_objects(64);
    o.max_pages = 2;
    assert_fails(vsh_unwrap(l.meshes, MESHES, &o, NULL, &atlas, &failure), VSH_ERROR_ARGUMENT, "max_pages");
}

TEST(objects_without_area_have_no_page_for_any_threads) {
    FREED_BY(free_level) level l = make_level();
    memset(l.shapes[0]->indices, 0, l.meshes[0].triangle_count * 3 * sizeof(uint32_t));
    vsh_unwrap_options o = of_objects(256);
    o.texels_per_unit = 12;
    o.fit_pages = 1;
    OWNED(vsh_atlas) *atlas = assert_same_bits(l.meshes, MESHES, &o);
    assert_int_equal(vsh_atlas_page_count(atlas), OBJECTS - 1);
    assert_int_equal(vsh_atlas_page_view(atlas, 0).first_mesh, 1);
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

static int32_t can_serve(const vsh_mesh *mesh) {
    int32_t usable = -1;
    assert_ok(vsh_uvs_usable(mesh, NULL, &usable, &failure));
    return usable;
}

TEST(uvs_that_can_serve_are_kept) {
    FREED shape *s = lump(48);
    const vsh_mesh mesh = shape_mesh(s, "lump");
    vsh_unwrap_options o = unwrap_into(256);
    OWNED(vsh_atlas) *atlas = NULL, *again = NULL;
    const vsh_atlas_info info = unwrap_well(&mesh, 1, &o, &atlas);
    FREED float *positions = NULL, *uvs = NULL;
    vsh_mesh own = with_uvs(&mesh, atlas, &positions, &uvs);
    assert_true(can_serve(&own));
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

    /* and none of these can */
    const float first[2] = {uvs[0], uvs[1]};
    const size_t far = own.indices[3 * (own.triangle_count - 1)];
    for (int i = 0; i < 4; ++i) {
        uvs[0] = i == 0 ? NAN : i == 1 ? 1.5F : i == 2 ? -0.1F : uvs[2 * far];
        uvs[1] = i == 3 ? uvs[2 * far + 1] : first[1];
        assert_false(can_serve(&own));
        assert_int_equal(unwrap_well(&own, 1, &o, NULL).kept, 0);
        uvs[0] = first[0];
        uvs[1] = first[1];
    }
    for (size_t v = 0; v < own.vertex_count; ++v) { /* two halves over each other */
        uvs[2 * v] = uvs[2 * v] > 0.5F ? uvs[2 * v] - 0.5F : uvs[2 * v];
    }
    assert_false(can_serve(&own));
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

TEST(it_can_be_cancelled_in_every_stage) {
    FREED shape *s = lump(64);
    const vsh_mesh mesh = shape_mesh(s, "lump");
    const vsh_unwrap_options o = unwrap_into(256);
    stopper where[] = {{"unwrap", 0.0, 0.0, 0},
                       {"unwrap", 0.3, 0.0, 0},
                       {"unwrap", 0.7, 0.0, 0},
                       {"pack", 0.0, 0.0, 0},
                       {"pack", 2.0, 0.0, 0}};
    for (size_t i = 0; i < sizeof where / sizeof where[0]; ++i) {
        const vsh_run run = run_watched(stop, &where[i]);
        OWNED(vsh_atlas) *atlas = (void *)&where[i];
        const vsh_result result = vsh_unwrap(&mesh, 1, &o, &run, &atlas, &failure);
        if (where[i].at > 1) {
            assert_int_equal(result, VSH_OK);
            assert_true(where[i].last == 1.0);
        } else {
            assert_int_equal(result, VSH_ERROR_CANCELLED);
            assert_non_null(strstr(failure.message, where[i].stage));
            assert_null(atlas);
        }
    }
}

TEST(memory_is_kept_within_its_limit) {
    FREED shape *s = lump(64);
    const vsh_mesh mesh = shape_mesh(s, "lump");
    vsh_unwrap_options o = unwrap_into(256);
    const vsh_run little = run_within(100000), run = run_within(100000000);
    OWNED(vsh_atlas) *atlas = NULL;
    assert_ok(vsh_unwrap(&mesh, 1, &o, &run, &atlas, &failure));
    vsh_atlas_free(atlas);
    assert_fails(vsh_unwrap(&mesh, 1, &o, &little, &atlas, &failure), VSH_ERROR_LIMIT, "");
    o.width = o.height = VSH_MAX_PAGE_SIZE; /* half a gigabyte of bits */
    assert_fails(vsh_unwrap(&mesh, 1, &o, &run, &atlas, &failure), VSH_ERROR_LIMIT, "");
}

static void refused(const vsh_mesh *mesh, size_t count, const vsh_unwrap_options *o, vsh_result code,
                    const char *word) {
    vsh_atlas *atlas = (void *)&code;
    assert_fails(vsh_unwrap(mesh, count, o, NULL, &atlas, &failure), code, word);
    assert_null(atlas);
}

TEST(bad_options_are_refused_by_name) {
    FREED shape *s = shape_new();
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
}

TEST(bad_meshes_are_refused) {
    FREED shape *s = shape_new();
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
}

/* A million units in one direction and one in the others; corners of floats' whole range. */
TEST(wild_numbers_do_no_harm) {
    FREED shape *s = shape_new();
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
    OWNED(vsh_atlas) *atlas = NULL;
    const vsh_result result = vsh_unwrap(&mesh, 1, &o, NULL, &atlas, &failure);
    assert_true(result == VSH_OK || result == VSH_ERROR_LIMIT);
}

/* A rectangle of 1 × 2 units that fills the square: along v a texel is twice as long as along u. */
TEST(density_and_stretch_of_uvs_are_those_of_their_derivatives) {
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
    assert_ok(vsh_uvs_measure(&mesh, 64, 64, &measures, &failure));
    assert_true(fabs(measures.texels_per_unit - 64.0 / sqrt(2.0)) < 1e-9);
    assert_true(fabs(measures.stretch - sqrt(1.25)) < 1e-9);
    assert_ok(vsh_uvs_measure(&mesh, 64, 128, &measures, &failure));
    assert_true(fabs(measures.texels_per_unit - 64.0) < 1e-9 && fabs(measures.stretch - 1.0) < 1e-9);
    mesh.uvs = NULL;
    assert_ok(vsh_uvs_measure(&mesh, 64, 64, &measures, &failure));
    assert_true(measures.texels_per_unit == 0.0 && measures.stretch == 0.0);
    assert_int_equal(vsh_uvs_measure(&mesh, 0, 64, &measures, NULL), VSH_ERROR_ARGUMENT);
}
