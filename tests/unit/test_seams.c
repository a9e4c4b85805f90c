/* vsh_lightmap_stitch(): values on both sides of charts' borders agree, and nothing else moves. */
#include "seams.h"

static const double E = 0.02;
static const double UNSEEN = 0.5 / 255.0; /* half a step of what is shown */

static float *new_plane(float value) {
    float *plane = malloc(TEXELS * sizeof *plane);
    for (size_t i = 0; i < TEXELS; ++i) {
        plane[i] = value;
    }
    return plane;
}

static float random_value(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) * 0x1p-24f;
}

/* Both borders pass through centres of texels, so that a column of each side is read: (a, b) go to the
 * minimum of (d + a - b)² 2 + keep (a² + b²), as two places fall to a texel. */
static void two_columns_meet_where_the_closed_form_says(void **state) {
    (void)state;
    charts_mesh *m = new_mesh();
    const double corner[2][4][3] = {{{0, 0, 0}, {1, 0, 0}, {1, 40, 0}, {0, 40, 0}},
                                    {{1, 0, 0}, {2, 0, 0}, {2, 40, 0}, {1, 40, 0}}};
    add_quad(m, corner[0], (const double[][2]){{6, 50}, {10.5, 50}, {10.5, 10}, {6, 10}});
    add_quad(m, corner[1], (const double[][2]){{20.5, 50}, {25, 50}, {25, 10}, {20.5, 10}});
    float *plane = new_plane(0.5f);
    for (size_t i = 0; i < TEXELS; ++i) {
        plane[i] = i % SIDE < 15 ? 0.5f : 0.53f;
    }
    const vsh_lightmap map = {.ao = plane};
    const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 0, E);
    assert_int_equal(report.seams, 1);
    assert_int_equal(report.places, 81);
    assert_int_equal(report.crowded, 0);
    const double keep = 0.01, move = 2.0 * 0.03 / (4.0 + keep);
    for (size_t row = 20; row < 40; ++row) {
        assert_true(fabs((double)plane[row * SIDE + 10] - 0.5 - move) < 1e-4);
        assert_true(fabs((double)plane[row * SIDE + 20] - 0.53 + move) < 1e-4);
        assert_true(plane[row * SIDE + 9] == 0.5f && plane[row * SIDE + 21] == 0.53f);
    }
    assert_true(fabs(report.before - 0.03) < 1e-6 && report.after < 0.0004);
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
        size_t moved = 0, at_limit = 0, guesses_beyond = 0;
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
            }
        }
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

/* The same square as two meshes of which one has a transform: ends are compared in the world. */
static void meshes_meet_in_the_world(void **state) {
    (void)state;
    charts_mesh *a = new_mesh(), *b = new_mesh();
    add_square(a, 0.0, (const double[]){4.3, 25.6}, 18.0, 0.0, 1.0);
    add_square(b, 0.0, SECOND, 14.0, 37.0, 1.0);
    const double beside[12] = {1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0};
    const double farther[12] = {1, 0, 0, 1.001, 0, 1, 0, 0, 0, 0, 1, 0};
    vsh_mesh meshes[2] = {a->mesh, b->mesh};
    float *plane = new_plane(0.5f);
    for (size_t i = 0; i < TEXELS; ++i) {
        plane[i] = is_first(i) ? 0.5f : 0.52f;
    }
    const vsh_lightmap map = {.ao = plane};
    meshes[1].transform = farther;
    const vsh_stitch_report apart = stitch(meshes, 2, &map, 0, E);
    assert_int_equal(apart.seams, 0);
    meshes[1].transform = beside;
    const vsh_stitch_report joined = stitch(meshes, 2, &map, 0, E);
    assert_int_equal(joined.seams, 1);
    assert_true(joined.after < 0.01 * joined.before);
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
            m, (const double[][3]){{1, 0, 0}, {1, 1, 0}, {2, 1, 0}, {2, 0, 0}}, /* no area in the lightmap */
            (const double[][2]){{2, 60}, {9, 60}, {12, 60}, {3, 60}});
        add_quad(m, (const double[][3]){{1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}}, /* a point */
                 (const double[][2]){{2, 60}, {9, 60}, {9, 55}, {2, 55}});
        add_quad(m,
                 (const double[][3]){{1, 0, 0}, {2, 0, 1}, {2, 1, 1}, {1, 1, 0}}, /* outside of the image */
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

static void what_is_no_value_of_light_is_left(void **state) {
    (void)state;
    charts_mesh *m = two_squares(37.0, 1.0);
    float *ao = new_plane(0.5f), *bent = malloc(3 * TEXELS * sizeof *bent), *error = new_plane(0.0f);
    float *invalid = new_plane(0.0f), *coverage = new_plane(1.0f), *shadow = new_plane(0.0f),
          *tint = malloc(3 * TEXELS * sizeof *tint);
    float *copy = malloc(3 * TEXELS * sizeof *copy);
    uint32_t seed = 3;
    for (size_t i = 0; i < TEXELS; ++i) {
        error[i] = shadow[i] = random_value(&seed);
        invalid[i] = error[i] < 0.5f ? 0.0f : 1.0f;
        ao[i] = is_first(i) ? 0.5f : NAN; /* of which nothing is known */
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
    const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 2, E);
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
    free(copy);
    free(tint);
    free(shadow);
    free(coverage);
    free(invalid);
    free(error);
    free(bent);
    free(ao);
    free(m);
}

/* --- as every call */

static vsh_result stitch_noise(const charts_mesh *m, const vsh_run *run, float *ao, float *light,
                               vsh_error *error) {
    uint32_t seed = 11;
    for (size_t i = 0; i < TEXELS; ++i) {
        ao[i] = random_value(&seed);
        for (size_t c = 0; c < 3; ++c) {
            light[3 * i + c] = random_value(&seed);
        }
    }
    vsh_charts *charts = charts_of(&m->mesh, 1);
    const vsh_lightmap map = {.ao = ao, .irradiance = light};
    const vsh_result result = vsh_lightmap_stitch(charts, &map, 0, NULL, run, NULL, error);
    vsh_charts_free(charts);
    return result;
}

static void any_number_of_threads_gives_the_same_bits(void **state) {
    (void)state;
    charts_mesh *m = two_squares(37.0, 1.0);
    float *ao[2] = {new_plane(0.0f), new_plane(0.0f)}, *light[2];
    for (int32_t threads = 1; threads <= 8; ++threads) {
        const int own = threads > 1;
        vsh_run run = vsh_run_default();
        run.threads = threads;
        light[own] = threads <= 2 ? malloc(3 * TEXELS * sizeof **light) : light[own];
        assert_int_equal(stitch_noise(m, &run, ao[own], light[own], NULL), VSH_OK);
        assert_memory_equal(ao[own], ao[0], TEXELS * sizeof **ao);
        assert_memory_equal(light[own], light[0], 3 * TEXELS * sizeof **light);
    }
    for (int i = 0; i < 2; ++i) {
        free(light[i]);
        free(ao[i]);
    }
    free(m);
}

static void the_memory_limit_is_held_before_anything_moves(void **state) {
    (void)state;
    charts_mesh *m = two_squares(37.0, 1.0);
    float *ao = new_plane(0.0f), *light = malloc(3 * TEXELS * sizeof *light), *before = new_plane(0.0f);
    float *other = malloc(3 * TEXELS * sizeof *other);
    vsh_error error = {0};
    vsh_run run = vsh_run_default();
    uint64_t refused = 0, most = 0;
    for (run.memory_limit = 64; most == 0; run.memory_limit *= 2) {
        const vsh_result result = stitch_noise(m, &run, ao, light, &error);
        most = result == VSH_OK ? run.memory_limit : 0;
        assert_true(result == VSH_OK || result == VSH_ERROR_LIMIT);
        refused += result == VSH_ERROR_LIMIT;
        uint32_t seed = 11;
        for (size_t i = 0; result != VSH_OK && i < TEXELS; ++i) {
            assert_true(ao[i] == random_value(&seed));
            for (size_t c = 0; c < 3; ++c) {
                assert_true(light[3 * i + c] == random_value(&seed));
            }
        }
    }
    assert_true(refused > 4 && most < 1000000); /* charts, marks, unknowns, vectors: each is looked at */
    assert_non_null(strstr(error.message, "seams"));
    run.memory_limit = most;
    run.memory_held = most;
    assert_int_equal(stitch_noise(m, &run, before, other, &error), VSH_ERROR_LIMIT);
    free(other);
    free(before);
    free(light);
    free(ao);
    free(m);
}

typedef struct stopping {
    double at;
    double last;
    int calls;
} stopping;

static int stop_at(void *user, const char *stage, double fraction) {
    stopping *s = user;
    assert_string_equal(stage, "seams");
    assert_true(fraction >= s->last && fraction <= 1.0);
    s->last = fraction;
    ++s->calls;
    return fraction >= s->at;
}

static void it_is_cancelled_wherever_it_is_and_tells_how_far_it_is(void **state) {
    (void)state;
    charts_mesh *m = two_squares(37.0, 1.0);
    float *ao = new_plane(0.0f), *light = malloc(3 * TEXELS * sizeof *light);
    const double at[] = {0.0, 0.2, 0.5, 2.0};
    for (size_t i = 0; i < sizeof at / sizeof at[0]; ++i) {
        stopping s = {at[i], 0.0, 0};
        vsh_error error = {0};
        vsh_run run = vsh_run_default();
        run.threads = 1;
        run.progress = stop_at;
        run.user = &s;
        const vsh_result result = stitch_noise(m, &run, ao, light, &error);
        assert_int_equal(result, at[i] > 1.0 ? VSH_OK : VSH_ERROR_CANCELLED);
        assert_true(s.calls > 0 && (at[i] < 1.0 || s.last == 1.0));
    }
    free(light);
    free(ao);
    free(m);
}

static void options_out_of_range_are_refused(void **state) {
    (void)state;
    charts_mesh *m = two_squares(0.0, 1.0);
    vsh_charts *charts = charts_of(&m->mesh, 1);
    float *ao = new_plane(0.5f);
    const vsh_lightmap map = {.ao = ao};
    for (int i = 0; i < 8; ++i) {
        vsh_stitch_options options = vsh_stitch_options_default();
        double *const members[] = {&options.max_change, &options.max_angle, &options.keep,
                                   &options.max_change};
        const double values[] = {-1e-9, -1.0, 0.0, 1.001, NAN, 181.0, 1.5, INFINITY};
        vsh_error error = {0};
        *members[i % 4] = values[i];
        assert_int_equal(vsh_lightmap_stitch(charts, &map, 0, &options, NULL, NULL, &error),
                         VSH_ERROR_ARGUMENT);
        assert_non_null(strstr(error.message, "vsh_stitch_options."));
    }
    free(ao);
    vsh_charts_free(charts);
    free(m);
}

static void names_of_what_is_done_go_both_ways(void **state) {
    (void)state;
    assert_int_equal(vsh_seams("fix"), VSH_SEAMS_FIX);
    assert_int_equal(vsh_seams("keep"), VSH_SEAMS_KEEP);
    assert_int_equal(vsh_seams("no"), -1);
    assert_int_equal(vsh_seams(NULL), -1);
    assert_string_equal(vsh_seams_name(VSH_SEAMS_FIX), "fix");
    assert_null(vsh_seams_name(2));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_columns_meet_where_the_closed_form_says),
        cmocka_unit_test(a_cylinder_with_a_ramp_around_it_has_no_jump_at_its_seam),
        cmocka_unit_test(charts_that_are_turned_or_mirrored_agree_along_their_border),
        cmocka_unit_test(the_less_moving_costs_the_less_is_left),
        cmocka_unit_test(charts_of_equal_values_stay_to_the_bit),
        cmocka_unit_test(no_value_moves_by_more_than_the_limit_or_out_of_its_range),
        cmocka_unit_test(creases_are_left_and_smooth_normals_make_none),
        cmocka_unit_test(meshes_meet_in_the_world),
        cmocka_unit_test(a_chart_nearby_is_neither_read_nor_moved),
        cmocka_unit_test(degenerate_edges_change_nothing),
        cmocka_unit_test(what_is_no_value_of_light_is_left),
        cmocka_unit_test(any_number_of_threads_gives_the_same_bits),
        cmocka_unit_test(the_memory_limit_is_held_before_anything_moves),
        cmocka_unit_test(it_is_cancelled_wherever_it_is_and_tells_how_far_it_is),
        cmocka_unit_test(options_out_of_range_are_refused),
        cmocka_unit_test(names_of_what_is_done_go_both_ways),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
