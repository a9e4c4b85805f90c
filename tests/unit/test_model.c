/* Models: what files of every format become. test_model_errors.c has what is refused. */
#include "models.h"

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance)) {
        fail_msg("%.17g, expected %.17g within %g", value, expected, tolerance);
    }
}

/* The UV at the corner of the quad that lies at (x, y) in local space. */
static const float *uv_at(const vsh_mesh *mesh, float x, float y) {
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        if (mesh->positions[3 * v] == x && mesh->positions[3 * v + 1] == y) {
            return mesh->uvs + 2 * v;
        }
    }
    fail_msg("no corner at (%g, %g)", (double)x, (double)y);
    return NULL;
}

static void assert_quad_uvs(const vsh_mesh *mesh, float scale) {
    static const float corners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    assert_non_null(mesh->uvs);
    for (int i = 0; i < 4; ++i) {
        const float *uv = uv_at(mesh, corners[i][0], corners[i][1]);
        assert_near(uv[0], scale * quad_uv[i][0], 0.0);
        assert_near(uv[1], scale * quad_uv[i][1], 0.0);
    }
}

static void uvs_point_up_whatever_the_format(void **state) {
    (void)state;
    char gltf[4096];
    quad_gltf(gltf, one_node, NULL, 3);
    unsigned char glb[8192];
    const size_t glb_size = quad_glb(glb);
    const struct {
        const char *name;
        const void *bytes;
        size_t size;
    } files[] = {
        {"quad.obj", quad_obj, strlen(quad_obj)},
        {"quad.ply", quad_ply, strlen(quad_ply)},
        {"quad.fbx", quad_fbx, strlen(quad_fbx)},
        {"quad.gltf", gltf, strlen(gltf)},
        {"quad.glb", glb, glb_size},
    };
    for (size_t i = 0; i < sizeof files / sizeof files[0]; ++i) {
        vsh_model *model = read_good(files[i].name, files[i].bytes, files[i].size);
        assert_int_equal(vsh_model_mesh_count(model), 1);
        const vsh_mesh mesh = vsh_model_mesh(model, 0, 0);
        assert_int_equal(mesh.triangle_count, 2);
        assert_quad_uvs(&mesh, 1.0F);
        assert_null(mesh.normals); /* none in the file, none made up */
        const vsh_mesh_report report = check(model, 0);
        assert_near(report.area, 1.0, 1e-12);
        assert_int_equal(report.open_edges, 4);
        vsh_model_free(model);
    }
}

static void the_second_uv_set_is_the_default(void **state) {
    (void)state;
    char gltf[4096];
    quad_gltf(gltf, one_node, NULL, 3);
    vsh_model *model = read_text("sets.gltf", gltf);
    assert_int_equal(vsh_model_uv_sets(model, 0), 2);
    vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    assert_quad_uvs(&mesh, 0.5F);
    mesh = vsh_model_mesh(model, 0, 1);
    assert_quad_uvs(&mesh, 0.5F);
    mesh = vsh_model_mesh(model, 0, 0);
    assert_quad_uvs(&mesh, 1.0F);
    static const int32_t missing[] = {2, 7, 8, 1000, -2};
    for (size_t i = 0; i < sizeof missing / sizeof missing[0]; ++i) {
        assert_null(vsh_model_mesh(model, 0, missing[i]).uvs);
    }
    vsh_model_free(model);
    model = read_text("quad.obj", quad_obj);
    assert_int_equal(vsh_model_uv_sets(model, 0), 1);
    mesh = vsh_model_mesh(model, 0, -1);
    assert_quad_uvs(&mesh, 1.0F);
    vsh_model_free(model);
}

static void nodes_are_instances_that_share_arrays(void **state) {
    (void)state;
    char gltf[4096];
    quad_gltf(gltf, instances, NULL, 3);
    vsh_model *model = read_text("instances.gltf", gltf);
    assert_int_equal(vsh_model_mesh_count(model), 2);
    const vsh_mesh moved = vsh_model_mesh(model, 0, 0), mirrored = vsh_model_mesh(model, 1, 0);
    assert_string_equal(moved.name, "moved/quad");
    assert_string_equal(mirrored.name, "mirrored/quad");
    assert_ptr_equal(moved.positions, mirrored.positions);
    assert_ptr_equal(moved.indices, mirrored.indices);
    for (size_t v = 0; v < moved.vertex_count; ++v) {
        const vshi_vec p = vshi_vec_off(moved.positions + 3 * v);
        const vshi_vec a = vshi_transform_point(moved.transform, p);
        const vshi_vec b = vshi_transform_point(mirrored.transform, p);
        const double tolerance = 1e-6; /* the quaternion is of floats */
        assert_near(a.x, 1.0 - 2.0 * p.y, tolerance);
        assert_near(a.y, 2.0 + 2.0 * (p.x + 1.0), tolerance);
        assert_near(a.z, 3.0 + 2.0 * p.z, tolerance);
        assert_near(b.x, 1.0 - 2.0 * p.y, tolerance);
        assert_near(b.y, 2.0 - 2.0 * p.x, tolerance);
        assert_near(b.z, 3.0 + 2.0 * p.z, tolerance);
    }
    for (size_t i = 0; i < 2; ++i) {
        const vsh_mesh mesh = vsh_model_mesh(model, i, 0);
        vshi_vec corner[3];
        vshi_mesh_triangle(&mesh, 0, corner);
        const vshi_vec normal = vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0]));
        assert_near(normal.z, 4.0, 1e-5); /* up on both: mirrored, a shape keeps its outside */
    }
    vsh_model_free(model);
}

static void a_node_scaled_to_nothing_is_left_out_with_a_warning(void **state) {
    (void)state;
    char gltf[4096];
    quad_gltf(gltf,
              "{\"children\":[1,2]},{\"name\":\"hidden\",\"mesh\":0,\"scale\":[0,0,0]},"
              "{\"name\":\"seen\",\"mesh\":0}",
              NULL, 3);
    vsh_model *model = read_text("hidden.gltf", gltf);
    assert_int_equal(vsh_model_mesh_count(model), 1);
    assert_string_equal(vsh_model_mesh(model, 0, 0).name, "seen/quad");
    assert_non_null(strstr(warnings, "hidden/quad"));
    vsh_model_free(model);
    quad_gltf(gltf, "{\"name\":\"hidden\",\"mesh\":0,\"scale\":[0,0,0]}", NULL, 3);
    refused("gone.gltf", gltf, VSH_ERROR_INPUT, "holds no triangles", "gone");
}

static void meshes_objects_and_polygons_become_triangles_and_lines_are_dropped(void **state) {
    (void)state;
    vsh_model *model =
        read_text("parts.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.25 0\n"
                               "vn 0 0 2\no first\nf 1//1 2//1 3//1\no second\nf 1 5 2 3 4\nl 1 2\n"
                               "p 3\no lines\nl 3 4\n");
    assert_int_equal(vsh_model_mesh_count(model), 2);
    const vsh_mesh first = vsh_model_mesh(model, 0, -1), second = vsh_model_mesh(model, 1, -1);
    assert_string_equal(first.name, "first");
    assert_string_equal(second.name, "second");
    assert_non_null(first.normals);
    assert_null(first.uvs);
    assert_int_equal(first.triangle_count, 1);
    assert_int_equal(second.triangle_count, 3);
    assert_near(check(model, 1).area, 1.0 - 0.125, 1e-6); /* concave */
    vsh_model_free(model);
}

/* An FBX says what its numbers are in; a Collada file, too (test_exported.c). */
static void an_fbx_is_in_metres(void **state) {
    (void)state;
    static const struct {
        const char *factor;
        double metres;
    } units[] = {{"100", 1.0}, {"2.5", 0.025}, {"1.0", 0.01}};
    for (size_t i = 0; i < sizeof units / sizeof units[0]; ++i) {
        char fbx[sizeof quad_fbx];
        memcpy(fbx, quad_fbx, sizeof fbx);
        memcpy(strstr(strstr(fbx, "UnitScaleFactor"), ",100") + 1, units[i].factor, 3);
        vsh_model *model = read_text("unit.fbx", fbx);
        assert_near(vsh_model_unit(model), units[i].metres, 1e-9);
        assert_near(check(model, 0).area, units[i].metres * units[i].metres, 1e-9);
        vsh_model_free(model);
    }
}

/* Twelve triangles with corners of their own, as STL has them. */
static void a_cube_in_stl_is_closed(void **state) {
    (void)state;
    static const uint8_t corners[36] = {0, 2, 3, 0, 3, 1, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3,
                                        0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 4, 5, 7, 4, 7, 6};
    float positions[36][3];
    for (int i = 0; i < 36; ++i) {
        for (int k = 0; k < 3; ++k) {
            positions[i][k] = (float)(corners[i] >> k & 1);
        }
    }
    unsigned char bytes[84 + 50 * 12];
    vsh_model *model = read_good("cube.stl", bytes, binary_stl(bytes, positions, 12));
    const vsh_mesh_report report = check(model, 0);
    assert_int_equal(report.open_edges, 0);
    assert_int_equal(report.flipped_edges, 0);
    assert_near(report.area, 6.0, 1e-12);
    assert_null(vsh_model_mesh(model, 0, -1).normals);
    vsh_model_free(model);
    model = read_good("lid.stl", bytes, binary_stl(bytes, positions, 10));
    assert_int_equal(check(model, 0).open_edges, 4);
    vsh_model_free(model);
    model = read_text("ascii.stl", triangle_stl);
    assert_int_equal(vsh_model_mesh(model, 0, -1).triangle_count, 1);
    vsh_model_free(model);
}

static void binary_ply_of_either_byte_order_is_read(void **state) {
    (void)state;
    for (int big_endian = 0; big_endian < 2; ++big_endian) {
        unsigned char bytes[1024];
        vsh_model *model = read_good("binary.ply", bytes, binary_ply(bytes, big_endian));
        const vsh_mesh_report report = check(model, 0);
        assert_near(report.area, 1.0, 1e-12);
        assert_int_equal(report.open_edges, 0); /* front and back */
        vsh_model_free(model);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(uvs_point_up_whatever_the_format),
        cmocka_unit_test(the_second_uv_set_is_the_default),
        cmocka_unit_test(nodes_are_instances_that_share_arrays),
        cmocka_unit_test(a_node_scaled_to_nothing_is_left_out_with_a_warning),
        cmocka_unit_test(meshes_objects_and_polygons_become_triangles_and_lines_are_dropped),
        cmocka_unit_test(an_fbx_is_in_metres),
        cmocka_unit_test(a_cube_in_stl_is_closed),
        cmocka_unit_test(binary_ply_of_either_byte_order_is_read),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
