/* stitch_one(): values on both sides of charts' borders agree, and nothing else moves. */
#include "handles.h"
#include "lightmap/seams.h"
#include "seams.h"
#include "testing.h"

static const double E = 0.02;
static const double UNSEEN = 0.5 / 255.0; /* half a step of 8 bits */

/* One side of a border at x = 1, 40 units long: quads whose edges along it end at these places, their chart a
 * strip of 5 texels whose border is the column `column`. */
static void add_strip(charts_mesh *m, int side, const double *places, int count, double column) {
    for (int i = 0; i + 1 < count; ++i) {
        const double low = places[i], high = places[i + 1], x = side == 0 ? column - 5.0 : column;
        const double corner[4][3] = {
            {side, low, 0}, {side + 1.0, low, 0}, {side + 1.0, high, 0}, {side, high, 0}};
        const double texel[4][2] = {
            {x, 50.0 - low}, {x + 5.0, 50.0 - low}, {x + 5.0, 50.0 - high}, {x, 50.0 - high}};
        add_quad(m, corner, texel);
    }
}

/* Two strips whose borders pass through centres of texels, cut into pieces along them. */
static charts_mesh *two_strips(int pieces, double left, double right) {
    double places[101];
    charts_mesh *m = new_mesh();
    for (int i = 0; i <= pieces; ++i) {
        places[i] = 40.0 * i / pieces;
    }
    add_strip(m, 0, places, pieces + 1, left);
    add_strip(m, 1, places, pieces + 1, right);
    return m;
}

/* `left` in columns below `from`, else `right`. */
static float *plane_of_columns(size_t from, float left, float right) {
    float *plane = new_plane(left);
    for (size_t t = 0; t < TEXELS; ++t) {
        plane[t] = t % SIDE < from ? left : right;
    }
    return plane;
}

/* The first square is 0.5, all else 0.52. */
static float *plane_of_squares(void) {
    float *plane = new_plane(0.5f);
    for (size_t i = 0; i < TEXELS; ++i) {
        plane[i] = is_first(i) ? 0.5f : 0.52f;
    }
    return plane;
}

/* A column of each side is read. Changes a and b go to the minimum of 2 (d - a - b)² + keep (a² + b²) within
 * their limits, as two places fall to a texel, however many edges the border has. A guess b costs b² / 10 and
 * has no limit. */
TEST(two_columns_meet_at_the_closed_form) {
    static const double d = 0.03;
    static const struct {
        int pieces;
        double keep, limit;
        bool guess;
        double a, b;
    } cases[] = {
        {1, 0.01, 0.02, false, 2 * d / 4.01, 2 * d / 4.01},
        {7, 1.0, 0.02, false, 2 * d / 5, 2 * d / 5},
        {100, 0.01, 0.02, false, 2 * d / 4.01, 2 * d / 4.01},
        {1, 0.01, 0.005, false, 0.005, 0.005},
        {1, 0.01, 0.02, true, 2 * d / 22.01, 20 * d / 22.01},
        {1, 0.01, 0.001, true, 0.001, 2 * (d - 0.001) / 2.001},
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        FREED charts_mesh *m = two_strips(cases[i].pieces, 10.5, 20.5);
        OWNED(vsh_charts) *charts = charts_of(&m->mesh, 1);
        FREED float *plane = plane_of_columns(15, 0.5f, 0.53f), *coverage = new_plane(1.0f);
        for (size_t t = 20; cases[i].guess && t < TEXELS; t += SIDE) {
            coverage[t] = 0.0f;
        }
        const vsh_lightmap map = {.ao = plane, .coverage = coverage};
        vsh_stitch_options options = vsh_stitch_options_default();
        options.keep = cases[i].keep;
        options.max_change = cases[i].limit;
        vsh_stitch_report report;
        assert_ok(stitch_one(charts, &map, 0, &options, NULL, &report, &failure));
        assert_int_equal(report.seams, cases[i].pieces);
        assert_int_equal(report.crowded, 0);
        assert_true(cases[i].pieces > 1 || report.places == 81);
        assert_true(fabs(report.before - d) < 1e-6);
        assert_true(fabs(report.after - fabs(d - cases[i].a - cases[i].b)) < 0.02 * d);
        for (size_t row = 20; row < 40; ++row) {
            assert_near(plane[row * SIDE + 10], 0.5 + cases[i].a, 1e-4);
            assert_near(plane[row * SIDE + 20], 0.53 - cases[i].b, 1e-4);
            assert_true(plane[row * SIDE + 9] == 0.5f && plane[row * SIDE + 21] == 0.53f);
        }
    }
}

/* Lookups beyond the image read its edge. */
TEST(borders_at_the_edge_of_the_image_read_the_edge) {
    FREED charts_mesh *m = two_strips(1, SIDE, 0.0);
    FREED float *plane = plane_of_columns(33, 0.53f, 0.5f), *before = plane_of_columns(33, 0.53f, 0.5f);
    const vsh_stitch_report report = stitch_ao(m, plane, E);
    assert_int_equal(report.places, 81);
    assert_true(report.texels > 80 && report.texels < 86); /* 41 or 42 of each side */
    assert_true(across(m, plane, 1, 2, 4, 7) < UNSEEN);
    for (size_t t = 0; t < TEXELS; ++t) {
        const bool read = t % SIDE == 0 || t % SIDE == SIDE - 1;
        assert_true(read || plane[t] == before[t]);
    }
}

/* One chart that meets itself: the ramp ends 0.03 higher than it began. */
TEST(a_cylinder_with_a_ramp_around_it_has_no_jump_at_its_seam) {
    enum { AROUND = 48 };
    FREED charts_mesh *m = new_mesh();
    m->mesh.normals = m->normals;
    for (int i = 0; i < AROUND; ++i) {
        double corner[4][3], texel[4][2];
        for (int k = 0; k < 4; ++k) {
            const int at = i + (k == 1 || k == 2), end = k >= 2;
            const double angle = 6.283185307179586 * (at % AROUND) / AROUND;
            const double place[3] = {cos(angle), sin(angle), end};
            memcpy(corner[k], place, sizeof place);
            texel[k][0] = 8.7 + 46.6 * at / AROUND;
            texel[k][1] = 50.2 - 40.5 * end;
            for (int c = 0; c < 3; ++c) {
                m->normals[3 * (4 * i + k) + c] = c < 2 ? (float)place[c] : 0.0f;
            }
        }
        add_quad(m, (const double(*)[3])corner, (const double(*)[2])texel);
    }
    FREED float *plane = new_plane(0.0f), *before = new_plane(0.0f);
    for (size_t i = 0; i < TEXELS; ++i) {
        const double x = fmin(fmax((double)(i % SIDE) + 0.5, 8.7), 55.3);
        plane[i] = before[i] = (float)(0.4 + 0.03 * (x - 8.7) / 46.6);
    }
    const vsh_lightmap map = {.sky = plane};
    const uint32_t last = 4 * (AROUND - 1);
    assert_true(across(m, before, 0, 3, last + 1, last + 2) > 0.029);
    const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 0, E);
    assert_int_equal(report.seams, 1);
    assert_true(across(m, plane, 0, 3, last + 1, last + 2) < UNSEEN);
    for (size_t i = 0; i < TEXELS; ++i) {
        const bool near = i % SIDE < 10 || i % SIDE > 53;
        assert_true(near || plane[i] == before[i]);
    }
}

TEST(charts_that_are_turned_or_mirrored_agree_along_their_border) {
    const double turns[] = {0.0, 90.0, 37.0, 180.0, -61.5};
    for (size_t t = 0; t < 2 * COUNT_OF(turns); ++t) {
        FREED charts_mesh *m = two_squares(turns[t / 2], t % 2 == 0 ? 1.0 : -1.0);
        FREED float *plane = new_plane(0.5f);
        for (size_t i = 0; i < TEXELS;
             ++i) { /* a ramp along the border of the first, another value in the second */
            plane[i] = is_first(i) ? 0.5f + 0.01f * (float)(i / SIDE) / SIDE : 0.52f;
        }
        assert_true(across(m, plane, 1, 2, 4, 7) > 0.015);
        const vsh_stitch_report report = stitch_ao(m, plane, E);
        assert_int_equal(report.seams, 1);
        assert_true(across(m, plane, 1, 2, 4, 7) < UNSEEN);
    }
}

TEST(charts_of_equal_values_stay_to_the_bit) {
    const float values[] = {0.3f, 1.0f / 3.0f, 0.0f, 1.0f, 0.7654321f};
    for (size_t v = 0; v < COUNT_OF(values); ++v) {
        FREED charts_mesh *m = two_squares(23.0 + 31.0 * (double)v, 1.0);
        FREED float *plane = new_plane(values[v]), *before = new_plane(values[v]);
        const vsh_stitch_report report = stitch_ao(m, plane, E);
        assert_true(report.places > 30 && report.before == 0.0 && report.after == 0.0);
        assert_memory_equal(plane, before, TEXELS * sizeof *plane);
    }
}

/* Noise, whose seams differ by far more than the limit. */
TEST(no_value_moves_by_more_than_the_limit_or_out_of_its_range) {
    const double limits[] = {0.0, 0.003, 0.02, 1.0};
    for (size_t l = 0; l < COUNT_OF(limits); ++l) {
        FREED charts_mesh *m = two_squares(37.0, 1.0);
        FREED float *plane = new_plane(0.0f), *light = malloc(3 * TEXELS * sizeof *light),
                    *coverage = new_plane(0.0f);
        FREED float *before = new_plane(0.0f), *light_before = malloc(3 * TEXELS * sizeof *light);
        uint32_t seed = 7;
        float brightest = 0.0f;
        for (size_t i = 0; i < TEXELS; ++i) {
            plane[i] = before[i] = random_value(&seed) < 0.3f ? 0.0f : random_value(&seed);
            coverage[i] = random_value(&seed) < 0.8f ? 1.0f : 0.0f;
            for (size_t c = 0; c < 3; ++c) {
                light[3 * i + c] = light_before[3 * i + c] = 40.0f * random_value(&seed);
                brightest = fmaxf(brightest, light[3 * i + c]);
            }
        }
        const vsh_lightmap map = {.ao = plane, .irradiance = light, .coverage = coverage};
        const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 0, limits[l]);
        assert_true(report.after <= report.before);
        size_t moved = 0, at_limit = 0, guesses_beyond = 0, light_beyond = 0;
        for (size_t i = 0; i < TEXELS; ++i) {
            const double by = fabs((double)plane[i] - (double)before[i]);
            moved += by > 0.0;
            assert_true(plane[i] >= 0.0f && plane[i] <= 1.0f);
            assert_true(coverage[i] == 0.0f || by <= limits[l]);
            at_limit += coverage[i] != 0.0f && by > 0.999 * limits[l];
            guesses_beyond += coverage[i] == 0.0f && by > limits[l];
            for (size_t c = 0; c < 3; ++c) {
                const double light_by = fabs((double)light[3 * i + c] - (double)light_before[3 * i + c]);
                assert_true(light[3 * i + c] >= 0.0f);
                assert_true(coverage[i] == 0.0f || light_by <= limits[l] * (double)brightest);
                moved += light_by > 0.0;
                light_beyond += coverage[i] != 0.0f && light_by > 5.0 * limits[l];
            }
        }
        assert_true(limits[l] == 0.0 || light_beyond > 20); /* its limit is a part of the light nearby */
        assert_true(moved > 40);
        assert_true(limits[l] == 0.0 || limits[l] == 1.0 || at_limit > 20);
        assert_true(limits[l] == 1.0 || guesses_beyond > 5);
    }
}

/* Two pairs of squares, which are two islands. */
TEST(without_coverage_texels_outside_of_charts_are_guesses) {
    FREED charts_mesh *m = new_mesh();
    for (int i = 0; i < 4; ++i) { /* the charts of a pair lie far from each other, in other orders */
        const double places[4][2] = {{3.4, 50.6}, {36.2, 22.3}, {40.7, 55.9}, {5.1, 20.8}};
        add_square(m, 5.0 * (i / 2) + i % 2, places[i], 11.0 + i, 0.0, 1.0);
    }
    OWNED(vsh_charts) *charts = charts_of(&m->mesh, 1);
    OWNED(texel_list) *texels = texels_from(charts);
    const texel_samples samples = samples_of(texels);
    FREED float *plane = random_plane(5), *before = random_plane(5), *covered = new_plane(0.0f);
    for (size_t i = 0; i < samples.count; ++i) {
        covered[vsh_texel_place(samples.texels[i], SIDE)] = 1.0f;
    }
    assert_int_equal(stitch_ao(m, plane, E).seams, 2);
    size_t moved = 0, beyond = 0;
    for (size_t i = 0; i < TEXELS; ++i) {
        const double by = fabs((double)plane[i] - (double)before[i]);
        assert_true(covered[i] == 0.0f || by <= E);
        moved += by > 0.0;
        beyond += by > E;
    }
    assert_true(moved > 80 && beyond > 20);
}

/* Two flat squares that meet at an angle. */
static charts_mesh *bent_squares(double degrees) {
    const double c = cos(degrees * 0.017453292519943295), s = sin(degrees * 0.017453292519943295);
    charts_mesh *m = new_mesh();
    add_square(m, 0.0, (const double[]){4.3, 25.6}, 18.0, 0.0, 1.0);
    add_quad(m, (const double[][3]){{1, 0, 0}, {1 + c, 0, s}, {1 + c, 1, s}, {1, 1, 0}},
             (const double[][2]){{41.2, 39.3}, {55.2, 39.3}, {55.2, 25.3}, {41.2, 25.3}});
    return m;
}

TEST(creases_are_left_and_smooth_normals_make_none) {
    const struct {
        double degrees;
        bool smooth, stitched;
    } cases[] = {{0.0, false, true},  {4.9, false, true},    {-4.9, false, true},
                 {5.1, false, false}, {-90.0, false, false}, {90.0, true, true}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        FREED charts_mesh *m = bent_squares(cases[i].degrees);
        for (size_t v = 0; cases[i].smooth && v < 8; ++v) {
            const float up[3] = {v == 1 || v == 2 || v == 4 || v == 7 ? -1.0f : 0.0f, 0.0f, 1.0f};
            memcpy(m->normals + 3 * v, up, sizeof up);
            m->mesh.normals = m->normals;
        }
        FREED float *plane = plane_of_squares(), *before = plane_of_squares();
        assert_int_equal(stitch_ao(m, plane, E).seams, cases[i].stitched);
        assert_true((memcmp(plane, before, TEXELS * sizeof *plane) != 0) == cases[i].stitched);
    }
}

/* Squares as two meshes of which one has a transform: ends are compared in the world, and in which order they
 * come. */
TEST(meshes_meet_in_the_world) {
    FREED charts_mesh *a = new_mesh(), *b = new_mesh();
    add_square(a, 0.0, (const double[]){4.3, 25.6}, 18.0, 0.0, 1.0);
    add_square(b, 0.0, SECOND, 14.0, 37.0, 1.0);
    const double farther[12] = {1, 0, 0, 1.001, 0, 1, 0, 0, 0, 0, 1, 0};
    const double beside[12] = {-1, 0, 0, 2, 0, -1,
                               0,  1, 0, 0, 1, 0}; /* half a turn: its corners 2 and 1 meet a's 1 and 2 */
    vsh_mesh meshes[2] = {a->mesh, b->mesh};
    FREED float *plane = new_plane(0.5f);
    for (size_t i = 0; i < TEXELS; ++i) {
        plane[i] = is_first(i) ? 0.4f + 0.01f * (float)(i / SIDE) : 0.55f;
    }
    const vsh_lightmap map = {.ao = plane};
    meshes[1].transform = farther;
    const vsh_stitch_report apart = stitch(meshes, 2, &map, 0, 1.0);
    assert_int_equal(apart.seams, 0);
    meshes[1].transform = beside;
    const vsh_stitch_report joined = stitch(meshes, 2, &map, 0, 1.0);
    assert_int_equal(joined.seams, 1);
    assert_true(joined.after < 0.02 * joined.before);
    assert_true(between(plane, a, 1, 2, b, 2, 1) < 4.0 * UNSEEN);
}

/* A third chart lies 0.1 texels beside the border, along half of its length. */
TEST(a_chart_nearby_is_not_read_and_not_moved) {
    FREED charts_mesh *m = two_squares(0.0, 1.0);
    add_quad(m, (const double[][3]){{7, 0, 0}, {8, 0, 0}, {8, 1, 0}, {7, 1, 0}},
             (const double[][2]){{22.4, 16.6}, {29.9, 16.6}, {29.9, 3.1}, {22.4, 3.1}});
    FREED float *plane = new_plane(0.5f), *before = new_plane(0.0f);
    for (size_t i = 0; i < TEXELS; ++i) {
        const size_t x = i % SIDE, y = i / SIDE;
        plane[i] = x >= 22 && x < 30 && y < 17 ? 0.9f : is_first(i) ? 0.5f : 0.52f;
    }
    memcpy(before, plane, TEXELS * sizeof *plane);
    const vsh_stitch_report report = stitch_ao(m, plane, E);
    assert_true(report.crowded > 10 && report.places > 10);
    assert_true(report.after < 0.02 * report.before);
    for (size_t i = 0; i < TEXELS; ++i) {
        assert_true(before[i] != 0.9f || plane[i] == before[i]);
    }
}

/* Zero area in the world and in the lightmap, one triangle again and again, corners in one place, UVs far
 * outside. */
TEST(degenerate_edges_change_nothing) {
    static const struct {
        double corner[4][3], texel[4][2];
    } degenerate[] = {
        {{{1, 0, 0}, {1, 0.5, 0}, {1, 1, 0}, {1, 0.2, 0}}, {{2, 60}, {9, 60}, {9, 55}, {2, 55}}},
        {{{1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}}, {{2, 60}, {9, 60}, {12, 60}, {3, 60}}},
        {{{1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}}, {{2, 60}, {9, 60}, {9, 55}, {2, 55}}},
        {{{1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}}, {{-13, 60}, {-2, 60}, {-2, 50}, {-13, 50}}},
        {{{1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}}, {{-2e9, 60}, {9, 6e12}, {9, 55}, {2, -55}}}};
    FREED charts_mesh *m = two_squares(90.0, 1.0);
    FREED float *plane = plane_of_squares(), *more = plane_of_squares();
    for (size_t round = 0; round < 2; ++round) {
        const vsh_stitch_report report = stitch_ao(m, round == 0 ? plane : more, E);
        assert_int_equal(report.seams, 1);
        for (size_t k = 0; k < COUNT_OF(degenerate); ++k) {
            add_quad(m, degenerate[k].corner, degenerate[k].texel);
        }
    }
    assert_memory_equal(plane, more, TEXELS * sizeof *plane);
    for (int again = 0; again < 60; ++again) { /* an edge of 120 triangles, in as many charts */
        add_square(m, 1.0, (const double[]){SECOND[0] + 0.01 * again, SECOND[1]}, 14.0, 90.0, 1.0);
    }
    const vsh_stitch_report report = stitch_ao(m, plane, E);
    assert_true(report.seams > 60 && report.seams < 4000);
}

/* --- edges that meet parts of others (T-junctions), and borders between lightmaps */

static const double WHOLE[2] = {0, 40}, HALVES[3] = {0, 20, 40}, THIRDS[4] = {0, 13, 27, 40},
                    PART[2] = {10, 30}, MANY[9] = {0, 3, 8, 10, 17, 20, 29, 31.5, 40};

/* Cuts of a border's two sides, and the seams that they have in common, with their length. */
static const struct {
    const double *left, *right;
    int left_count, right_count;
    uint64_t seams;
    int begin, end;
} cases[] = {{WHOLE, HALVES, 2, 3, 2, 0, 40},  {HALVES, WHOLE, 3, 2, 2, 0, 40},
             {HALVES, THIRDS, 3, 4, 4, 0, 40}, {WHOLE, MANY, 2, 9, 8, 0, 40},
             {THIRDS, MANY, 4, 9, 10, 0, 40},  {WHOLE, PART, 2, 2, 1, 10, 30},
             {HALVES, PART, 3, 2, 2, 10, 30},  {MANY, MANY, 9, 9, 8, 0, 40}};

/* A turn by no right angle. */
static const double TURNED[12] = {0.36, 0.48, -0.8, 70.7, -0.8, 0.6, 0.0, 11.1, 0.48, 0.64, 0.6, -33.3};

/* (a, b) go to the minimum of 2 (d + a - b)² + keep (a² + b²), as along a border of equal edges. */
TEST(parts_of_edges_meet_as_whole_ones_do) {
    for (size_t i = 0; i < 3 * COUNT_OF(cases); ++i) {
        const size_t c = i / 3;
        FREED charts_mesh *m = new_mesh();
        add_strip(m, 0, cases[c].left, cases[c].left_count, 10.5);
        add_strip(m, 1, cases[c].right, cases[c].right_count, 20.5);
        m->mesh.transform = i % 3 == 1 ? TURNED : NULL;
        for (size_t v = 0; i % 3 == 2 && v < m->mesh.vertex_count; ++v) { /* rounded to 32 bits */
            float *p = m->positions + 3 * v, from[3] = {p[0], p[1], p[2]};
            for (int k = 0; k < 3; ++k) {
                const double *row = TURNED + 4 * k;
                p[k] = (float)(row[0] * (double)from[0] + row[1] * (double)from[1] +
                               row[2] * (double)from[2] + row[3]);
            }
        }
        FREED float *plane = plane_of_columns(15, 0.5f, 0.53f);
        const vsh_stitch_report report = stitch_ao(m, plane, E);
        assert_that(report.seams == cases[c].seams, "case %zu: %d seams, expected %d", i, (int)report.seams,
                    (int)cases[c].seams);
        const double move = 2.0 * 0.03 / (4.0 + 0.01);
        for (int row = 12; row < 48; ++row) { /* y = 50 - row - 0.5 in the world */
            const int inside = 49.5 - row > cases[c].begin + 2 && 49.5 - row < cases[c].end - 2;
            const int outside = 49.5 - row < cases[c].begin - 2 || 49.5 - row > cases[c].end + 2;
            const double left = (double)plane[row * SIDE + 10], right = (double)plane[row * SIDE + 20];
            assert_that((!inside || (fabs(left - 0.5 - move) <= 2e-4 && fabs(right - 0.53 + move) <= 2e-4)) &&
                            (!outside || (left == (double)0.5f && right == (double)0.53f)),
                        "case %zu, row %d: %g and %g", i, row, left, right);
        }
    }
}

TEST(an_end_beside_an_edge_or_over_a_crease_cuts_nothing) {
    for (int kind = 0; kind < 3; ++kind) {
        FREED charts_mesh *m = new_mesh();
        add_strip(m, 0, WHOLE, 2, 10.5);
        add_strip(m, 1, HALVES, 3, 20.5);
        for (size_t v = 4; v < m->mesh.vertex_count; ++v) {
            float *p = m->positions + 3 * v;
            p[0] += kind == 1 && p[1] == 20 ? 0.001F : 0.0F; /* in the plane */
            p[2] += kind == 2 ? 0.2F * (p[0] - 1.0F) : 0.0F; /* 11 degrees */
        }
        FREED float *plane = new_plane(0.5f);
        assert_int_equal(stitch_ao(m, plane, E).seams, kind == 0 ? 2 : 0);
    }
}

/* A T within one chart is none of its borders: what is on both sides is the same. */
TEST(a_junction_within_a_chart_is_no_seam) {
    FREED charts_mesh *m = new_mesh();
    add_strip(m, 0, WHOLE, 2, 15.5);
    add_strip(m, 1, HALVES, 3, 15.5);
    FREED float *plane = random_plane(3), *before = random_plane(3);
    assert_int_equal(stitch_ao(m, plane, E).seams, 0);
    assert_memory_equal(plane, before, TEXELS * sizeof *plane);
}

/* --- several lightmaps */

typedef struct two_pages {
    charts_mesh *m[2];
    vsh_charts *charts[2];
    float *ao[2];
    vsh_lightmap maps[2];
    vsh_stitch_page pages[2];
} two_pages;

/* Both have their chart at the same texels. */
static void make_pages(two_pages *p, const double *left, int left_count) {
    for (int k = 0; k < 2; ++k) {
        p->m[k] = new_mesh();
        if (k == 0) {
            add_strip(p->m[k], 0, left, left_count, 20.5);
        } else {
            add_strip(p->m[k], 1, WHOLE, 2, 20.5);
        }
        p->charts[k] = charts_of(&p->m[k]->mesh, 1);
        p->ao[k] = new_plane(k == 0 ? 0.5f : 0.53f);
        p->maps[k] = (vsh_lightmap){.ao = p->ao[k]};
        p->pages[k] = (vsh_stitch_page){p->charts[k], &p->maps[k]};
    }
}

static void free_pages(two_pages *p) {
    for (int k = 0; k < 2; ++k) {
        free(p->ao[k]);
        vsh_charts_free(p->charts[k]);
        free(p->m[k]);
    }
}

TEST(borders_between_lightmaps_agree) {
    for (int cut = 0; cut < 2; ++cut) {
        FREED_BY(free_pages) two_pages p;
        make_pages(&p, cut ? THIRDS : WHOLE, cut ? 4 : 2);
        vsh_stitch_report report;
        assert_ok(stitch_one(p.charts[0], &p.maps[0], 0, NULL, NULL, &report, &failure));
        assert_int_equal(report.seams, 0);
        assert_ok(vsh_lightmaps_stitch(p.pages, 2, 0, NULL, NULL, &report, &failure));
        assert_int_equal(report.seams, cut ? 3 : 1);
        const double move = 2.0 * 0.03 / (4.0 + 0.01);
        for (size_t t = 0; t < TEXELS; ++t) {
            const size_t row = t / SIDE, column = t % SIDE;
            if (column != 20) {
                assert_true(p.ao[0][t] == 0.5f && p.ao[1][t] == 0.53f);
            } else if (row > 13 && row < 47) {
                assert_true(fabs((double)p.ao[0][t] - 0.5 - move) < 2e-4);
                assert_true(fabs((double)p.ao[1][t] - 0.53 + move) < 2e-4);
            }
            assert_true(fabs((double)p.ao[0][t] - 0.5) <= E && fabs((double)p.ao[1][t] - 0.53) <= E + 1e-7);
        }
    }
}

/* A page that meets none of the others. */
TEST(one_of_several_changes_as_it_does_alone) {
    static const double away[12] = {1, 0, 0, 100, 0, 1, 0, 0, 0, 0, 1, 0};
    FREED charts_mesh *m = two_squares(37.0, 1.0);
    m->mesh.transform = away;
    OWNED(vsh_charts) *charts = charts_of(&m->mesh, 1);
    FREED float *alone = random_plane(9), *among = random_plane(9);
    FREED_BY(free_pages) two_pages p;
    make_pages(&p, WHOLE, 2);
    const vsh_lightmap of_one = {.ao = alone}, of_three = {.ao = among};
    const vsh_stitch_page pages[3] = {p.pages[0], {charts, &of_three}, p.pages[1]};
    assert_ok(stitch_one(charts, &of_one, 0, NULL, NULL, NULL, &failure));
    assert_ok(vsh_lightmaps_stitch(pages, 3, 0, NULL, NULL, NULL, &failure));
    assert_memory_equal(alone, among, TEXELS * sizeof *alone);
}

TEST(pages_of_other_planes_are_refused) {
    FREED_BY(free_pages) two_pages p;
    make_pages(&p, WHOLE, 2);
    const vsh_lightmap none = {.coverage = p.ao[0]};
    const vsh_stitch_page bad[3][2] = {{p.pages[0], {p.charts[1], &none}},
                                       {p.pages[0], {NULL, &p.maps[1]}},
                                       {{p.charts[0], NULL}, p.pages[1]}};
    for (int i = 0; i < 3; ++i) {
        assert_int_equal(vsh_lightmaps_stitch(bad[i], 2, 0, NULL, NULL, NULL, &failure), VSH_ERROR_ARGUMENT);
    }
    assert_int_equal(vsh_lightmaps_stitch(NULL, 2, 0, NULL, NULL, NULL, &failure), VSH_ERROR_ARGUMENT);
    assert_ok(vsh_lightmaps_stitch(NULL, 0, 0, NULL, NULL, NULL, &failure));
}

/* --- memory, options, and which planes change */

static vsh_result stitch_noise(const charts_mesh *m, const vsh_run *run, float *ao, float *light,
                               vsh_error *error) {
    uint32_t seed = 11;
    for (size_t i = 0; i < TEXELS; ++i) {
        ao[i] = random_value(&seed);
        for (size_t c = 0; c < 3; ++c) {
            light[3 * i + c] = random_value(&seed);
        }
    }
    OWNED(vsh_charts) *charts = charts_of(&m->mesh, 1);
    const vsh_lightmap map = {.ao = ao, .irradiance = light};
    return stitch_one(charts, &map, 0, NULL, run, NULL, error);
}

TEST(the_memory_limit_is_held_before_anything_moves) {
    FREED charts_mesh *m = two_squares(37.0, 1.0);
    FREED float *ao = new_plane(0.0f), *light = malloc(3 * TEXELS * sizeof *light);
    vsh_run run = run_on(1);
    uint64_t refused = 0, most = 0;
    for (run.memory_limit = 64; most == 0; run.memory_limit *= 2) {
        const vsh_result result = stitch_noise(m, &run, ao, light, &failure);
        most = result == VSH_OK ? run.memory_limit : 0;
        assert_true(result == VSH_OK || result == VSH_ERROR_LIMIT);
        refused += result == VSH_ERROR_LIMIT && strstr(failure.message, "seams") != NULL;
        uint32_t seed = 11;
        for (size_t i = 0; result != VSH_OK && i < TEXELS; ++i) {
            assert_true(ao[i] == random_value(&seed));
            for (size_t c = 0; c < 3; ++c) {
                assert_true(light[3 * i + c] == random_value(&seed));
            }
        }
    }
    assert_true(refused > 4 && most < 1000000); /* charts, marks, unknowns, vectors: each is looked at */
    vsh_run four = run_within(most);
    four.threads = 4; /* vectors of four channels are larger than all else */
    assert_int_equal(stitch_noise(m, &four, ao, light, &failure), VSH_ERROR_LIMIT);
    FREED charts_mesh *many = new_mesh(); /* without seams, finding edges takes most */
    for (int i = 0; i < MOST_VERTICES / 4; ++i) {
        add_square(many, 2.0 * i, (const double[]){1.0 + 3.5 * (i % 16), 4.0 + 3.5 * (i / 16)}, 2.5, 0.0,
                   1.0);
    }
    run.memory_limit = 20000;
    assert_int_equal(stitch_noise(many, &run, ao, light, &failure), VSH_ERROR_LIMIT);
}

/* The same differences, as AO and as light. */
TEST(differences_of_light_are_relative_to_the_brightest_texel) {
    FREED charts_mesh *m = two_squares(37.0, 1.0);
    FREED float *ao = new_plane(0.0f), *light = malloc(3 * TEXELS * sizeof *light);
    for (size_t i = 0; i < TEXELS; ++i) {
        ao[i] = is_first(i) ? 0.98f : 1.0f;
        light[3 * i] = light[3 * i + 1] = light[3 * i + 2] = 50.0f * ao[i];
    }
    const vsh_lightmap dim = {.ao = ao}, bright = {.irradiance = light};
    const vsh_stitch_report of_ao = stitch(&m->mesh, 1, &dim, 0, 0.02);
    const vsh_stitch_report of_light = stitch(&m->mesh, 1, &bright, 0, 0.02);
    assert_true(fabs(of_ao.before - 0.02) < 1e-6 && fabs(of_light.before - 0.02) < 1e-6);
    assert_true(of_ao.after < 0.0004 && of_light.after < 0.0004);
    assert_true(of_light.places == of_ao.places && of_light.texels == of_ao.texels);
}

TEST(options_out_of_range_are_refused) {
    FREED charts_mesh *m = two_squares(0.0, 1.0);
    OWNED(vsh_charts) *charts = charts_of(&m->mesh, 1);
    FREED float *ao = new_plane(0.5f);
    const vsh_lightmap map = {.ao = ao};
    for (int i = 0; i < 8; ++i) {
        vsh_stitch_options options = vsh_stitch_options_default();
        double *const members[] = {&options.max_change, &options.max_angle, &options.keep,
                                   &options.max_change};
        const double values[] = {-1e-9, -1.0, 0.0, 1.001, NAN, 181.0, 1.5, INFINITY};
        *members[i % 4] = values[i];
        assert_fails(stitch_one(charts, &map, 0, &options, NULL, NULL, &failure), VSH_ERROR_ARGUMENT,
                     "vsh_stitch_options.");
    }
}

TEST(planes_that_are_not_light_do_not_change) {
    FREED charts_mesh *m = two_squares(37.0, 1.0);
    FREED float *ao = new_plane(0.5f), *bent = malloc(3 * TEXELS * sizeof *bent), *error = new_plane(0.0f);
    FREED float *invalid = new_plane(0.0f), *coverage = new_plane(1.0f), *shadow = new_plane(0.0f),
                *tint = malloc(3 * TEXELS * sizeof *tint);
    FREED float *copy = malloc(3 * TEXELS * sizeof *copy);
    uint32_t seed = 3;
    for (size_t i = 0; i < TEXELS; ++i) {
        error[i] = shadow[i] = random_value(&seed);
        invalid[i] = error[i] < 0.5f ? 0.0f : 1.0f;
        ao[i] = is_first(i) ? 0.5f : NAN; /* nothing is known of it */
        for (size_t c = 0; c < 3; ++c) {
            bent[3 * i + c] = tint[3 * i + c] = random_value(&seed);
        }
    }
    memcpy(copy, bent, 3 * TEXELS * sizeof *bent);
    float *const shadows[] = {shadow, NULL}, *const errors[] = {error, error}, *const tints[] = {NULL, tint};
    const vsh_lightmap map = {.shadow = shadows,
                              .ao = ao,
                              .bent = bent,
                              .shadow_error = errors,
                              .ao_error = error,
                              .tint = tints,
                              .invalid = invalid,
                              .coverage = coverage};
    const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 2, 0.02);
    assert_true(report.after < report.before);
    assert_memory_equal(bent, copy, 3 * TEXELS * sizeof *bent);
    assert_memory_not_equal(tint, copy, 3 * TEXELS * sizeof *tint);
    seed = 3;
    size_t moved = 0;
    for (size_t i = 0; i < TEXELS; ++i) {
        const float first = random_value(&seed);
        assert_true(error[i] == first && invalid[i] == (first < 0.5f ? 0.0f : 1.0f) && coverage[i] == 1.0f);
        assert_true(is_first(i) ? ao[i] == 0.5f : isnan(ao[i]) != 0);
        moved += shadow[i] != first;
        for (size_t c = 0; c < 3; ++c) {
            random_value(&seed);
        }
    }
    assert_true(moved > 20);
}
