/* Flat light maps against closed forms and against rays that meet every segment of the outline in turn. */
#include "outlines.h"
#include "testing.h"

/* A half plane's edge: of the angles -a … a around the light those below b are hidden. */
TEST(an_edge_hides_its_share_of_the_angle) {
    OWNED(vsh_outline) *wall =
        box(-1e6, 1.0, 0.0, 2.0); /* seen from y = 0 its edge is the corner farther to the left */
    for (int i = 0; i <= 200; ++i) {
        const double x = -1.0 + 0.01 * i, angle = 0.4;
        const vsh_light sun = flat_sun(0.0, 1.0, angle);
        const double corner = fmax(-0.5 * angle, fmin(0.5 * angle, fmin(atan2(x, 1.0), atan2(x, 2.0))));
        const double expected = (corner + 0.5 * angle) / angle;
        assert_true(fabs(vsh_flat_visibility(wall, &sun, (const double[]){x, 0.0}) - expected) < 1e-12);
    }
    for (int i = 0; i <= 200; ++i) {
        const double x = -1.0 + 0.01 * i, r = 0.3;
        const vsh_light light = lamp(0.0, 4.0, r);
        const double half = asin(r / hypot(x, 4.0)), centre = atan2(x, 4.0);
        const double corner = fmax(-half, fmin(half, fmin(atan2(x, 1.0), atan2(x, 2.0)) - centre));
        const double expected = (corner + half) / (2.0 * half);
        assert_true(fabs(vsh_flat_visibility(wall, &light, (const double[]){x, 0.0}) - expected) < 1e-12);
    }
}

/* Over points all about, with lights in, on and behind the outline. */
static void compare_with_rays(const vsh_outline *outline, const vsh_light *light, double reach, int points,
                              uint64_t seed) {
    enum { RAYS = 1000 };
    int between = 0;
    for (int i = 0; i < points; ++i) {
        const double p[2] = {reach * (2.0 * any(seed + 2 * (uint64_t)i) - 1.0),
                             reach * (2.0 * any(seed + 2 * (uint64_t)i + 1) - 1.0)};
        const double truth = truth_visibility(outline, light, p[0], p[1], RAYS);
        const double value = vsh_flat_visibility(outline, light, p);
        between += value > 0.0 && value < 1.0;
        /* a ray in the middle of its part is wrong by half of it at an edge, of which there are a few */
        if (fabs(value - truth) > 10.0 / RAYS) {
            fail_msg("at (%.17g, %.17g): %.9g, by rays %.9g", p[0], p[1], value, truth);
        }
    }
    assert_true(between > points / 200);
}

TEST(text_is_as_rays_see_it) {
    OWNED(vsh_outline) *letters = text("vdb", 1.0);
    const vsh_light lights[] = {lamp(0.3, 2.0, 0.3),  lamp(-0.5, 0.2, 0.5),    lamp(-0.5, -0.3, 0.05),
                                lamp(5.0, -3.0, 1.0), flat_sun(1.0, 0.3, 0.2), flat_sun(-0.2, -1.0, 2.5)};
    for (size_t l = 0; l < sizeof lights / sizeof lights[0]; ++l) {
        compare_with_rays(letters, &lights[l], 2.0, 120, 1000 * l);
    }
}

/* Points of a star with spikes of every size. */
static vsh_outline *star(uint64_t seed) {
    enum { COUNT = 60 };
    double points[2 * COUNT];
    for (int i = 0; i < COUNT; ++i) {
        const double angle = 2.0 * PI * i / COUNT, radius = 0.2 + any(seed + (uint64_t)i);
        points[2 * i] = radius * cos(angle);
        points[2 * i + 1] = radius * sin(angle);
    }
    return polygon(points, COUNT);
}

TEST(stars_are_as_rays_see_them) {
    for (uint64_t s = 0; s < 6; ++s) {
        OWNED(vsh_outline) *outline = star(100 * s);
        const vsh_light lights[] = {lamp(0.6, 0.6, 0.5), lamp(1.2, 0.0, 0.4)}; /* spikes reach into them */
        for (size_t l = 0; l < sizeof lights / sizeof lights[0]; ++l) {
            compare_with_rays(outline, &lights[l], 2.0, 300, 7 * s + l);
        }
    }
}

TEST(a_disc_around_a_whole_star_is_seen_by_all) {
    OWNED(vsh_outline) *outline = star(300);
    const vsh_light light = lamp(0.1, 0.0, 1.5);
    for (uint64_t i = 0; i < 300; ++i) {
        const double p[2] = {4.0 * any(2 * i) - 2.0, 4.0 * any(2 * i + 1) - 2.0};
        assert_true(vsh_flat_visibility(outline, &light, p) == 1.0);
        assert_true(truth_visibility(outline, &light, p[0], p[1], 100) == 1.0);
    }
}

/* More gaps in one cone than the intervals that are kept. */
TEST(a_comb_of_a_thousand_teeth) {
    enum { TEETH = 1000 };
    FREED double *points = calloc(8 * TEETH, sizeof *points);
    size_t counts[TEETH];
    for (int i = 0; i < TEETH; ++i) {
        const double x = -5.0 + 0.01 * i;
        const double tooth[8] = {x, 1.0, x + 0.004, 1.0, x + 0.004, 1.001, x, 1.001};
        memcpy(points + 8 * i, tooth, sizeof tooth);
        counts[i] = 4;
    }
    OWNED(vsh_outline) *comb = NULL;
    assert_ok(vsh_outline_from_polygons(points, counts, TEETH, NULL, &comb, &failure));
    for (int k = 0; k < 5; ++k) {
        const double x = 0.3 * k, half = 1.3;
        const vsh_light sky = flat_sun(0.0, 1.0, 2.0 * half);
        double hidden = 0.0; /* from below a tooth hides what is between its lower left and right corner, or
                                the upper one where that is farther out */
        for (int i = 0; i < TEETH; ++i) {
            const double *t = points + 8 * i;
            const double left = fmin(atan2(t[0] - x, 1.0), atan2(t[0] - x, 1.001));
            const double right = fmax(atan2(t[2] - x, 1.0), atan2(t[2] - x, 1.001));
            hidden += fmax(0.0, fmin(half, right) - fmax(-half, left));
        }
        const double value = vsh_flat_visibility(comb, &sky, (const double[]){x, 0.0});
        assert_less(fabs(value - (1.0 - hidden / (2.0 * half))), 1e-9);
        assert_true(value > 0.3 && value < 0.7);
    }
}

TEST(a_light_of_no_size_is_seen_or_not) {
    OWNED(vsh_outline) *letters = text("vdb", 1.0);
    const vsh_light lights[] = {lamp(0.3, 2.0, 0.0), flat_sun(1.0, 0.3, 0.0)};
    int dark = 0, lit = 0;
    for (size_t l = 0; l < 2; ++l) {
        for (uint64_t i = 0; i < 500; ++i) {
            const double p[2] = {4.0 * any(2 * i) - 2.0, 4.0 * any(2 * i + 1) - 2.0};
            const double value = vsh_flat_visibility(letters, &lights[l], p);
            assert_true(value == truth_visibility(letters, &lights[l], p[0], p[1], 1));
            dark += value == 0.0;
            lit += value == 1.0;
        }
    }
    assert_true(dark > 50 && lit > 50);
}

TEST(points_in_the_light_and_without_casters_are_lit) {
    OWNED(vsh_outline) *wall = box(-0.1, -0.1, 0.1, 0.1);
    const vsh_light light = lamp(0.5, 0.0, 0.3);
    assert_true(vsh_flat_visibility(wall, &light, (const double[]){0.6, 0.1}) == 1.0);
    assert_true(vsh_flat_visibility(NULL, &light, (const double[]){-3.0, 0.1}) == 1.0);
    assert_true(vsh_flat_visibility(wall, &light, (const double[]){-0.101, 0.0}) == 0.0);
    assert_true(isnan(vsh_flat_visibility(wall, &light, (const double[]){NAN, 0.0})));
}

/* --- maps */

enum { SIZE = 96 };

typedef struct map {
    float shadow[2][SIZE * SIZE], rgb[3][SIZE * SIZE], coverage[SIZE * SIZE];
} map;

static vsh_flat_options options_of(int32_t method) {
    vsh_flat_options options = vsh_flat_options_default();
    options.width = options.height = SIZE;
    options.region_min[0] = options.region_min[1] = -2.0;
    options.region_max[0] = options.region_max[1] = 2.0;
    options.method = method;
    options.padding = 0;
    return options;
}

static void bake(const vsh_outline *casters, const vsh_light *lights, size_t count,
                 const vsh_flat_options *options, const vsh_run *run, map *m) {
    float *shadow[2] = {m->shadow[0], m->shadow[1]}, *rgb[3] = {m->rgb[0], m->rgb[1], m->rgb[2]};
    const vsh_flat_map view = {shadow, rgb, m->coverage};
    assert_ok(vsh_flat_bake(casters, lights, count, options, run, &view, &failure));
}

static void texel_point(size_t i, double p[2]) {
    p[0] = -2.0 + 4.0 * ((double)(i % SIZE) + 0.5) / SIZE;
    p[1] = 2.0 - 4.0 * ((double)(i / SIZE) + 0.5) / SIZE;
}

TEST(a_map_holds_what_its_texels_see) {
    static map m;
    OWNED(vsh_outline) *letters = text("flat", 1.0);
    vsh_light lights[2] = {lamp(0.3, 1.5, 0.2), flat_sun(1.0, 0.5, 0.3)};
    lights[0].falloff = VSH_FALLOFF_QUADRATIC;
    lights[0].reach = 2.5;
    const double color[3] = {1.0, 0.5, 0.25};
    memcpy(lights[0].color, color, sizeof color);
    const vsh_flat_options options = options_of(VSH_FLAT_EXACT);
    bake(letters, lights, 2, &options, NULL, &m);
    double square = 0.0;
    size_t outside = 0;
    for (size_t i = 0; i < SIZE * SIZE; ++i) {
        double p[2];
        texel_point(i, p);
        const bool inside = truth_inside(letters, p[0], p[1]);
        assert_true((double)m.coverage[i] == (inside ? 0.0 : 1.0));
        if (inside) {
            assert_true(m.shadow[0][i] == 0.0f && m.rgb[0][i] == 0.0f);
            continue;
        }
        const double distance = hypot(p[0] - 0.3, p[1] - 1.5);
        const double seen = vsh_flat_visibility(letters, &lights[0], p);
        const double far = vsh_flat_visibility(letters, &lights[1], p);
        const double fade = pow(1.0 - fmin(1.0, fmax(distance, 0.2) / 2.5), 2.0);
        assert_true(fabs((double)m.shadow[0][i] - (distance < 2.5 ? seen : 0.0)) < 1e-6);
        assert_less(fabs((double)m.shadow[1][i] - far), 1e-6);
        for (int c = 0; c < 3; ++c) {
            assert_less(fabs((double)m.rgb[c][i] - (seen * fade * color[c] + far)), 1e-5);
        }
        if (i % 37 == 0) {
            const double error =
                (double)m.shadow[1][i] - truth_visibility(letters, &lights[1], p[0], p[1], 400);
            square += error * error;
            ++outside;
        }
    }
    assert_less(sqrt(square / (double)outside), 0.003);
}

/* Its outer half is the estimate's own: h/t over the sine of half the angle, at an edge that is b beyond the
 * light's centre sin b / sin a; the inner half is dark. */
TEST(classic_knows_the_outer_half_of_a_penumbra) {
    static map m;
    OWNED(vsh_outline) *wall = box(-1.9, 0.5, 0.0, 0.7);
    const vsh_light sun = flat_sun(0.0, 1.0, 0.5);
    const vsh_flat_options options = options_of(VSH_FLAT_CLASSIC);
    bake(wall, &sun, 1, &options, NULL, &m);
    double worst = 0.0;
    int between = 0;
    for (size_t i = 0; i < SIZE * SIZE; ++i) {
        double p[2];
        texel_point(i, p);
        if (p[1] < 0.0 && fabs(p[0]) < 1.0) {
            const double edge = fmin(atan2(p[0], 0.5 - p[1]), atan2(p[0], 0.7 - p[1]));
            const double expected = p[0] < 0.0 ? 0.0 : fmin(1.0, sin(edge) / sin(0.25));
            worst = fmax(worst, fabs((double)m.shadow[0][i] - expected));
            between += expected > 0.0 && expected < 1.0;
        }
    }
    assert_true(worst < 0.1 && between > 100);
}

TEST(a_scene_of_twice_the_size_is_the_same) {
    static map a, b;
    OWNED(vsh_outline) *letters = text("flat", 1.0), *larger = NULL;
    const double twice[6] = {2.0, 0.0, 0.0, 0.0, 2.0, 0.0};
    const vsh_outline_instance instance = {letters, twice};
    assert_ok(vsh_outline_unite(&instance, 1, NULL, &larger, &failure));
    const vsh_light light = lamp(0.3, 1.5, 0.2), far = lamp(0.6, 3.0, 0.4);
    vsh_flat_options options = options_of(VSH_FLAT_EXACT);
    bake(letters, &light, 1, &options, NULL, &a);
    for (int axis = 0; axis < 2; ++axis) {
        options.region_min[axis] *= 2.0;
        options.region_max[axis] *= 2.0;
    }
    bake(larger, &far, 1, &options, NULL, &b);
    assert_memory_equal(a.shadow[0], b.shadow[0], sizeof a.shadow[0]); /* by a power of two: the same bits */
}

TEST(supersampling_averages_what_is_outside) {
    static map m;
    OWNED(vsh_outline) *wall = box(-0.999, -1.0, 0.013, 0.5);
    const vsh_light light = lamp(0.3, 1.5, 0.2);
    vsh_flat_options options = options_of(VSH_FLAT_EXACT);
    options.supersample = 4;
    bake(wall, &light, 1, &options, NULL, &m);
    const double texel = 4.0 / SIZE;
    int parts = 0;
    for (size_t i = 0; i < SIZE * SIZE; ++i) {
        double p[2], sum = 0.0;
        int count = 0;
        texel_point(i, p);
        for (int s = 0; s < 16; ++s) {
            const double q[2] = {p[0] + texel * ((s % 4 + 0.5) / 4.0 - 0.5),
                                 p[1] - texel * ((s / 4 + 0.5) / 4.0 - 0.5)};
            if (!(q[0] > -0.999 && q[0] < 0.013 && q[1] > -1.0 && q[1] < 0.5)) {
                sum += vsh_flat_visibility(wall, &light, q);
                ++count;
            }
        }
        assert_less(fabs((double)m.coverage[i] - count / 16.0), 1e-6);
        assert_true(fabs((double)m.shadow[0][i] - (count > 0 ? sum / count : 0.0)) < 1e-6);
        parts += count > 0 && count < 16;
    }
    assert_true(parts > 20);
}

TEST(padding_grows_values_and_not_coverage) {
    static map m, padded;
    OWNED(vsh_outline) *wall = box(-1.0, -1.0, 0.0, 0.5);
    const vsh_light light = lamp(0.3, 1.5, 0.2);
    vsh_flat_options options = options_of(VSH_FLAT_EXACT);
    bake(wall, &light, 1, &options, NULL, &m);
    options.padding = 2;
    bake(wall, &light, 1, &options, NULL, &padded);
    assert_memory_equal(m.coverage, padded.coverage, sizeof m.coverage);
    const size_t row = SIZE / 2, last = SIZE / 2 - 1; /* the column left of x = 0 */
    assert_true(m.coverage[row * SIZE + last] == 0.0f && m.shadow[0][row * SIZE + last] == 0.0f);
    assert_true(padded.shadow[0][row * SIZE + last] == m.shadow[0][row * SIZE + last + 1]);
    assert_true(m.shadow[0][row * SIZE + last + 1] > 0.0f);
    assert_true(padded.shadow[0][row * SIZE + last - 2] == 0.0f);
}

/* --- what is refused */

typedef struct watch {
    double last, stop;
} watch;

static int32_t follow(void *user, const char *stage, double fraction) {
    watch *w = user;
    if (fraction < w->last) {
        w->last = 0.0; /* the next stage */
    }
    w->last = fraction;
    return fraction >= w->stop;
}

TEST(bad_options_are_refused) {
    static map m;
    OWNED(vsh_outline) *wall = box(-1.0, -1.0, 0.0, 0.5);
    float *shadow[1] = {m.shadow[0]};
    const vsh_flat_map view = {shadow, NULL, NULL};
    const vsh_light light = lamp(0.3, 1.5, 0.2);
    const vsh_flat_options good = options_of(VSH_FLAT_EXACT);
#define REFUSED(field, value, part)                                                                          \
    do {                                                                                                     \
        vsh_flat_options bad = good;                                                                         \
        bad.field = value;                                                                                   \
        assert_fails(vsh_flat_bake(wall, &light, 1, &bad, NULL, &view, &failure), VSH_ERROR_ARGUMENT, part); \
    } while (0)
    REFUSED(struct_size, 0, "struct_size");
    REFUSED(struct_size, sizeof good + 8, "struct_size");
    REFUSED(width, 0, "width 0");
    REFUSED(height, 65537, "height 65537");
    REFUSED(method, 3, "method 3");
    REFUSED(supersample, 17, "supersample 17");
    REFUSED(padding, -1, "padding -1");
    REFUSED(max_steps, 15, "max_steps 15");
    REFUSED(region_max[0], -2.0, "region");
    REFUSED(region_min[1], NAN, "region");
    REFUSED(region_min[1], -INFINITY, "region");
#undef REFUSED
    vsh_light bad = light;
    bad.radius = -1.0;
    assert_fails(vsh_flat_bake(wall, &bad, 1, &good, NULL, &view, &failure), VSH_ERROR_ARGUMENT, "radius");
    bad = flat_sun(0.0, 0.0, 0.1);
    bad.direction[2] = 1.0;
    assert_fails(vsh_flat_bake(wall, &bad, 1, &good, NULL, &view, &failure), VSH_ERROR_ARGUMENT, "plane");
    assert_fails(vsh_flat_bake(wall, NULL, 1, &good, NULL, &view, &failure), VSH_ERROR_ARGUMENT, "lights");
    assert_fails(vsh_flat_bake(wall, &light, 1, &good, NULL, NULL, &failure), VSH_ERROR_ARGUMENT, "map");
}

TEST(limits_and_cancelling) {
    static map m;
    OWNED(vsh_outline) *wall = box(-1.0, -1.0, 0.0, 0.5);
    float *shadow[1] = {m.shadow[0]};
    const vsh_flat_map view = {shadow, NULL, NULL};
    const vsh_light light = lamp(0.3, 1.5, 0.2), wide = lamp(0.0, 1e7, 1e6);
    vsh_flat_options options = options_of(VSH_FLAT_CLASSIC);
    vsh_run run = run_within(5000);
    assert_fails(vsh_flat_bake(wall, &light, 1, &options, &run, &view, &failure), VSH_ERROR_LIMIT, "limit");
    assert_fails(vsh_flat_bake(wall, &wide, 1, &options, NULL, &view, &failure), VSH_ERROR_LIMIT, "classic");
    run.memory_limit = 0;
    const double stops[] = {0.0, 0.1, 0.5, 1.0};
    for (size_t i = 0; i < sizeof stops / sizeof stops[0]; ++i) {
        watch w = {0.0, stops[i]};
        run.progress = follow;
        run.user = &w;
        assert_fails(vsh_flat_bake(wall, &light, 1, &options, &run, &view, &failure), VSH_ERROR_CANCELLED,
                     "cancelled");
    }
    watch w = {0.0, 2.0};
    run.user = &w;
    assert_ok(vsh_flat_bake(wall, &light, 1, &options, &run, &view, &failure));
    assert_true(w.last == 1.0);
}

TEST(tiny_lights_are_seen_or_not_and_wide_ones_as_their_neighbours) {
    static const double SIZES[] = {5e-324, 1e-300, 1e-160, 1e-50, 1e-20, 1e-10, 1e-7};
    OWNED(vsh_outline) *letters = text("vdb", 1.0);
    for (uint64_t i = 0; i < 300; ++i) {
        const double p[2] = {4.0 * any(2 * i) - 2.0, 4.0 * any(2 * i + 1) - 2.0};
        vsh_light lights[] = {lamp(1.9, 1.7, 0.0), flat_sun(0.3, 1.0, 0.0)};
        for (int l = 0; l < 2; ++l) {
            const double hard = vsh_flat_visibility(letters, &lights[l], p);
            for (size_t k = 0; k < sizeof SIZES / sizeof SIZES[0]; ++k) {
                lights[l].radius = lights[l].angle = SIZES[k];
                assert_true(fabs(vsh_flat_visibility(letters, &lights[l], p) - hard) < 1e-3);
            }
        }
        lights[0].radius = 1e99;
        assert_true(vsh_flat_visibility(letters, &lights[0], p) == 1.0);
        lights[1].angle = 179.99 / 180.0 * PI;
        const double wide = vsh_flat_visibility(letters, &lights[1], p);
        lights[1].angle = nextafter(PI, 0.0);
        assert_true(fabs(vsh_flat_visibility(letters, &lights[1], p) - wide) < 1e-3);
    }
}
