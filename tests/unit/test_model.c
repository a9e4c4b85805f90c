/* Models: what files of every format become, and what is refused. */
#include "models.h"
#include "testing.h"

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

static void assert_quad_uvs(const vsh_model *model, int32_t uv_set, float scale) {
    static const float corners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    const vsh_mesh mesh = vsh_model_mesh(model, 0, uv_set);
    assert_non_null(mesh.uvs);
    for (int i = 0; i < 4; ++i) {
        const float *uv = uv_at(&mesh, corners[i][0], corners[i][1]);
        assert_near(uv[0], scale * quad_uv[i][0], 0.0);
        assert_near(uv[1], scale * quad_uv[i][1], 0.0);
    }
}

TEST(uvs_point_up_whatever_the_format) {
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
        OWNED(vsh_model) *model = read_good(files[i].name, files[i].bytes, files[i].size);
        assert_int_equal(vsh_model_mesh_count(model), 1);
        const vsh_mesh mesh = vsh_model_mesh(model, 0, 0);
        assert_int_equal(mesh.triangle_count, 2);
        assert_quad_uvs(model, 0, 1.0F);
        assert_null(mesh.normals); /* none in the file, none made up */
        const vsh_mesh_report report = check(model, 0);
        assert_near(report.area, 1.0, 1e-12);
        assert_int_equal(report.open_edges, 4);
    }
}

TEST(the_second_uv_set_is_the_default) {
    char gltf[4096];
    quad_gltf(gltf, one_node, NULL, 3);
    OWNED(vsh_model) *model = read_text("sets.gltf", gltf);
    assert_int_equal(vsh_model_uv_sets(model, 0), 2);
    assert_quad_uvs(model, -1, 0.5F);
    assert_quad_uvs(model, 1, 0.5F);
    assert_quad_uvs(model, 0, 1.0F);
    static const int32_t missing[] = {2, 7, 8, 1000, -2};
    for (size_t i = 0; i < sizeof missing / sizeof missing[0]; ++i) {
        assert_null(vsh_model_mesh(model, 0, missing[i]).uvs);
    }
    OWNED(vsh_model) *one = read_text("quad.obj", quad_obj);
    assert_int_equal(vsh_model_uv_sets(one, 0), 1);
    assert_quad_uvs(one, -1, 1.0F);
}

TEST(nodes_are_instances_that_share_arrays) {
    char gltf[4096];
    quad_gltf(gltf, instances, NULL, 3);
    OWNED(vsh_model) *model = read_text("instances.gltf", gltf);
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
}

TEST(a_node_scaled_to_nothing_is_left_out_with_a_warning) {
    char gltf[4096];
    quad_gltf(gltf,
              "{\"children\":[1,2]},{\"name\":\"hidden\",\"mesh\":0,\"scale\":[0,0,0]},"
              "{\"name\":\"seen\",\"mesh\":0}",
              NULL, 3);
    OWNED(vsh_model) *model = read_text("hidden.gltf", gltf);
    assert_int_equal(vsh_model_mesh_count(model), 1);
    assert_string_equal(vsh_model_mesh(model, 0, 0).name, "seen/quad");
    assert_non_null(strstr(warnings, "hidden/quad"));
    quad_gltf(gltf, "{\"name\":\"hidden\",\"mesh\":0,\"scale\":[0,0,0]}", NULL, 3);
    refused("gone.gltf", gltf, VSH_ERROR_INPUT, "holds no triangles", "gone");
}

TEST(meshes_objects_and_polygons_become_triangles_and_lines_are_dropped) {
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
TEST(an_fbx_is_in_metres) {
    static const struct {
        const char *factor;
        double metres;
    } units[] = {{"100", 1.0}, {"2.5", 0.025}, {"1.0", 0.01}};
    for (size_t i = 0; i < sizeof units / sizeof units[0]; ++i) {
        char fbx[sizeof quad_fbx];
        memcpy(fbx, quad_fbx, sizeof fbx);
        memcpy(strstr(strstr(fbx, "UnitScaleFactor"), ",100") + 1, units[i].factor, 3);
        OWNED(vsh_model) *model = read_text("unit.fbx", fbx);
        assert_near(vsh_model_unit(model), units[i].metres, 1e-9);
        assert_near(check(model, 0).area, units[i].metres * units[i].metres, 1e-9);
    }
}

/* Twelve triangles with corners of their own, as STL has them. */
TEST(a_cube_in_stl_is_closed) {
    static const uint8_t corners[36] = {0, 2, 3, 0, 3, 1, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3,
                                        0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 4, 5, 7, 4, 7, 6};
    float positions[36][3];
    for (int i = 0; i < 36; ++i) {
        for (int k = 0; k < 3; ++k) {
            positions[i][k] = (float)(corners[i] >> k & 1);
        }
    }
    unsigned char bytes[84 + 50 * 12];
    OWNED(vsh_model) *cube = read_good("cube.stl", bytes, binary_stl(bytes, positions, 12));
    const vsh_mesh_report report = check(cube, 0);
    assert_int_equal(report.open_edges, 0);
    assert_int_equal(report.flipped_edges, 0);
    assert_near(report.area, 6.0, 1e-12);
    assert_null(vsh_model_mesh(cube, 0, -1).normals);
    OWNED(vsh_model) *lid = read_good("lid.Stl", bytes, binary_stl(bytes, positions, 10));
    assert_int_equal(check(lid, 0).open_edges, 4);
    OWNED(vsh_model) *ascii = read_text("ascii.stl", triangle_stl);
    assert_int_equal(vsh_model_mesh(ascii, 0, -1).triangle_count, 1);
}

TEST(binary_ply_of_either_byte_order_is_read) {
    for (int big_endian = 0; big_endian < 2; ++big_endian) {
        unsigned char bytes[1024];
        OWNED(vsh_model) *model = read_good("binary.ply", bytes, binary_ply(bytes, big_endian));
        const vsh_mesh_report report = check(model, 0);
        assert_near(report.area, 1.0, 1e-12);
        assert_int_equal(report.open_edges, 0); /* front and back */
    }
}

/* --- Model files that are wrong, cut, too large or not there; cancelling. */

TEST(bad_obj_is_refused_with_line_and_value) {
#define CORNERS "v 0 0 0\nv 1 0 0\nv 1 1 0\n"
    refused("a.obj", "v nan 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n", VSH_ERROR_INPUT, "line 1", "'nan'");
    refused("a.obj", "v 0 0 0\nv 1 -inf 0\nv 1 1 0\nf 1 2 3\n", VSH_ERROR_INPUT, "line 2", "'-inf'");
    refused("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 1e39\nf 1 2 3\n", VSH_ERROR_INPUT, "line 3", "'1e39'");
    refused("a.obj", "v 0 0 0\nv 1 0,5 0\nv 1 1 0\nf 1 2 3\n", VSH_ERROR_INPUT, "line 2", "'0,5'");
    refused("a.obj", "v 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n", VSH_ERROR_INPUT, "line 1", "at least 3");
    refused("a.obj", CORNERS "f 1 2 3\nf 1 2 99\n", VSH_ERROR_INPUT, "line 5", "99");
    refused("a.obj", CORNERS "f 1 2 -4\n", VSH_ERROR_INPUT, "line 4", "-4");
    refused("a.obj", CORNERS "f 0 1 2\n", VSH_ERROR_INPUT, "line 4", "index 0");
    refused("a.obj", CORNERS "f 1 2 99999999999999999999\n", VSH_ERROR_INPUT, "line 4", "9999");
    refused("a.obj", CORNERS "vt 0 0\nf 1/1 2/1 3/2\n", VSH_ERROR_INPUT, "line 5",
            "texture coordinate index 2");
    refused("a.obj", CORNERS "vt 0 nan\nf 1/1 2/1 3/1\n", VSH_ERROR_INPUT, "line 4", "'nan'");
    refused("a.obj", CORNERS "f 1 2 \\\n77\n", VSH_ERROR_INPUT, "line 4", "77");
    refused("a.obj", CORNERS "l 1 2\n", VSH_ERROR_INPUT, "holds no triangles", "");
    refused("a.obj", CORNERS, VSH_ERROR_INPUT, "holds no triangles", "");
#undef CORNERS
    vsh_model_free(read_text("late.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\nv 1 1 0\n"));
    vsh_model_free(read_text("dos.obj", "v 0 0 0\r\nv 1 0 0 # corner\r\nv 1 1 0\r\nf 1 2 \\\r\n3\r\n"));
}

TEST(bad_ply_and_stl_are_refused) {
#define HEAD(n)                                                                                              \
    "ply\nformat ascii 1.0\nelement vertex " n "\nproperty float x\nproperty float y\nproperty float z\n"    \
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    refused("a.ply", HEAD("3") "0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n", VSH_ERROR_INPUT, "vertex 1", "'nan'");
    refused("a.ply", HEAD("3") "0 0 0\n1 0 0\n0 1 0\n3 0 1 9\n", VSH_ERROR_INPUT, "face 0", "vertex 9");
    refused("a.ply", HEAD("3") "0 0 0\n1 0 0\n0 1 0\n4 0 1 2 9\n", VSH_ERROR_INPUT, "face 0", "vertex 9");
    refused("a.ply", HEAD("3") "0 0 0\n1 0 0\n0 1 0\n3 0 1 -2\n", VSH_ERROR_INPUT, "face 0", "'-2'");
    refused("a.ply", HEAD("4000000000") "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", VSH_ERROR_READ, "cut short",
            "4000000000");
    refused("a.ply", HEAD("-3") "0 0 0\n", VSH_ERROR_INPUT, "header", "-3");
    refused(
        "a.ply",
        "ply\nformat ascii 1.0\nelement vertex 4\nelement face 1\nproperty list uchar int vertex_indices\n"
        "end_header\n4 0 1 2 3\n",
        VSH_ERROR_INPUT, "no x, y or z", "a.ply");
    refused("a.ply",
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty uchar red\nelement face 1\n"
            "property list uchar int vertex_indices\nend_header\n1\n2\n3\n4\n4 0 1 2 3\n",
            VSH_ERROR_INPUT, "no x, y or z", "a.ply");
#undef HEAD
    refused("a.stl",
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 inf 0\nvertex 0 1 0\nendloop\n"
            "endfacet\nendsolid a\n",
            VSH_ERROR_INPUT, "vertex 1 of facet 0", "'inf'");
    const float bad[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, NAN, 0}};
    unsigned char bytes[84 + 50];
    vsh_model *model = NULL;
    assert_fails(read_bytes("b.stl", bytes, binary_stl(bytes, bad, 1), &model, &failure), VSH_ERROR_INPUT,
                 "nan");
}

/* By their endings, and by their first bytes whatever the ending. */
TEST(alembic_and_usd_are_refused_by_name) {
    static const char *const endings[] = {"a.usd", "a.usda", "a.USDC", "a.usdz"};
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; ++i) {
        refused(endings[i], "anything", VSH_ERROR_INPUT, "is a USD file",
                "OBJ, glTF, GLB, PLY, STL, FBX or DAE");
    }
    refused("a.blend", "anything", VSH_ERROR_INPUT, "is Blender's own file", "export it as GLB");
    refused("a.obj", "BLENDER-v304", VSH_ERROR_INPUT, "is Blender's own file", "export it as GLB");
    refused("a.abc", "anything", VSH_ERROR_INPUT, "is an Alembic file", "OBJ");
    refused("a.obj", "Ogawa and more", VSH_ERROR_INPUT, "a.obj: is an Alembic file", "OBJ");
    refused("a.obj", "\x89HDF\r\n\x1a\n and more", VSH_ERROR_INPUT, "is an Alembic file", "OBJ");
    refused("a.obj", "#usda 1.0\n", VSH_ERROR_INPUT, "is a USD file", "OBJ");
    refused("a", "PXR-USDC and more", VSH_ERROR_INPUT, "is a USD file", "OBJ");
    unsigned char zip[64] = "PK\x03\x04";
    zip[26] = 6;
    memcpy(zip + 30, "a.usdc", 6);
    vsh_model *model = NULL;
    assert_fails(read_bytes("b.obj", zip, sizeof zip, &model, &failure), VSH_ERROR_INPUT, "is a USD file");
    memcpy(zip + 30, "a.text", 6); /* any other Zip file is what its ending says */
    assert_fails(read_bytes("b.obj", zip, sizeof zip, &model, &failure), VSH_ERROR_INPUT, "");
    assert_null(strstr(failure.message, "USD"));
}

TEST(bad_gltf_is_refused) {
    char gltf[4096];
    quad_gltf(gltf, one_node, (float[]){1, NAN, 0}, 3);
    refused("a.gltf", gltf, VSH_ERROR_INPUT, "'quad'", "vertex 2");
    quad_gltf(gltf, one_node, (float[]){INFINITY, 1, 0}, 3);
    refused("a.gltf", gltf, VSH_ERROR_INPUT, "'quad'", "inf");
    quad_gltf(gltf, one_node, NULL, 4);
    refused("a.gltf", gltf, VSH_ERROR_INPUT, "index 5 of 6 is 4", "only 4 vertices");
    memcpy(strstr(gltf, "\"scene\""), "\"xcene\"", 7); /* the first scene is meant then */
    refused("a.gltf", gltf, VSH_ERROR_INPUT, "index 5 of 6 is 4", "only 4 vertices");
    quad_gltf(gltf, "{\"name\":\"far\",\"mesh\":0,\"translation\":[1e39,0,0]}", NULL, 3);
    refused("a.gltf", gltf, VSH_ERROR_INPUT, "far/quad", "row 0 column 3");
    quad_gltf(gltf, "{\"name\":\"empty\"}", NULL, 3);
    refused("a.gltf", gltf, VSH_ERROR_INPUT, "holds no triangles", "a.gltf");
    refused("a.gltf", "{\"asset\": {\"version\": 2.0 \"x\"}}", VSH_ERROR_INPUT, "line 1", "column");
}

TEST(files_that_cannot_be_read_say_why) {
    vsh_model *model;
    assert_fails(vsh_model_read(path_of("missing.obj").text, NULL, &model, &failure), VSH_ERROR_READ,
                 "missing.obj: No such file");
    assert_null(model);
    char as_folder[512];
    snprintf(as_folder, sizeof as_folder, "%s/.", folder);
    assert_int_equal(vsh_model_read(as_folder, NULL, &model, NULL), VSH_ERROR_INPUT);
    refused("empty.obj", "", VSH_ERROR_READ, "is empty", "");
    refused("other.xyzzy", quad_obj, VSH_ERROR_INPUT, ".xyzzy", "no mesh format");
    /* what Assimp would read, but has not been seen to read right */
    refused("other.x3d", quad_obj, VSH_ERROR_INPUT, ".x3d", "OBJ, glTF, GLB, PLY, STL, FBX or DAE");
    refused("other.3ds", quad_obj, VSH_ERROR_INPUT, ".3ds", "OBJ, glTF, GLB, PLY, STL, FBX or DAE");
    refused("none", quad_obj, VSH_ERROR_INPUT, "no ending", "");
    refused("text.fbx", "hello, world", VSH_ERROR_READ, "damaged or cut short", "");
}

TEST(the_memory_limit_is_checked) {
    write_bytes("limit.obj", quad_obj, strlen(quad_obj));
    vsh_run run = vsh_run_default();
    vsh_model *model;
    run.memory_limit = 100;
    assert_fails(vsh_model_read(path_of("limit.obj").text, &run, &model, &failure), VSH_ERROR_LIMIT,
                 "limit.obj");
    run.memory_limit = 1 << 20;
    assert_ok(vsh_model_read(path_of("limit.obj").text, &run, &model, &failure));
    vsh_model_free(model);
    unlink(path_of("limit.obj").text);
}

typedef struct watch {
    double last, stop;
    int calls;
} watch;

static int32_t watch_progress(void *user, const char *stage, double fraction) {
    watch *w = user;
    assert_string_equal(stage, "load");
    assert_true(fraction >= w->last && fraction <= 1.0);
    w->last = fraction;
    ++w->calls;
    return fraction >= w->stop;
}

TEST(progress_rises_to_one_and_can_cancel_anywhere) {
    static const double stops[] = {2.0, 0.0, 0.1, 0.5, 0.99, 1.0};
    write_bytes("watch.obj", quad_obj, strlen(quad_obj));
    for (size_t i = 0; i < sizeof stops / sizeof stops[0]; ++i) {
        watch w = {0.0, stops[i], 0};
        vsh_run run = run_watched(watch_progress, &w);
        OWNED(vsh_model) *model = NULL;
        const vsh_result result = vsh_model_read(path_of("watch.obj").text, &run, &model, NULL);
        assert_int_equal(result, stops[i] > 1.0 ? VSH_OK : VSH_ERROR_CANCELLED);
        assert_int_equal(model == NULL, stops[i] <= 1.0);
        assert_true(w.calls >= 1 && (stops[i] <= 1.0 || w.last == 1.0));
    }
    unlink(path_of("watch.obj").text);
}

/* Cuts a file at every length. What still reads must be a mesh that passes its check; formats that know their
 * own length must notice every cut that loses more than white space. */
static void cut_everywhere(const char *name, const void *bytes, size_t size, bool knows_its_length) {
    char *copy = malloc(size + 1); /* of the very size, so that a sanitizer sees what is read past it */
    assert_non_null(copy);
    memcpy(copy, bytes, size);
    size_t last = size;
    while (last > 0 && (copy[last - 1] == '\n' || copy[last - 1] == ' ')) {
        --last;
    }
    for (size_t length = 0; length < last; ++length) {
        OWNED(vsh_model) *model = NULL;
        const vsh_result result = read_bytes(name, copy, length, &model, &failure);
        if (result == VSH_OK) {
            for (size_t i = 0; i < vsh_model_mesh_count(model); ++i) {
                check(model, i);
            }
            assert_that(!knows_its_length, "%s: nothing noticed at %zu of %zu bytes", name, length, size);
        } else if (strstr(failure.message, name) == NULL) {
            fail_msg("%s at %zu bytes: '%s' does not name the file", name, length, failure.message);
        }
    }
    free(copy);
}

TEST(files_cut_at_any_length_do_no_harm) {
    char gltf[4096];
    quad_gltf(gltf, instances, NULL, 3);
    unsigned char bytes[8192];
    cut_everywhere("cut.obj", quad_obj, strlen(quad_obj), false);
    cut_everywhere("cut.ply", quad_ply, strlen(quad_ply), true);
    cut_everywhere("cut.ply", bytes, binary_ply(bytes, false), true);
    cut_everywhere("cut.ply", bytes, binary_ply(bytes, true), true);
    cut_everywhere("cut.stl", triangle_stl, strlen(triangle_stl) - strlen(" a b\n"), true);
    const float corners[6][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
    cut_everywhere("cut.stl", bytes, binary_stl(bytes, corners, 2), true);
    cut_everywhere("cut.gltf", gltf, strlen(gltf), true);
    cut_everywhere("cut.glb", bytes, quad_glb(bytes), true);
    cut_everywhere("cut.fbx", quad_fbx, strlen(quad_fbx), false);
}

FIXTURE(make_folder, remove_folder)
