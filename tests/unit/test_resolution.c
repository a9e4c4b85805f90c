/* Resolutions where the user gives none, and casters without voxels. */
#include "rays.h"
#include "scenes.h"
#include "shading.h"
#include "testing.h"

enum { POINTS = 400 };

static vsh_occluders *plate_of(int32_t resolution) {
    const vsh_mesh mesh = plate_mesh();
    vsh_occluders_options options = vsh_occluders_options_default();
    options.grid.resolution = resolution;
    vsh_occluders *made = NULL;
    assert_ok(vsh_occluders_create(&mesh, 1, resolution > 0 ? &options : NULL, NULL, &made, &failure));
    return made;
}

/* Below and beside the plate, looking up. */
static void scatter(double positions[POINTS][3], float normals[POINTS][3]) {
    uint64_t counter = 3;
    for (int i = 0; i < POINTS; ++i) {
        const double x = between(&counter, -2, 2), y = between(&counter, -1, 0.7);
        put_point(positions[0], normals[0], (size_t)i, x, y, between(&counter, -2, 2));
    }
}

/* Root mean square of the differences; more than 20 points must be partly lit. */
static double error_of(const float lit[POINTS], const float truth[POINTS]) {
    double square = 0.0;
    int partly = 0;
    for (int i = 0; i < POINTS; ++i) {
        square += pow((double)lit[i] - (double)truth[i], 2.0);
        partly += truth[i] > 0.05f && truth[i] < 0.95f;
    }
    assert_true(partly > 20);
    return sqrt(square / POINTS);
}

/* --- casters without voxels */

TEST(triangles_alone_give_shadows_within_the_error_of_the_truth) {
    OWNED(vsh_occluders) *made = plate_of(0);
    const vsh_occluders_info info = occluders_info(made);
    assert_true(info.voxel_size == 0.0 && info.field_bytes == 0 && info.levels == 0 && info.has_triangles);
    double positions[POINTS][3];
    float normals[POINTS][3], lit[POINTS], truth[POINTS];
    scatter(positions, normals);
    const vsh_points points = {POINTS, positions[0], normals[0], NULL};
    const vshi_occluder_parts parts = parts_of(made);
    for (int lamp = 0; lamp < 2; ++lamp) {
        vsh_light light = vsh_light_default();
        light.angle = 0.3;
        if (lamp) {
            light.type = VSH_LIGHT_SPHERE;
            light.position[1] = 3.0;
            light.radius = 0.4;
        }
        vsh_shade_options options = vsh_shade_options_default();
        vsh_shade_stats stats = vsh_shade_stats_zero();
        assert_ok(vsh_shade_shadow(made, &points, &light, &options, NULL, lit, NULL, &stats, &failure));
        assert_true(stats.samples == 0 && stats.marches == 0 && stats.rays > 0);
        see_light(parts.triangles, NULL, POINTS, positions[0], normals[0], 1e-6, &light, 4096, truth);
        assert_true(error_of(lit, truth) < options.max_error);
    }
}

TEST(ao_by_rays_has_the_bits_that_it_has_with_voxels) {
    double positions[POINTS][3];
    float normals[POINTS][3], ao[2][POINTS];
    scatter(positions, normals);
    const vsh_points points = {POINTS, positions[0], normals[0], NULL};
    for (int voxels = 0; voxels < 2; ++voxels) {
        OWNED(vsh_occluders) *made = plate_of(voxels ? 64 : 0);
        assert_ok(vsh_shade_ao(made, &points, NULL, NULL, ao[voxels], NULL, NULL, NULL, &failure));
    }
    assert_memory_equal(ao[0], ao[1], sizeof ao[0]);
}

TEST(methods_that_need_voxels_are_refused_without_them) {
    OWNED(vsh_occluders) *made = plate_of(0);
    const double at[3] = {0.0, 0.0, 0.0};
    const float up[3] = {0.0f, 1.0f, 0.0f};
    const vsh_points points = {1, at, up, NULL};
    const vsh_light light = vsh_light_default();
    float value;
    for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_AUTO; ++method) {
        vsh_shade_options options = vsh_shade_options_default();
        options.method = method;
        const bool traced = method >= VSH_SHADOW_EXACT;
        assert_int_equal(
            vsh_shade_shadow(made, &points, &light, &options, NULL, &value, NULL, NULL, &failure),
            traced ? VSH_OK : VSH_ERROR_ARGUMENT);
        assert_true(traced || strstr(failure.message, "have no voxels") != NULL);
    }
    for (int32_t method = VSH_AO_TAPS; method <= VSH_AO_AUTO; ++method) {
        vsh_shade_options options = vsh_shade_options_default();
        options.ao_method = method;
        assert_int_equal(vsh_shade_ao(made, &points, &options, NULL, &value, NULL, NULL, NULL, &failure),
                         method >= VSH_AO_EXACT ? VSH_OK : VSH_ERROR_ARGUMENT);
    }
    const vshi_occluder_parts parts = parts_of(made);
    vsh_field_sample(parts.field, 1, at, &value);
    assert_true(isnan(value));
    OWNED(vsh_query) *query = query_of(made, &light, 1, NULL);
    vsh_query_output output = vsh_query_output_default();
    output.distance = &value;
    assert_int_equal(vsh_query_points(query, &points, NULL, NULL, &output, NULL, &failure),
                     VSH_ERROR_ARGUMENT);
}

/* --- chosen resolutions */

static int32_t chosen(const char *more, const char *casters, double points) {
    char text[2048];
    snprintf(text, sizeof text, "{\"casters\": [%s], \"receivers\": []%s}", casters, more);
    OWNED(vsh_scene) *scene = parse("/scene.json", text);
    OWNED(vsh_assets) *assets = NULL;
    assert_ok(vsh_assets_load(scene, NULL, &assets, &failure));
    const int32_t resolution = vshi_scene_resolution(scene, assets, NULL, points);
    return resolution;
}

#define MESH "{\"mesh\": \"" VSH_ASSETS "/thin.glb\"}"
#define BALL "{\"sdf\": {\"shape\": \"sphere\", \"radius\": 1}}"
#define SUN                                                                                                  \
    ", \"lights\": [{\"name\": \"sun\", \"type\": \"directional\", \"direction\": [0, 1, 0], "               \
    "\"angle_deg\": 5}]"
#define AO ", \"ao\": {\"distance\": 0.6}"
#define MARCHED ", \"method\": \"adaptive\""
#define MARCHED_AO ", \"ao\": {\"distance\": 0.6, \"method\": \"adaptive\"}"

TEST(traced_casters_get_voxels_only_where_shadows_pay_for_them) {
    assert_int_equal(chosen(AO, MESH, 1e9), 0);
    assert_int_equal(chosen(SUN AO, MESH, 0.0), 0);
    assert_int_equal(chosen(SUN AO, MESH, 64.0 * 64.0), 0);
    int32_t last = 0;
    for (double points = 1e4; points < 1e10; points *= 10.0) {
        const int32_t now = chosen(SUN, MESH, points);
        assert_true(now >= last);
        assert_true(chosen(SUN ", \"max_error\": 0.002", MESH, points) >= now);
        last = now;
    }
    assert_true(last >= 96);
}

TEST(marched_shapes_get_as_many_as_their_error_asks_for) {
    assert_int_equal(chosen(SUN AO, BALL, 1e6), 0); /* traced */
    assert_int_equal(chosen(SUN MARCHED, BALL, 1e6), 200);
    assert_int_equal(chosen(SUN MARCHED ", \"max_error\": 0.01", BALL, 1e6), 400);
    assert_int_equal(chosen(SUN MARCHED ", \"max_error\": 0.05", BALL, 1e6), 128);
    assert_int_equal(chosen(SUN MARCHED ", \"max_error\": 0.0001", BALL, 1e6), 1024);
    assert_int_equal(chosen(MARCHED_AO ", \"max_error\": 0.005", BALL, 1e6), 240);
    assert_int_equal(chosen(SUN ", \"method\": \"cone\"", BALL, 1e6), 256);
}

TEST(resolutions_that_are_given_stay) {
    assert_int_equal(chosen(SUN ", \"resolution\": 64", MESH, 1.0), VSHI_RESOLUTION_NAMED);
    assert_int_equal(chosen(SUN ", \"resolution\": 256", MESH, 1.0), VSHI_RESOLUTION_NAMED);
    assert_int_equal(chosen(SUN ", \"voxel_size\": 0.5", BALL, 1.0), VSHI_RESOLUTION_NAMED);
    assert_int_equal(chosen(SUN ", \"method\": \"cone\"", MESH, 1.0), 256);
    assert_int_equal(chosen(SUN ", \"method\": \"adaptive\"", MESH, 1.0), 256);
}
