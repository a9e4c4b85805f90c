/* glTF by the text of its specification: accessors of every kind, extensions, poses and transforms, with
 * values that a small mistake would change; and refusals. */
#include "gltf_maker.h"
#include "handles.h"

/* These free the maker. */
static void refuse_as(maker *m, const char *rest, vsh_result code, const char *part, const char *other) {
    refused("a.gltf", text_of(m, rest), code, part, other);
    free(m);
}

static void refuse_made(maker *m, const char *rest, const char *part) {
    refuse_as(m, rest, VSH_ERROR_INPUT, part, "");
}

static void assert_corner(const vsh_model *model, size_t mesh, int k, double x, double y, double z) {
    const vsh_mesh view = vsh_model_mesh(model, mesh, 0);
    vshi_vec corner[3];
    vshi_mesh_triangle(&view, 0, corner);
    const double tolerance = 1e-6 * fmax(1.0, fmax(fabs(x), fabs(y)));
    assert_near(corner[k].x, x, tolerance);
    assert_near(corner[k].y, y, tolerance);
    assert_near(corner[k].z, z, tolerance);
}

static void assert_normal(const vsh_model *model, size_t vertex, double x, double y, double z) {
    const float *n = vsh_model_mesh(model, 0, 0).normals + 3 * vertex;
    assert_near((double)n[0], x, 1e-6);
    assert_near((double)n[1], y, 1e-6);
    assert_near((double)n[2], z, 1e-6);
}

/* --- accessors */

TEST(offsets_of_views_and_accessors_add_up) {
    OWNED(vsh_model) *model = read_made(begin(), ALONE MESH("\"POSITION\":0,\"NORMAL\":1", ""));
    assert_corner(model, 0, 1, 1, 0, 0);
    assert_corner(model, 0, 2, 1, 1, 0);
    assert_normal(model, 2, 0, 0, 1);
    maker *m = begin(); /* a view that begins in the buffer and ends behind it */
    snprintf(m->views + strlen(m->views), 200, ",{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":48}",
             m->size - 44);
    strcat(m->accessors, ",{\"bufferView\":2,\"componentType\":5126,\"count\":1,\"type\":\"VEC3\"}");
    refuse_made(m, ALONE MESH("\"POSITION\":2", ""), "bufferViews[2]: 48 bytes");
    m = begin(); /* and one that ends behind its byteLength */
    m->beyond = 4;
    refuse_made(m, ALONE MESH("\"POSITION\":1", ""), "bufferViews[1]: 52 bytes");
    static const struct {
        const char *offset, *part;
    } bad[] = {{"8", "pass the 52 bytes of bufferViews[0]"}, /* where the buffer goes on */
               {"1e300", "count or byteOffset"},
               {"-4", "count or byteOffset"},
               {"9007199254740992", "pass the 52 bytes"}};
    for (size_t i = 0; i < COUNT_OF(bad); ++i) {
        m = begin();
        snprintf(m->accessors + strlen(m->accessors), 200,
                 ",{\"bufferView\":0,\"byteOffset\":%s,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}",
                 bad[i].offset);
        refuse_made(m, ALONE MESH("\"POSITION\":2", ""), bad[i].part);
    }
}

/* KHR_mesh_quantization: every type, as it is and normalized, with a stride that is no multiple of the type.
 */
TEST(quantized_positions_stand_for_their_numbers) {
    static const struct {
        int type, size;
        long lowest, most;
    } types[] = {
        {BYTES, 1, -127, 127}, {UBYTES, 1, 0, 255}, {SHORTS, 2, -32767, 32767}, {USHORTS, 2, 0, 65535}};
    for (size_t t = 0; t < 4; ++t) {
        const long at[3][3] = {{0, 0, 0}, {types[t].most, 0, 0}, {types[t].lowest, types[t].most, 1}};
        unsigned char bytes[24] = {0};
        for (size_t i = 0; i < 9; ++i) {
            const uint16_t bits = (uint16_t)at[i / 3][i % 3];
            memcpy(bytes + 8 * (i / 3) + (size_t)types[t].size * (i % 3), &bits, (size_t)types[t].size);
        }
        for (int normalized = 0; normalized < 2; ++normalized) {
            maker *m = begin();
            add(m, bytes, sizeof bytes, ",\"byteStride\":8", types[t].type, 3, "VEC3",
                normalized ? ",\"normalized\":true" : "");
            OWNED(vsh_model) *model = read_made(m, "\"extensionsRequired\":[\"KHR_mesh_quantization\"]," NODE(
                                                       ",\"scale\":[2,2,2]") MESH("\"POSITION\":2", ""));
            const double unit = normalized ? 2.0 / (double)types[t].most : 2.0;
            for (int i = 0; i < 3; ++i) {
                assert_corner(model, 0, i, unit * (double)at[i][0], unit * (double)at[i][1],
                              unit * (double)at[i][2]);
            }
        }
    }
}

/* As gltfpack writes it: normals of bytes, UVs of unsigned shorts, indices of every type. */
TEST(quantized_normals_uvs_and_indices_stand_for_their_numbers) {
    static const uint32_t order[6] = {0, 1, 2, 0, 2, 3};
    for (int type = UBYTES; type <= UINTS; type += 2) {
        const size_t size = type == UBYTES ? 1 : type == USHORTS ? 2 : 4;
        for (int count = 6; count >= 5; --count) { /* a corner alone is no triangle */
            unsigned char normals[16], uvs[16], indices[24] = {0};
            for (size_t v = 0; v < 4; ++v) {
                memcpy(normals + 4 * v, (int8_t[4]){0, -127, (int8_t)-128, 0}, 4);
                memcpy(uvs + 4 * v, (uint16_t[2]){(uint16_t)(13107 * v), 65535}, 4);
            }
            for (size_t i = 0; i < 6; ++i) {
                indices[size * i] = (unsigned char)order[i];
            }
            maker *m = begin();
            add(m, normals, 16, ",\"byteStride\":4", BYTES, 4, "VEC3", ",\"normalized\":true");
            add(m, uvs, 16, "", USHORTS, 4, "VEC2", ",\"normalized\":true");
            add(m, indices, 24, "", type, count, "SCALAR", "");
            OWNED(vsh_model) *model =
                read_made(m, "\"extensionsRequired\":[\"KHR_mesh_quantization\"]," ALONE MESH(
                                 "\"POSITION\":0,\"NORMAL\":2,\"TEXCOORD_0\":3", ",\"indices\":4"));
            const vsh_mesh mesh = vsh_model_mesh(model, 0, 0);
            assert_int_equal(mesh.triangle_count, count / 3);
            assert_memory_equal(mesh.indices, order, 3 * mesh.triangle_count * sizeof order[0]);
            for (size_t v = 0; v < mesh.vertex_count; ++v) {
                assert_normal(model, v, 0, -1, -1); /* -128, too */
                assert_near((double)mesh.uvs[2 * v], 0.2 * (double)v, 1e-7);
                assert_true(mesh.uvs[2 * v + 1] == 0.0F); /* v up */
            }
        }
    }
}

#define SPARSE(count, type, indices, values)                                                                 \
    ",\"sparse\":{\"count\":" count ",\"indices\":{\"bufferView\":" indices                                  \
    ",\"byteOffset\":4,\"componentType\":" type "},\"values\":{\"bufferView\":" values ",\"byteOffset\":4}}"

/* Indices of every type, in no order; the last of those that agree counts. */
TEST(sparse_parts_replace_elements_by_indices_of_any_unsigned_type) {
    static const float moved[3][3] = {{9, 9, 9}, {0, 7, 0}, {5, 0, 0}};
    static const uint16_t order[3] = {0, 3, 2}, third[3] = {9, 2, 1};
    static const struct {
        size_t size;
        const char *sparse;
        unsigned char last; /* index */
        const char *part;   /* why it is refused */
    } types[] = {{1, SPARSE("3", "5121", "2", "3"), 1, NULL},
                 {2, SPARSE("3", "5123", "2", "3"), 1, NULL},
                 {4, SPARSE("3", "5125", "2", "3"), 1, NULL},
                 {1, SPARSE("3", "5120", "2", "3"), 1, "its sparse part is wrong"},
                 {4, SPARSE("3", "5126", "2", "3"), 1, "its sparse part is wrong"},
                 {1, SPARSE("3", "0", "2", "3"), 1, "its sparse part is wrong"},
                 {1, SPARSE("5", "5121", "2", "3"), 1, "its sparse part is wrong"},
                 {1, SPARSE("3", "5121", "2", "3"), 4, "sparse index 2 of 3 is 4"}};
    for (size_t t = 0; t < COUNT_OF(types); ++t) {
        unsigned char indices[12] = {[0] = 1};
        indices[types[t].size] = 2;
        indices[2 * types[t].size] = types[t].last;
        maker *m = begin();
        add(m, indices, 3 * types[t].size, "", UBYTES, 3, "SCALAR", "");
        add(m, moved, sizeof moved, "", FLOATS, 3, "VEC3", "");
        add(m, QUAD, sizeof QUAD, "", FLOATS, 4, "VEC3", types[t].sparse);
        /* of no view: of zeros */
        snprintf(m->accessors + strlen(m->accessors), 400,
                 ",{\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"%s}", types[t].sparse);
        add(m, third, sizeof third, "", USHORTS, 3, "SCALAR", "");
        if (types[t].part != NULL) {
            refuse_as(m, ALONE MESH("\"POSITION\":4", ""), VSH_ERROR_INPUT, types[t].part, "accessors[4]");
            continue;
        }
        const char *text = text_of(m, ALONE MESH("\"POSITION\":4", ""));
        for (int with_view = 0; with_view < 2; ++with_view) {
            OWNED(vsh_model) *model = read_text("a.gltf", text);
            assert_corner(model, 0, 1, 5, 0, 0);
            assert_corner(model, 0, 2, 0, 7, 0);
            text = text_of(m, ALONE MESH("\"POSITION\":5", ""));
        }
        free(m);
    }
    maker *m = begin(); /* of indices */
    add(m, (const uint16_t[2]){1, 2}, 4, "", USHORTS, 2, "SCALAR", "");
    add(m, order + 1, 4, "", USHORTS, 2, "SCALAR", "");
    add(m, (const uint16_t[3]){0, 1, 2}, 6, "", USHORTS, 3, "SCALAR", SPARSE("2", "5123", "2", "3"));
    OWNED(vsh_model) *model = read_made(m, ALONE MESH("\"POSITION\":0", ",\"indices\":4"));
    for (int k = 0; k < 3; ++k) {
        const float *p = QUAD[order[k]];
        assert_corner(model, 0, k, (double)p[0], (double)p[1], 0);
    }
}

TEST(attributes_of_another_length_or_type_are_refused) {
    maker *m = begin();
    add(m, QUAD, sizeof QUAD, "", FLOATS, 3, "VEC3", "");
    refuse_made(m, ALONE MESH("\"POSITION\":2,\"NORMAL\":1", ""), "NORMAL has 4 elements for 3");
    m = begin();
    add(m, QUAD, sizeof QUAD, "", FLOATS, 3, "VEC4", "");
    refuse_made(m, ALONE MESH("\"POSITION\":2", ""), "POSITION has 4 components");
}

TEST(vertices_that_are_not_used_take_nothing_of_others_with_them) {
    static const uint16_t order[4] = {1, 2, 3, 0};
    static const float normals[4][3] = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}};
    static const float uvs[4][2] = {{0.9F, 0.9F}, {0.1F, 0}, {0.2F, 0}, {0.3F, 0.25F}};
    maker *m = begin();
    add(m, order, sizeof order, "", USHORTS, 3, "SCALAR", "");
    add(m, normals, sizeof normals, "", FLOATS, 4, "VEC3", "");
    add(m, uvs, sizeof uvs, "", FLOATS, 4, "VEC2", "");
    OWNED(vsh_model) *model =
        read_made(m, ALONE MESH("\"POSITION\":0,\"NORMAL\":3,\"TEXCOORD_0\":4,\"TEXCOORD_1\":4,"
                                "\"TEXCOORD_2\":4",
                                ",\"indices\":2"));
    const vsh_mesh view = vsh_model_mesh(model, 0, 2);
    assert_int_equal(view.vertex_count, 3);
    assert_corner(model, 0, 0, 1, 0, 0);
    assert_corner(model, 0, 2, 0, 1, 0);
    assert_normal(model, 0, 1, 0, 0);
    assert_normal(model, 2, 0, 0, -1);
    assert_non_null(view.uvs);
    assert_true(view.uvs[0] == 0.1F && view.uvs[4] == 0.3F && view.uvs[5] == 0.75F);
}

/* --- primitives */

TEST(strips_and_fans_become_triangles_of_one_winding_without_degenerate_ones) {
    static const struct {
        uint16_t indices[6];
        int count;
        const char *rest;
        size_t triangles;
    } cases[] = {{{0, 1, 3, 2}, 4, ALONE MESH("\"POSITION\":0", ",\"indices\":2,\"mode\":5"), 2},
                 {{0, 1, 2, 3}, 4, ALONE MESH("\"POSITION\":0", ",\"indices\":2,\"mode\":6"), 2},
                 {{0, 1, 2, 2, 2, 3}, 6, ALONE MESH("\"POSITION\":0", ",\"indices\":2,\"mode\":5"), 1},
                 /* two corners too many in a list of triangles */
                 {{0, 1, 2, 2, 2, 3}, 5, ALONE MESH("\"POSITION\":0", ",\"indices\":2"), 1}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        maker *m = begin();
        add(m, cases[i].indices, sizeof cases[i].indices, "", USHORTS, cases[i].count, "SCALAR", "");
        OWNED(vsh_model) *model = read_made(m, cases[i].rest);
        const vsh_mesh_report report = check(model, 0);
        assert_int_equal(vsh_model_mesh(model, 0, 0).triangle_count, cases[i].triangles);
        assert_int_equal(report.flipped_edges, 0);
        assert_int_equal(report.open_edges, cases[i].triangles + 2);
        assert_near(report.area, 0.5 * (double)cases[i].triangles, 1e-12);
    }
}

TEST(alpha_comes_with_the_mesh) {
    static const char *const modes[] = {"OPAQUE", "MASK", "BLEND"};
    for (int32_t i = 0; i < 4; ++i) {
        char rest[1024];
        snprintf(rest, sizeof rest,
                 "\"materials\":[{\"alphaMode\":\"%s\"}]," ALONE MESH("\"POSITION\":0", ",\"material\":0"),
                 modes[i % 3]);
        OWNED(vsh_model) *model = i < 3 ? read_made(begin(), rest) : read_text("a.obj", quad_obj);
        assert_int_equal(vsh_model_mesh(model, 0, 0).alpha, i % 3);
    }
}

/* --- poses */

TEST(nodes_stand_by_rotation_matrix_and_scene) {
    static const struct {
        const char *rest;
        double second[3], third[3]; /* corners */
    } files[] = {
        /* a right angle about x, by a quaternion of length 1 and of length 2 */
        {NODE(",\"rotation\":[0.70710678,0,0,0.70710678]"), {1, 0, 0}, {1, 0, 1}},
        {NODE(",\"rotation\":[0,1.41421356,0,1.41421356]"), {0, 0, -1}, {0, 1, -1}},
        /* columns: x to y, y to z, z to x, then a move */
        {NODE(",\"matrix\":[0,1,0,0, 0,0,1,0, 1,0,0,0, 5,6,7,1]"), {5, 7, 7}, {5, 7, 8}},
        {"\"scene\":1,\"scenes\":[{\"nodes\":[0]},{\"nodes\":[1]}],\"nodes\":[{\"mesh\":0},{\"mesh\":0,"
         "\"translation\":[0,0,9]}],",
         {1, 0, 9},
         {1, 1, 9}},
        /* no scene: what is nobody's child */
        {"\"nodes\":[{\"mesh\":0},{\"children\":[0],\"translation\":[0,3,0]}],", {1, 3, 0}, {1, 4, 0}},
    };
    for (size_t i = 0; i < COUNT_OF(files); ++i) {
        char rest[1024];
        snprintf(rest, sizeof rest, "%s" MESH("\"POSITION\":0", ""), files[i].rest);
        OWNED(vsh_model) *model = read_made(begin(), rest);
        assert_int_equal(vsh_model_mesh_count(model), 1);
        const double *b = files[i].second, *c = files[i].third;
        assert_corner(model, 0, 1, b[0], b[1], b[2]);
        assert_corner(model, 0, 2, c[0], c[1], c[2]);
    }
}

TEST(instances_stand_behind_their_node_and_have_equally_many_of_each) {
    static const float moves[3][3] = {{0, 0, 0}, {4, 0, 0}, {0, 0, 0}};
    static const float turns[2][4] = {{0, 0, 0, 1}, {0, 0, 0.70710678F, 0.70710678F}};
    static const char rest[] = "\"extensionsRequired\":[\"EXT_mesh_gpu_instancing\"]," NODE(
        ",\"scale\":[2,2,2],\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"TRANSLATION\":2,"
        "\"ROTATION\":3}}}") MESH("\"POSITION\":0", "");
    for (int count = 3; count >= 2; --count) {
        maker *m = begin();
        add(m, moves, sizeof moves, "", FLOATS, count, "VEC3", "");
        add(m, turns, sizeof turns, "", FLOATS, 2, "VEC4", "");
        if (count == 3) {
            refuse_made(m, rest, "ROTATION has 2 elements for 3");
            continue;
        }
        OWNED(vsh_model) *model = read_made(m, rest);
        assert_int_equal(vsh_model_mesh_count(model), 2);
        assert_corner(model, 0, 1, 2, 0, 0);
        assert_corner(model, 1, 1, 8, 2, 0);
        assert_int_not_equal(vsh_model_mesh(model, 0, 0).object, vsh_model_mesh(model, 1, 0).object);
    }
}

TEST(morph_targets_move_normals_too) {
    static const float moves[4][3] = {{0, 0, 0}, {0, 0, 2}, {0, 0, 0}, {0, 0, 0}};
    static const float turns[4][3] = {{0, 0, 0}, {0.8F, 0, -0.8F}, {0, 0, 0}, {0, 0, 0}};
    maker *m = begin();
    add(m, moves, sizeof moves, "", FLOATS, 4, "VEC3", "");
    add(m, turns, sizeof turns, "", FLOATS, 4, "VEC3", "");
    OWNED(vsh_model) *model =
        read_made(m, ALONE "\"meshes\":[{\"weights\":[0.5],\"primitives\":[{\"attributes\":{\"POSITION\":0,"
                           "\"NORMAL\":1},\"targets\":[{\"POSITION\":2,\"NORMAL\":3}]}]}]");
    assert_corner(model, 0, 1, 1, 0, 1);
    assert_normal(model, 1, 0.4, 0, 0.6);
}

/* The quad skinned to joints 1 (at 0, 4, 0, turned by a right angle about z) and 2 (at 10, 0, 0; bound two to
 * the right). The node's own transform is none of the skin's business. */
TEST(skins_are_at_rest_scale_weights_add_sets_and_turn_normals) {
    static const float sideways[4][3] = {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}};
    static const uint8_t second[4][8] = {{1}, {1}, {1}, {1}};
    static const float half[4][4] = {{0.5F}, {0.5F}, {0.5F}, {0}};
    static const float none[4][4] = {{0}, {0.5F}, {0}, {0}};
    static const float bound[2][16] = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                       {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -2, 0, 0, 1}};
    static const char *const parts[] = {NULL, "joints are no four bytes", "joint 1 is no node of the scene",
                                        "2 joints, but 1 matrices", "vertex 0 uses joint 2"};
    for (int wrong = 0; wrong < 5; ++wrong) {
        const uint8_t first[4][8] = {{wrong == 4 ? 2 : 0}, {0}, {0}, {0}};
        maker *m = begin();
        add(m, half, sizeof half, "", FLOATS, 4, "VEC4", "");
        add(m, sideways, sizeof sideways, "", FLOATS, 4, "VEC3", "");
        add(m, first, sizeof first, ",\"byteStride\":8", UBYTES, wrong == 1 ? 3 : 4, "VEC4", "");
        add(m, second, sizeof second, ",\"byteStride\":8", UBYTES, 4, "VEC4", "");
        add(m, none, sizeof none, "", FLOATS, 4, "VEC4", "");
        add(m, bound, sizeof bound, "", FLOATS, wrong == 3 ? 1 : 2, "MAT4", "");
        char rest[2048];
        snprintf(
            rest, sizeof rest,
            "\"scenes\":[{\"nodes\":[0,1%s]}],\"nodes\":[{\"mesh\":0,\"skin\":0,\"translation\":[100,0,"
            "0]},{\"translation\":[0,4,0],\"rotation\":[0,0,0.70710678,0.70710678]},{\"translation\":[10,"
            "0,0]}],\"skins\":[{\"joints\":[1,2],\"inverseBindMatrices\":7}]," MESH(
                "\"POSITION\":0,\"NORMAL\":3,\"JOINTS_0\":4,\"WEIGHTS_0\":2,\"JOINTS_1\":5,"
                "\"WEIGHTS_1\":6",
                ""),
            wrong == 2 ? "" : ",2");
        if (wrong != 0) {
            refuse_made(m, rest, parts[wrong]);
            continue;
        }
        OWNED(vsh_model) *model = read_made(m, rest);
        assert_corner(model, 0, 0, 0, 4, 0);                   /* half of a joint is all of it */
        assert_corner(model, 0, 1, 0.5 * (0 + 9), 0.5 * 5, 0); /* two sets */
        assert_corner(model, 0, 2, -1, 5, 0);                  /* turned */
        assert_normal(model, 0, 0, 1, 0);
    }
}

TEST(nodes_share_a_mesh_but_not_its_pose) {
    for (int order = 0; order < 2; ++order) {
        char rest[1024];
        snprintf(
            rest, sizeof rest,
            "\"scenes\":[{\"nodes\":[%s,2]}],\"nodes\":[{\"mesh\":0},{\"mesh\":0,\"weights\":[2]},{\"mesh\":"
            "0,\"skin\":0},{\"translation\":[0,8,0]}],\"skins\":[{\"joints\":[3]}],\"meshes\":[{"
            "\"primitives\":[{\"attributes\":{\"POSITION\":0,\"JOINTS_0\":2,\"WEIGHTS_0\":3},\"targets\":[{"
            "\"POSITION\":0}]}]}]",
            order == 0 ? "0,1,3" : "1,0,3");
        maker *m = begin();
        static const uint8_t joints[16] = {0};
        static const float weights[4][4] = {{1}, {1}, {1}, {1}};
        add(m, joints, sizeof joints, "", UBYTES, 4, "VEC4", "");
        add(m, weights, sizeof weights, "", FLOATS, 4, "VEC4", "");
        OWNED(vsh_model) *model = read_made(m, rest);
        assert_int_equal(vsh_model_mesh_count(model), 3);
        assert_corner(model, order == 0 ? 0 : 1, 1, 1, 0, 0);
        assert_corner(model, order == 0 ? 1 : 0, 1, 3, 0, 0);
        assert_corner(model, 2, 1, 1, 8, 0);
    }
}

/* --- what is refused */

TEST(required_extensions_that_are_not_known_are_refused_by_name) {
    static const struct {
        const char *name, *advice;
    } cases[] = {{"KHR_made_up", "export it without"}, {"KHR_node_visibility", "visible nodes"},
                 {"KHR_mesh_quantization", NULL},      {"KHR_texture_transform", NULL},
                 {"KHR_materials_unlit", NULL},        {"KHR_lights_punctual", NULL}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        char rest[1024];
        snprintf(rest, sizeof rest, "\"extensionsRequired\":[\"%s\"]," ALONE MESH("\"POSITION\":0", ""),
                 cases[i].name);
        if (cases[i].advice != NULL) {
            refuse_as(begin(), rest, VSH_ERROR_UNSUPPORTED, cases[i].name, cases[i].advice);
        } else {
            vsh_model_free(read_made(begin(), rest));
        }
    }
}

TEST(a_missing_buffer_is_named) {
#define BESIDE(uri)                                                                                          \
    "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":48,\"uri\":\"" uri "\"}]," ALONE MESH(    \
        "\"POSITION\":0",                                                                                    \
        "") ",\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}],"      \
            "\"bufferViews\":[{\"buffer\":0,\"byteLength\":48}]}"
    refused("a.gltf", BESIDE("my%20data.bin"), VSH_ERROR_READ, "my data.bin': cannot be read: No such file",
            "buffers[0]");
    refused("a.gltf", BESIDE("https://example.org/a.bin"), VSH_ERROR_UNSUPPORTED, "https://", "beside it");
    write_all(at("my data.bin"), QUAD, 48);
    vsh_model_free(read_text("a.gltf", BESIDE("my%20data.bin")));
    write_all(at("my data.bin"), QUAD, 40);
    refused("a.gltf", BESIDE("my%20data.bin"), VSH_ERROR_READ, "cut short: 40 bytes of 48", "buffers[0]");
    assert_int_equal(unlink(at("my data.bin")), 0);
#undef BESIDE
}

TEST(values_out_of_range_are_refused) {
    static const struct {
        const char *rest, *part;
    } bad[] = {
        {NODE(",\"children\":[0]") MESH("\"POSITION\":0", ""), "nodes[0] is its own descendant"},
        {NODE(",\"children\":[9]") MESH("\"POSITION\":0", ""), "names node 9"},
        {NODE(",\"children\":[-1]") MESH("\"POSITION\":0", ""), "names node -1"},
        {NODE(",\"translation\":[0,\"a\",0]") MESH("\"POSITION\":0", ""), "nodes[0]: its transform"},
        {ALONE MESH("\"POSITION\":0", ",\"mode\":7"), "its mode is unknown"},
        {ALONE MESH("\"POSITION\":0", ",\"indices\":2"), "'indices' is 2"},
        {ALONE MESH("\"POSITION\":0", ",\"indices\":-1"), "'indices' is no index"},
        {ALONE MESH("\"POSITION\":0", ",\"indices\":0"), "its indices have 3 components"},
    };
    for (size_t i = 0; i < COUNT_OF(bad); ++i) {
        refuse_made(begin(), bad[i].rest, bad[i].part);
    }
    refused("a.gltf", "{\"asset\":{\"version\":\"1.0\"}}", VSH_ERROR_UNSUPPORTED, "is glTF 1.0", "2.0");
    refused("a.gltf", "{}", VSH_ERROR_INPUT, "is no glTF", "");
    refused("a.gltf", "[]", VSH_ERROR_INPUT, "is no glTF", "");
}

TEST(nodes_deeper_than_the_limit_are_refused) {
    enum { NODES = 1100 };
    static char rest[1 << 15];
    size_t used = (size_t)snprintf(rest, sizeof rest, "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[");
    for (int i = 0; i < NODES; ++i) {
        used += (size_t)snprintf(rest + used, sizeof rest - used, "%s{\"children\":[%d]}", i > 0 ? "," : "",
                                 i + 1);
    }
    snprintf(rest + used, sizeof rest - used, ",{}]");
    refuse_as(begin(), rest, VSH_ERROR_LIMIT, "deeper than 1024", "");
}

/* The size that an accessor claims is compared with the limit before memory is allocated. */
TEST(claims_of_memory_are_checked) {
    FREED maker *m = begin();
    strcat(m->accessors, ",{\"componentType\":5126,\"count\":4000000000,\"type\":\"VEC3\"}");
    const char *text = text_of(m, ALONE MESH("\"POSITION\":2", ""));
    write_all(at("a.gltf"), text, strlen(text));
    const vsh_run run = run_within(100000000);
    vsh_model *model;
    assert_int_equal(vsh_model_read(at("a.gltf"), &run, &model, &failure), VSH_ERROR_LIMIT);
    assert_int_equal(unlink(at("a.gltf")), 0);
}

FIXTURE(make_folder, remove_empty_folder)
