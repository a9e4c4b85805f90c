/* Cameras: which are refused, which box they frame, how they turn. */
#include "pictures.h"
#include "testing.h"

TEST(cameras_that_see_nothing_are_refused) {
    vsh_camera camera = camera_at(1.0, 2.0, 3.0, 1.0, 2.0, 3.0, 30.0);
    assert_fails(vsh_camera_check(&camera, &failure), VSH_ERROR_ARGUMENT, "position and target");
    camera = camera_at(0.0, 5.0, 0.0, 0.0, 0.0, 0.0, 30.0);
    assert_fails(vsh_camera_check(&camera, &failure), VSH_ERROR_ARGUMENT, "up");
    camera = camera_at(0.0, NAN, 0.0, 0.0, 0.0, 0.0, 30.0);
    assert_int_equal(vsh_camera_check(&camera, &failure), VSH_ERROR_ARGUMENT);
    camera = camera_at(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0);
    assert_int_equal(vsh_camera_check(&camera, &failure), VSH_ERROR_ARGUMENT);
    camera = vsh_camera_default();
    assert_ok(vsh_camera_check(&camera, &failure));
    camera.struct_size = 4;
    assert_int_equal(vsh_camera_check(&camera, &failure), VSH_ERROR_ARGUMENT);
}

TEST(a_framed_box_fills_the_picture) {
    const double low[3] = {-3.0, 0.0, 1.0}, high[3] = {2.0, 1.0, 4.0};
    const double ups[3][3] = {{0.0, 1.0, 0.0}, {0.0, 0.0, 2.0}, {0.3, 0.5, -0.2}};
    for (int u = 0; u < 3; ++u) {
        for (double azimuth = 0.0; azimuth < 6.0; azimuth += 0.7) {
            vsh_camera camera = vsh_camera_default();
            memcpy(camera.up, ups[u], sizeof camera.up);
            assert_ok(vsh_camera_frame(&camera, low, high, azimuth, 0.4, (double)WIDE / HIGH, &failure));
            assert_ok(vsh_camera_check(&camera, &failure));
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

/* Points in a ball: the nearest place from which all are seen, one at an edge of each pair at least. */
TEST(framed_points_fill_the_picture) {
    enum { COUNT = 50 };
    double points[COUNT][3];
    for (int i = 0; i < COUNT; ++i) {
        points[i][0] = 5.0 + 3.0 * sin(12.9898 * i + 1.0);
        points[i][1] = 0.7 * sin(78.233 * i + 2.0);
        points[i][2] = -2.0 + sin(37.719 * i + 3.0);
    }
    for (double azimuth = 0.0; azimuth < 6.0; azimuth += 0.7) {
        vsh_camera camera = vsh_camera_default();
        assert_ok(vsh_camera_frame_points(&camera, COUNT, &points[0][0], azimuth, 0.4, (double)WIDE / HIGH,
                                          &failure));
        assert_ok(vsh_camera_check(&camera, &failure));
        const pinhole p = pinhole_of(&camera);
        double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
        for (int i = 0; i < COUNT; ++i) {
            const double to[3] = {points[i][0] - p.eye[0], points[i][1] - p.eye[1], points[i][2] - p.eye[2]};
            const double away = dot(to, p.forward);
            const double at[2] = {dot(to, p.right) / (away * p.pixel * 0.5 * WIDE),
                                  dot(to, p.up) / (away * p.pixel * 0.5 * HIGH)};
            assert_true(away > 0.0);
            for (int axis = 0; axis < 2; ++axis) {
                low[axis] = fmin(low[axis], at[axis]);
                high[axis] = fmax(high[axis], at[axis]);
            }
        }
        const double wide = 0.5 * (high[0] - low[0]), tall = 0.5 * (high[1] - low[1]);
        assert_true(fmax(wide, tall) > 0.8 && fmax(wide, tall) < 0.9);
        const int larger = wide > tall ? 0 : 1;
        assert_true(fabs(high[larger] + low[larger]) < 1e-9); /* in the middle */
    }
}

TEST(points_that_cannot_be_framed_are_refused) {
    vsh_camera camera = vsh_camera_default();
    const double same[6] = {1.0, 2.0, 3.0, 1.0, 2.0, 3.0}, bad[6] = {0.0, 0.0, 0.0, NAN, 1.0, 1.0};
    assert_int_equal(vsh_camera_frame_points(&camera, 2, same, 0.0, 0.0, 1.0, &failure), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_camera_frame_points(&camera, 2, bad, 0.0, 0.0, 1.0, &failure), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_camera_frame_points(&camera, 0, bad, 0.0, 0.0, 1.0, &failure), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_camera_frame_points(&camera, 2, NULL, 0.0, 0.0, 1.0, &failure), VSH_ERROR_ARGUMENT);
}

TEST(an_orbit_turns_around_the_target) {
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
    return run_all_tests(NULL, NULL);
}
