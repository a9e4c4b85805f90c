/* What a tile may leave out: bounds on what boxes hide, held against rays that are really cast at them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/elementary.h"
#include "scene/tile_reach.h"

#include <vdbshade/settings.h>

#include <stdio.h>
#include <stdlib.h>

static uint64_t state_of_dice;

/* splitmix64 (Steele and others 2014). */
static double dice(double low, double high) {
    state_of_dice += UINT64_C(0x9e3779b97f4a7c15);
    uint64_t z = state_of_dice;
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    z ^= z >> 31;
    return low + (high - low) * (double)(z >> 11) * 0x1p-53;
}

static vshi_vec somewhere(double half) {
    const double x = dice(-half, half), y = dice(-half, half), z = dice(-half, half);
    return (vshi_vec){x, y, z};
}

static vshi_world_box box_at(vshi_vec middle, double half) {
    const double x = dice(0.0, half), y = dice(0.0, half), z = dice(0.0, half);
    return (vshi_world_box){{middle.x - x, middle.y - y, middle.z - z},
                            {middle.x + x, middle.y + y, middle.z + z}};
}

static vshi_vec within(const vshi_world_box *box) {
    const double x = dice(box->low[0], box->high[0]), y = dice(box->low[1], box->high[1]);
    return (vshi_vec){x, y, dice(box->low[2], box->high[2])};
}

/* Where a ray from `from` along `way` is in the box: *near ≤ t ≤ *far. */
static bool meets(const vshi_world_box *box, vshi_vec from, vshi_vec way, double end, double *near,
                  double *far) {
    const double o[3] = {from.x, from.y, from.z}, d[3] = {way.x, way.y, way.z};
    *near = 0.0;
    *far = end;
    for (int axis = 0; axis < 3; ++axis) {
        const double a = (box->low[axis] - o[axis]) / d[axis], b = (box->high[axis] - o[axis]) / d[axis];
        *near = fmax(*near, fmin(a, b));
        *far = fmin(*far, fmax(a, b));
    }
    return *near <= *far;
}

/* A point of the unit disc. */
static void disc(double *x, double *y) {
    do {
        *x = dice(-1.0, 1.0);
        *y = dice(-1.0, 1.0);
    } while (*x * *x + *y * *y > 1.0);
}

/* A sun that stands towards `where`, of an angle, or a sphere there, of a radius. */
static vsh_light light_of(int32_t type, vshi_vec where, double width) {
    vsh_light light = vsh_light_default();
    const bool is_sun = type == VSH_LIGHT_DIRECTIONAL;
    double *to = is_sun ? light.direction : light.position;
    light.type = type;
    to[0] = where.x;
    to[1] = where.y;
    to[2] = where.z;
    *(is_sun ? &light.angle : &light.radius) = width;
    return light;
}

/* A ray to somewhere on the light, as those that shading casts: evenly over its disc. */
static vshi_vec ray_to(const vshi_light_place *light, vshi_vec from, double *end) {
    double x, y;
    disc(&x, &y);
    vshi_light_view view;
    vshi_light_look(light, from, false, &view);
    vshi_vec u, v;
    vshi_frame(view.axis, &u, &v);
    const double tangent = vshi_light_tangent(light, &view);
    const vshi_vec off = vshi_add(vshi_scale(u, tangent * x), vshi_scale(v, tangent * y));
    *end = light->parallel ? 1e6 : view.distance;
    return vshi_unit(vshi_add(view.axis, off));
}

static vsh_scene scene_of(const vsh_light *light, double ao) {
    vsh_scene scene = vsh_scene_default();
    scene.lights = light;
    scene.light_count = light != NULL;
    scene.ao = ao > 0.0;
    scene.shade.ao_distance = ao > 0.0 ? ao : scene.shade.ao_distance;
    return scene;
}

static vsh_light any_light(void) {
    const bool is_sun = dice(0.0, 1.0) < 0.5;
    const vshi_vec where = is_sun ? vshi_unit(somewhere(1.0)) : somewhere(60.0);
    const double width = dice(0.0, 1.0) < 0.2 ? 0.0 : dice(0.0, is_sun ? 2.8 : 8.0);
    return light_of(is_sun ? VSH_LIGHT_DIRECTIONAL : VSH_LIGHT_SPHERE, where, width);
}

enum { SCENES = 400, POINTS = 12, RAYS = 400 };

static void what_a_light_s_rays_meet_is_never_more_than_its_share(void **state) {
    (void)state;
    state_of_dice = 1;
    int none = 0, some = 0, whole = 0;
    for (int k = 0; k < SCENES; ++k) {
        const vsh_light light = any_light();
        const vsh_scene scene = scene_of(&light, 0.0);
        vshi_reach reach;
        vsh_error error;
        assert_int_equal(vshi_reach_make(&scene, &reach, &error), VSH_OK);
        const vshi_world_box receiver = box_at(somewhere(10.0), 6.0);
        vshi_vec middle = somewhere(50.0);
        if (k % 2 == 0) { /* on its way, or near it */
            double end;
            const vshi_vec from = within(&receiver), way = ray_to(&reach.lights[0], from, &end);
            middle = vshi_add(vshi_add(from, vshi_scale(way, dice(0.0, fmin(end, 60.0)))), somewhere(8.0));
        }
        const vshi_world_box caster = box_at(middle, 5.0);
        const double share = vshi_reach_share(&reach, &receiver, &caster);
        none += share == 0.0;
        some += share > 0.0 && share < 1.0;
        whole += share >= 1.0;
        for (int p = 0; p < POINTS; ++p) {
            const vshi_vec from = within(&receiver);
            vshi_light_view view;
            int met = 0;
            if (vshi_light_look(&reach.lights[0], from, false, &view) != VSHI_LIGHT_SEEN) {
                continue;
            }
            for (int i = 0; i < RAYS; ++i) {
                double end, near, far;
                const vshi_vec way = ray_to(&reach.lights[0], from, &end);
                met += meets(&caster, from, way, end, &near, &far);
            }
            const double seen = (double)met / RAYS, off = sqrt(fmin(share, 1.0) / RAYS);
            if (share == 0.0 ? met > 0 : seen > share + 5.0 * off) {
                fail_msg("scene %d: %g of the rays met what may hide %g", k, seen, share);
            }
        }
        vshi_reach_free(&reach);
    }
    printf("%d boxes are out of reach, %d hide a part, %d may hide all\n", none, some, whole);
    assert_true(none > SCENES / 4);
    assert_true(some > SCENES / 20);
    assert_true(whole > SCENES / 40);
}

/* A cube that stands on its corner before a narrow sun covers 0.73 of the ball that is reckoned for it. */
static void a_share_is_near_to_what_a_cube_hides(void **state) {
    (void)state;
    state_of_dice = 4;
    const vshi_vec towards = vshi_unit((vshi_vec){1.0, 1.0, 1.0});
    const vsh_light light = light_of(VSH_LIGHT_DIRECTIONAL, towards, 0.2);
    const vsh_scene scene = scene_of(&light, 0.0);
    vshi_reach reach;
    vsh_error error;
    assert_int_equal(vshi_reach_make(&scene, &reach, &error), VSH_OK);
    const vshi_world_box receiver = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    const vshi_vec middle = vshi_scale(towards, 100.0);
    const vshi_world_box cube = {{middle.x - 4.0, middle.y - 4.0, middle.z - 4.0},
                                 {middle.x + 4.0, middle.y + 4.0, middle.z + 4.0}};
    const double share = vshi_reach_share(&reach, &receiver, &cube);
    enum { MANY = 20000 };
    int met = 0;
    for (int i = 0; i < MANY; ++i) {
        double end, near, far;
        const vshi_vec from = {0.0, 0.0, 0.0}, way = ray_to(&reach.lights[0], from, &end);
        met += meets(&cube, from, way, end, &near, &far);
    }
    const double seen = (double)met / MANY;
    printf("%.3f of the sun is hidden, %.3f at most\n", seen, share);
    assert_true(share > 0.3 && share < 0.8);
    assert_true(seen > 0.65 * share && seen <= share);
    vshi_reach_free(&reach);
}

static void what_ao_s_rays_meet_is_never_more_than_its_share(void **state) {
    (void)state;
    state_of_dice = 2;
    int none = 0, some = 0;
    for (int k = 0; k < SCENES; ++k) {
        const double distance = dice(1.0, 40.0);
        const vsh_scene scene = scene_of(NULL, distance);
        vshi_reach reach;
        vsh_error error;
        assert_int_equal(vshi_reach_make(&scene, &reach, &error), VSH_OK);
        const vshi_world_box receiver = box_at(somewhere(10.0), 3.0), caster = box_at(somewhere(30.0), 5.0);
        const double share = vshi_reach_share(&reach, &receiver, &caster);
        none += share == 0.0;
        some += share > 0.0 && share < 1.0;
        for (int p = 0; p < POINTS; ++p) {
            const vshi_vec from = within(&receiver), normal = vshi_unit(somewhere(1.0));
            vshi_vec u, v;
            vshi_frame(normal, &u, &v);
            int met = 0;
            for (int i = 0; i < RAYS; ++i) {
                double x, y, near, far;
                disc(&x, &y); /* evenly over it: by the cosine over the dome (Malley) */
                const vshi_vec flat = vshi_add(vshi_scale(u, x), vshi_scale(v, y));
                const vshi_vec way = vshi_add(flat, vshi_scale(normal, sqrt(fmax(0.0, 1.0 - x * x - y * y))));
                met += meets(&caster, from, way, distance, &near, &far);
            }
            const double seen = (double)met / RAYS, off = sqrt(fmin(share, 1.0) / RAYS);
            if (share == 0.0 ? met > 0 : seen > share + 5.0 * off) {
                fail_msg("scene %d: %g of the rays met what may hide %g", k, seen, share);
            }
        }
        vshi_reach_free(&reach);
    }
    printf("%d boxes are out of reach, %d hide a part\n", none, some);
    assert_true(none > SCENES / 8);
    assert_true(some > SCENES / 8);
}

static bool holds(const vshi_world_box *box, vshi_vec p) {
    const double at[3] = {p.x, p.y, p.z};
    for (int axis = 0; axis < 3; ++axis) {
        const double slack = 1e-6 * (fabs(at[axis]) + 1.0);
        if (at[axis] < box->low[axis] - slack || at[axis] > box->high[axis] + slack) {
            return false;
        }
    }
    return true;
}

static void a_region_holds_every_ray_as_far_as_the_world_goes(void **state) {
    (void)state;
    state_of_dice = 3;
    int inside = 0, smaller = 0;
    for (int k = 0; k < SCENES; ++k) {
        const vsh_light light = any_light();
        const vsh_scene scene = scene_of(&light, 0.0);
        vshi_reach reach;
        vsh_error error;
        assert_int_equal(vshi_reach_make(&scene, &reach, &error), VSH_OK);
        const vshi_world_box world = {{-40.0, -40.0, -40.0}, {40.0, 40.0, 40.0}};
        const vshi_world_box receiver = box_at(somewhere(30.0), 4.0);
        const vshi_world_box region = vshi_reach_region(&reach, &receiver, &world);
        for (int axis = 0; axis < 3; ++axis) {
            smaller += region.low[axis] > -40.0 && region.high[axis] < 40.0;
        }
        for (int i = 0; i < RAYS; ++i) {
            const vshi_vec from = within(&receiver);
            vshi_light_view view;
            double end, near, far;
            if (vshi_light_look(&reach.lights[0], from, false, &view) != VSHI_LIGHT_SEEN) {
                continue;
            }
            const vshi_vec way = ray_to(&reach.lights[0], from, &end);
            if (meets(&world, from, way, end, &near, &far)) {
                const vshi_vec last = vshi_add(from, vshi_scale(way, far));
                inside += 1;
                assert_true(holds(&region, last));
            }
        }
        vshi_reach_free(&reach);
    }
    printf("%d rays in %d regions, %d sides shorter than the world's\n", inside, SCENES, smaller);
    assert_true(inside > SCENES * RAYS / 4);
    assert_true(smaller > SCENES / 4);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_a_light_s_rays_meet_is_never_more_than_its_share),
        cmocka_unit_test(a_share_is_near_to_what_a_cube_hides),
        cmocka_unit_test(what_ao_s_rays_meet_is_never_more_than_its_share),
        cmocka_unit_test(a_region_holds_every_ray_as_far_as_the_world_goes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
