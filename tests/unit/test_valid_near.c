/* Which texels of a lightmap are valid where it is close: narrow gaps, and what is seen past an open end. */
#include "validity.h"

/* Two boxes, the upper one a millionth and a half of the scene's size over the lower: more than the roundings
 * of floats, less than rays are lifted by. */
static void a_gap_that_is_narrower_than_the_lift_of_rays_is_no_solid(void **state) {
    (void)state;
    static const double GAPS[2] = {6e-6, 0.0};
    for (int k = 0; k < 2; ++k) {
        shape *s = calloc(1, sizeof *s);
        add_box(s, (box){{-2.0, -1.0, -2.0}, {2.0, 0.0, 2.0}});
        add_box(s, (box){{-1.0, GAPS[k], -1.0}, {1.0, 1.0, 1.0}});
        const vsh_mesh mesh = mesh_of(s);
        baked b = bake(&mesh, 32, 0, 1.0);
        size_t between = 0, valid = 0;
        for (size_t i = 0; i < b.samples.count; ++i) {
            const double *p = b.samples.positions + 3 * i;
            if (fabs(p[1]) < 1e-5 && fabs(p[0]) < 0.99 && fabs(p[2]) < 0.99) {
                ++between;
                valid += is_valid(&b, i);
            }
        }
        assert_true(between > 1000);
        assert_int_equal(valid, k == 0 ? between : 0);
        free_baked(&b);
        free(s);
    }
}

/* A quarter of a bent pipe, open at both ends, whose faces look inwards; one end a little over a floor. Some
 * rays from beside it go into it, most do not. */
static void a_floor_beside_the_mouth_of_an_inward_pipe_is_valid(void **state) {
    (void)state;
    enum { AROUND = 24, ALONG = 16, TOP = 3 };
    static const double PI = 3.14159265358979323846, BEND = 0.6, RADIUS = 0.15;
    shape *s = calloc(1, sizeof *s);
    add_box(s, (box){{-0.4, -0.1, -1.0}, {0.4, 0.0, 0.4}});
    for (int k = 0; k < AROUND * ALONG; ++k) {
        double corners[4][3];
        for (int c = 0; c < 4; ++c) {
            const double a = 0.5 * PI * (k / AROUND + (c >= 2)) / ALONG;
            const double b = 2.0 * PI * ((k + (c == 1 || c == 2)) % AROUND) / AROUND;
            const double r = BEND + RADIUS * cos(b);
            corners[c][0] = RADIUS * sin(b);
            corners[c][1] = 0.02 + r * sin(a);
            corners[c][2] = -r * cos(a);
        }
        add_quad(s, (const double(*)[3])corners);
    }
    const vsh_mesh mesh = mesh_of(s);
    for (size_t k = 0; k < 4 * s->quads; ++k) { /* the floor's top has most of the lightmap */
        s->uvs[2 * k + 1] = 0.9f + 0.1f * s->uvs[2 * k + 1];
    }
    const float top[8] = {0.0f, 0.0f, 1.0f, 0.0f, 1.0f, 0.9f, 0.0f, 0.9f};
    memcpy(s->uvs + 8 * TOP, top, sizeof top);
    baked b = bake(&mesh, 32, 0, 1.0);
    size_t beside = 0, wrong = 0;
    for (size_t i = 0; i < b.samples.count; ++i) {
        const double *p = b.samples.positions + 3 * i;
        if (p[1] == 0.0 && hypot(p[0], p[2] + BEND) > RADIUS) {
            ++beside;
            wrong += !is_valid(&b, i);
        }
    }
    assert_true(beside > 10000);
    assert_int_equal(wrong, 0);
    free_baked(&b);
    free(s);
}

int main(void) {
    if (!vsh_triangles_available()) {
        return 0;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_gap_that_is_narrower_than_the_lift_of_rays_is_no_solid),
        cmocka_unit_test(a_floor_beside_the_mouth_of_an_inward_pipe_is_valid),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
