/* Cameras: which are refused, which box they frame, how they turn. */
#include "pictures.h"

static void cameras_that_see_nothing_are_refused(void **state) {
    (void)state;
    vsh_error error;
    vsh_camera camera = camera_at(1.0, 2.0, 3.0, 1.0, 2.0, 3.0, 30.0);
    assert_int_equal(vsh_camera_check(&camera, &error), VSH_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "position and target"));
    camera = camera_at(0.0, 5.0, 0.0, 0.0, 0.0, 0.0, 30.0);
    assert_int_equal(vsh_camera_check(&camera, &error), VSH_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "up"));
    camera = camera_at(0.0, NAN, 0.0, 0.0, 0.0, 0.0, 30.0);
    assert_int_equal(vsh_camera_check(&camera, &error), VSH_ERROR_ARGUMENT);
    camera = camera_at(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0);
    assert_int_equal(vsh_camera_check(&camera, &error), VSH_ERROR_ARGUMENT);
    camera = vsh_camera_default();
    assert_int_equal(vsh_camera_check(&camera, &error), VSH_OK);
    camera.struct_size = 4;
    assert_int_equal(vsh_camera_check(&camera, &error), VSH_ERROR_ARGUMENT);
}

static void a_framed_box_fills_the_picture(void **state) {
    (void)state;
    const double low[3] = {-3.0, 0.0, 1.0}, high[3] = {2.0, 1.0, 4.0};
    const double ups[3][3] = {{0.0, 1.0, 0.0}, {0.0, 0.0, 2.0}, {0.3, 0.5, -0.2}};
    for (int u = 0; u < 3; ++u) {
        for (double azimuth = 0.0; azimuth < 6.0; azimuth += 0.7) {
            vsh_camera camera = vsh_camera_default();
            vsh_error error;
            memcpy(camera.up, ups[u], sizeof camera.up);
            assert_int_equal(vsh_camera_frame(&camera, low, high, azimuth, 0.4, (double)WIDE / HIGH, &error),
                             VSH_OK);
            assert_int_equal(vsh_camera_check(&camera, &error), VSH_OK);
            const pinhole p = pinhole_of(&camera);
            double most = 0.0;
            for (int corner = 0; corner < 8; ++corner) {
                double to[3];
                for (int i = 0; i < 3; ++i) {
                    to[i] = (corner >> i & 1 ? high[i] : low[i]) - p.eye[i];
                }
                const double away = dot(to, p.forward);
                most = fmax(most, fabs(dot(to, p.right)) / (away * p.pixel * 0.5 * WIDE));
                most = fmax(most, fabs(dot(to, p.up)) / (away * p.pixel * 0.5 * HIGH));
                assert_true(away > 0.0);
            }
            assert_true(most < 1.0 && most > 0.9);
        }
    }
}

static void an_orbit_turns_around_the_target(void **state) {
    (void)state;
    vsh_camera camera = camera_at(1.0, 2.0, 7.0, 1.0, 1.0, 3.0, 30.0);
    vsh_camera_orbit(&camera, 0.5 * PI);
    const double expected[3] = {5.0, 2.0, 3.0};
    for (int i = 0; i < 3; ++i) {
        assert_true(fabs(camera.position[i] - expected[i]) < 1e-12);
    }
    for (int i = 0; i < 5; ++i) {
        vsh_camera_orbit(&camera, 0.3 * PI);
    }
    assert_true(fabs(camera.position[2] - 7.0) < 1e-12 && fabs(camera.position[0] - 1.0) < 1e-12);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cameras_that_see_nothing_are_refused),
        cmocka_unit_test(a_framed_box_fills_the_picture),
        cmocka_unit_test(an_orbit_turns_around_the_target),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
