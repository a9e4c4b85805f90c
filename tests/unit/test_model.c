/* Models of files of every format, and files that are refused. */
#include "gltf_maker.h"

static void assert_quad_uvs(const vsh_model *model, int32_t uv_set, float scale) {
    const vsh_mesh mesh = vsh_model_mesh(model, 0, uv_set);
    unsigned found = 0;
    assert_non_null(mesh.uvs);
    for (size_t v = 0; v < mesh.vertex_count; ++v) {
        for (int i = 0; i < 4; ++i) {
            if (mesh.positions[3 * v] == QUAD[i][0] && mesh.positions[3 * v + 1] == QUAD[i][1]) {
                assert_near(mesh.uvs[2 * v], scale * quad_uv[i][0], 0.0);
                assert_near(mesh.uvs[2 * v + 1], scale * quad_uv[i][1], 0.0);
                found |= 1U << i;
            }
        }
    }
    assert_int_equal(found, 15);
}

/* glTF is compared with OBJ in test_exported.c. */
TEST(uvs_point_up_whatever_the_format) {
    static const char *const files[][2] = {
        {"quad.obj", quad_obj}, {"quad.ply", quad_ply}, {"quad.fbx", quad_fbx}};
    for (size_t i = 0; i < COUNT_OF(files); ++i) {
        OWNED(vsh_model) *model = read_text(files[i][0], files[i][1]);
        assert_int_equal(vsh_model_mesh_count(model), 1);
        const vsh_mesh mesh = vsh_model_mesh(model, 0, 0);
        assert_int_equal(mesh.triangle_count, 2);
        assert_int_equal(vsh_model_uv_sets(model, 0), 1);
        assert_quad_uvs(model, -1, 1.0F);
        assert_null(mesh.normals); /* none in the file, none made up */
        const vsh_mesh_report report = check(model, 0);
        assert_near(report.area, 1.0, 1e-12);
        assert_int_equal(report.open_edges, 4);
    }
}

/* A glTF of the quad with these nodes and two sets of UVs, the second half as large. `corner2` (NULL: the
 * quad's own) and `last_index` may be wrong. */
static const char *quad_gltf(const char *nodes, const float *corner2, uint16_t last_index) {
    float positions[4][3], uvs[2][4][2];
    const uint16_t indices[6] = {0, 1, 2, 0, 2, last_index};
    memcpy(positions, QUAD, sizeof positions);
    memcpy(positions[2], corner2 != NULL ? corner2 : QUAD[2], sizeof positions[2]);
    for (int i = 0; i < 8; ++i) {
        const float scale = i < 4 ? 1.0F : 0.5F;
        uvs[i / 4][i % 4][0] = scale * quad_uv[i % 4][0];
        uvs[i / 4][i % 4][1] = 1.0F - scale * quad_uv[i % 4][1]; /* glTF's v points down */
    }
    FREED maker *m = calloc(1, sizeof *m);
    add(m, positions, sizeof positions, "", FLOATS, 4, "VEC3", "");
    add(m, uvs[0], sizeof uvs[0], "", FLOATS, 4, "VEC2", "");
    add(m, uvs[1], sizeof uvs[1], "", FLOATS, 4, "VEC2", "");
    add(m, indices, sizeof indices, "", USHORTS, 6, "SCALAR", "");
    char rest[2048];
    snprintf(rest, sizeof rest,
             "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[%s],\"meshes\":[{\"name\":\"quad\",\"primitives\":[{"
             "\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1,\"TEXCOORD_1\":2},\"indices\":3}]}]",
             nodes);
    return text_of(m, rest);
}

static const char one_node[] = "{\"name\":\"here\",\"mesh\":0}";

/* The root turns by 90° about z, doubles, and moves by (1, 2, 3); one child moves by (1, 0, 0), one mirrors
 * x. */
static const char instances[] =
    "{\"name\":\"root\",\"children\":[1,2],\"translation\":[1,2,3],\"scale\":[2,2,2],"
    "\"rotation\":[0,0,0.70710678118654752,0.70710678118654752]},"
    "{\"name\":\"moved\",\"mesh\":0,\"translation\":[1,0,0]},"
    "{\"name\":\"mirrored\",\"mesh\":0,\"matrix\":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}";

TEST(the_second_uv_set_is_the_default) {
    OWNED(vsh_model) *model = read_text("sets.gltf", quad_gltf(one_node, NULL, 3));
    assert_int_equal(vsh_model_uv_sets(model, 0), 2);
    assert_quad_uvs(model, -1, 0.5F);
    assert_quad_uvs(model, 1, 0.5F);
    assert_quad_uvs(model, 0, 1.0F);
    static const int32_t missing[] = {2, 7, 8, 1000, -2};
    for (size_t i = 0; i < COUNT_OF(missing); ++i) {
        assert_null(vsh_model_mesh(model, 0, missing[i]).uvs);
    }
}

TEST(nodes_are_instances_that_share_arrays) {
    OWNED(vsh_model) *model = read_text("instances.gltf", quad_gltf(instances, NULL, 3));
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
    static const char hidden[] = "{\"name\":\"hidden\",\"mesh\":0,\"scale\":[0,0,0]}";
    char nodes[256];
    snprintf(nodes, sizeof nodes, "{\"children\":[1,2]},%s,{\"name\":\"seen\",\"mesh\":0}", hidden);
    OWNED(vsh_model) *model = read_text("hidden.gltf", quad_gltf(nodes, NULL, 3));
    assert_int_equal(vsh_model_mesh_count(model), 1);
    assert_string_equal(vsh_model_mesh(model, 0, 0).name, "seen/quad");
    assert_non_null(strstr(warnings, "hidden/quad"));
    refused("gone.gltf", quad_gltf(hidden, NULL, 3), VSH_ERROR_INPUT, "holds no triangles", "gone");
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
TEST(fbx_units_are_metres) {
    static const struct {
        const char *factor;
        double metres;
    } units[] = {{"100", 1.0}, {"2.5", 0.025}, {"1.0", 0.01}};
    for (size_t i = 0; i < COUNT_OF(units); ++i) {
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
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
            "element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 "
            "1 2\n",
            VSH_ERROR_UNSUPPORTED, "'tristrips'", "save it with faces");
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

TEST(bad_gltf_is_refused) {
    static const char far_away[] = "{\"name\":\"far\",\"mesh\":0,\"translation\":[1e39,0,0]}";
    static const struct {
        const char *nodes;
        float corner2[3];
        uint16_t last_index;
        const char *part, *other;
    } bad[] = {
        {one_node, {1, NAN, 0}, 3, "'quad'", "vertex 2"},
        {one_node, {INFINITY, 1, 0}, 3, "'quad'", "inf"},
        {one_node, {1, 1, 0}, 4, "index 5 of 6 is 4", "only 4 vertices"},
        {far_away, {1, 1, 0}, 3, "far/quad", "row 0 column 3"},
        {"{\"name\":\"empty\"}", {1, 1, 0}, 3, "holds no triangles", "a.gltf"},
    };
    for (size_t i = 0; i < COUNT_OF(bad); ++i) {
        refused("a.gltf", quad_gltf(bad[i].nodes, bad[i].corner2, bad[i].last_index), VSH_ERROR_INPUT,
                bad[i].part, bad[i].other);
    }
    refused("a.gltf", "{\"asset\": {\"version\": 2.0 \"x\"}}", VSH_ERROR_INPUT, "line 1", "column");
}

TEST(files_that_cannot_be_read_are_refused_with_a_reason) {
    vsh_model *model;
    assert_fails(vsh_model_read(at("missing.obj"), NULL, &model, &failure), VSH_ERROR_READ,
                 "missing.obj: No such file");
    assert_null(model);
    refused("empty.obj", "", VSH_ERROR_READ, "is empty", "");
    refused("other.xyzzy", quad_obj, VSH_ERROR_INPUT, ".xyzzy", "no mesh format");
    refused("other.3ds", quad_obj, VSH_ERROR_INPUT, ".3ds", "OBJ, glTF, GLB, PLY, STL, FBX or DAE");
    refused("none", quad_obj, VSH_ERROR_INPUT, "no ending", "");
    refused("text.fbx", "hello, world", VSH_ERROR_READ, "damaged or cut short", "");
}

/* Cuts a file at every length. A file that is still read must be a mesh that passes its check. Formats that
 * know their own length must notice every cut, unless it loses white space only. */
static void cut_everywhere(const char *name, const void *bytes, size_t size, bool knows_its_length) {
    char *copy = malloc(size + 1); /* of exactly this size, so that a sanitizer sees reads past the end */
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
    unsigned char bytes[1024];
    cut_everywhere("cut.obj", quad_obj, strlen(quad_obj), false);
    cut_everywhere("cut.ply", quad_ply, strlen(quad_ply), true);
    cut_everywhere("cut.ply", bytes, binary_ply(bytes, false), true);
    cut_everywhere("cut.ply", bytes, binary_ply(bytes, true), true);
    cut_everywhere("cut.stl", triangle_stl, strlen(triangle_stl) - strlen(" a b\n"), true);
    const float corners[6][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
    cut_everywhere("cut.stl", bytes, binary_stl(bytes, corners, 2), true);
    const char *gltf = quad_gltf(instances, NULL, 3);
    cut_everywhere("cut.gltf", gltf, strlen(gltf), true);
    FREED unsigned char *glb = NULL;
    const size_t glb_size = read_all(VSH_MODELS "/scene.glb", &glb);
    cut_everywhere("cut.glb", glb, glb_size, true);
    cut_everywhere("cut.fbx", quad_fbx, strlen(quad_fbx), false);
}

/* --- OBJ: what its statements become */

static const char corners[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/* "name object triangles vertices;" of each mesh. */
static void assert_parts(const char *text, const char *expected) {
    char parts[1024] = "";
    OWNED(vsh_model) *model = read_text("parts.obj", text);
    for (size_t i = 0; i < vsh_model_mesh_count(model); ++i) {
        const vsh_mesh mesh = vsh_model_mesh(model, i, 0);
        const size_t used = strlen(parts);
        snprintf(parts + used, sizeof parts - used, "%s %u %zu %zu;", mesh.name, mesh.object,
                 mesh.triangle_count, mesh.vertex_count);
    }
    assert_string_equal(parts, expected);
}

TEST(objects_groups_and_materials_part_a_file) {
    char text[1024];
#define PARTS(statements, expected)                                                                          \
    snprintf(text, sizeof text, "%s%s", corners, statements);                                                \
    assert_parts(text, expected)
    PARTS("f 1 2 3\n", "defaultobject 1 1 3;");
    PARTS("o A\nf 1 2 3\ng B C \nf 1 2 3\nf 1 3 4\n", "A 1 1 3;B C 2 2 4;");
    PARTS("g A\nf 1 2 3\ng A\nf 1 3 4\n", "A 1 2 4;");
    PARTS("g A\nf 1 2 3\ng\nf 1 3 4\ng A\nf 1 3 4\n", "A 1 1 3;(null) 2 1 3;A 3 1 3;");
    PARTS("o A\nusemtl x\nf 1 2 3\nusemtl y\nf 1 3 4\nusemtl y\nf 1 3 4\n", "A 1 1 3;A/y 1 2 3;");
    PARTS("o A\nf 1 2 3\nusemtl y\nf 1 3 4\n", "A 1 2 4;"); /* faces without a material take the first */
    PARTS("o A\nf 1 2 3\no B\nf 1 3 4\no A\nf 1 3 4\n", "A 1 1 3;A 1 1 3;B 2 1 3;");
    PARTS("o A\nl 1 2\np 3\no B\nf 1 2 3 4\n", "B 1 2 4;");
#undef PARTS
}

TEST(corners_that_agree_in_all_share_a_vertex) {
    char text[512];
    snprintf(text, sizeof text,
             "%svt 0 0\nvt 1 1\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 1/1/1 3/2/1 4/1/1\nf -4/-2/-1 3/2/1 4//1\n",
             corners);
    OWNED(vsh_model) *model = read_text("shared.obj", text);
    const vsh_mesh mesh = vsh_model_mesh(model, 0, 0);
    static const uint32_t indices[9] = {0, 1, 2, 0, 3, 4, 0, 3, 5};
    assert_int_equal(mesh.vertex_count, 6);
    assert_memory_equal(mesh.indices, indices, sizeof indices);
    static const float uvs[12] = {0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0};
    assert_memory_equal(mesh.uvs, uvs, sizeof uvs);
}

/* Other programs write these statements. Assimp 5.2 did not read them. */
TEST(unusual_statements_are_read) {
    OWNED(vsh_model) *model =
        read_text("odd.obj", "\xef\xbb\xbfv 0 0 0 1 1 1 1\r# lone ends of lines\r  v 4 0 0 2\r"
                             "v 1e0 +1. 0 # a corner\rvt .5\rvp 1 2\rf 1/1/ \\\r2/1 3/1 # all\r"
                             "f 1/1 2/1\r");
    const vsh_mesh mesh = vsh_model_mesh(model, 0, 0);
    static const float positions[9] = {0, 0, 0, 2, 0, 0, 1, 1, 0}, uvs[6] = {0.5F, 0, 0.5F, 0, 0.5F, 0};
    assert_int_equal(mesh.triangle_count, 1);
    assert_memory_equal(mesh.positions, positions, sizeof positions);
    assert_memory_equal(mesh.uvs, uvs, sizeof uvs);
}

/* A long strip of triangles, with a very long line and lines that go on. */
TEST(files_and_lines_of_any_length_are_read) {
    enum { COUNT = 60000, LONG = 700000 };
    FREED char *text = malloc(COUNT * 64 + 2 * LONG);
    char *to = text;
    for (int i = 0; i < COUNT; ++i) {
        to += sprintf(to, "v %d %d.25 -%d\n", i, i % 2, i % 7);
        if (i >= 2) {
            to += sprintf(to, i % 3 == 0 ? "f -1 -2 \\\r\n-3\n" : "f -1 -2 -3\n");
        }
        if (i == COUNT / 2) {
            *to++ = '#';
            memset(to, 'x', LONG);
            to[LONG] = '\n';
            to += LONG + 1;
        }
    }
    OWNED(vsh_model) *model = read_good("long.obj", text, (size_t)(to - text));
    const vsh_mesh mesh = vsh_model_mesh(model, 0, 0);
    assert_int_equal(mesh.triangle_count, COUNT - 2);
    for (size_t t = 0; t < COUNT - 2; ++t) {
        for (size_t k = 0; k < 3; ++k) {
            const size_t v = t + 2 - k;
            const float *p = mesh.positions + 3 * (size_t)mesh.indices[3 * t + k];
            assert_that(p[0] == (float)v && p[1] == (float)(v % 2) + 0.25F && p[2] == -(float)(v % 7),
                        "triangle %zu: (%g, %g, %g)", t, (double)p[0], (double)p[1], (double)p[2]);
        }
    }
    to += sprintf(to, "f 1 2 x\n");
    vsh_model *none = NULL;
    assert_fails(read_bytes("long.obj", text, (size_t)(to - text), &none, &failure), VSH_ERROR_INPUT, "");
    char line[32];
    snprintf(line, sizeof line, "line %d:", COUNT + COUNT - 2 + (COUNT - 2) / 3 + 2);
    assert_non_null(strstr(failure.message, line));
}

TEST(hostile_statements_are_refused_and_name_their_line) {
    char text[512];
#define REFUSED(statement, what)                                                                             \
    snprintf(text, sizeof text, "%s%s", corners, statement);                                                 \
    refused("a.obj", text, VSH_ERROR_INPUT, "line 5", what)
    REFUSED("f 1 2 2147483648\n", "index 2147483648 out of range, the file has 4");
    REFUSED("f 1 2 999999999999999999\n", "index 999999999999999999 out of range");
    REFUSED("f 1 2 -2147483648\n", "-2147483648");
    REFUSED("f 1 2 3x\n", "'3x' is no corner");
    REFUSED("f 1/1/1/1 2 3\n", "'1/1/1/1' is no corner");
    REFUSED("f 1 / 2\n", "'/' is no corner");
    REFUSED("v 1 2 3 0\nf 1 2 3\n", "weight is 0");
    REFUSED("v\n", "vertex of 0 numbers");
    REFUSED("vn 0 0\n", "normal of 2 numbers");
    REFUSED("v 1 2 0x3\n", "'0x3'");
    REFUSED("v 1 2 1e\n", "'1e'");
    REFUSED("vt 1e39\n", "'1e39'");
#undef REFUSED
}

/* A place with very many normals, as a cone's tip may have. */
TEST(many_vertices_at_one_place_are_fast) {
    enum { COUNT = 100000 };
    FREED char *text = malloc(COUNT * 64);
    char *to = text;
    to += sprintf(to, "%s", corners);
    for (int i = 1; i <= COUNT; ++i) {
        to += sprintf(to, "vn 0 0 %d\nf 1//%d 2 3\n", i, i);
    }
    OWNED(vsh_model) *model = read_good("tip.obj", text, (size_t)(to - text));
    assert_int_equal(vsh_model_mesh(model, 0, 0).vertex_count, COUNT + 2);
}

TEST(material_libraries_decide_which_meshes_are_blended) {
    static const char materials[] = "newmtl clear\nd 0.5\n\tnewmtl solid \r\nTr 0\nnewmtl thin\nTr 0.25\n"
                                    "newmtl edge\nd -halo 0.0\nnewmtl last\nd 1.0\n";
    static const char *const names[] = {"clear", "solid", "thin", "edge", "last", "other"};
    static const bool blended[] = {true, false, true, true, false, false};
    write_all(at("own.mtl"), materials, sizeof materials - 1);
    for (size_t i = 0; i < COUNT_OF(names); ++i) {
        char text[512];
        snprintf(text, sizeof text, "mtllib %s\n%susemtl %s\nf 1 2 3\n", i % 2 == 0 ? "own.mtl" : "gone.mtl",
                 corners, names[i]);
        OWNED(vsh_model) *model =
            read_text("own.obj", text); /* own.mtl is read also where the named library is missing */
        assert_int_equal(vsh_model_mesh(model, 0, 0).alpha,
                         blended[i] ? VSH_ALPHA_BLENDED : VSH_ALPHA_OPAQUE);
        const int32_t material = model->shapes[model->entries[0].shape].material - 1;
        assert_in_range(material, 0, model->material_count - 1);
        const vshi_material told = vshi_model_get_material(model, (size_t)material);
        assert_string_equal(told.name, names[i]);
        assert_int_equal(told.alpha, blended[i] ? VSH_ALPHA_BLENDED : VSH_ALPHA_OPAQUE);
        assert_string_equal(vsh_model_mesh(model, 0, 0).material_name, names[i]);
    }
    write_all(at("own.mtl"), "newmtl a\nd x\n", 13);
    vsh_model *none = NULL;
    assert_fails(read_bytes("own.obj", "mtllib own.mtl\n", 15, &none, &failure), VSH_ERROR_INPUT,
                 "own.mtl: line 2: 'd' is 'x'");
    assert_int_equal(unlink(at("own.mtl")), 0);
}

/* A small file may need much memory. This is compared with the limit before it is allocated. */
TEST(memory_is_held_against_the_limit) {
    enum { COUNT = 50000 };
    FREED char *text = malloc(COUNT * 8 + sizeof corners);
    char *to = text;
    to += sprintf(to, "%s", corners);
    for (int i = 0; i < COUNT; ++i) {
        to += sprintf(to, "f 1 2 3\n");
    }
    write_all(at("limit.obj"), text, (size_t)(to - text));
    vsh_run run = vsh_run_default();
    OWNED(vsh_model) *model = NULL;
    run.memory_limit = 1000000;
    assert_fails(vsh_model_read(at("limit.obj"), &run, &model, &failure), VSH_ERROR_LIMIT, "limit.obj");
    assert_null(model);
    run.memory_limit = 3000000;
    assert_ok(vsh_model_read(at("limit.obj"), &run, &model, &failure));
    assert_int_equal(unlink(at("limit.obj")), 0);
}

FIXTURE(make_folder, remove_empty_folder)
