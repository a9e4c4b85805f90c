/* How far `cone` is off under lights of any width where one thick caster hides them: a box over the points,
 * the light straight above it, so that one straight edge of it crosses the light's disc. README has the
 * bounds. */
#include "shading.h"

enum { POINTS = 241 };

/* Visible share of a disc light that is hidden by a half plane as far from its centre, in its radii. */
static double segment(double x) {
    x = fmin(1.0, fmax(-1.0, x));
    return 0.5 + (x * sqrt(1.0 - x * x) + asin(x)) / PI;
}

/* The worst of the points that lie across the penumbra of a box from `low` to `low + thick` over them. */
static double worst(double low, double thick, double degrees) {
    const truth_solid box = {TRUTH_BOX, {-4.0, low + 0.5 * thick, 0.0}, {4.0, 0.5 * thick, 8.0}, 0.0, 0.0};
    vsh_field *field = field_of((truth_scene){&box, 1}, 0.1, 16.0);
    const double towards[3] = {0.0, 1.0, 0.0}, w = tan(0.5 * RADIANS(degrees));
    const vsh_light light = sun(towards, RADIANS(degrees));
    static double positions[3 * POINTS];
    static float normals[3 * POINTS], visible[POINTS];
    for (size_t i = 0; i < POINTS; ++i) {
        const double t = 1.2 * (-1.0 + 2.0 * (double)i / (POINTS - 1));
        positions[3 * i] = w * t * (t < 0.0 ? low : low + thick); /* its lower edge, or its upper one */
        normals[3 * i + 1] = 1.0f;
    }
    shadows(field, &light, VSH_SHADOW_CONE, POINTS, positions, normals, visible);
    double off = 0.0;
    for (size_t i = 0; i < POINTS; ++i) {
        const double x = positions[3 * i];
        off = fmax(off, fabs((double)visible[i] - segment(x / w / (x < 0.0 ? low : low + thick))));
    }
    vsh_field_free(field);
    return off;
}

static void one_thick_caster_is_right_under_narrow_lights_and_less_so_under_wide_ones(void **unused) {
    (void)unused;
    static const double boxes[][2] = {{1.0, 4.0}, {1.0, 2.0}, {0.5, 4.0}};
    static const struct {
        double degrees, most;
    } lights[] = {{1.0, 0.05}, {5.0, 0.05}, {10.0, 0.05}, {20.0, 0.07}, {60.0, 0.18}};
    for (size_t b = 0; b < sizeof boxes / sizeof boxes[0]; ++b) {
        for (size_t i = 0; i < sizeof lights / sizeof lights[0]; ++i) {
            const double off = worst(boxes[b][0], boxes[b][1], lights[i].degrees);
            if (!(off <= lights[i].most)) {
                fail_msg("box %g thick, %g above, light of %g°: %.3f off, said %.3f", boxes[b][1],
                         boxes[b][0], lights[i].degrees, off, lights[i].most);
            }
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_thick_caster_is_right_under_narrow_lights_and_less_so_under_wide_ones),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
