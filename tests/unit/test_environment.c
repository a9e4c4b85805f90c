/* The host's floating-point environment: no setting of it shows in a result, every setting is given back. */
#include "testing.h"
#include "traced.h"

#include "base/floats.h"
#include "field/field.h"
#include "previews.h"

#include <fenv.h>

enum { SIDE = 32, COUNT = SIDE * SIDE, SHADOWS = VSH_SHADOW_EXACT + 2, AOS = VSH_AO_EXACT + 1 };

#if defined(__x86_64__)
/* MXCSR: flush to zero, denormals are zero, both; then rounding down, up, to zero, all of it, and nothing
 * masked but inexact results and denormals. */
static const vshi_floats SETTINGS[] = {
    VSHI_FLOATS_DEFAULT, 0x9f80, 0x1fc0, 0x9fc0, 0x3f80, 0x5f80, 0x7f80, 0xffc0, 0x1100};
#elif defined(__aarch64__)
static const vshi_floats SETTINGS[] = {VSHI_FLOATS_DEFAULT, 1u << 24, 1u << 22, 2u << 22, 3u << 22};
#else
static const vshi_floats SETTINGS[] = {VSHI_FLOATS_DEFAULT};
#endif
enum { SETTING_COUNT = sizeof SETTINGS / sizeof SETTINGS[0] };

/* What one run of everything gives. */
typedef struct outcome {
    float visible[SHADOWS][COUNT], open[AOS][COUNT], light[3 * COUNT], sampled[COUNT], traced[2][COUNT];
    double distances[64];
    uint64_t field; /* hash of its values */
    vsh_shade_stats stats;
    size_t strange; /* calls of a callback in another environment than the default one */
} outcome;

static double positions[3 * COUNT];
static float normals[3 * COUNT];

static uint64_t hash(uint64_t h, const void *data, size_t size) {
    const unsigned char *bytes = data;
    for (size_t i = 0; i < size; ++i) {
        h = (h ^ bytes[i]) * 0x100000001b3u;
    }
    return h;
}

static int32_t look(void *user, const char *stage, double fraction) {
    *(size_t *)user += vshi_floats_differ(vshi_floats_get()) != 0;
    return 0;
}

/* A torus whose every distance is asked for from some thread of the pool. */
static double ring(void *user, const double p[3]) {
    if (vshi_floats_differ(vshi_floats_get())) {
        return (double)NAN; /* refused with VSH_ERROR_INPUT */
    }
    return hypot(hypot(p[0], p[2]) - 1.0, p[1]) - 0.31;
}

/* Into an outcome of zeros. */
static void run_all(int s, int32_t threads, outcome *o) {
    const vshi_floats setting = SETTINGS[s];

    vsh_run run = run_on(threads);
    run.progress = look;
    run.user = &o->strange;
    o->stats = vsh_shade_stats_zero();
    const vsh_distance field = {ring, NULL, 1.0, 0, {-1.4, -0.4, -1.4}, {1.4, 0.4, 1.4}};
    const vsh_grid_options options = with_voxel(0.047);
    vsh_field_options field_options = vsh_field_options_default();
    field_options.reach = 3.3;
    vsh_sdf_node node = vsh_sdf_node_default();
    node.shape = VSH_SDF_TORUS;
    node.rotation[0] = 0.3;
    const vsh_sdf tree = {&node, 1};
    const double place[3] = {0.3, 2.1, 0.7};
    const vsh_light lights[2] = {sun(truth_seeds_sun, 0.2), lamp(place, 0.3)};
    const vsh_points points = {COUNT, positions, normals, NULL};
    OWNED(vsh_grid) *grid = NULL;
    OWNED(vsh_field) *f = NULL;
    vsh_result results[2 + SHADOWS + AOS + 3] = {VSH_OK};
    size_t calls = 2;
    OWNED(vsh_triangles) *triangles = NULL;
    const truth_solid ball = {TRUTH_SPHERE, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 0.9, 0.0};
    vsh_mesh mesh = mesh_of_solid(&ball);

    vshi_floats_set(setting);
    results[0] = vsh_grid_from_distance(&field, &options, &run, &grid, &failure);
    results[1] =
        results[0] == VSH_OK ? vsh_field_create(grid, &field_options, &run, &f, &failure) : results[0];
    if (results[1] == VSH_OK) {
        vshi_floats_set(setting);
        results[calls++] = vsh_triangles_create(&mesh, 1, &run, &triangles, &failure);
        vshi_floats_set(setting);
        for (int32_t i = 0; i <= SHADOW_METHODS; ++i) { /* once more the cone, of the lamp */
            vsh_shade_options how = preview_options();
            how.method = i < SHADOW_METHODS ? i : VSH_SHADOW_CONE;
            results[calls++] = vsh_shade_shadow(occluders_traced(f, triangles), &points,
                                                &lights[i == 1 || i >= VSH_SHADOW_EXACT], &how, &run,
                                                o->visible[i], NULL, &o->stats, &failure);
        }
        for (int32_t i = 0; i < AO_METHODS; ++i) {
            vsh_shade_options how = preview_options();
            how.ao_method = i;
            results[calls++] = vsh_shade_ao(occluders_traced(f, triangles), &points, &how, &run, o->open[i],
                                            NULL, NULL, &o->stats, &failure);
        }
        if (triangles != NULL) {
            vshi_floats_set(setting);
            results[calls++] = vsh_trace_shadow(triangles, NULL, COUNT, positions, normals, 1e-5, &lights[1],
                                                32, &run, o->traced[0], &failure);
            vshi_floats_set(setting);
            results[calls++] = vsh_trace_ao(triangles, NULL, COUNT, positions, normals, 1e-5, 1.0, 32, &run,
                                            o->traced[1], &failure);
        }
        vshi_floats_set(setting);
        vsh_shade_irradiance(&points, NULL, &lights[1], o->visible[1], o->light);
        vsh_field_sample(f, COUNT, positions, o->sampled);
        for (int i = 0; i < 64; ++i) {
            o->distances[i] = vsh_sdf_distance(&tree, positions + 3 * i);
        }
    }
    const vshi_floats after = vshi_floats_get();
    vshi_floats_set(VSHI_FLOATS_DEFAULT);

    assert_ok(results[1]);
    for (size_t i = 0; i < calls; ++i) {
        assert_ok(results[i]);
    }
    /* flags that say what has happened may be added where the host's setting is the default one */
    assert_true((after & ~(vshi_floats)VSHI_FLOATS_FLAGS) == (setting & ~(vshi_floats)VSHI_FLOATS_FLAGS));
    o->field = hash(0xcbf29ce484222325u, f->values, (size_t)f->value_count * sizeof *f->values);
    free((void *)(uintptr_t)mesh.positions);
    free((void *)(uintptr_t)mesh.indices);
}

TEST(no_setting_of_the_host_shows_and_all_are_given_back) {
    static outcome expected, other;
    uint64_t counter = 3;
    floor_texels(SIDE, positions, normals);
    for (size_t i = 0; i < 3 * COUNT; ++i) {
        positions[i] += i % 3 == 1 ? -0.7 : 0.0;
        normals[i] += (float)between(&counter, -0.3, 0.3);
    }
    run_all(0, 0, &expected);
    assert_int_equal(expected.strange, 0);
    for (int s = 0; s < SETTING_COUNT; ++s) {
        const int32_t threads[] = {1, 2, 0, 6};
        for (int t = s == 0 ? 3 : s % 4; t < 4; ++t) {
            memset(&other, 0, sizeof other);
            run_all(s, threads[t], &other);
            if (memcmp(&expected, &other, sizeof expected) != 0) {
                fail_msg("setting %#llx, %d threads: other bits; %zu callbacks in the host's setting",
                         (unsigned long long)SETTINGS[s], threads[t], other.strange);
            }
        }
    }
}

/* Lengths that are denormal numbers, and scenes that have them, are what they are. */
TEST(denormals_are_numbers) {
    FREED_BY(caster_free) casting c = caster_of(truth_seeds(), 0.1, 2.0);
    const double p[3] = {0.3, 1e-310, 0.2}, zero[3] = {0.3, 0.0, 0.2};
    const float tiny[3] = {0.0f, 1e-41f, 1e-44f}, up[3] = {0.0f, 1.0f, 0.0f};
    const double towards[3] = {5e-324, 1e-310, 0.0};
    const vsh_light light = sun(towards, 1e-310), straight = sun((const double[]){0.0, 1.0, 0.0}, 0.0);
    for (int s = 0; s < SETTING_COUNT; ++s) {
        for (int32_t method = 0; method < SHADOW_METHODS; ++method) {
            vshi_floats_set(SETTINGS[s]);
            const float a = cast_shadow_at(&c, &light, method, p, tiny);
            const float b = cast_shadow_at(&c, &straight, method, zero, up);
            vshi_floats_set(VSHI_FLOATS_DEFAULT);
            assert_int_equal(bits_of(a), bits_of(b));
        }
        for (int32_t method = 0; method < AO_METHODS; ++method) {
            vshi_floats_set(SETTINGS[s]);
            const float a = cast_ao_at(&c, method, 1.0, p, tiny), b = cast_ao_at(&c, method, 1.0, zero, up);
            vshi_floats_set(VSHI_FLOATS_DEFAULT);
            const float n = cast_ao_at(&c, method, 1.0, zero, up);
            assert_int_equal(bits_of(b), bits_of(n));
            assert_true(fabsf(a - b) <= 1e-2f); /* the normal is turned by a thousandth */
        }
    }
}
