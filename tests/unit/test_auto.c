/* Bakes that name no method keep the error asked for, whatever the voxels. */
#include "rays.h"
#include "shapes.h"
#include "traced.h"
#include "truth/metrics.h"

enum { SIDE = 48, COUNT = SIDE * SIDE };

static void add_box(shape *s, double x0, double y0, double z0, double x1, double y1, double z1) {
    shape_box(s, (double[3]){x0, y0, z0}, (double[3]){x1, y1, z1}, ALL_SIDES);
}

static casting make(const shape *s, double voxel) {
    const vsh_mesh mesh = shape_mesh(s, "shape");
    return caster_of_meshes(&mesh, 1, voxel, 4.0);
}

static double positions[3 * COUNT];
static float normals[3 * COUNT], values[COUNT], truth[COUNT], other[COUNT];
static uint32_t texels[COUNT];

/* A square of points that look up, `height` over the origin. */
static vsh_points board(double half, double height) {
    put_square(SIDE, half, height, positions, normals);
    for (size_t i = 0; i < COUNT; ++i) {
        texels[i] = (uint32_t)(i % SIDE + 65536 * (i / SIDE));
    }
    return (vsh_points){COUNT, positions, normals, texels};
}

static const double UP[3] = {0.4, 1.0, 0.3};

static vsh_shade_stats shade(const vsh_occluders *casters, const vsh_points *points,
                             const vsh_shade_options *options, float *into) {
    const vsh_light light = sun(UP, RADIANS(6.0));
    return shade_points(casters, points, &light, options, NULL, into, NULL);
}

static double rmse_to_truth(const casting *c, const vsh_points *points) {
    const vsh_shade_options options = vsh_shade_options_default();
    const vsh_light light = sun(UP, RADIANS(6.0));
    see_light(c->triangles, NULL, COUNT, points->positions, points->normals, 1e-5, &light, 4096, truth);
    shade(occluders_of_caster(c), points, &options, values);
    return truth_compare(COUNT, values, truth, NULL).rmse;
}

/* test_occluders has casters without layers. */
TEST(a_layer_has_the_method_that_its_own_triangles_allow) {
    FREED shape *s = shape_new();
    add_box(s, -0.3, 0.2, -0.3, 0.3, 0.8, 0.3);
    FREED_BY(caster_free) casting c = make(s, 0.05);
    const vsh_points points = board(1.0, 0.0);
    const vsh_shade_options options = vsh_shade_options_default();
    vshi_layer layer = vshi_layer_default();
    layer.field = c.field; /* no triangles */
    const vsh_occluders casters = {
        .field = c.field, .triangles = c.triangles, .layers = &layer, .layer_count = 1};
    shade(&casters, &points, &options, values);
    layer.method = VSH_SHADOW_ADAPTIVE;
    shade(&casters, &points, &options, other);
    assert_memory_equal(values, other, sizeof values);
    assert_ok(vsh_shade_ao(&casters, &points, &options, NULL, values, NULL, NULL, NULL, &failure));
}

TEST(parts_thinner_than_voxels_are_reported_as_lost) {
    FREED shape *fence = shape_new(), *block = shape_new();
    for (int i = 0; i < 10; ++i) {
        add_box(fence, -1.0 + 0.2 * i, 0.0, 0.0, -0.9 + 0.2 * i, 1.0, 0.02);
    }
    add_box(block, -0.5, 0.0, 1.0, 0.5, 1.0, 2.0);
    const vsh_mesh meshes[2] = {shape_mesh(fence, "fence"), shape_mesh(block, "block")};
    const double voxels[3] = {0.12, 0.05, 0.012};
    for (int v = 0; v < 3; ++v) {
        FREED_BY(caster_free) casting c = caster_of_meshes(meshes, 2, voxels[v], 4.0);
        vshi_lost lost[2];
        assert_ok(vshi_field_find_lost(c.field, meshes, 2, c.triangles, lost, &failure));
        assert_less(lost[1].share, 0.005);
        if (v < 2) {
            assert_less(0.2, lost[0].share);
            assert_less(fabs(lost[0].thickness - 0.02), 0.001);
        } else {
            assert_less(lost[0].share, 0.005);
        }
    }
}

TEST(voxels_coarser_than_casters_add_no_error_to_exact) {
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
        shape_quad_at(cards, card);
    }
    const vsh_points points = board(1.0, 0.0);
    const shape *const shapes[2] = {slats, cards};
    for (int which = 0; which < 2; ++which) {
        for (double voxel = 0.2; voxel > 0.02; voxel *= 0.5) {
            FREED_BY(caster_free) casting c = make(shapes[which], voxel);
            assert_at_most(rmse_to_truth(&c, &points), 0.02);
        }
    }
}
