/* What is baked where no method is named: the error that was asked for, whatever the voxels. */
#include "shapes.h"
#include "testing.h"
#include "traced.h"

enum { SIDE = 48, COUNT = SIDE * SIDE };

static void add_box(shape *s, double x0, double y0, double z0, double x1, double y1, double z1) {
    shape_box(s, (double[3]){x0, y0, z0}, (double[3]){x1, y1, z1}, ALL_SIDES);
}

static void add_quad(shape *s, const double corners[4][3]) {
    uint32_t v[4];
    for (int k = 0; k < 4; ++k) {
        v[k] = shape_vertex(s, corners[k][0], corners[k][1], corners[k][2]);
    }
    shape_quad(s, v[0], v[1], v[2], v[3]);
}

static casting make_of(const vsh_mesh *meshes, size_t count, double voxel) {
    const vsh_grid_options options = with_voxel(voxel);
    vsh_grid *grid = NULL;
    casting c = {NULL, NULL};
    assert_ok(vsh_grid_from_meshes(meshes, count, &options, NULL, &grid, &failure));
    assert_ok(vsh_triangles_create(meshes, count, NULL, &c.triangles, &failure));
    c.field = field_of_grid(grid, 4.0);
    return c;
}

static casting make(const shape *s, double voxel) {
    const vsh_mesh mesh = shape_mesh(s, "shape");
    return make_of(&mesh, 1, voxel);
}

static double positions[3 * COUNT];
static float normals[3 * COUNT], values[COUNT], truth[COUNT], other[COUNT];
static uint32_t texels[COUNT];

/* A square of points that look up, `height` over the origin. */
static vsh_points board(double half, double height) {
    for (size_t i = 0; i < COUNT; ++i) {
        positions[3 * i] = half * (2.0 * ((double)(i % SIDE) + 0.5) / SIDE - 1.0);
        positions[3 * i + 1] = height;
        positions[3 * i + 2] = half * (2.0 * ((double)(i / SIDE) + 0.5) / SIDE - 1.0);
        normals[3 * i] = normals[3 * i + 2] = 0.0f;
        normals[3 * i + 1] = 1.0f;
        texels[i] = (uint32_t)(i % SIDE + 65536 * (i / SIDE));
    }
    return (vsh_points){COUNT, positions, normals, texels};
}

static const double UP[3] = {0.4, 1.0, 0.3};

static vsh_shade_stats shade_by(const vsh_occluders *casters, const vsh_points *points,
                                const vsh_shade_options *options, float *into) {
    const vsh_light light = sun(UP, RADIANS(6.0));
    vsh_shade_stats stats = vsh_shade_stats_zero();
    assert_ok(vsh_shade_shadow(casters, points, &light, options, NULL, into, NULL, &stats, &failure));
    return stats;
}

static vsh_shade_stats shade(const casting *c, const vsh_points *points, const vsh_shade_options *options,
                             float *into) {
    return shade_by(occluders_of_caster(c), points, options, into);
}

static double rmse_to_truth(const casting *c, const vsh_points *points, const vsh_shade_options *options) {
    const vsh_light light = sun(UP, RADIANS(6.0));
    double sum = 0.0;
    assert_ok(vsh_trace_shadow(c->triangles, NULL, points->count, points->positions, points->normals, 1e-5,
                               &light, 4096, NULL, truth, &failure));
    shade(c, points, options, values);
    for (size_t i = 0; i < points->count; ++i) {
        sum += ((double)values[i] - (double)truth[i]) * ((double)values[i] - (double)truth[i]);
    }
    return sqrt(sum / (double)points->count);
}

TEST(the_default_is_exact_with_triangles_and_adaptive_without) {
    FREED shape *s = shape_new();
    add_box(s, -0.3, 0.2, -0.3, 0.3, 0.8, 0.3);
    FREED_BY(caster_free) casting c = make(s, 0.05);
    const vsh_points points = board(1.0, 0.0);
    for (int traced = 0; traced < 2; ++traced) {
        vsh_shade_options options = vsh_shade_options_default(), named = options;
        const casting given = {c.field, traced ? c.triangles : NULL};
        named.method = traced ? VSH_SHADOW_EXACT : VSH_SHADOW_ADAPTIVE;
        named.ao_method = traced ? VSH_AO_EXACT : VSH_AO_ADAPTIVE;
        shade(&given, &points, &options, values);
        shade(&given, &points, &named, other);
        assert_memory_equal(values, other, sizeof values);
        assert_ok(vsh_shade_ao(occluders_of_caster(&given), &points, &options, NULL, values, NULL, NULL, NULL,
                               &failure));
        assert_ok(
            vsh_shade_ao(occluders_of_caster(&given), &points, &named, NULL, other, NULL, NULL, NULL, NULL));
        assert_memory_equal(values, other, sizeof values);
        assert_int_equal(vsh_shadow_method_resolve(VSH_SHADOW_AUTO, traced), named.method);
        assert_int_equal(vsh_ao_method_resolve(VSH_AO_AUTO, traced), named.ao_method);
    }
}

TEST(a_layer_takes_the_method_that_its_own_triangles_allow) {
    FREED shape *s = shape_new();
    add_box(s, -0.3, 0.2, -0.3, 0.3, 0.8, 0.3);
    FREED_BY(caster_free) casting c = make(s, 0.05);
    const vsh_points points = board(1.0, 0.0);
    vsh_layer layer = vsh_layer_default();
    layer.field = c.field; /* no triangles */
    vsh_shade_options options = vsh_shade_options_default();
    const vsh_occluders casters = {
        .field = c.field, .triangles = c.triangles, .layers = &layer, .layer_count = 1};
    shade_by(&casters, &points, &options, values);
    layer.method = VSH_SHADOW_ADAPTIVE;
    shade_by(&casters, &points, &options, other);
    assert_memory_equal(values, other, sizeof values);
    assert_ok(vsh_shade_ao(&casters, &points, &options, NULL, values, NULL, NULL, NULL, &failure));
}

TEST(rays_follow_from_the_error_unless_they_are_limited) {
    FREED shape *s = shape_new();
    for (int i = 0; i < 10; ++i) {
        add_box(s, -1.0 + 0.2 * i, 0.5, -1.0, -0.92 + 0.2 * i, 0.55, 1.0);
    }
    FREED_BY(caster_free) casting c = make(s, 0.03);
    const vsh_points points = board(1.0, 0.0);
    vsh_shade_options options = vsh_shade_options_default();
    options.max_error = 0.003;
    const double free = rmse_to_truth(&c, &points, &options);
    const double said = sqrt(shade(&c, &points, &options, values).square_error / COUNT);
    options.rays = 32;
    const double limited = rmse_to_truth(&c, &points, &options);
    const double told = sqrt(shade(&c, &points, &options, values).square_error / COUNT);
    assert_true(free <= 0.003 && said <= 0.003 && said >= 0.9 * free);
    assert_true(limited > 0.003 && told > 0.003);
}

TEST(parts_thinner_than_voxels_are_found_lost) {
    FREED shape *fence = shape_new(), *block = shape_new();
    for (int i = 0; i < 10; ++i) {
        add_box(fence, -1.0 + 0.2 * i, 0.0, 0.0, -0.9 + 0.2 * i, 1.0, 0.02);
    }
    add_box(block, -0.5, 0.0, 1.0, 0.5, 1.0, 2.0);
    const vsh_mesh meshes[2] = {shape_mesh(fence, "fence"), shape_mesh(block, "block")};
    const double voxels[3] = {0.12, 0.05, 0.012};
    for (int v = 0; v < 3; ++v) {
        FREED_BY(caster_free) casting c = make_of(meshes, 2, voxels[v]);
        vsh_lost lost[2];
        assert_ok(vsh_field_find_lost(c.field, meshes, 2, c.triangles, lost, &failure));
        assert_less(lost[1].share, 0.005);
        if (v < 2) {
            assert_true(lost[0].share > 0.2 && lost[0].triangles > 0);
            assert_less(fabs(lost[0].thickness - 0.02), 0.001);
        } else {
            assert_less(lost[0].share, 0.005);
        }
    }
}

TEST(voxels_coarser_than_casters_cost_exact_no_error) {
    FREED shape *slats = shape_new(), *cards = shape_new();
    for (int i = 0; i < 10; ++i) {
        add_box(slats, -1.0 + 0.2 * i, 0.5, -1.0, -0.9 + 0.2 * i, 0.51, 1.0);
    }
    uint64_t counter = 1;
    for (int i = 0; i < 60; ++i) {
        const double x = between(&counter, -1.0, 1.0), y = between(&counter, 0.5, 1.2),
                     z = between(&counter, -1.0, 1.0), t = between(&counter, -0.1, 0.1);
        const double card[4][3] = {{x - 0.1, y, z - 0.1},
                                   {x + 0.1, y + t, z - 0.1},
                                   {x + 0.1, y + t, z + 0.1},
                                   {x - 0.1, y, z + 0.1}};
        add_quad(cards, card);
    }
    const vsh_points points = board(1.0, 0.0);
    const shape *const shapes[2] = {slats, cards};
    for (int which = 0; which < 2; ++which) {
        for (double voxel = 0.2; voxel > 0.02; voxel *= 0.5) {
            FREED_BY(caster_free) casting c = make(shapes[which], voxel);
            vsh_shade_options options = vsh_shade_options_default();
            const double rmse = rmse_to_truth(&c, &points, &options);
            assert_at_most(rmse, 0.02);
        }
    }
}

/* A board whose AO is interpolated between texels, with low slats on it. */
TEST(ao_between_texels_keeps_the_error_beside_what_is_low) {
    enum { SIZE = 96, TEXELS = SIZE * SIZE };
    static const double VOXEL = 0.05, LIFT = 0.05 / 64; /* what AO's own rays begin at */
    static float plane[TEXELS], covered[TEXELS];
    static const float uvs[8] = {0.0f, 0.0f, 1.0f, 0.0f, 1.0f, 1.0f, 0.0f, 1.0f};
    FREED shape *ground = shape_new(), *low = shape_new();
    add_quad(ground, (const double[4][3]){{-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}});
    for (int i = 0; i < 12; ++i) {
        const double x = -0.95 + 0.16 * i;
        add_box(low, x, -0.005, -0.9, x + 0.03, 0.012, 0.9);
    }
    vsh_mesh meshes[2] = {shape_mesh(ground, "ground"), shape_mesh(low, "slats")};
    meshes[0].uvs = uvs;
    FREED_BY(caster_free) casting c = make_of(meshes, 2, VOXEL);
    vsh_lightmap_options size = vsh_lightmap_options_default();
    size.width = size.height = SIZE;
    OWNED(vsh_charts) *charts = NULL;
    OWNED(vsh_texels) *of = NULL;
    assert_ok(vsh_charts_create(meshes, 1, &size, NULL, NULL, &charts, &failure));
    assert_ok(vsh_texels_create(charts, NULL, &of, &failure));
    const vsh_texel_samples samples = vsh_texels_samples(of);
    FREED float *open = malloc(samples.count * sizeof *open);
    assert_ok(vsh_trace_ao(c.triangles, NULL, samples.count, samples.positions, samples.normals, LIFT, 0.5,
                           1024, NULL, open, &failure));
    vsh_shade_options options = vsh_shade_options_default();
    options.ao_distance = 0.5;
    const vsh_lightmap lightmap = {.ao = plane, .coverage = covered};
    assert_ok(
        vsh_bake_lightmap(occluders_of_caster(&c), charts, NULL, 0, &options, NULL, &lightmap, NULL, NULL));
    double sum = 0.0, count = 0.0;
    for (size_t i = 0; i < samples.count; ++i) {
        const size_t at = vsh_texel_place(samples.texels[i], SIZE);
        const double off = (double)plane[at] - (double)open[i];
        sum += covered[at] > 0.0f ? off * off : 0.0;
        count += covered[at] > 0.0f;
    }
    assert_true(count > 0.5 * TEXELS && sqrt(sum / count) <= 0.02);
}
