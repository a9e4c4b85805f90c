/* glTF by the text of its specification: accessors of every kind, extensions, poses, and what is refused. */
#include "models.h"
#include "testing.h"

/* A whole file: `rest` is its JSON behind the buffer, in which {B} stands for the buffer's length. */
static const char *gltf_of(const char *rest, const void *buffer, size_t size) {
    static char json[1 << 16], text[1 << 14];
    base64(buffer, size, text);
    const int length = snprintf(json, sizeof json,
                                "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":%zu,\"uri\":"
                                "\"data:application/octet-stream;base64,%s\"}],%s}",
                                size, text, rest);
    assert_in_range(length, 1, sizeof json - 1);
    return json;
}

#define ONE_MESH                                                                                             \
    "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0%s}],\"meshes\":[{\"primitives\":[{%"                \
    "s\"attributes\":"                                                                                       \
    "{\"POSITION\":0%s}}]}]"

static vsh_model *read_gltf(const char *rest, const void *buffer, size_t size) {
    return read_text("a.gltf", gltf_of(rest, buffer, size));
}

static void refused_gltf(const char *rest, const void *buffer, size_t size, vsh_result code, const char *part,
                         const char *other) {
    refused("a.gltf", gltf_of(rest, buffer, size), code, part, other);
}

/* Corner k of the only triangle, in the world. */
static vshi_vec corner_of(const vsh_model *model, size_t mesh, int k) {
    const vsh_mesh view = vsh_model_mesh(model, mesh, 0);
    vshi_vec corner[3];
    vshi_mesh_triangle(&view, 0, corner);
    return corner[k];
}

static void assert_at(vshi_vec p, double x, double y, double z) {
    assert_near(p.x, x, 1e-6);
    assert_near(p.y, y, 1e-6);
    assert_near(p.z, z, 1e-6);
}

/* KHR_mesh_quantization: every type, as it is and normalized, with a stride that is no multiple of the type.
 */
TEST(quantized_positions_stand_for_their_numbers) {
    static const struct {
        int type, size;
        double most;
        bool is_signed;
    } types[] = {
        {5120, 1, 127.0, true}, {5121, 1, 255.0, false}, {5122, 2, 32767.0, true}, {5123, 2, 65535.0, false}};
    for (size_t t = 0; t < 4; ++t) {
        for (int normalized = 0; normalized < 2; ++normalized) {
            const long lowest = types[t].is_signed ? -(long)types[t].most : 0, most = (long)types[t].most;
            const long at[3][3] = {{0, 0, 0}, {most, 0, 0}, {lowest, most, 1}};
            unsigned char buffer[24] = {0};
            for (size_t i = 0; i < 3; ++i) {
                for (size_t k = 0; k < 3; ++k) {
                    const unsigned long bits = (unsigned long)at[i][k];
                    unsigned char *to = buffer + 8 * i + (size_t)types[t].size * k;
                    to[0] = (unsigned char)bits;
                    if (types[t].size == 2) {
                        to[1] = (unsigned char)(bits >> 8);
                    }
                }
            }
            char rest[1024];
            snprintf(
                rest, sizeof rest,
                "\"extensionsRequired\":[\"KHR_mesh_quantization\"]," ONE_MESH
                ",\"accessors\":[{\"bufferView\":0,\"componentType\":%d,\"count\":3,\"type\":\"VEC3\","
                "\"normalized\":%s}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":24,\"byteStride\":8}]",
                ",\"scale\":[2,2,2]", "", "", types[t].type, normalized ? "true" : "false");
            OWNED(vsh_model) *model = read_gltf(rest, buffer, sizeof buffer);
            const double unit = normalized ? 2.0 / types[t].most : 2.0;
            const double tolerance = normalized ? 1e-6 : 1e-6 * types[t].most;
            for (int i = 0; i < 3; ++i) {
                const vshi_vec p = corner_of(model, 0, i);
                assert_near(p.x, unit * (double)at[i][0], tolerance);
                assert_near(p.y, unit * (double)at[i][1], tolerance);
                assert_near(p.z, unit * (double)at[i][2], tolerance);
            }
        }
    }
}

static const float corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};

#define FOUR_CORNERS                                                                                         \
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"%s}%s],"           \
    "\"bufferViews\":[{\"buffer\":0,\"byteLength\":48}%s]"

TEST(sparse_accessors_replace_elements) {
    unsigned char buffer[48 + 4 + 24];
    const float moved[2][3] = {{5, 0, 0}, {0, 7, 0}};
    memcpy(buffer, corners, 48);
    memcpy(buffer + 48, (unsigned char[4]){1, 2, 0, 0}, 4);
    memcpy(buffer + 52, moved, 24);
    char rest[2048];
    for (int with_view = 0; with_view < 2; ++with_view) { /* without: of zeros */
        snprintf(rest, sizeof rest,
                 ONE_MESH
                 ",\"accessors\":[{%s\"componentType\":5126,\"count\":4,\"type\":\"VEC3\",\"sparse\":"
                 "{\"count\":2,\"indices\":{\"bufferView\":1,\"componentType\":5121},\"values\":{"
                 "\"bufferView\":2}}}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":48},{\"buffer\":"
                 "0,\"byteOffset\":48,\"byteLength\":2},{\"buffer\":0,\"byteOffset\":52,"
                 "\"byteLength\":24}]",
                 "", "", "", with_view ? "\"bufferView\":0," : "");
        OWNED(vsh_model) *model = read_gltf(rest, buffer, sizeof buffer);
        assert_at(corner_of(model, 0, 1), 5, 0, 0);
        assert_at(corner_of(model, 0, 2), 0, 7, 0);
    }
    buffer[49] = 4;
    refused_gltf(rest, buffer, sizeof buffer, VSH_ERROR_INPUT, "sparse index 1 of 2 is 4", "accessors[0]");
}

/* KHR_mesh_quantization as gltfpack writes it: normals of bytes, UVs of unsigned shorts, indices of every
 * type. */
TEST(quantized_normals_uvs_and_indices_stand_for_their_numbers) {
    for (int type = 5121; type <= 5125; type += 2) {
        unsigned char buffer[48 + 16 + 16 + 24] = {0};
        memcpy(buffer, corners, 48);
        for (size_t v = 0; v < 4; ++v) {
            memcpy(buffer + 48 + 4 * v, (int8_t[4]){0, -127, (int8_t)-128, 0}, 4);
            memcpy(buffer + 64 + 4 * v, (uint16_t[2]){(uint16_t)(13107 * v), 65535}, 4);
        }
        const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
        const size_t size = type == 5121 ? 1 : type == 5123 ? 2 : 4;
        for (size_t i = 0; i < 6; ++i) {
            buffer[80 + size * i] = (unsigned char)indices[i];
        }
        char rest[2048];
        snprintf(
            rest, sizeof rest,
            "\"extensionsRequired\":[\"KHR_mesh_quantization\"],\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{"
            "\"mesh\":0}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":1,"
            "\"TEXCOORD_0\":2},\"indices\":3}]}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,"
            "\"count\":4,\"type\":\"VEC3\"},{\"bufferView\":1,\"componentType\":5120,\"normalized\":true,"
            "\"count\":4,\"type\":\"VEC3\"},{\"bufferView\":2,\"componentType\":5123,\"normalized\":true,"
            "\"count\":4,\"type\":\"VEC2\"},{\"bufferView\":3,\"componentType\":%d,\"count\":6,\"type\":"
            "\"SCALAR\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":48},{\"buffer\":0,\"byteOffset\":48,"
            "\"byteLength\":16,\"byteStride\":4},{\"buffer\":0,\"byteOffset\":64,\"byteLength\":16},{"
            "\"buffer\":0,\"byteOffset\":80,\"byteLength\":24}]",
            type);
        vsh_model *model = read_gltf(rest, buffer, sizeof buffer);
        const vsh_mesh mesh = vsh_model_mesh(model, 0, 0);
        assert_memory_equal(mesh.indices, indices, sizeof indices);
        for (size_t v = 0; v < 4; ++v) {
            assert_true(mesh.normals[3 * v] == 0.0F && mesh.normals[3 * v + 1] == -1.0F);
            assert_true(mesh.normals[3 * v + 2] == -1.0F); /* -128, too */
            assert_near((double)mesh.uvs[2 * v], 0.2 * (double)v, 1e-7);
            assert_true(mesh.uvs[2 * v + 1] == 0.0F); /* v up */
        }
        vsh_model_free(model);
        memcpy(strstr(rest, "\"count\":6"), "\"count\":5", 9); /* a corner alone is no triangle */
        model = read_gltf(rest, buffer, sizeof buffer);
        assert_int_equal(vsh_model_mesh(model, 0, 0).triangle_count, 1);
        vsh_model_free(model);
    }
}

/* Indices of every type, in no order; the last of those that agree counts. */
TEST(sparse_indices_may_be_of_any_unsigned_type) {
    static const float moved[3][3] = {{9, 9, 9}, {0, 7, 0}, {5, 0, 0}};
    static const struct {
        int type;
        size_t size;
        vsh_result result;
    } types[] = {{5121, 1, VSH_OK},          {5123, 2, VSH_OK},          {5125, 4, VSH_OK},
                 {5120, 1, VSH_ERROR_INPUT}, {5126, 4, VSH_ERROR_INPUT}, {0, 1, VSH_ERROR_INPUT}};
    for (size_t t = 0; t < sizeof types / sizeof types[0]; ++t) {
        unsigned char buffer[48 + 12 + 36] = {0};
        memcpy(buffer, corners, 48);
        buffer[48] = 1;
        buffer[48 + types[t].size] = 2;
        buffer[48 + 2 * types[t].size] = 1;
        memcpy(buffer + 60, moved, 36);
        char rest[2048];
        snprintf(rest, sizeof rest,
                 ONE_MESH
                 ",\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":"
                 "\"VEC3\",\"sparse\":{\"count\":3,\"indices\":{\"bufferView\":1,\"componentType\":%d},"
                 "\"values\":{\"bufferView\":2}}}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":48},{"
                 "\"buffer\":0,\"byteOffset\":48,\"byteLength\":%zu},{\"buffer\":0,\"byteOffset\":60,"
                 "\"byteLength\":36}]",
                 "", "", "", types[t].type, 3 * types[t].size);
        if (types[t].result != VSH_OK) {
            refused_gltf(rest, buffer, sizeof buffer, types[t].result, "its sparse part is wrong",
                         "accessors[0]");
            continue;
        }
        OWNED(vsh_model) *model = read_gltf(rest, buffer, sizeof buffer);
        assert_at(corner_of(model, 0, 1), 5, 0, 0);
        assert_at(corner_of(model, 0, 2), 0, 7, 0);
    }
}

TEST(strips_and_fans_become_triangles_of_one_winding) {
    static const float zigzag[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
    for (int mode = 5; mode <= 6; ++mode) {
        char rest[1024], of[32];
        snprintf(of, sizeof of, "\"mode\":%d,", mode);
        snprintf(rest, sizeof rest, ONE_MESH "," FOUR_CORNERS, "", of, "", "", "", "");
        OWNED(vsh_model) *model = read_gltf(rest, mode == 5 ? zigzag : corners, 48);
        const vsh_mesh_report report = check(model, 0);
        assert_int_equal(vsh_model_mesh(model, 0, 0).triangle_count, 2);
        assert_int_equal(report.flipped_edges, 0);
        assert_int_equal(report.open_edges, 4);
        assert_near(report.area, 1.0, 1e-12);
    }
}

TEST(required_extensions_that_are_not_known_are_refused_by_name) {
    static const struct {
        const char *name, *advice;
    } unknown[] = {{"KHR_made_up", "export it without"}, {"KHR_node_visibility", "to be seen"}};
    static const char *const known[] = {"KHR_mesh_quantization", "KHR_texture_transform",
                                        "KHR_materials_unlit", "KHR_lights_punctual"};
    char rest[1024];
    for (size_t i = 0; i < 2; ++i) {
        snprintf(rest, sizeof rest, "\"extensionsRequired\":[\"%s\"]," ONE_MESH "," FOUR_CORNERS,
                 unknown[i].name, "", "", "", "", "", "");
        refused_gltf(rest, corners, 48, VSH_ERROR_UNSUPPORTED, unknown[i].name, unknown[i].advice);
    }
    for (size_t i = 0; i < 4; ++i) {
        snprintf(rest, sizeof rest, "\"extensionsRequired\":[\"%s\"]," ONE_MESH "," FOUR_CORNERS, known[i],
                 "", "", "", "", "", "");
        vsh_model_free(read_gltf(rest, corners, 48));
    }
}

TEST(instances_stand_behind_their_node) {
    unsigned char buffer[48 + 24];
    const float moves[2][3] = {{0, 0, 0}, {3, 0, 0}};
    memcpy(buffer, corners, 48);
    memcpy(buffer + 48, moves, 24);
    char rest[2048];
    snprintf(rest, sizeof rest,
             "\"extensionsRequired\":[\"EXT_mesh_gpu_instancing\"]," ONE_MESH "," FOUR_CORNERS,
             ",\"scale\":[2,2,2],\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{"
             "\"TRANSLATION\":1}}}",
             "", "", "", ",{\"bufferView\":1,\"componentType\":5126,\"count\":2,\"type\":\"VEC3\"}",
             ",{\"buffer\":0,\"byteOffset\":48,\"byteLength\":24}");
    OWNED(vsh_model) *model = read_gltf(rest, buffer, sizeof buffer);
    assert_int_equal(vsh_model_mesh_count(model), 2);
    assert_at(corner_of(model, 0, 1), 2, 0, 0);
    assert_at(corner_of(model, 1, 1), 8, 0, 0);
    assert_int_not_equal(vsh_model_mesh(model, 0, 0).object, vsh_model_mesh(model, 1, 0).object);
}

/* Two joints with a matrix each; the node's own transform is none of the skin's business. */
TEST(skins_are_at_rest_and_leave_their_node_out) {
    unsigned char buffer[48 + 16 + 64 + 128] = {0};
    memcpy(buffer, corners, 48);
    for (size_t v = 0; v < 4; ++v) {
        const float weights[4] = {0.75F, 0.25F, 0, 0};
        buffer[48 + 4 * v + 1] = 1;
        memcpy(buffer + 64 + 16 * v, weights, 16);
    }
    for (size_t joint = 0; joint < 2; ++joint) {
        float m[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
        m[12] = joint == 1 ? -2.0F : 0.0F; /* bound two to the right */
        memcpy(buffer + 128 + 64 * joint, m, 64);
    }
    char rest[4096];
    snprintf(
        rest, sizeof rest,
        "\"scenes\":[{\"nodes\":[0,1]}],\"nodes\":[{\"mesh\":0,\"skin\":0,\"translation\":[100,0,0]},"
        "{\"children\":[2],\"translation\":[0,4,0]},{\"translation\":[2,8,0]}],\"skins\":[{\"joints\":[1,"
        "2],\"inverseBindMatrices\":3}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,"
        "\"JOINTS_0\":1,\"WEIGHTS_0\":2}}]}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,"
        "\"count\":4,\"type\":\"VEC3\"},{\"bufferView\":1,\"componentType\":5121,\"count\":4,\"type\":"
        "\"VEC4\"},{\"bufferView\":2,\"componentType\":5126,\"count\":4,\"type\":\"VEC4\"},{"
        "\"bufferView\":3,\"componentType\":5126,\"count\":2,\"type\":\"MAT4\"}],\"bufferViews\":[{"
        "\"buffer\":0,\"byteLength\":48},{\"buffer\":0,\"byteOffset\":48,\"byteLength\":16},{\"buffer\":0,"
        "\"byteOffset\":64,\"byteLength\":64},{\"buffer\":0,\"byteOffset\":128,\"byteLength\":128}]");
    vsh_model *model = read_gltf(rest, buffer, sizeof buffer);
    assert_at(corner_of(model, 0, 0), 0, 0.75 * 4 + 0.25 * 12, 0);
    assert_at(corner_of(model, 0, 1), 1, 6, 0);
    vsh_model_free(model);
    buffer[49] = 2;
    refused_gltf(rest, buffer, sizeof buffer, VSH_ERROR_INPUT, "vertex 0 uses joint 2", "only 2");
}

TEST(alpha_comes_with_the_mesh) {
    static const char *const modes[] = {"OPAQUE", "MASK", "BLEND"};
    for (int32_t i = 0; i < 3; ++i) {
        char rest[1024];
        snprintf(rest, sizeof rest, "\"materials\":[{\"alphaMode\":\"%s\"}]," ONE_MESH "," FOUR_CORNERS,
                 modes[i], "", "\"material\":0,", "", "", "", "");
        OWNED(vsh_model) *model = read_gltf(rest, corners, 48);
        assert_int_equal(vsh_model_mesh(model, 0, 0).alpha, i);
    }
    OWNED(vsh_model) *model = read_text("a.obj", "mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n");
    assert_int_equal(vsh_model_mesh(model, 0, 0).alpha, VSH_ALPHA_OPAQUE);
}

TEST(a_buffer_that_is_not_there_is_named) {
#define BESIDE(uri)                                                                                          \
    "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":48,\"uri\":\"" uri "\"}],\"scenes\":[{"   \
    "\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}" \
    "}]"                                                                                                     \
    "}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}],"            \
    "\"bufferViews\":[{\"buffer\":0,\"byteLength\":48}]}"
    refused("a.gltf", BESIDE("my%20data.bin"), VSH_ERROR_READ, "my data.bin': cannot be read: No such file",
            "buffers[0]");
    refused("a.gltf", BESIDE("https://example.org/a.bin"), VSH_ERROR_UNSUPPORTED, "https://", "beside it");
    write_bytes("my data.bin", corners, 48);
    vsh_model_free(read_text("a.gltf", BESIDE("my%20data.bin")));
    write_bytes("my data.bin", corners, 40);
    refused("a.gltf", BESIDE("my%20data.bin"), VSH_ERROR_READ, "cut short: 40 bytes of 48", "buffers[0]");
    assert_int_equal(unlink(path_of("my data.bin").text), 0);
#undef BESIDE
}

TEST(what_is_out_of_range_is_refused) {
    static const struct {
        const char *node, *primitive, *accessor, *part;
    } bad[] = {
        {",\"children\":[0]", "", "", "nodes[0] is its own descendant"},
        {",\"children\":[9]", "", "", "names node 9"},
        {",\"children\":[-1]", "", "", "names node -1"},
        {",\"translation\":[0,\"a\",0]", "", "", "nodes[0]: its transform"},
        {"", "\"mode\":7,", "", "its mode is none"},
        {"", "\"indices\":1,", "", "'indices' is 1"},
        {"", "\"indices\":-1,", "", "'indices' is no index"},
        {"", "\"indices\":0,", "", "its indices have 3 components"},
        {"", "", ",\"byteOffset\":4", "pass the 48 bytes of bufferViews[0]"},
        {"", "", ",\"byteOffset\":1e300", "count or byteOffset"},
        {"", "", ",\"byteOffset\":-4", "count or byteOffset"},
        {"", "", ",\"byteOffset\":9007199254740992", "pass the 48 bytes"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        char rest[1024];
        snprintf(rest, sizeof rest, ONE_MESH "," FOUR_CORNERS, bad[i].node, bad[i].primitive, "",
                 bad[i].accessor, "", "");
        refused_gltf(rest, corners, 48, VSH_ERROR_INPUT, bad[i].part, "");
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
    refused_gltf(rest, corners, 48, VSH_ERROR_LIMIT, "deeper than 1024", "");
}

/* What an accessor claims is held against the limit before memory is taken. */
TEST(claims_of_memory_are_checked) {
    write_bytes("a.gltf", "", 0);
    char rest[1024];
    snprintf(rest, sizeof rest,
             ONE_MESH ",\"accessors\":[{\"componentType\":5126,\"count\":4000000000,\"type\":\"VEC3\"}]", "",
             "", "");
    const char *text = gltf_of(rest, corners, 48);
    write_bytes("a.gltf", text, strlen(text));
    vsh_run run = vsh_run_default();
    run.memory_limit = 100000000;
    vsh_model *model;
    assert_int_equal(vsh_model_read(path_of("a.gltf").text, &run, &model, &failure), VSH_ERROR_LIMIT);
    assert_int_equal(unlink(path_of("a.gltf").text), 0);
}

FIXTURE(make_folder, remove_folder)
