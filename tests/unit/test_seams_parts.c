/* Borders whose edges meet parts of others (T-junctions), and borders between lightmaps. */
#include "seams.h"

static const double E = 0.02;

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

static const double WHOLE[2] = {0, 40}, HALVES[3] = {0, 20, 40}, THIRDS[4] = {0, 13, 27, 40},
                    PART[2] = {10, 30}, MANY[9] = {0, 3, 8, 10, 17, 20, 29, 31.5, 40};

/* What a border's two sides are cut at, and how many seams they have in common, over how much of it. */
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
static void parts_of_edges_meet_as_whole_ones_do(void **state) {
    (void)state;
    for (size_t i = 0; i < 3 * sizeof cases / sizeof cases[0]; ++i) {
        const size_t c = i / 3;
        charts_mesh *m = new_mesh();
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
        float *plane = new_plane(0.5f);
        for (size_t t = 0; t < TEXELS; ++t) {
            plane[t] = t % SIDE < 15 ? 0.5f : 0.53f;
        }
        const vsh_lightmap map = {.ao = plane};
        const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 0, E);
        if (report.seams != cases[c].seams) {
            fail_msg("case %zu: %d seams, expected %d", i, (int)report.seams, (int)cases[c].seams);
        }
        const double move = 2.0 * 0.03 / (4.0 + 0.01);
        for (int row = 12; row < 48; ++row) { /* y = 50 - row - 0.5 in the world */
            const int inside = 49.5 - row > cases[c].begin + 2 && 49.5 - row < cases[c].end - 2;
            const int outside = 49.5 - row < cases[c].begin - 2 || 49.5 - row > cases[c].end + 2;
            const double left = (double)plane[row * SIDE + 10], right = (double)plane[row * SIDE + 20];
            if ((inside && (fabs(left - 0.5 - move) > 2e-4 || fabs(right - 0.53 + move) > 2e-4)) ||
                (outside && (left != (double)0.5f || right != (double)0.53f))) {
                fail_msg("case %zu, row %d: %g and %g", i, row, left, right);
            }
        }
        free(plane);
        free(m);
    }
}

static void an_end_beside_an_edge_or_over_a_crease_cuts_nothing(void **state) {
    (void)state;
    for (int kind = 0; kind < 3; ++kind) {
        charts_mesh *m = new_mesh();
        add_strip(m, 0, WHOLE, 2, 10.5);
        add_strip(m, 1, HALVES, 3, 20.5);
        for (size_t v = 4; v < m->mesh.vertex_count; ++v) {
            float *p = m->positions + 3 * v;
            p[0] += kind == 1 && p[1] == 20 ? 0.001F : 0.0F; /* in the plane */
            p[2] += kind == 2 ? 0.2F * (p[0] - 1.0F) : 0.0F; /* 11 degrees */
        }
        float *plane = new_plane(0.5f);
        const vsh_lightmap map = {.ao = plane};
        const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 0, E);
        assert_int_equal(report.seams, kind == 0 ? 2 : 0);
        free(plane);
        free(m);
    }
}

/* A T within one chart is none of its borders: what is on both sides is the same. */
static void a_junction_within_a_chart_is_no_seam(void **state) {
    (void)state;
    charts_mesh *m = new_mesh();
    add_strip(m, 0, WHOLE, 2, 15.5);
    add_strip(m, 1, HALVES, 3, 15.5);
    float *plane = new_plane(0.5f), *before = new_plane(0.5f);
    uint32_t seed = 3;
    for (size_t t = 0; t < TEXELS; ++t) {
        plane[t] = before[t] = random_value(&seed);
    }
    const vsh_lightmap map = {.ao = plane};
    const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 0, E);
    assert_int_equal(report.seams, 0);
    assert_memory_equal(plane, before, TEXELS * sizeof *plane);
    free(before);
    free(plane);
    free(m);
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

static void borders_between_lightmaps_agree(void **state) {
    (void)state;
    two_pages p;
    for (int cut = 0; cut < 2; ++cut) {
        make_pages(&p, cut ? THIRDS : WHOLE, cut ? 4 : 2);
        vsh_stitch_report report;
        assert_int_equal(vsh_lightmap_stitch(p.charts[0], &p.maps[0], 0, NULL, NULL, &report, NULL), VSH_OK);
        assert_int_equal(report.seams, 0);
        assert_int_equal(vsh_lightmaps_stitch(p.pages, 2, 0, NULL, NULL, &report, NULL), VSH_OK);
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
        free_pages(&p);
    }
}

/* A page that meets none of the others. */
static void one_of_several_changes_as_it_does_alone(void **state) {
    (void)state;
    static const double away[12] = {1, 0, 0, 100, 0, 1, 0, 0, 0, 0, 1, 0};
    charts_mesh *m = two_squares(37.0, 1.0);
    m->mesh.transform = away;
    vsh_charts *charts = charts_of(&m->mesh, 1);
    float *alone = new_plane(0.5f), *among = new_plane(0.5f);
    for (int32_t threads = 0; threads <= 4; ++threads) {
        two_pages p;
        make_pages(&p, WHOLE, 2);
        uint32_t seed = 9;
        for (size_t t = 0; t < TEXELS; ++t) {
            *(threads == 0 ? &alone[t] : &among[t]) = random_value(&seed);
        }
        const vsh_lightmap map = {.ao = threads == 0 ? alone : among};
        const vsh_stitch_page pages[3] = {p.pages[0], {charts, &map}, p.pages[1]};
        vsh_run run = vsh_run_default();
        run.threads = threads;
        assert_int_equal(threads == 0 ? vsh_lightmap_stitch(charts, &map, 0, NULL, NULL, NULL, NULL)
                                      : vsh_lightmaps_stitch(pages, 3, 0, NULL, &run, NULL, NULL),
                         VSH_OK);
        assert_true(threads == 0 || memcmp(alone, among, TEXELS * sizeof *alone) == 0);
        free_pages(&p);
    }
    free(among);
    free(alone);
    vsh_charts_free(charts);
    free(m);
}

static void pages_of_other_planes_are_refused(void **state) {
    (void)state;
    two_pages p;
    make_pages(&p, WHOLE, 2);
    vsh_error error = {0};
    const vsh_lightmap none = {.coverage = p.ao[0]};
    const vsh_stitch_page bad[3][2] = {{p.pages[0], {p.charts[1], &none}},
                                       {p.pages[0], {NULL, &p.maps[1]}},
                                       {{p.charts[0], NULL}, p.pages[1]}};
    for (int i = 0; i < 3; ++i) {
        assert_int_equal(vsh_lightmaps_stitch(bad[i], 2, 0, NULL, NULL, NULL, &error), VSH_ERROR_ARGUMENT);
    }
    assert_int_equal(vsh_lightmaps_stitch(NULL, 2, 0, NULL, NULL, NULL, &error), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_lightmaps_stitch(NULL, 0, 0, NULL, NULL, NULL, &error), VSH_OK);
    free_pages(&p);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(parts_of_edges_meet_as_whole_ones_do),
        cmocka_unit_test(an_end_beside_an_edge_or_over_a_crease_cuts_nothing),
        cmocka_unit_test(a_junction_within_a_chart_is_no_seam),
        cmocka_unit_test(borders_between_lightmaps_agree),
        cmocka_unit_test(one_of_several_changes_as_it_does_alone),
        cmocka_unit_test(pages_of_other_planes_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
