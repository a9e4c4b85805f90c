/* Spheres that cast by themselves, against analytic rays. */
#include "folder.h"
#include "shading.h"
#include "testing.h"
#include "truth/analytic.h"
#include "truth/directions.h"
#include "truth/metrics.h"

#include "shapes/spheres.h"

enum { POINTS = 400, RAYS = 1024, MOST = 400 };

typedef struct stage {
    truth_solid solids[MOST];
    double spheres[MOST][4];
    size_t count;
    vshi_spheres *made;
    double positions[3 * POINTS];
    float normals[3 * POINTS];
} stage;

static vshi_spheres *spheres_of(const double *list, size_t count, const double *transform) {
    vshi_spheres *made = NULL;
    assert_ok(vshi_spheres_create(list, count, transform, NULL, &made, &failure));
    return made;
}

/* `count` spheres of radii low … high in a box over a floor, which the points are on. */
static stage *set_up(size_t count, double low, double high, double side) {
    stage *s = calloc(1, sizeof *s);
    uint64_t counter = count;
    s->count = count;
    for (size_t i = 0; i < count; ++i) {
        double *sphere = s->spheres[i];
        sphere[3] = between(&counter, low, high);
        sphere[0] = between(&counter, -side, side);
        sphere[1] = sphere[3] + between(&counter, 0.0, side);
        sphere[2] = between(&counter, -side, side);
        s->solids[i].shape = TRUTH_SPHERE;
        memcpy(s->solids[i].center, sphere, 3 * sizeof *sphere);
        s->solids[i].radius = sphere[3];
    }
    for (size_t i = 0; i < POINTS; ++i) {
        s->positions[3 * i] = between(&counter, -1.3 * side, 1.3 * side);
        s->positions[3 * i + 2] = between(&counter, -1.3 * side, 1.3 * side);
        s->normals[3 * i + 1] = 1.0f;
    }
    s->made = spheres_of(s->spheres[0], count, NULL);
    return s;
}

static void tear_down(stage *s) {
    vshi_spheres_free(s->made);
    free(s);
}

static void shadow(const stage *s, const vsh_light *light, int32_t method, bool normals, float *values) {
    const vsh_points points = {POINTS, s->positions, normals ? s->normals : NULL, NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    vshi_spheres_shadow(s->made, light, method, &points, 0, POINTS, values, &stats);
    assert_true(stats.samples > 0);
}

static float shadow_at_point(const vshi_spheres *made, const vsh_light *light, int32_t method,
                             const double *position, const float *normal) {
    const vsh_points points = {1, position, normal, NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    float value = -1.0f;
    vshi_spheres_shadow(made, light, method, &points, 0, 1, &value, &stats);
    return value;
}

static const double TOWARDS[3] = {-0.5, 0.6, -0.6};

TEST(hard_shadows_are_the_rays) {
    stage *s = set_up(MOST, 0.05, 0.15, 2.0);
    static float values[POINTS], truth[POINTS];
    const vsh_light light = sun(TOWARDS, RADIANS(5.0));
    shadow(s, &light, VSH_SHADOW_HARD, false, values);
    const truth_scene scene = {s->solids, s->count};
    truth_lights(scene, POINTS, s->positions, NULL, TOWARDS, 0.0, INFINITY, 1, truth);
    size_t hidden = 0;
    for (size_t i = 0; i < POINTS; ++i) {
        assert_true(values[i] == truth[i]);
        hidden += values[i] == 0.0f;
    }
    assert_true(hidden > POINTS / 4 && hidden < POINTS);
    tear_down(s);
}

TEST(the_classic_method_is_the_nearest_miss) {
    stage *s = set_up(30, 0.05, 0.3, 2.0);
    static float values[POINTS];
    const double w = 0.1;
    const vsh_light light = sun(TOWARDS, 2.0 * atan(w));
    shadow(s, &light, VSH_SHADOW_CLASSIC, false, values);
    for (size_t i = 0; i < POINTS; ++i) {
        double expected = 1.0;
        for (size_t k = 0; k < s->count; ++k) {
            double d[3];
            go_along(s->spheres[k], -1.0, s->positions + 3 * i, d);
            const double along = dot3(d, TOWARDS) / length3(TOWARDS);
            const double miss = sqrt(dot3(d, d) - along * along) - s->spheres[k][3];
            if (along > 0.0) {
                expected = fmin(expected, fmax(miss, 0.0) / (w * along));
            }
        }
        assert_float_equal(values[i], expected, 1e-5);
    }
    tear_down(s);
}

/* Half of a sphere is below its own tangent plane, and does not shade it. */
TEST(a_sphere_leaves_its_own_surface_open) {
    const double sphere[4] = {1.0, 2.0, 3.0, 0.7};
    OWNED(vshi_spheres) *made = spheres_of(sphere, 1, NULL);
    uint64_t counter = 4;
    for (int i = 0; i < 200; ++i) {
        double n[3], towards[3], position[3];
        float normal[3];
        random_direction(&counter, n);
        random_direction(&counter, towards);
        for (int axis = 0; axis < 3; ++axis) {
            normal[axis] = (float)n[axis];
            position[axis] = (double)(float)(sphere[axis] + 0.7 * n[axis]);
        }
        const vsh_light light = sun(towards, 0.3);
        assert_true(shadow_at_point(made, &light, VSH_SHADOW_CLASSIC, position, normal) == 1.0f);
    }
}

TEST(bounds_lose_no_sphere_of_many) {
    enum { MANY = 20000 };
    FREED double *list = malloc(4 * MANY * sizeof *list);
    uint64_t counter = 8;
    for (size_t i = 0; i < MANY; ++i) {
        for (size_t k = 0; k < 3; ++k) {
            /* a third of them at one place: nothing to part them by */
            list[4 * i + k] = i % 3 == 0 ? 1e4 : 1e4 + between(&counter, -50.0, 50.0);
        }
        list[4 * i + 3] = between(&counter, 0.01, 0.3);
    }
    static const double moved[12] = {0, -2, 0, 7, 0, 0, 2, -3, -2, 0, 0, 1};
    OWNED(vshi_spheres) *made = spheres_of(list, MANY, moved);
    vshi_spheres_info info;
    vshi_spheres_get_info(made, &info);
    assert_int_equal(info.count, MANY);
    assert_true(info.bytes <= 100 * MANY);
    for (int p = 0; p < 200; ++p) {
        double towards[3], position[3];
        random_direction(&counter, towards);
        position[0] = -2e4 + 7 + between(&counter, -120.0, 120.0);
        position[1] = 2e4 - 3 + between(&counter, -120.0, 120.0);
        position[2] = -2e4 + 1 + between(&counter, -120.0, 120.0);
        bool hidden = false;
        for (size_t i = 0; i < MANY; ++i) {
            const double *s = list + 4 * i;
            const double d[3] = {-2.0 * s[1] + 7 - position[0], 2.0 * s[2] - 3 - position[1],
                                 -2.0 * s[0] + 1 - position[2]};
            const double along = dot3(d, towards), square = dot3(d, d);
            hidden = hidden || square < 4.0 * s[3] * s[3] ||
                     (along > 0.0 && square - along * along < 4.0 * s[3] * s[3]);
        }
        const vsh_light light = sun(towards, 0.1);
        const float value = shadow_at_point(made, &light, VSH_SHADOW_HARD, position, NULL);
        assert_true(value == (hidden ? 0.0f : 1.0f));
    }
}

TEST(bad_spheres_are_refused_by_number) {
    static const double shear[12] = {1, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                        bad[] = {0.0, -1.0, INFINITY, NAN, 1e16};
    double list[8] = {0, 0, 0, 1, 1, 1, 1, 1};
    vshi_spheres *made = NULL;
    for (size_t i = 0; i < 5; ++i) {
        list[7] = bad[i];
        assert_fails(vshi_spheres_create(list, 2, NULL, NULL, &made, &failure), VSH_ERROR_INPUT,
                     "sphere 1: radius");
        assert_null(made);
    }
    list[7] = 1.0;
    list[1] = NAN;
    assert_fails(vshi_spheres_create(list, 2, NULL, NULL, &made, &failure), VSH_ERROR_INPUT,
                 "sphere 0: y nan");
    list[1] = 0.0;
    const vsh_run run = run_within(150);
    assert_fails(vshi_spheres_create(list, 2, shear, NULL, &made, &failure), VSH_ERROR_ARGUMENT, "");
    assert_fails(vshi_spheres_create(list, 0, NULL, NULL, &made, &failure), VSH_ERROR_INPUT, "");
    assert_fails(vshi_spheres_create(list, (size_t)1 << 31, NULL, NULL, &made, &failure), VSH_ERROR_LIMIT,
                 "");
    assert_fails(vshi_spheres_create(list, 2, NULL, &run, &made, &failure), VSH_ERROR_LIMIT, "");
}

static vsh_result read_text(const char *text, double **spheres, size_t *count) {
    write_string(at("spheres.csv"), text);
    return vshi_spheres_read(at("spheres.csv"), NULL, spheres, count, &failure);
}

TEST(rows_of_a_file_are_read_or_refused_by_number) {
    double *spheres = NULL;
    size_t count = 0;
    static const double expected[16] = {1, -2.5, 3e2, 0.5, 4, 5, 6, 7, 8, 9, 10, 11, 0.25, 0, 1, 2};
    assert_ok(
        read_text("x,y,z,radius\r\n1,-2.5,3e2,0.5\r\n\n# none\n4; 5; 6; 7\n\"8\",9,\"10\" 11\n.25 0\t1 2",
                  &spheres, &count));
    assert_int_equal(count, 4);
    assert_memory_equal(spheres, expected, sizeof expected);
    free(spheres);
    static const struct {
        const char *text, *message;
    } bad[] = {
        {"1,2,3,4\n1,2,3\n", ":2: '1,2,3': expected four numbers"},
        {"1,2,3,4\n\n1,2,3,-4\n", ":3: radius -4 is out of range 0 (excluded)"},
        {"1,2,3,0\n", ":1: radius 0 is out of range"},
        {"1,2,3,4,5\n", ":1: '1,2,3,4,5': expected four numbers"},
        {"1,2,3,4\nx,y,z,r\n", ":2: 'x,y,z,r': expected four numbers"},
        {"1,2,nan,4\n", ":1: '1,2,nan,4': expected four numbers"},
        {"1,2,1e999,4\n", ":1: z inf is out of range"},
        {"1,2,0x10,4\n", ":1: '1,2,0x10,4'"},
        {"1,,2,3,4\n", ":1: '1,,2,3,4'"},
        {"# nothing\n", ": no spheres"},
        {"", ": no spheres"},
    };
    for (size_t i = 0; i < COUNT_OF(bad); ++i) {
        assert_fails(read_text(bad[i].text, &spheres, &count), VSH_ERROR_INPUT, bad[i].message);
        assert_null(spheres);
    }
    assert_int_equal(vshi_spheres_read("no such file.csv", NULL, &spheres, &count, &failure), VSH_ERROR_READ);
    assert_int_equal(vshi_spheres_read(".", NULL, &spheres, &count, &failure), VSH_ERROR_READ);
}

FIXTURE(make_folder, remove_folder)
