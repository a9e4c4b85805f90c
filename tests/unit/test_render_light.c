/* Fog and lightmaps in pictures, against closed forms; pictures of 8 bits. */
#include "pictures.h"
#include "testing.h"

/* --- fog */

/* The box around the sphere has a diagonal of 2 √3, and the fog a quarter of that around it. */
TEST(fog_in_the_sun_shines_and_in_shadow_does_not) {
    vsh_field *field = ball(0.0, 0.0, 0.0, 1.0, 0.02);
    const vsh_surface surface = {field, {0.0, 0.0, 0.0}};
    const double x[3] = {1.0, 0.0, 0.0};
    const vsh_light light = sun(x, 0.0);
    const double diagonal = 2.0 * sqrt(3.0), extinction = 1.0 / diagonal, around = 0.25 * diagonal;
    for (int side = 0; side < 2; ++side) {
        /* past the sphere at a corner of its box, all lit; then to the sphere, in its shadow from z = 1 on */
        const double sx = side == 0 ? 0.9 : -0.9, sy = side == 0 ? 0.9 : 0.0;
        vsh_render_options o = small(camera_at(sx, sy, 200.0, sx, sy, 0.0, 0.1), 2);
        o.shafts = 1.0;
        o.shaft_steps = 16;
        memset(o.sky, 0, sizeof o.sky);
        render(&surface, 1, field, &light, &o, NULL);
        const float *c = color + 3 * (HIGH / 2 * WIDE + WIDE / 2);
        const double left = exp(-extinction * (2.0 + 2.0 * around));
        const double expected =
            side == 0 ? o.background[0] * left + 1.0 - left : 1.0 - exp(-extinction * around);
        assert_true(fabs((double)c[0] - expected) < 0.015);
    }
    vsh_field_free(field);
}

/* --- lightmaps */

static const float quad_positions[] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
static const float quad_uvs[] = {0, 0, 1, 0, 1, 1, 0, 1};
static const uint32_t quad_indices[] = {0, 1, 2, 0, 2, 3};

static vsh_mesh quad(void) {
    return (vsh_mesh){.positions = quad_positions,
                      .uvs = quad_uvs,
                      .indices = quad_indices,
                      .vertex_count = 4,
                      .triangle_count = 2};
}

/* Texel centres at (i + ½) / N, row 0 at v = 1. */
TEST(a_lightmap_is_looked_up_where_it_was_baked) {
    enum { N = 4 };
    float ao[N * N], shadow[N * N];
    for (int i = 0; i < N * N; ++i) {
        ao[i] = (float)(0.1 + 0.2 * (i % N));
        shadow[i] = (float)(0.9 - 0.2 * (i / N)); /* light at the top */
    }
    const char *const names[] = {"ao", "shadow.sun"};
    const float *const planes[] = {ao, shadow};
    const vsh_image image = {N, N, 2, names, planes, NULL};
    const vsh_mesh mesh = quad();
    const vsh_lit_meshes lit = {&mesh, 1, &image, {0.5, 1.0, 0.25}, 0};
    const double z[3] = {0.0, 0.0, 1.0};
    const vsh_light light = sun(z, 0.1);
    vsh_field *field = ball(0.0, 0.0, -3.0, 0.5, 0.05); /* hidden behind it */
    const vsh_surface surface = {field, {1.0, 0.0, 0.0}};
    vsh_render_options o = small(camera_at(0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 20.0), 1);
    const double sky[3] = {1.0, 0.0, 2.0};
    memcpy(o.sky, sky, sizeof sky);
    o.lit = &lit;
    o.lit_count = 1;
    render(&surface, 1, field, &light, &o, NULL);
    const pinhole p = pinhole_of(&o.camera);
    int inside = 0;
    for (int i = 0; i < PIXELS; ++i) {
        double ray[3];
        ray_of(&p, i % WIDE, i / WIDE, ray);
        const double x = 5.0 * ray[0], y = 5.0 * ray[1];
        /* between the outermost texel centres both are linear, and no filter shows */
        if (fabs(x) < 0.65 && fabs(y) < 0.65) {
            const double open = 0.1 + 0.2 * (0.5 * (x + 1.0) * N - 0.5);
            const double seen = 0.9 - 0.2 * ((1.0 - 0.5 * (y + 1.0)) * N - 0.5);
            assert_true(fabs((double)depth[i] - 5.0) < 1e-5);
            assert_true(fabs((double)color[3 * i] - 0.5 * (seen + open)) < 1e-4);
            assert_true(fabs((double)color[3 * i + 1] - seen) < 1e-4);
            assert_true(fabs((double)color[3 * i + 2] - 0.25 * (seen + 2.0 * open)) < 1e-4);
            ++inside;
        } else if (fabs(x) < 0.95 && fabs(y) < 0.95) {
            assert_true(alpha[i] == 1.0f); /* no gap along the diagonal either */
        }
    }
    assert_true(inside > 300);
    const char *const others[] = {"ao", "shadow.moon"};
    const vsh_image missing = {N, N, 2, others, planes, NULL};
    vsh_lit_meshes wrong = {&mesh, 1, &missing, {0.5, 0.5, 0.5}, 0};
    o.lit = &wrong;
    assert_fails(vsh_render(&surface, 1, occluders_of(field), &light, 1, &o, NULL, &picture, NULL, &failure),
                 VSH_ERROR_INPUT, "shadow.sun");
    wrong.meshes = NULL;
    assert_fails(vsh_render(&surface, 1, occluders_of(field), &light, 1, &o, NULL, &picture, NULL, &failure),
                 VSH_ERROR_ARGUMENT, "");
    assert_string_equal(failure.message, "lit meshes 0: no lightmap, or no meshes");
    o.lit = NULL;
    assert_fails(vsh_render(&surface, 1, occluders_of(field), &light, 1, &o, NULL, &picture, NULL, &failure),
                 VSH_ERROR_ARGUMENT, "");
    assert_string_equal(failure.message, "lit is NULL with a lit_count of 1");
    vsh_field_free(field);
}

TEST(irradiance_comes_before_shadows) {
    const float red[1] = {0.2f}, green[1] = {0.4f}, blue[1] = {0.6f}, dark[1] = {0.0f};
    const char *const names[] = {"irradiance.B", "irradiance.G", "irradiance.R", "shadow.sun"};
    const float *const planes[] = {blue, green, red, dark};
    const vsh_image image = {1, 1, 4, names, planes, NULL};
    const vsh_mesh mesh = quad();
    const vsh_lit_meshes lit = {&mesh, 1, &image, {1.0, 1.0, 0.5}, 0};
    const vsh_light light = vsh_light_default();
    vsh_field *field = ball(0.0, 0.0, -3.0, 0.5, 0.05);
    vsh_render_options o = small(camera_at(0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 20.0), 1);
    memset(o.sky, 0, sizeof o.sky);
    o.lit = &lit;
    o.lit_count = 1;
    render(NULL, 0, field, &light, &o, NULL);
    const float *c = color + 3 * (HIGH / 2 * WIDE + WIDE / 2);
    assert_true(fabs((double)c[0] - 0.2) < 1e-5 && fabs((double)c[1] - 0.4) < 1e-5 &&
                fabs((double)c[2] - 0.3) < 1e-5);
    vsh_field_free(field);
}

TEST(gradients_are_dithered_to_srgb) {
    static float planes[4][PIXELS];
    float *const rgb[3] = {planes[0], planes[1], planes[2]};
    for (int i = 0; i < PIXELS; ++i) {
        color[3 * i] = 0.25f;
        color[3 * i + 1] = 0.0f;
        color[3 * i + 2] = 1.0f;
        alpha[i] = 0.5f;
    }
    assert_ok(vsh_picture_encode(&picture, WIDE, HIGH, 1.0, rgb, NULL, &failure));
    double mean = 0.0;
    for (int i = 0; i < PIXELS; ++i) {
        const double steps = 255.0 * (double)planes[0][i];
        assert_true(fabs(steps - round(steps)) < 1e-3 && fabs(steps - 187.516) < 1.0);
        assert_true(planes[1][i] == 0.0f && planes[2][i] == 1.0f);
        mean += steps / PIXELS;
    }
    assert_true(fabs(mean - 187.516) < 0.05); /* of 0.5: 0.735357 */
    assert_ok(vsh_picture_encode(&picture, WIDE, HIGH, 0.0, rgb, planes[3], &failure));
    assert_true(fabs(255.0 * (double)planes[0][7] - 187.516) < 1.0); /* 0.25 over half of a pixel */
    assert_true(fabs((double)planes[3][7] - 128.0 / 255.0) < 1e-6);
    assert_fails(vsh_picture_encode(&picture, WIDE, HIGH, NAN, rgb, NULL, &failure), VSH_ERROR_ARGUMENT, "");
}

int main(void) {
    return run_all_tests(NULL, NULL);
}
