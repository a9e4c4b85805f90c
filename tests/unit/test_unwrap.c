/* Charts of every kind of mesh: no triangle without a place, none flipped, none over another, no texel of two
 * charts, none nearer than the padding, and no chart stretched beyond the limit. */
#include "testing.h"
#include "unwraps.h"

#include "unwrap/patch.h"

static const double ORIGIN[3] = {0, 0, 0};

/* Unwraps a mesh into a square of so many texels, and looks at all of it. */
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

/* One of which looks the other way: each hangs together by itself. */
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
    for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; ++i) {
        FREED shape *s = shape_new();
        shapes[i].make(s);
        const vsh_mesh mesh = shape_mesh(s, shapes[i].name);
        unwrap_well(&mesh, 1, &small, NULL);
        const vsh_atlas_info info = unwrap_mesh(&mesh, 256);
        assert_that(info.charts >= shapes[i].least && info.charts <= shapes[i].most &&
                        info.stretch <= shapes[i].stretch && info.worst_stretch <= shapes[i].worst &&
                        info.covered >= shapes[i].covered,
                    "%s: %u charts, stretch %g, at worst %g, %g covered", mesh.name, info.charts,
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
            for (uint32_t k = 0; k < 4; ++k) { /* beside a floor, of which they are a small part */
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

/* Two leaves of a hinge that is nearly shut, whatever its shading says. */
TEST(what_is_folded_onto_itself_is_cut) {
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
TEST(a_tip_of_thousands_of_triangles_takes_no_time) {
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
    assert_in_range(vsh_atlas_chart_count(atlas), 1, 16);
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

/* A rectangle's borders are a tenth of a texel beyond centres of texels: what is read within it is nearly all
 * of its own texels, and no texel's centre is on an edge of the surface. */
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

enum { MOST = 64 };

/* A patch of its triangles and UVs alone, which is all that is looked at. */
static int overlaps(double (*uv)[2], uint32_t vertices, uint32_t (*corner)[3], uint32_t count) {
    uint32_t beyond[3 * MOST];
    for (uint32_t i = 0; i < 3 * count; ++i) {
        beyond[i] = VSHI_NONE;
        for (uint32_t k = 0; k < 3 * count; ++k) {
            if (corner[i / 3][i % 3] == corner[k / 3][(k + 1) % 3] &&
                corner[i / 3][(i + 1) % 3] == corner[k / 3][k % 3]) {
                beyond[i] = k;
            }
        }
    }
    const vshi_patch patch = {
        .count = count, .vertex_count = vertices, .corner = corner, .beyond = beyond, .uv = uv};
    for (uint32_t i = 0; i < count; ++i) {
        assert_true(vshi_patch_doubled_area(&patch, i) > 0.0);
    }
    bool found = false;
    assert_ok(vshi_patch_overlaps(&patch, &found, &failure));
    return found;
}

/* A strip of quads around a turn and some, whose ends lie over each other unless the second is moved out. */
static int spiral_overlaps(double turns, double out) {
    enum { STEPS = 24 };
    double uv[2 * STEPS + 2][2];
    uint32_t corner[2 * STEPS][3];
    for (uint32_t i = 0; i <= STEPS; ++i) {
        const double angle = 6.283185307179586 * turns * i / STEPS, r = 1 + out * i / STEPS;
        for (uint32_t k = 0; k < 2; ++k) {
            uv[2 * i + k][0] = (r + 0.2 * k) * cos(angle);
            uv[2 * i + k][1] = (r + 0.2 * k) * sin(angle);
        }
    }
    for (uint32_t i = 0; i < STEPS; ++i) {
        const uint32_t v = 2 * i;
        memcpy(corner[2 * i], (uint32_t[3]){v, v + 1, v + 3}, sizeof corner[0]);
        memcpy(corner[2 * i + 1], (uint32_t[3]){v, v + 3, v + 2}, sizeof corner[0]);
    }
    return overlaps(uv, 2 * STEPS + 2, corner, 2 * STEPS);
}

TEST(ends_that_lie_over_each_other_are_overlap) {
    assert_false(spiral_overlaps(0.9, 0.0));
    assert_false(spiral_overlaps(1.2, 0.4));
    assert_true(spiral_overlaps(1.2, 0.05));    /* borders cross */
    assert_true(spiral_overlaps(1.0005, 0.05)); /* by less than the raster sees */
    assert_true(spiral_overlaps(1.25, 0.0)); /* they lie along each other, and cross nowhere but at corners */
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
    for (size_t a = 0; a < sizeof assets / sizeof assets[0]; ++a) {
        char path[512];
        snprintf(path, sizeof path, VSH_ASSETS "/%s", assets[a].name);
        OWNED(vsh_model) *model = NULL;
        assert_ok(vsh_model_read(path, NULL, &model, &failure));
        const size_t count = vsh_model_mesh_count(model);
        FREED vsh_mesh *meshes = calloc(count, sizeof *meshes);
        assert_non_null(meshes);
        for (size_t m = 0; m < count; ++m) {
            meshes[m] = vsh_model_mesh(model, m, -1);
        }
        const vsh_unwrap_options o = unwrap_into(assets[a].size);
        const vsh_atlas_info info = unwrap_well(meshes, count, &o, NULL);
        assert_that(info.covered >= assets[a].covered && info.stretch <= 1.05, "%s: %g covered, stretch %g",
                    path, info.covered, info.stretch);
    }
}
