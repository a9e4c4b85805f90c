/* The channel `sky`: the visible share of an even sky, with casters at any distance, against form factors. */
#include "shading.h"
#include "testing.h"
#include "truth/metrics.h"

enum { BOXES = 5, SIDE = 48, COUNT = SIDE * SIDE };

/* A floor at y = 0 between four walls of a height: a well, or a trench where they are far apart along z. */
typedef struct stage {
    truth_solid boxes[BOXES];
    double half[2], height;
    vsh_field *field;
    vshi_triangles *triangles;
    float corners[12];
    vsh_mesh mesh; /* of the charts */
    vsh_charts *charts;
    float sky[COUNT], coverage[COUNT];
    vsh_bake_error errors[2]; /* of AO, which is not baked, and of the sky */
} stage;

static void make_triangles(stage *s, size_t count) {
    float corners[BOXES][24];
    vsh_mesh meshes[BOXES];
    for (size_t i = 0; i < count; ++i) {
        double low[3], high[3];
        for (size_t k = 0; k < 3; ++k) {
            low[k] = s->boxes[i].center[k] - s->boxes[i].half[k];
            high[k] = s->boxes[i].center[k] + s->boxes[i].half[k];
        }
        meshes[i] = box_mesh(corners[i], low, high);
    }
    s->triangles = triangles_from(meshes, count);
}

static vsh_lightmap_options sizes_of(int32_t spacing) {
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = SIDE;
    options.ao_spacing = spacing;
    return options;
}

/* A receiver by three of its corners; along u, then v. */
static void receive(stage *s, const double origin[3], const double u[3], const double v[3], int32_t spacing) {
    for (size_t axis = 0; axis < 3; ++axis) {
        s->corners[axis] = (float)origin[axis];
        s->corners[3 + axis] = (float)(origin[axis] + u[axis]);
        s->corners[6 + axis] = (float)(origin[axis] + u[axis] + v[axis]);
        s->corners[9 + axis] = (float)(origin[axis] + v[axis]);
    }
    s->mesh = quad_mesh("receiver", s->corners, QUAD_UVS);
    const vsh_lightmap_options options = sizes_of(spacing);
    vsh_charts_free(s->charts);
    s->charts = charts_from(&s->mesh, 1, &options);
}

static void receive_floor(stage *s, int32_t spacing) {
    const double x = s->half[0], z = s->half[1];
    receive(s, (double[]){-x, 0.0, z}, (double[]){2.0 * x, 0.0, 0.0}, (double[]){0.0, 0.0, -2.0 * z},
            spacing);
}

/* The floor alone has no walls. */
static stage *set_up(double half_x, double half_z, double height, size_t boxes) {
    const double x = half_x, z = half_z, h = 0.5 * height;
    stage *s = calloc(1, sizeof *s);
    *s = (stage){.boxes = {{TRUTH_BOX, {0.0, -0.25, 0.0}, {x + 0.5, 0.25, z + 0.5}, 0.0, 0.0},
                           {TRUTH_BOX, {-x - 0.25, h, 0.0}, {0.25, h, z + 0.5}, 0.0, 0.0},
                           {TRUTH_BOX, {x + 0.25, h, 0.0}, {0.25, h, z + 0.5}, 0.0, 0.0},
                           {TRUTH_BOX, {0.0, h, -z - 0.25}, {x + 0.5, h, 0.25}, 0.0, 0.0},
                           {TRUTH_BOX, {0.0, h, z + 0.25}, {x + 0.5, h, 0.25}, 0.0, 0.0}},
                 .half = {half_x, half_z},
                 .height = height};
    s->field = field_of((truth_scene){s->boxes, boxes}, 0.04, 4.0);
    make_triangles(s, boxes);
    receive_floor(s, 4);
    return s;
}

static void tear_down(stage **held) {
    stage *s = *held;
    vsh_charts_free(s->charts);
    vshi_triangles_free(s->triangles);
    vshi_field_free(s->field);
    free(s);
}

static vsh_result bake_sky(stage *s, int32_t method, int32_t up, vsh_error *error) {
    vsh_shade_options shade = vsh_shade_options_default();
    shade.ao_method = method;
    const vsh_lightmap lightmap = {.sky = s->sky, .asked = {.sky = up}, .coverage = s->coverage};
    vsh_occluders casters = *occluders_traced(s->field, s->triangles);
    casters.true_triangles = s->triangles;
    vsh_bake_stats stats = vsh_bake_stats_zero();
    stats.errors = s->errors;
    memset(s->errors, 0, sizeof s->errors);
    return vsh_bake_lightmap(&casters, s->charts, NULL, 0, &shade, NULL, &lightmap, &stats, error);
}

static void bake_well(stage *s, int32_t method, int32_t up) {
    assert_ok(bake_sky(s, method, up, &failure));
}

/* Form factor of a rectangle a × b that is c above a point, its corner straight above it. */
static double corner(double a, double b, double c) {
    const double x = a / c, y = b / c, p = sqrt(1.0 + x * x), q = sqrt(1.0 + y * y);
    return (x / p * atan(y / p) + y / q * atan(x / q)) / (2.0 * PI);
}

static double opening(const stage *s, double x, double z) {
    const double a = s->half[0] - x, b = s->half[0] + x, c = s->half[1] - z, d = s->half[1] + z;
    return corner(a, c, s->height) + corner(a, d, s->height) + corner(b, c, s->height) +
           corner(b, d, s->height);
}

/* `bias`: that of exact, at most, either way. */
static void check_floor(double half_x, double half_z, int32_t spacing, double bias) {
    static const int32_t methods[] = {VSH_AO_EXACT, VSH_AO_ADAPTIVE};
    FREED_BY(tear_down) stage *s = set_up(half_x, half_z, 1.0, BOXES);
    receive_floor(s, spacing);
    for (int m = 0; m < 2; ++m) {
        bake_well(s, methods[m], VSH_UP_Y);
        static float truth[COUNT];
        for (size_t i = 0; i < COUNT; ++i) {
            const double x = s->half[0] * (2.0 * ((double)(i % SIDE) + 0.5) / SIDE - 1.0);
            const double z = s->half[1] * (2.0 * ((double)(i / SIDE) + 0.5) / SIDE - 1.0);
            truth[i] = (float)opening(s, x, z);
        }
        const truth_metrics off = truth_compare(COUNT, s->sky, truth, s->coverage);
        const double said = vsh_bake_error_rmse(&s->errors[1]), count = (double)off.count;
        assert_true(count > COUNT * 8 / 10);
        assert_true(off.rmse < 0.02 && said < 0.02);
        assert_true(methods[m] != VSH_AO_EXACT || fabs(off.bias) < bias);
        assert_true(s->errors[0].values == 0.0 && s->errors[1].values == count);
        assert_true(s->errors[1].compared == count && said > 0.8 * off.rmse);
    }
}

TEST(the_bottom_of_wells_and_trenches_sees_their_opening) {
    check_floor(1.0, 1.0, 4, 0.007);
    check_floor(0.5, 6.0, 4, 0.007);
    check_floor(1.0, 1.0, 1, 0.001);
}

TEST(open_floors_walls_and_ceilings_see_one_half_and_nothing) {
    static const int32_t methods[] = {VSH_AO_EXACT, VSH_AO_ADAPTIVE, VSH_AO_RAYS};
    static const struct {
        int32_t up;
        float value;
    } of_floor[] = {{VSH_UP_Y, 1.0f}, {VSH_UP_X, 0.5f}, {VSH_UP_MINUS_Z, 0.5f}, {VSH_UP_MINUS_Y, 0.0f}};
    FREED_BY(tear_down) stage *s = set_up(2.0, 2.0, 1.0, 1);
    for (int m = 0; m < 3; ++m) {
        for (size_t u = 0; u < COUNT_OF(of_floor); ++u) {
            bake_well(s, methods[m], of_floor[u].up);
            for (size_t i = 0; i < COUNT; ++i) {
                assert_true(s->sky[i] == of_floor[u].value);
            }
        }
    }
}

TEST(a_sky_without_an_axis_or_rays_is_refused) {
    FREED_BY(tear_down) stage *s = set_up(1.0, 1.0, 1.0, 1);
    assert_fails(bake_sky(s, VSH_AO_ADAPTIVE, 0, &failure), VSH_ERROR_ARGUMENT, "asked.sky 0");
    assert_int_equal(bake_sky(s, VSH_AO_ADAPTIVE, 7, &failure), VSH_ERROR_ARGUMENT);
    assert_fails(bake_sky(s, VSH_AO_CONES, VSH_UP_Y, &failure), VSH_ERROR_ARGUMENT, "cones");
}
