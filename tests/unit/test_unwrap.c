/* Charts of every kind of mesh: no triangle without a place, none flipped, none over another, no texel of two
 * charts, none nearer than the padding, and no chart stretched beyond the limit. */
#include "testing.h"
#include "unwraps.h"

static const double ORIGIN[3] = {0, 0, 0};

/* Unwraps a mesh into a square of `size` texels, and checks the atlas. */
static vsh_atlas_info unwrap_mesh(const vsh_mesh *mesh, int32_t size) {
    const vsh_unwrap_options o = unwrap_into(size);
    return unwrap_well(mesh, 1, &o, NULL);
}

/* --- shapes */

static void cube_of_sides(shape *s) {
    shape_box(s, (double[3]){-1, -1, -1}, (double[3]){1, 1, 1}, ALL_SIDES);
}

/* Corners that are shared by the sides: nothing but creases parts them. */
static void cube_of_corners(shape *s) {
    static const uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (int i = 0; i < 8; ++i) {
        shape_vertex(s, i & 1, i >> 1 & 1, i >> 2);
    }
    for (int i = 0; i < 6; ++i) {
        shape_quad(s, quads[i][0], quads[i][1], quads[i][2], quads[i][3]);
    }
}

static void tube(shape *s) {
    shape_turned(s, ORIGIN, (const double[][2]){{1, -2}, {1, 2}}, 2, 64);
}

static void cone(shape *s) {
    shape_turned(s, ORIGIN, (const double[][2]){{2, 0}, {1, 2}, {0.01, 3.98}}, 3, 64);
}

static void ball(shape *s) {
    shape_ball(s, ORIGIN, 3.0, -1.0, 1.0, 64);
}

static void torus(shape *s) {
    shape_grid(s, torus_at, 48, 32, 1, 1, 0);
}

static void moebius_strip(shape *s) {
    shape_grid(s, moebius_at, 60, 6, 1, 0, 1);
}

static void twelve_cards_around_one_edge(shape *s) {
    const uint32_t a = shape_vertex(s, 0, 0, 0), b = shape_vertex(s, 0, 0, 2);
    for (int i = 0; i < 12; ++i) {
        const uint32_t c = shape_vertex(s, cos(0.5 * i), sin(0.5 * i), 1);
        shape_triangle(s, i % 2 ? a : b, i % 2 ? b : a, c);
    }
}

static void sheet_at(double u, double v, double p[3]) {
    p[0] = 8 * u;
    p[1] = 8 * v;
    p[2] = 0.05 * p[0] * p[0];
}

/* One of the copies looks the other way. Each copy must stay connected. */
static void three_copies_of_a_bent_sheet(shape *s) {
    for (int copy = 0; copy < 3; ++copy) {
        const size_t first = s->triangles;
        shape_grid(s, sheet_at, 8, 8, 0, 0, 0);
        if (copy == 1) {
            shape_turn(s, first);
        }
    }
}

static void triangle(shape *s) {
    shape_triangle(s, shape_vertex(s, 0, 0, 0), shape_vertex(s, 1, 0, 0), shape_vertex(s, 0, 1, 0));
}

TEST(shapes_have_few_charts_of_little_stretch) {
    static const struct {
        const char *name;
        void (*make)(shape *s);
        uint32_t least, most; /* charts */
        double stretch, worst, covered;
    } shapes[] = {{"cube of sides", cube_of_sides, 6, 6, 1.0001, 1.0001, 0.6},
                  {"cube of corners", cube_of_corners, 6, 6, 2, 2, 0},
                  {"tube", tube, 1, 6, 1.0005, 1.005, 0},
                  {"cone", cone, 1, 6, 1.0005, 1.005, 0},
                  {"ball", ball, 2, 24, 1.05, 1.1, 0},
                  {"torus", torus, 2, 32, 1.05, 2, 0},
                  {"Moebius strip", moebius_strip, 1, 12, 2, 2, 0},
                  {"fan", twelve_cards_around_one_edge, 1, 12, 2, 2, 0},
                  {"copies", three_copies_of_a_bent_sheet, 3, 3, 2, 2, 0},
                  {"triangle", triangle, 1, 1, 2, 2, 0.48}};
    vsh_unwrap_options small = unwrap_into(64);
    small.padding = 1;
    for (size_t i = 0; i < COUNT_OF(shapes); ++i) {
        FREED shape *s = shape_new();
        shapes[i].make(s);
        const vsh_mesh mesh = shape_mesh(s, shapes[i].name);
        unwrap_well(&mesh, 1, &small, NULL);
        const vsh_atlas_info info = unwrap_mesh(&mesh, 256);
        assert_that(info.charts >= shapes[i].least && info.charts <= shapes[i].most &&
                        info.stretch <= shapes[i].stretch && info.worst_stretch <= shapes[i].worst &&
                        info.covered >= shapes[i].covered,
                    "%s: %u charts, stretch %g, at worst %g, %g covered", mesh.name, (unsigned)info.charts,
                    info.stretch, info.worst_stretch, info.covered);
    }
}

/* Bars of few sides without ends: what shading rounds is one chart, what it does not is cut along its edges.
 */
TEST(bars_are_cut_along_edges_that_shading_shows) {
    for (uint32_t sides = 3; sides <= 6; ++sides) {
        for (int rounded = 0; rounded < 3; ++rounded) {
            FREED shape *s = shape_new();
            float normals[4 * 6 + 4][3];
            for (uint32_t i = 0; i < sides; ++i) { /* each side has vertices of its own */
                for (uint32_t k = 0; k < 4; ++k) {
                    const double turn = 6.283185307179586 / sides, at = turn * (i + (k == 1 || k == 2)),
                                 facing = rounded == 1 ? at : turn * (i + 0.5);
                    shape_vertex(s, 0.1 * cos(at), 0.1 * sin(at), k >= 2 ? 3 : 0);
                    normals[4 * i + k][0] = (float)cos(facing);
                    normals[4 * i + k][1] = (float)sin(facing);
                    normals[4 * i + k][2] = 0;
                }
                shape_quad(s, 4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3);
            }
            for (uint32_t k = 0; k < 4; ++k) { /* with a floor that is much larger */
                shape_vertex(s, 10.0 * (k == 1 || k == 2), 10.0 * (k >= 2), -9);
                normals[4 * sides + k][0] = normals[4 * sides + k][1] = 0;
                normals[4 * sides + k][2] = 1;
            }
            shape_quad(s, 4 * sides, 4 * sides + 1, 4 * sides + 2, 4 * sides + 3);
            vsh_mesh mesh = shape_mesh(s, "bar");
            mesh.normals = rounded == 2 ? NULL : &normals[0][0];
            const vsh_atlas_info info = unwrap_mesh(&mesh, 128);
            assert_that(info.charts == 1 + (rounded == 1 ? 1 : sides), "%u sides, %d: %d charts", sides,
                        rounded, (int)info.charts);
            assert_true(info.stretch < 1.01);
        }
    }
}

/* Two leaves of a hinge that is nearly shut, with any shading normals. */
TEST(surfaces_folded_onto_themselves_are_cut) {
    for (int shut = 0; shut < 2; ++shut) {
        FREED shape *s = shape_new();
        const double angle = shut ? 2.6 : 2.0, c = -cos(angle), d = sin(angle); /* normals are so far apart */
        shape_quad(s, shape_vertex(s, 0, 0, 0), shape_vertex(s, 0, 0, 1), shape_vertex(s, 1, 0, 1),
                   shape_vertex(s, 1, 0, 0));
        shape_quad(s, shape_vertex(s, 0, 0, 1), shape_vertex(s, 0, 0, 0), shape_vertex(s, c, d, 0),
                   shape_vertex(s, c, d, 1));
        float normals[8][3] = {{0}};
        for (int v = 0; v < 8; ++v) {
            normals[v][0] = 1;
        }
        vsh_mesh mesh = shape_mesh(s, "hinge");
        mesh.normals = &normals[0][0];
        assert_int_equal(unwrap_mesh(&mesh, 64).charts, 1 + shut);
    }
}

/* One vertex with all of a wavy cone's triangles: eliminated too early, it would fill the equations. */
TEST(a_tip_of_thousands_of_triangles_is_unwrapped_fast) {
    enum { AROUND = 30000 };
    FREED shape *s = shape_new();
    const uint32_t tip = shape_vertex(s, 0, 0, 1);
    for (int i = 0; i < AROUND; ++i) {
        const double angle = 6.283185307179586 * i / AROUND;
        shape_vertex(s, cos(angle), sin(angle), 0.1 * sin(7 * angle));
    }
    for (uint32_t i = 0; i < AROUND; ++i) {
        shape_triangle(s, tip, 1 + i, 1 + (i + 1) % AROUND);
    }
    const vsh_mesh mesh = shape_mesh(s, "tip");
    const vsh_unwrap_options o = unwrap_into(256);
    vsh_run run = run_within(100000000);
    OWNED(vsh_atlas) *atlas = NULL;
    assert_ok(vsh_unwrap(&mesh, 1, &o, &run, &atlas, &failure));
    assert_in_range(atlas_info(atlas).charts, 1, 16);
}

TEST(a_soup_of_random_triangles_has_places) {
    FREED shape *s = shape_new();
    uint64_t seed = 5;
    for (uint32_t i = 0; i < 120; ++i) { /* few vertices, so that they meet in every way */
        shape_vertex(s, next_number(&seed), next_number(&seed), next_number(&seed));
    }
    for (int i = 0; i < 400; ++i) {
        const uint32_t v[3] = {(uint32_t)(120 * next_number(&seed)), (uint32_t)(120 * next_number(&seed)),
                               (uint32_t)(120 * next_number(&seed))};
        shape_triangle(s, v[0], v[1], v[2]);
    }
    const vsh_mesh mesh = shape_mesh(s, "soup");
    vsh_unwrap_options o = unwrap_into(512);
    o.padding = 2;
    assert_true(unwrap_well(&mesh, 1, &o, NULL).charts > 100);
}

/* So rough that many an edge is a crease that ends within a chart: a slit that must not open inside out. */
TEST(rough_balls_lie_over_themselves_nowhere) {
    for (uint64_t seed = 1; seed <= 6; ++seed) {
        uint64_t random = seed;
        FREED shape *s = shape_new();
        shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, 60);
        for (size_t v = 0; v < s->vertices; ++v) {
            const float k = 1.0F + (0.01F + 0.004F * (float)seed) * (float)next_number(&random);
            for (int i = 0; i < 3; ++i) {
                s->positions[v][i] *= k;
            }
        }
        const vsh_mesh mesh = shape_mesh(s, "rough");
        assert_true(unwrap_mesh(&mesh, 512).stretch < 1.05);
    }
}

/* Points, lines, slivers of a millionth of their length, and a triangle among them. */
TEST(triangles_without_area_have_no_chart_and_slivers_have_one) {
    FREED shape *s = shape_new();
    const uint32_t a = shape_vertex(s, 0, 0, 0), b = shape_vertex(s, 1, 0, 0), c = shape_vertex(s, 0, 1, 0),
                   middle = shape_vertex(s, 0.5, 0, 0), thin = shape_vertex(s, 0.3, 1e-6, 0);
    shape_triangle(s, a, b, c);
    shape_triangle(s, a, a, a);
    shape_triangle(s, a, middle, b);
    shape_triangle(s, b, a, b);
    shape_triangle(s, a, b, thin);
    shape_triangle(s, c, thin, b);
    const vsh_mesh mesh = shape_mesh(s, "slivers");
    assert_int_equal(unwrap_mesh(&mesh, 128).flat_triangles, 3);
}

/* Sizes from 1e-30 to 1e30 units, and far from the origin. */
TEST(units_do_not_matter) {
    for (int i = 0; i < 5; ++i) {
        static const double sizes[5] = {1e-30, 1e-3, 1, 1e6, 1e30};
        const double k = sizes[i], transform[12] = {k, 0, 0, 5 * k, 0, k, 0, 0, 0, 0, k, -7 * k};
        FREED shape *s = shape_new();
        shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, 24);
        vsh_mesh mesh = shape_mesh(s, "ball");
        mesh.transform = transform;
        const vsh_atlas_info info = unwrap_mesh(&mesh, 128);
        mesh.transform = NULL;
        const vsh_atlas_info one = unwrap_mesh(&mesh, 128);
        assert_int_equal(info.charts, one.charts);
        assert_true(fabs(info.texels_per_unit * k / one.texels_per_unit - 1) < 0.05);
    }
}

/* Counts the quads whose triangles are in two charts. */
static size_t count_parted_quads(const shape *s) {
    const vsh_mesh mesh = shape_mesh(s, "torus");
    const vsh_unwrap_options o = unwrap_into(256);
    OWNED(vsh_atlas) *atlas = NULL;
    unwrap_well(&mesh, 1, &o, &atlas);
    const vsh_atlas_mesh m = vsh_atlas_mesh_view(atlas, 0);
    size_t apart = 0, borders = 0;
    for (size_t q = 0; q < mesh.triangle_count / 2; ++q) {
        apart += m.charts[2 * q] != m.charts[2 * q + 1];
        borders += q > 0 && m.charts[2 * q] != m.charts[2 * q - 2];
    }
    assert_true(borders > 0);
    return apart;
}

/* Modellers often write faces with vertices of their own. A bend below a crease never splits a quad,
 * whichever diagonal it has. */
TEST(triangles_of_a_quad_stay_together) {
    FREED shape *s = shape_new(), *faces = shape_new();
    uint64_t random = 3;
    shape_grid(s, torus_at, 40, 24, 1, 1, 0);
    assert_int_equal(count_parted_quads(s), 0);
    for (size_t v = 0; v < s->vertices; ++v) {
        for (int i = 0; i < 3; ++i) {
            s->positions[v][i] += 0.08F * (float)next_number(&random);
        }
    }
    for (size_t q = 0; q < s->triangles / 2; ++q) {
        const uint32_t *a = s->indices[2 * q], *b = s->indices[2 * q + 1], of[4] = {a[0], a[1], a[2], b[2]};
        const uint32_t first = (uint32_t)faces->vertices;
        for (int k = 0; k < 4; ++k) {
            const float *p = s->positions[of[k]];
            shape_vertex(faces, (double)p[0], (double)p[1], (double)p[2]);
        }
        shape_quad(faces, first, first + 1, first + 2, first + 3);
    }
    assert_int_equal(count_parted_quads(faces), 0);
}

/* A rectangle's borders are a tenth of a texel beyond centres of texels. So lookups within it read nearly
 * only its own texels, and no texel's centre is on an edge of the surface. */
TEST(borders_of_rectangles_are_just_beyond_centres_of_texels) {
    FREED shape *s = shape_new();
    shape_box(s, (double[3]){0, 0, 0}, (double[3]){1, 2, 3.3}, ALL_SIDES);
    const vsh_mesh mesh = shape_mesh(s, "box");
    const vsh_unwrap_options o = unwrap_into(128);
    OWNED(vsh_atlas) *atlas = NULL;
    unwrap_well(&mesh, 1, &o, &atlas);
    const vsh_atlas_mesh m = vsh_atlas_mesh_view(atlas, 0);
    for (size_t i = 0; i < 2 * m.vertex_count; ++i) {
        const double texel = (double)m.uvs[i] * 128 - 0.5;
        assert_true(fabs(fabs(texel - floor(texel + 0.5)) - 0.1) < 1e-4);
    }
}

/* A helix of quads around a turn and some, with UVs seen from above: their ends lie over each other unless
 * the second is moved out. Tells whether these UVs are kept. */
static bool keeps_spiral(double turns, double out) {
    enum { STEPS = 24 };
    FREED shape *s = shape_new();
    float uvs[2 * STEPS + 2][2];
    for (uint32_t i = 0; i <= STEPS; ++i) {
        const double angle = 6.283185307179586 * turns * i / STEPS, r = 1 + out * i / STEPS;
        for (uint32_t k = 0; k < 2; ++k) {
            const double x = (r + 0.2 * k) * cos(angle), y = (r + 0.2 * k) * sin(angle);
            const uint32_t v = shape_vertex(s, x, y, 0.1 * i);
            uvs[v][0] = (float)(0.5 + 0.25 * x);
            uvs[v][1] = (float)(0.5 + 0.25 * y);
        }
    }
    for (uint32_t v = 0; v < 2 * STEPS; v += 2) {
        shape_quad(s, v, v + 1, v + 3, v + 2);
    }
    vsh_mesh mesh = shape_mesh(s, "helix");
    mesh.uvs = uvs[0];
    vsh_unwrap_options o = unwrap_into(256);
    o.keep_uvs = VSH_UNWRAP_KEEP;
    return unwrap_well(&mesh, 1, &o, NULL).kept == 1;
}

TEST(uvs_that_lie_over_each_other_are_replaced) {
    assert_true(keeps_spiral(0.9, 0.0));
    assert_true(keeps_spiral(1.2, 0.4));
    assert_false(keeps_spiral(1.2, 0.05));    /* borders cross */
    assert_false(keeps_spiral(1.0005, 0.05)); /* by less than the raster sees */
    assert_false(keeps_spiral(1.25, 0.0)); /* they lie along each other, and cross nowhere but at corners */
}

TEST(the_sample_assets_unwrap) {
    static const struct {
        const char *name;
        int32_t size;
        double covered;
    } assets[] = {{"cloister.glb", 1024, 0.70},
                  {"smooth.glb", 512, 0.60},
                  {"thin.glb", 512, 0.50},
                  {"seeds_floor.obj", 256, 0.5}};
    for (size_t a = 0; a < COUNT_OF(assets); ++a) {
        char path[512];
        snprintf(path, sizeof path, VSH_ASSETS "/%s", assets[a].name);
        OWNED(vsh_model) *model = NULL;
        assert_ok(vsh_model_read(path, NULL, &model, &failure));
        const size_t count = vsh_model_mesh_count(model);
        FREED vsh_mesh *meshes = calloc(count, sizeof *meshes);
        for (size_t m = 0; m < count; ++m) {
            meshes[m] = vsh_model_mesh(model, m, -1);
        }
        const vsh_unwrap_options o = unwrap_into(assets[a].size);
        const vsh_atlas_info info = unwrap_well(meshes, count, &o, NULL);
        assert_that(info.covered >= assets[a].covered && info.stretch <= 1.05, "%s: %g covered, stretch %g",
                    path, info.covered, info.stretch);
    }
}

/* --- runs: threads, pages, densities, instances, objects, kept UVs, limits, bad input */

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
    const vsh_atlas_info info = atlas_info(atlas);
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

TEST(objects_without_area_have_no_page) {
    FREED_BY(free_level) level l = make_level();
    memset(l.shapes[0]->indices, 0, l.meshes[0].triangle_count * 3 * sizeof(uint32_t));
    vsh_unwrap_options o = of_objects(256);
    o.texels_per_unit = 12;
    o.fit_pages = 1;
    OWNED(vsh_atlas) *atlas = NULL;
    assert_ok(vsh_unwrap(l.meshes, MESHES, &o, NULL, &atlas, &failure));
    assert_int_equal(atlas_info(atlas).pages, OBJECTS - 1);
    assert_int_equal(vsh_atlas_page_view(atlas, 0).first_mesh, 1);
}

/* The mesh with the UVs of an atlas; free both arrays. */
static vsh_mesh with_uvs(const vsh_mesh *mesh, const vsh_atlas *atlas, float **positions, float **uvs) {
    const vsh_atlas_mesh m = vsh_atlas_mesh_view(atlas, 0);
    *positions = calloc(m.vertex_count, 3 * sizeof(float));
    *uvs = calloc(m.vertex_count, 2 * sizeof(float));
    for (size_t v = 0; v < m.vertex_count; ++v) {
        memcpy(*positions + 3 * v, mesh->positions + 3 * (size_t)m.sources[v], 3 * sizeof(float));
    }
    memcpy(*uvs, m.uvs, m.vertex_count * 2 * sizeof(float));
    return mesh_of_arrays(mesh->name, *positions, *uvs, m.vertex_count, m.indices, m.triangle_count);
}

TEST(uvs_that_can_serve_are_kept) {
    FREED shape *s = lump(48);
    const vsh_mesh mesh = shape_mesh(s, "lump");
    vsh_unwrap_options o = unwrap_into(256);
    OWNED(vsh_atlas) *atlas = NULL, *again = NULL;
    const vsh_atlas_info info = unwrap_well(&mesh, 1, &o, &atlas);
    FREED float *positions = NULL, *uvs = NULL;
    vsh_mesh own = with_uvs(&mesh, atlas, &positions, &uvs);
    o.keep_uvs = VSH_UNWRAP_KEEP;
    o.width = o.height = 200;
    const vsh_atlas_info kept = unwrap_well(&own, 1, &o, &again);
    assert_int_equal(kept.kept, 1);
    assert_int_equal(kept.charts, info.charts);
    /* shapes and relative sizes of triangles are those of the UVs */
    const vsh_atlas_mesh m = vsh_atlas_mesh_view(again, 0), before = vsh_atlas_mesh_view(atlas, 0);
    double least = INFINITY, most = 0;
    for (size_t i = 0; i < m.triangle_count; ++i) {
        const corner_uvs now = uvs_of(&m, &kept, i), then = uvs_of(&before, &info, i);
        least = fmin(least, doubled_area(&now) / doubled_area(&then));
        most = fmax(most, doubled_area(&now) / doubled_area(&then));
    }
    assert_true(most / least < 1.002 && fabs(kept.stretch - info.stretch) < 1e-4);

    /* and none of these can */
    const float first[2] = {uvs[0], uvs[1]};
    const size_t far = own.indices[3 * (own.triangle_count - 1)];
    for (int i = 0; i < 4; ++i) {
        uvs[0] = i == 0 ? NAN : i == 1 ? 1.5F : i == 2 ? -0.1F : uvs[2 * far];
        uvs[1] = i == 3 ? uvs[2 * far + 1] : first[1];
        assert_int_equal(unwrap_well(&own, 1, &o, NULL).kept, 0);
        uvs[0] = first[0];
        uvs[1] = first[1];
    }
    for (size_t v = 0; v < own.vertex_count; ++v) { /* two halves over each other */
        uvs[2 * v] = uvs[2 * v] > 0.5F ? uvs[2 * v] - 0.5F : uvs[2 * v];
    }
    assert_int_equal(unwrap_well(&own, 1, &o, NULL).kept, 0);
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
    mesh.triangle_count = 0;
    refused(&mesh, 1, &o, VSH_ERROR_INPUT, "has area");
    mesh.triangle_count = 3;
    memset(s->indices, 0, 9 * sizeof(uint32_t));
    refused(&mesh, 1, &o, VSH_ERROR_INPUT, "has area");
}

/* A rectangle of 1 × 2 units that fills the square: along v a texel is twice as long as along u. */
TEST(density_and_stretch_follow_from_the_derivatives_of_uvs) {
    static const float positions[12] = {0, 0, 0, 1, 0, 0, 1, 2, 0, 0, 2, 0};
    vsh_mesh mesh = quad_mesh("rectangle", positions, QUAD_UVS);
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
