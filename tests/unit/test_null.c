/* Every call that returns a code refuses NULL where it needs something else, says so, and leaves NULL in the
 * place of a handle. */
#include "testing.h"

enum { SIDE = 4, COUNT = SIDE * SIDE };

static vsh_error error;
static void *made;

static void expect_refused(const char *call, vsh_result result) {
    assert_that(result == VSH_ERROR_ARGUMENT && error.message[0] != '\0' && made == NULL, "%s: %s%s", call,
                vsh_result_name(result), made != NULL ? ", and its place is as it was" : "");
    error.message[0] = '\0';
}

/* A call that makes no handle. */
#define REFUSED(call) (made = NULL, expect_refused(#call, (call)))

/* One that would make a handle in PLACE, which holds something else before. */
#define MAKES_NONE(call) (made = &error, expect_refused(#call, (call)))
#define PLACE (void *)&made

static double far_away(void *user, const double position[3]) {
    return position[0];
}

static void far_away_all(void *user, size_t count, const double *positions, double *distances) {}

TEST(casters_need_their_arguments) {
    const double square[8] = {-1, -1, 1, -1, 1, 1, -1, 1},
                 transform[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const size_t corners = 4;
    const vsh_grid_instance instance = {NULL, transform};
    vsh_distance distance = {0};
    const vsh_mesh mesh = {.name = "empty", .vertex_count = 3, .triangle_count = 1};
    vsh_mesh_report report;
    vsh_heights_source heights = {.columns = 2, .rows = 2, .size = {1, 1}, .height = 1};
    MAKES_NONE(vsh_grid_from_meshes(NULL, 1, NULL, NULL, PLACE, &error));
    MAKES_NONE(vsh_grid_from_meshes(&mesh, 1, NULL, NULL, PLACE, &error));
    REFUSED(vsh_grid_from_meshes(&mesh, 1, NULL, NULL, NULL, &error));
    MAKES_NONE(vsh_grid_from_sdf(NULL, NULL, NULL, PLACE, &error));
    REFUSED(vsh_grid_from_sdf(NULL, NULL, NULL, NULL, &error));
    MAKES_NONE(vsh_unwrap(NULL, 1, NULL, NULL, PLACE, &error));
    REFUSED(vsh_unwrap(&mesh, 1, NULL, NULL, NULL, &error));
    REFUSED(vsh_receiver_needs_unwrap(NULL, &mesh, 1, NULL, &(int32_t){0}, &error));
    REFUSED(vsh_receiver_needs_unwrap(&(vsh_receiver){0}, &mesh, 1, NULL, NULL, &error));
    REFUSED(vsh_uvs_measure(NULL, 16, 16, &(vsh_uvs_measures){0}, &error));
    REFUSED(vsh_uvs_measure(&mesh, 16, 16, NULL, &error));
    MAKES_NONE(vsh_grid_from_distance(NULL, NULL, NULL, PLACE, &error));
    MAKES_NONE(vsh_grid_from_distance(&distance, NULL, NULL, PLACE, &error));
    distance.distance = far_away;
    REFUSED(vsh_grid_from_distance(&distance, NULL, NULL, NULL, &error));
    distance.distance = NULL;
    MAKES_NONE(vsh_grid_from_distances(NULL, far_away_all, NULL, NULL, PLACE, &error));
    MAKES_NONE(vsh_grid_from_distances(&distance, NULL, NULL, NULL, PLACE, &error));
    REFUSED(vsh_grid_from_distances(&distance, far_away_all, NULL, NULL, NULL, &error));
    MAKES_NONE(vsh_grid_unite(NULL, 1, NULL, NULL, PLACE, &error));
    MAKES_NONE(vsh_grid_unite(&instance, 1, NULL, NULL, PLACE, &error));
    REFUSED(vsh_grid_unite(&instance, 1, NULL, NULL, NULL, &error));
    MAKES_NONE(vsh_grid_from_openvdb(NULL, 0, 0, NULL, PLACE, &error));
    REFUSED(vsh_grid_from_openvdb(&error, 0, 0, NULL, NULL, &error));
    REFUSED(vsh_grid_to_openvdb(NULL, 0, 0, &error, &error));
    REFUSED(vsh_volume_to_openvdb(NULL, 0, 0, 0, &error, &error));
    MAKES_NONE(vsh_grid_from_outline(NULL, 1.0, NULL, NULL, NULL, PLACE, &error));
    REFUSED(vsh_mesh_check(NULL, &report, &error));
    REFUSED(vsh_mesh_check(&mesh, NULL, &error));
    MAKES_NONE(vsh_model_read(NULL, NULL, PLACE, &error));
    REFUSED(vsh_model_read("a.obj", NULL, NULL, &error));
    MAKES_NONE(vsh_model_from_heights(NULL, 0, NULL, PLACE, &error));
    MAKES_NONE(vsh_model_from_heights(&heights, 0, NULL, PLACE, &error));
    REFUSED(vsh_model_from_heights(&heights, 0, NULL, NULL, &error));
    MAKES_NONE(vsh_outline_from_polygons(NULL, &corners, 1, NULL, PLACE, &error));
    MAKES_NONE(vsh_outline_from_polygons(square, NULL, 1, NULL, PLACE, &error));
    REFUSED(vsh_outline_from_polygons(square, &corners, 1, NULL, NULL, &error));
}

TEST(file_calls_need_paths_and_places) {
    vsh_vdb_entry entry;
    size_t count;
    char digest[VSH_DIGEST_TEXT];
    const char *const name = "ao";
    const vsh_image unnamed = {1, 1, 1, NULL, NULL, NULL}, empty = {1, 1, 1, &name, NULL, NULL};
    MAKES_NONE(vsh_grid_read(NULL, NULL, NULL, PLACE, &error));
    REFUSED(vsh_grid_read("a.vdb", NULL, NULL, NULL, &error));
    REFUSED(vsh_grid_write(NULL, "a.vdb", NULL, NULL, 0, &error));
    REFUSED(vsh_vdb_list(NULL, NULL, &entry, 1, &count, &error));
    REFUSED(vsh_vdb_list("a.vdb", NULL, NULL, 1, &count, &error));
    REFUSED(vsh_vdb_list("a.vdb", NULL, &entry, 1, NULL, &error));
    MAKES_NONE(vsh_voxels_from_vdb(NULL, NULL, NULL, PLACE, &error));
    REFUSED(vsh_voxels_from_vdb("a.vdb", NULL, NULL, NULL, &error));
    REFUSED(vsh_volume_write(NULL, "a.vdb", 0, NULL, 0, &error));
    MAKES_NONE(vsh_scene_read(NULL, NULL, PLACE, &error));
    REFUSED(vsh_scene_read("a.json", NULL, NULL, &error));
    MAKES_NONE(vsh_lights_read(NULL, 0.1, 0.0, 0.0, NULL, PLACE, &count, &error));
    REFUSED(vsh_lights_read("a.glb", 0.1, 0.0, 0.0, NULL, NULL, &count, &error));
    MAKES_NONE(vsh_lights_read("a.glb", 0.1, 0.0, 0.0, NULL, PLACE, NULL, &error));
    MAKES_NONE(vsh_flat_scene_read(NULL, NULL, PLACE, &error));
    REFUSED(vsh_flat_scene_read("a.json", NULL, NULL, &error));
    REFUSED(vsh_file_digest(NULL, NULL, digest, &error));
    REFUSED(vsh_file_digest("a.exr", NULL, NULL, &error));
    MAKES_NONE(vsh_image_read(NULL, NULL, PLACE, &error));
    REFUSED(vsh_image_read("a.exr", NULL, NULL, &error));
    REFUSED(vsh_image_write(NULL, &empty, NULL, &error));
    REFUSED(vsh_image_write("a.exr", NULL, NULL, &error));
    REFUSED(vsh_image_write("a.exr", &unnamed, NULL, &error));
    REFUSED(vsh_image_write("a.exr", &empty, NULL, &error));
    REFUSED(vsh_image_check("a.exr", NULL, NULL, &error));
}

TEST(scenes_need_their_arguments) {
    const vsh_scene scene = {0};
    vsh_scene set = vsh_scene_default();
    vsh_flat_scene flat = vsh_flat_scene_default();
    REFUSED(vsh_scene_set(NULL, "rays", "1", &error));
    REFUSED(vsh_scene_set(&set, NULL, "1", &error));
    REFUSED(vsh_receiver_set(NULL, "--size", "1", &error));
    REFUSED(vsh_flat_scene_set(NULL, "--size", "1", &error));
    REFUSED(vsh_flat_scene_set(&flat, NULL, "1", &error));
    MAKES_NONE(vsh_assets_load(NULL, NULL, PLACE, &error));
    REFUSED(vsh_assets_load(&set, NULL, NULL, &error));
    MAKES_NONE(vsh_scene_casters(NULL, NULL, NULL, PLACE, &error));
    MAKES_NONE(vsh_scene_casters(&scene, NULL, NULL, PLACE, &error));
    MAKES_NONE(vsh_scene_occluders(NULL, NULL, NULL, NULL, PLACE, &error));
    MAKES_NONE(vsh_scene_occluders(&scene, NULL, NULL, NULL, PLACE, &error));
    MAKES_NONE(vsh_provenance_create(NULL, NULL, PLACE, &error));
    REFUSED(vsh_bake_scene(NULL, NULL, NULL, NULL, &error));
    REFUSED(vsh_merge_scene(NULL, NULL, NULL, NULL, &error));
    REFUSED(vsh_forecast_scene(NULL, NULL, NULL, NULL, &error));
    REFUSED(vsh_receiver_check(NULL, 0, &error));
    MAKES_NONE(vsh_receiver_charts(NULL, 0, NULL, 0, NULL, PLACE, &error));
}

/* Something that casts nothing. */
static vsh_occluders *no_casters(void) {
    vshi_occluders_own own = {.field = NULL};
    vsh_occluders *casters = NULL;
    assert_int_equal(vshi_field_create_empty(1.0, &own.field, &error), VSH_OK);
    const vshi_occluder_parts parts = {.field = own.field};
    assert_int_equal(vshi_occluders_make(&parts, &own, &casters, &error), VSH_OK);
    return casters;
}

TEST(shading_needs_its_arguments) {
    OWNED(vsh_occluders) *casters = no_casters();
    const vsh_light light = vsh_light_default();
    const double positions[3] = {0, 0, 0};
    const float normals[3] = {0, 1, 0};
    const vsh_points points = {1, positions, normals, NULL}, nowhere = {1, NULL, normals, NULL},
                     turned = {1, positions, NULL, NULL};
    float value, direction[3];
    REFUSED(vsh_light_check(NULL, &error));
    MAKES_NONE(vsh_occluders_create(NULL, 1, NULL, NULL, PLACE, &error));
    REFUSED(vsh_shade_shadow(NULL, &points, &light, NULL, NULL, &value, NULL, NULL, &error));
    REFUSED(vsh_shade_shadow(casters, NULL, &light, NULL, NULL, &value, NULL, NULL, &error));
    REFUSED(vsh_shade_shadow(casters, &nowhere, &light, NULL, NULL, &value, NULL, NULL, &error));
    REFUSED(vsh_shade_shadow(casters, &points, NULL, NULL, NULL, &value, NULL, NULL, &error));
    REFUSED(vsh_shade_shadow(casters, &points, &light, NULL, NULL, NULL, NULL, NULL, &error));
    REFUSED(vsh_shade_ao(NULL, &points, NULL, NULL, &value, NULL, NULL, NULL, &error));
    REFUSED(vsh_shade_ao(casters, NULL, NULL, NULL, &value, NULL, NULL, NULL, &error));
    REFUSED(vsh_shade_ao(casters, &nowhere, NULL, NULL, &value, NULL, NULL, NULL, &error));
    REFUSED(vsh_shade_ao(casters, &turned, NULL, NULL, &value, NULL, NULL, NULL, &error));
    REFUSED(vsh_shade_ao(casters, &points, NULL, NULL, NULL, NULL, NULL, NULL, &error));
    REFUSED(vsh_shade_ao(NULL, &points, NULL, NULL, &value, NULL, direction, NULL, &error));
    REFUSED(vsh_shade_ao(casters, &points, NULL, NULL, NULL, NULL, direction, NULL, &error));
    MAKES_NONE(vsh_query_create(NULL, &light, 1, NULL, PLACE, &error));
    MAKES_NONE(vsh_query_create(casters, NULL, 1, NULL, PLACE, &error));
    REFUSED(vsh_query_create(casters, &light, 1, NULL, NULL, &error));
    vsh_query *query = NULL;
    assert_int_equal(vsh_query_create(casters, &light, 1, NULL, &query, &error), VSH_OK);
    const vsh_query_output output = vsh_query_output_default();
    vsh_point_layout layout = vsh_point_layout_default();
    REFUSED(vsh_query_points(NULL, &points, NULL, NULL, &output, NULL, &error));
    REFUSED(vsh_query_points(query, NULL, NULL, NULL, &output, NULL, &error));
    REFUSED(vsh_query_points(query, &nowhere, NULL, NULL, &output, NULL, &error));
    REFUSED(vsh_query_points(query, &points, NULL, NULL, NULL, NULL, &error));
    REFUSED(vsh_query_points(query, &nowhere, &layout, NULL, &output, NULL, &error));
    layout.float_positions = normals;
    REFUSED(vsh_query_points(query, &points, &layout, NULL, &output, NULL, &error));
    vsh_query_free(query);
}

TEST(baking_needs_its_arguments) {
    OWNED(vsh_occluders) *casters = no_casters();
    OWNED(vsh_voxels) *voxels = NULL;
    OWNED(vsh_volume) *volume = NULL;
    const double low[3] = {0, 0, 0}, high[3] = {1, 1, 1};
    const int32_t index[3] = {0, 0, 0}, size[3] = {1, 1, 1};
    const vsh_light light = vsh_light_default();
    const vsh_lightmap lightmap = {0};
    float values[COUNT];
    const vsh_flat_map flat = {NULL, NULL, NULL};
    const vsh_flat_scene plane = vsh_flat_scene_default();
    const vsh_mesh mesh = {.name = "none", .vertex_count = 3, .triangle_count = 1};
    assert_int_equal(vsh_voxels_from_box(low, high, 0.5, NULL, &voxels, &error), VSH_OK);
    assert_int_equal(vsh_bake_volume(casters, voxels, &light, 1, NULL, NULL, &volume, NULL, &error), VSH_OK);
    MAKES_NONE(vsh_charts_create(NULL, 1, NULL, NULL, NULL, PLACE, &error));
    REFUSED(vsh_charts_create(&mesh, 1, NULL, NULL, NULL, NULL, &error));
    REFUSED(vsh_bake_lightmap(casters, NULL, &light, 1, NULL, NULL, &lightmap, NULL, &error));
    REFUSED(vsh_bake_lightmap(NULL, NULL, &light, 1, NULL, NULL, &lightmap, NULL, &error));
    REFUSED(stitch_one(NULL, &lightmap, 1, NULL, NULL, NULL, &error));
    vsh_charts *charts = NULL;
    const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, places[6] = {0, 0, 1, 0, 0, 1};
    const uint32_t triangle[3] = {0, 1, 2};
    const vsh_mesh one = mesh_of_arrays(NULL, corners, places, 3, triangle, 1);
    assert_int_equal(vsh_charts_create(&one, 1, NULL, NULL, NULL, &charts, &error), VSH_OK);
    REFUSED(stitch_one(charts, NULL, 1, NULL, NULL, NULL, &error));
    REFUSED(vsh_lightmap_fill_hidden(charts, NULL, 0, NULL, NULL, &error));
    REFUSED(vsh_lightmap_fill_hidden(NULL, &lightmap, 0, NULL, NULL, &error));
    vsh_charts_free(charts);
    REFUSED(vsh_flat_bake(NULL, NULL, &flat, &error));
    REFUSED(vsh_flat_bake(&plane, NULL, NULL, &error));
    MAKES_NONE(vsh_voxels_from_grid(NULL, 1.0, NULL, PLACE, &error));
    MAKES_NONE(vsh_voxels_from_box(NULL, high, 0.5, NULL, PLACE, &error));
    MAKES_NONE(vsh_voxels_from_box(low, NULL, 0.5, NULL, PLACE, &error));
    REFUSED(vsh_voxels_from_box(low, high, 0.5, NULL, NULL, &error));
    MAKES_NONE(vsh_bake_volume(NULL, voxels, &light, 1, NULL, NULL, PLACE, NULL, &error));
    MAKES_NONE(vsh_bake_volume(casters, NULL, &light, 1, NULL, NULL, PLACE, NULL, &error));
    MAKES_NONE(vsh_bake_volume(casters, voxels, NULL, 1, NULL, NULL, PLACE, NULL, &error));
    REFUSED(vsh_bake_volume(casters, voxels, &light, 1, NULL, NULL, NULL, NULL, &error));
    REFUSED(vsh_grid_copy(NULL, index, size, values, &error));
    REFUSED(vsh_volume_copy(NULL, 0, index, size, values, &error));
    REFUSED(vsh_volume_copy(volume, 0, NULL, size, values, &error));
    REFUSED(vsh_volume_copy(volume, 0, index, NULL, values, &error));
    REFUSED(vsh_volume_copy(volume, 0, index, size, NULL, &error));
}

TEST(drawing_and_comparing_need_their_arguments) {
    OWNED(vsh_occluders) *casters = no_casters();
    const vsh_surface nothing = {NULL, {0.5, 0.5, 0.5}};
    const vsh_light light = vsh_light_default();
    vsh_render_options options = vsh_render_options_default();
    options.width = options.height = SIDE;
    float color[3 * COUNT], depth[COUNT], alpha[COUNT], normal[3 * COUNT];
    const vsh_picture picture = {color, depth, alpha, normal}, none = {NULL, NULL, NULL, NULL};
    float *const rgb[3] = {depth, depth, depth}, *const no_green[3] = {depth, NULL, depth};
    const double bounds[3] = {0, 0, 0};
    vsh_measures measures;
    const vsh_compared compared = {0}, planeless = {.size = {1, 1, 1}};
    REFUSED(vsh_render(NULL, 1, casters, &light, 1, &options, NULL, &picture, NULL, &error));
    REFUSED(vsh_render(&nothing, 1, casters, &light, 1, &options, NULL, &picture, NULL, &error));
    REFUSED(vsh_render(NULL, 0, NULL, &light, 1, &options, NULL, &picture, NULL, &error));
    REFUSED(vsh_render(NULL, 0, casters, NULL, 1, &options, NULL, &picture, NULL, &error));
    REFUSED(vsh_render(NULL, 0, casters, &light, 1, &options, NULL, NULL, NULL, &error));
    REFUSED(vsh_camera_orbit(NULL, 0.0, &error));
    REFUSED(vsh_camera_frame(NULL, bounds, bounds, 0.0, 0.0, 1.0, &error));
    REFUSED(vsh_camera_frame(&options.camera, NULL, bounds, 0.0, 0.0, 1.0, &error));
    REFUSED(vsh_camera_frame(&options.camera, bounds, NULL, 0.0, 0.0, 1.0, &error));
    REFUSED(vsh_picture_encode(NULL, SIDE, SIDE, 1.0, rgb, NULL, &error));
    REFUSED(vsh_picture_encode(&none, SIDE, SIDE, 1.0, rgb, NULL, &error));
    REFUSED(vsh_picture_encode(&picture, SIDE, SIDE, 1.0, NULL, NULL, &error));
    REFUSED(vsh_picture_encode(&picture, SIDE, SIDE, 1.0, no_green, NULL, &error));
    REFUSED(vsh_compare(NULL, NULL, NULL, &measures, &error));
    REFUSED(vsh_compare(&compared, NULL, NULL, NULL, &error));
    REFUSED(vsh_compare(&planeless, NULL, NULL, &measures, &error));
    vsh_accuracy accuracy;
    REFUSED(vsh_compare_accuracy(NULL, 1, NULL, &accuracy, &error));
    REFUSED(vsh_compare_accuracy(&compared, 1, NULL, &accuracy, &error));
    REFUSED(vsh_compare_accuracy(&compared, 0, NULL, NULL, &error));
    vsh_comparison *comparison;
    REFUSED(vsh_compare_files(NULL, "new.exr", NULL, NULL, &comparison, &error));
    REFUSED(vsh_compare_files("golden.exr", NULL, NULL, NULL, &comparison, &error));
    REFUSED(vsh_compare_files("golden.exr", "new.exr", NULL, NULL, NULL, &error));
    const vsh_view_bake no_bake = vsh_view_bake_default();
    vsh_view_bake seen = vsh_view_bake_default();
    seen.model = "a.obj";
    REFUSED(vsh_view_write(NULL, &seen, NULL, NULL, &error));
    REFUSED(vsh_view_write("a.html", NULL, NULL, NULL, &error));
    REFUSED(vsh_view_write("a.html", &no_bake, NULL, NULL, &error));
    REFUSED(vsh_view_write("a.html", &seen, &no_bake, NULL, &error));
    seen.plane_count = 1;
    REFUSED(vsh_view_write("a.html", &seen, NULL, NULL, &error));
    const vsh_scene scene = {.caster_count = 0};
    REFUSED(vsh_view_write_scene(NULL, "a", &scene, NULL, &error));
    REFUSED(vsh_view_write_scene("a.html", NULL, &scene, NULL, &error));
    REFUSED(vsh_view_write_scene("a.html", "a", NULL, NULL, &error));
    assert_int_equal(vsh_comparison_alike(NULL), 0);
    assert_null(vsh_comparison_channel(NULL, 0));
    assert_null(vsh_comparison_problem(NULL, 0));
    vsh_comparison_free(NULL);
}
