/* vsh_lightmap_stitch(): values on both sides of charts' borders agree, and nothing else moves. */
#include "seams.h"

static const double E = 0.02;
static const double UNSEEN = 0.5 / 255.0; /* half a step of what is shown */

/* Two strips whose borders pass through centres of texels, cut into pieces along them. */
static charts_mesh *two_strips(int pieces, double left, double right) {
    charts_mesh *m = new_mesh();
    for (int side = 0; side < 2; ++side) {
        for (int i = 0; i < pieces; ++i) {
            const double low = 40.0 * i / pieces, high = 40.0 * (i + 1) / pieces;
            const double x = side == 0 ? left - 5.0 : right, from = 50.0 - low, to = 50.0 - high;
            const double corner[4][3] = {
                {side, low, 0}, {side + 1.0, low, 0}, {side + 1.0, high, 0}, {side, high, 0}};
            const double texel[4][2] = {{x, from}, {x + 5.0, from}, {x + 5.0, to}, {x, to}};
            add_quad(m, corner, texel);
        }
    }
    return m;
}

/* A column of each side is read: (a, b) go to the minimum of 2 (d + a - b)² + keep (a² + b²), as two places
 * fall to a texel, however many edges the border has. */
static void two_columns_meet_where_the_closed_form_says(void **state) {
    (void)state;
    const int pieces[] = {1, 7, 100};
    for (size_t i = 0; i < 2 * sizeof pieces / sizeof pieces[0]; ++i) {
        charts_mesh *m = two_strips(pieces[i / 2], 10.5, 20.5);
        vsh_charts *charts = charts_of(&m->mesh, 1);
        float *plane = new_plane(0.5f);
        for (size_t t = 0; t < TEXELS; ++t) {
            plane[t] = t % SIDE < 15 ? 0.5f : 0.53f;
        }
        const vsh_lightmap map = {.ao = plane};
        vsh_stitch_options options = vsh_stitch_options_default();
        options.keep = i % 2 == 0 ? options.keep : 1.0;
        vsh_stitch_report report;
        assert_int_equal(vsh_lightmap_stitch(charts, &map, 0, &options, NULL, &report, NULL), VSH_OK);
        assert_int_equal(report.seams, pieces[i / 2]);
        assert_int_equal(report.crowded, 0);
        assert_true(pieces[i / 2] > 1 || report.places == 81);
        const double move = 2.0 * 0.03 / (4.0 + options.keep);
        for (size_t row = 20; row < 40; ++row) {
            assert_true(fabs((double)plane[row * SIDE + 10] - 0.5 - move) < 1e-4);
            assert_true(fabs((double)plane[row * SIDE + 20] - 0.53 + move) < 1e-4);
            assert_true(plane[row * SIDE + 9] == 0.5f && plane[row * SIDE + 21] == 0.53f);
        }
        assert_true(fabs(report.before - 0.03) < 1e-6 &&
                    report.after < 0.08 * 0.03 * sqrt(options.keep * 100.0));
        free(plane);
        vsh_charts_free(charts);
        free(m);
    }
}

/* a² + b² / 10 is what it costs, so b goes ten times as far. */
static void what_is_guessed_gives_way_to_what_was_baked(void **state) {
    (void)state;
    charts_mesh *m = two_strips(1, 10.5, 20.5);
    float *plane = new_plane(0.5f), *coverage = new_plane(1.0f);
    for (size_t t = 0; t < TEXELS; ++t) {
        plane[t] = t % SIDE < 15 ? 0.5f : 0.53f;
        coverage[t] = t % SIDE == 20 ? 0.0f : 1.0f;
    }
    const vsh_lightmap map = {.ao = plane, .coverage = coverage};
    stitch(&m->mesh, 1, &map, 0, E);
    const double keep = 0.01, move = 4.0 * 0.03 / (44.0 + keep);
    for (size_t row = 20; row < 40; ++row) {
        assert_true(fabs((double)plane[row * SIDE + 10] - 0.5 - move) < 1e-4);
        assert_true(fabs((double)plane[row * SIDE + 20] - 0.53 + 10.0 * move) < 1e-4);
    }
    free(coverage);
    free(plane);
    free(m);
}

/* What lies beyond the image is its edge again, for lookups. */
static void borders_at_the_edge_of_the_image_read_the_edge(void **state) {
    (void)state;
    charts_mesh *m = two_strips(1, SIDE, 0.0);
    float *plane = new_plane(0.5f), *before = new_plane(0.5f);
    for (size_t t = 0; t < TEXELS; ++t) {
        plane[t] = before[t] = t % SIDE > 32 ? 0.5f : 0.53f;
    }
    const vsh_lightmap map = {.ao = plane};
    const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 0, E);
    assert_int_equal(report.places, 81);
    assert_true(report.texels > 80 && report.texels < 86); /* 41 or 42 of each side */
    assert_true(across(m, plane, 1, 2, 4, 7) < UNSEEN);
    for (size_t t = 0; t < TEXELS; ++t) {
        const bool read = t % SIDE == 0 || t % SIDE == SIDE - 1;
        assert_true(read || plane[t] == before[t]);
    }
    free(before);
    free(plane);
    free(m);
}

/* One chart that meets itself: the ramp ends 0.03 higher than it began. */
static void a_cylinder_with_a_ramp_around_it_has_no_jump_at_its_seam(void **state) {
    (void)state;
    enum { AROUND = 48 };
    charts_mesh *m = new_mesh();
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
    float *plane = new_plane(0.0f), *before = new_plane(0.0f);
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
    free(before);
    free(plane);
    free(m);
}

static void charts_that_are_turned_or_mirrored_agree_along_their_border(void **state) {
    (void)state;
    const double turns[] = {0.0, 90.0, 37.0, 180.0, -61.5};
    for (size_t t = 0; t < 2 * sizeof turns / sizeof turns[0]; ++t) {
        charts_mesh *m = two_squares(turns[t / 2], t % 2 == 0 ? 1.0 : -1.0);
        float *plane = new_plane(0.5f);
        for (size_t i = 0; i < TEXELS;
             ++i) { /* a ramp along the border of the first, another value in the second */
            plane[i] = is_first(i) ? 0.5f + 0.01f * (float)(i / SIDE) / SIDE : 0.52f;
        }
        const vsh_lightmap map = {.ao = plane};
        assert_true(across(m, plane, 1, 2, 4, 7) > 0.015);
        const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 0, E);
        assert_int_equal(report.seams, 1);
        assert_true(across(m, plane, 1, 2, 4, 7) < UNSEEN);
        free(plane);
        free(m);
    }
}

/* What it costs to move is what is left: without it nothing is. */
static void the_less_moving_costs_the_less_is_left(void **state) {
    (void)state;
    charts_mesh *m = two_squares(37.0, 1.0);
    vsh_charts *charts = charts_of(&m->mesh, 1);
    float *plane = new_plane(0.5f);
    double last = INFINITY;
    for (double keep = 1.0; keep > 1e-3 / 2; keep /= 10.0) {
        for (size_t i = 0; i < TEXELS; ++i) {
            plane[i] = is_first(i) ? 0.5f : 0.52f;
        }
        const vsh_lightmap map = {.ao = plane};
        vsh_stitch_options options = vsh_stitch_options_default();
        options.keep = keep;
        options.max_change = 1.0;
        vsh_stitch_report report;
        assert_int_equal(vsh_lightmap_stitch(charts, &map, 0, &options, NULL, &report, NULL), VSH_OK);
        assert_true(fabs(report.before - 0.02) < 1e-6 && report.after < 0.5 * last);
        last = report.after;
    }
    assert_true(last < 1e-4);
    free(plane);
    vsh_charts_free(charts);
    free(m);
}

static void charts_of_equal_values_stay_to_the_bit(void **state) {
    (void)state;
    const float values[] = {0.3f, 1.0f / 3.0f, 0.0f, 1.0f, 0.7654321f};
    for (size_t v = 0; v < sizeof values / sizeof values[0]; ++v) {
        charts_mesh *m = two_squares(23.0 + 31.0 * (double)v, 1.0);
        float *plane = new_plane(values[v]), *before = new_plane(values[v]);
        const vsh_lightmap map = {.ao = plane};
        const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 0, E);
        assert_true(report.places > 30 && report.before == 0.0 && report.after == 0.0);
        assert_memory_equal(plane, before, TEXELS * sizeof *plane);
        free(before);
        free(plane);
        free(m);
    }
}

/* Noise, which asks for far more than the limit. */
static void no_value_moves_by_more_than_the_limit_or_out_of_its_range(void **state) {
    (void)state;
    const double limits[] = {0.0, 0.003, 0.02, 1.0};
    for (size_t l = 0; l < sizeof limits / sizeof limits[0]; ++l) {
        charts_mesh *m = two_squares(37.0, 1.0);
        float *plane = new_plane(0.0f), *light = malloc(3 * TEXELS * sizeof *light),
              *coverage = new_plane(0.0f);
        float *before = new_plane(0.0f), *light_before = malloc(3 * TEXELS * sizeof *light);
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
        assert_true(limits[l] == 0.0 || light_beyond > 20); /* its limit is in parts of what is near */
        assert_true(moved > 40);
        assert_true(limits[l] == 0.0 || limits[l] == 1.0 || at_limit > 20);
        assert_true(limits[l] == 1.0 || guesses_beyond > 5);
        free(light_before);
        free(before);
        free(coverage);
        free(light);
        free(plane);
        free(m);
    }
}

/* Two pairs of squares, which are two islands. */
static void without_coverage_charts_tell_what_is_a_guess(void **state) {
    (void)state;
    charts_mesh *m = new_mesh();
    for (int i = 0; i < 4; ++i) { /* the charts of a pair lie far from each other, in other orders */
        const double places[4][2] = {{3.4, 50.6}, {36.2, 22.3}, {40.7, 55.9}, {5.1, 20.8}};
        add_square(m, 5.0 * (i / 2) + i % 2, places[i], 11.0 + i, 0.0, 1.0);
    }
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = SIDE;
    vsh_charts *charts = NULL;
    assert_int_equal(vsh_charts_create(&m->mesh, 1, &options, NULL, NULL, &charts, NULL), VSH_OK);
    vsh_texels *texels = NULL;
    assert_int_equal(vsh_texels_create(charts, NULL, &texels, NULL), VSH_OK);
    const vsh_texel_samples samples = vsh_texels_samples(texels);
    float *plane = new_plane(0.0f), *before = new_plane(0.0f), *covered = new_plane(0.0f);
    for (size_t i = 0; i < samples.count; ++i) {
        covered[vsh_texel_place(samples.texels[i], SIDE)] = 1.0f;
    }
    uint32_t seed = 5;
    for (size_t i = 0; i < TEXELS; ++i) {
        plane[i] = before[i] = random_value(&seed);
    }
    const vsh_lightmap map = {.ao = plane};
    const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 0, E);
    assert_int_equal(report.seams, 2);
    size_t moved = 0, beyond = 0;
    for (size_t i = 0; i < TEXELS; ++i) {
        const double by = fabs((double)plane[i] - (double)before[i]);
        assert_true(covered[i] == 0.0f || by <= E);
        moved += by > 0.0;
        beyond += by > E;
    }
    assert_true(moved > 80 && beyond > 20);
    free(covered);
    free(before);
    free(plane);
    vsh_texels_free(texels);
    vsh_charts_free(charts);
    free(m);
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

static void creases_are_left_and_smooth_normals_make_none(void **state) {
    (void)state;
    const struct {
        double degrees;
        bool smooth, stitched;
    } cases[] = {{0.0, false, true},  {4.9, false, true},    {-4.9, false, true},
                 {5.1, false, false}, {-90.0, false, false}, {90.0, true, true}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        charts_mesh *m = bent_squares(cases[i].degrees);
        for (size_t v = 0; cases[i].smooth && v < 8; ++v) {
            const float up[3] = {v == 1 || v == 2 || v == 4 || v == 7 ? -1.0f : 0.0f, 0.0f, 1.0f};
            memcpy(m->normals + 3 * v, up, sizeof up);
            m->mesh.normals = m->normals;
        }
        float *plane = new_plane(0.5f), *before = new_plane(0.5f);
        for (size_t t = 0; t < TEXELS; ++t) {
            plane[t] = before[t] = is_first(t) ? 0.5f : 0.52f;
        }
        const vsh_lightmap map = {.ao = plane};
        const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 0, E);
        assert_int_equal(report.seams, cases[i].stitched);
        assert_true((memcmp(plane, before, TEXELS * sizeof *plane) != 0) == cases[i].stitched);
        free(before);
        free(plane);
        free(m);
    }
}

/* Squares as two meshes of which one has a transform: ends are compared in the world, and in which order they
 * come. */
static void meshes_meet_in_the_world(void **state) {
    (void)state;
    charts_mesh *a = new_mesh(), *b = new_mesh();
    add_square(a, 0.0, (const double[]){4.3, 25.6}, 18.0, 0.0, 1.0);
    add_square(b, 0.0, SECOND, 14.0, 37.0, 1.0);
    const double farther[12] = {1, 0, 0, 1.001, 0, 1, 0, 0, 0, 0, 1, 0};
    const double beside[12] = {-1, 0, 0, 2, 0, -1,
                               0,  1, 0, 0, 1, 0}; /* half a turn: its corners 2 and 1 meet a's 1 and 2 */
    vsh_mesh meshes[2] = {a->mesh, b->mesh};
    float *plane = new_plane(0.5f);
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
    free(plane);
    free(b);
    free(a);
}

/* A third chart lies 0.1 texels beside the border, along half of its length. */
static void a_chart_nearby_is_neither_read_nor_moved(void **state) {
    (void)state;
    charts_mesh *m = two_squares(0.0, 1.0);
    add_quad(m, (const double[][3]){{7, 0, 0}, {8, 0, 0}, {8, 1, 0}, {7, 1, 0}},
             (const double[][2]){{22.4, 16.6}, {29.9, 16.6}, {29.9, 3.1}, {22.4, 3.1}});
    float *plane = new_plane(0.5f), *before = new_plane(0.0f);
    for (size_t i = 0; i < TEXELS; ++i) {
        const size_t x = i % SIDE, y = i / SIDE;
        plane[i] = x >= 22 && x < 30 && y < 17 ? 0.9f : is_first(i) ? 0.5f : 0.52f;
    }
    memcpy(before, plane, TEXELS * sizeof *plane);
    const vsh_lightmap map = {.ao = plane};
    const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 0, E);
    assert_true(report.crowded > 10 && report.places > 10);
    assert_true(report.after < 0.02 * report.before);
    for (size_t i = 0; i < TEXELS; ++i) {
        assert_true(before[i] != 0.9f || plane[i] == before[i]);
    }
    free(before);
    free(plane);
    free(m);
}

/* Zero area in the world and in the lightmap, one triangle again and again, corners in one place, UVs far
 * outside. */
static void degenerate_edges_change_nothing(void **state) {
    (void)state;
    charts_mesh *m = two_squares(90.0, 1.0);
    float *plane[2] = {new_plane(0.5f), new_plane(0.5f)};
    for (size_t round = 0; round < 2; ++round) {
        for (size_t i = 0; i < TEXELS; ++i) {
            plane[round][i] = is_first(i) ? 0.5f : 0.52f;
        }
        const vsh_lightmap map = {.ao = plane[round]};
        const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 0, E);
        assert_int_equal(report.seams, 1);
        add_quad(m, (const double[][3]){{1, 0, 0}, {1, 0.5, 0}, {1, 1, 0}, {1, 0.2, 0}}, /* a line */
                 (const double[][2]){{2, 60}, {9, 60}, {9, 55}, {2, 55}});
        add_quad(
            m, (const double[][3]){{1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}}, /* no area in the lightmap */
            (const double[][2]){{2, 60}, {9, 60}, {12, 60}, {3, 60}});
        add_quad(m, (const double[][3]){{1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}}, /* a point */
                 (const double[][2]){{2, 60}, {9, 60}, {9, 55}, {2, 55}});
        add_quad(m,
                 (const double[][3]){{1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}}, /* outside of the image */
                 (const double[][2]){{-13, 60}, {-2, 60}, {-2, 50}, {-13, 50}});
        add_quad(m, (const double[][3]){{1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}}, /* and far outside */
                 (const double[][2]){{-2e9, 60}, {9, 6e12}, {9, 55}, {2, -55}});
    }
    assert_memory_equal(plane[0], plane[1], TEXELS * sizeof **plane);
    for (int again = 0; again < 60; ++again) { /* an edge of 120 triangles, in as many charts */
        add_square(m, 1.0, (const double[]){SECOND[0] + 0.01 * again, SECOND[1]}, 14.0, 90.0, 1.0);
    }
    const vsh_lightmap map = {.ao = plane[0]};
    const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 0, E);
    assert_true(report.seams > 60 && report.seams < 4000);
    free(plane[1]);
    free(plane[0]);
    free(m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_columns_meet_where_the_closed_form_says),
        cmocka_unit_test(what_is_guessed_gives_way_to_what_was_baked),
        cmocka_unit_test(borders_at_the_edge_of_the_image_read_the_edge),
        cmocka_unit_test(a_cylinder_with_a_ramp_around_it_has_no_jump_at_its_seam),
        cmocka_unit_test(charts_that_are_turned_or_mirrored_agree_along_their_border),
        cmocka_unit_test(the_less_moving_costs_the_less_is_left),
        cmocka_unit_test(charts_of_equal_values_stay_to_the_bit),
        cmocka_unit_test(no_value_moves_by_more_than_the_limit_or_out_of_its_range),
        cmocka_unit_test(without_coverage_charts_tell_what_is_a_guess),
        cmocka_unit_test(creases_are_left_and_smooth_normals_make_none),
        cmocka_unit_test(meshes_meet_in_the_world),
        cmocka_unit_test(a_chart_nearby_is_neither_read_nor_moved),
        cmocka_unit_test(degenerate_edges_change_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
