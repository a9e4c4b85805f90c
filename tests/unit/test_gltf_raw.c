/* A reader leaves arrays of a GLB in the file (src/model/model_message.c). They equal arrays that are read in
 * the process itself, and damaged ones are refused. The test is its own reader. */
#define _GNU_SOURCE

#include "served.h"
#include "testing.h"

enum {
    SIDE = 80,
    VERTICES = SIDE * SIDE + 1, /* the last is nobody's */
    CORNERS = 6 * (SIDE - 1) * (SIDE - 1),
    POSITIONS = 12 * VERTICES,
    UVS = 8 * VERTICES,
    BODY = 2 * POSITIONS + UVS + 4 * CORNERS
};

typedef struct sheet {
    float positions[VERTICES][3], normals[VERTICES][3], uvs[VERTICES][2];
    uint32_t indices[CORNERS];
} sheet;

static sheet *make_sheet(void) {
    sheet *s = calloc(1, sizeof *s);
    assert_non_null(s);
    for (uint32_t v = 0; v < VERTICES; ++v) {
        const float x = (float)(v % SIDE), y = (float)(v / SIDE);
        memcpy(s->positions[v], (float[3]){x, y, 0.01F * x * y}, sizeof(float[3]));
        memcpy(s->normals[v], (float[3]){-0.01F * y, -0.01F * x, 1.0F}, sizeof(float[3]));
        memcpy(s->uvs[v], (float[2]){x / SIDE, y / SIDE}, sizeof(float[2]));
    }
    for (uint32_t q = 0; q < CORNERS / 6; ++q) {
        const uint32_t a = q / (SIDE - 1) * SIDE + q % (SIDE - 1), d = a + SIDE + 1;
        memcpy(s->indices + 6 * (size_t)q, (uint32_t[6]){a, a + 1, d, a, d, a + SIDE}, sizeof(uint32_t[6]));
    }
    return s;
}

/* `position` is more of the accessor of positions, `node` of the node. */
static void write_sheet(const char *name, const sheet *s, const char *position, const char *node) {
    char json[2048];
    int size = snprintf(
        json, sizeof json,
        "{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0%9$s}],"
        "\"meshes\":"
        "[{\"name\":\"sheet\",\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":1,\"TEXCOORD_0\":2},"
        "\"targets\":[{\"POSITION\":0}],\"indices\":3}]}],\"accessors\":[{\"bufferView\":0,\"componentType\":"
        "5126,\"count\":%1$d,\"type\":\"VEC3\"%8$s},{\"bufferView\":1,\"componentType\":5126,\"count\":%1$d,"
        "\"type\":\"VEC3\"},{\"bufferView\":2,\"componentType\":5126,\"count\":%1$d,\"type\":\"VEC2\"},"
        "{\"bufferView\":3,\"componentType\":5125,\"count\":%2$d,\"type\":\"SCALAR\"}],\"bufferViews\":[{"
        "\"buffer\":0,\"byteLength\":%3$d},{\"buffer\":0,\"byteOffset\":%3$d,\"byteLength\":%3$d},{"
        "\"buffer\":"
        "0,\"byteOffset\":%4$d,\"byteLength\":%5$d},{\"buffer\":0,\"byteOffset\":%6$d,\"byteLength\":%7$d}],"
        "\"buffers\":[{\"byteLength\":%10$d}]}",
        VERTICES, CORNERS, POSITIONS, 2 * POSITIONS, UVS, 2 * POSITIONS + UVS, 4 * CORNERS, position, node,
        BODY);
    assert_in_range(size, 1, sizeof json - 5);
    while (size % 4 != 0) {
        json[size++] = ' ';
    }
    const size_t all = 28 + (size_t)size + BODY;
    unsigned char *bytes = malloc(all), *at = bytes + 20 + size;
    assert_non_null(bytes);
    memcpy(bytes, "glTF\2\0\0", 8);
    put_u32(bytes + 8, all);
    put_u32(bytes + 12, (size_t)size);
    memcpy(bytes + 16, "JSON", 4);
    memcpy(bytes + 20, json, (size_t)size);
    put_u32(at, BODY);
    memcpy(at + 4, "BIN", 4);
    memcpy(at + 8, s->positions, POSITIONS);
    memcpy(at + 8 + POSITIONS, s->normals, POSITIONS);
    memcpy(at + 8 + 2 * POSITIONS, s->uvs, UVS);
    memcpy(at + 8 + 2 * POSITIONS + UVS, s->indices, 4 * CORNERS);
    write_bytes(name, bytes, all);
    free(bytes);
}

static vsh_result read_by(bool reader, const char *name, vsh_model **model, vsh_error *error) {
    vsh_run run = vsh_run_default();
    run.warning = keep_warning;
    run.reader = reader ? "/proc/self/exe" : NULL;
    run.reader_seconds = reader ? 120.0 : 0.0;
    warnings[0] = '\0';
    return vsh_model_read(path_of(name).text, &run, model, error);
}

static bool is_raw(const vsh_model *model) {
    return model->blocks[0] != NULL;
}

static void assert_same(const vsh_model *a, const vsh_model *b) {
    assert_int_equal(vsh_model_mesh_count(a), vsh_model_mesh_count(b));
    for (size_t i = 0; i < vsh_model_mesh_count(a); ++i) {
        const vsh_mesh x = vsh_model_mesh(a, i, 0), y = vsh_model_mesh(b, i, 0);
        assert_int_equal(x.vertex_count, y.vertex_count);
        assert_int_equal(x.triangle_count, y.triangle_count);
        assert_memory_equal(x.positions, y.positions, x.vertex_count * sizeof(float[3]));
        assert_memory_equal(x.normals, y.normals, x.vertex_count * sizeof(float[3]));
        assert_memory_equal(x.uvs, y.uvs, x.vertex_count * sizeof(float[2]));
        assert_memory_equal(x.indices, y.indices, x.triangle_count * sizeof(uint32_t[3]));
    }
}

/* `raw`: whether they are expected to be left in the file. */
static void assert_alike(const sheet *s, const char *position, const char *node, bool raw, size_t vertices) {
    vsh_model *model[2];
    char said[sizeof warnings];
    write_sheet("a.glb", s, position, node);
    for (int reader = 0; reader < 2; ++reader) {
        assert_ok(read_by(reader != 0, "a.glb", &model[reader], &failure));
        if (reader == 0) {
            memcpy(said, warnings, sizeof said);
        }
    }
    assert_string_equal(said, warnings);
    assert_int_equal(unlink(path_of("a.glb").text), 0);
    assert_true(is_raw(model[1]) == raw);
    assert_int_equal(vsh_model_mesh(model[1], 0, 0).vertex_count, vertices);
    assert_same(model[0], model[1]);
    vsh_model_free(model[0]);
    vsh_model_free(model[1]);
}

TEST(arrays_left_in_the_file_are_those_read_here) {
    sheet *s = make_sheet();
    assert_alike(s, "", "", true, VERTICES - 1); /* without the vertex that nobody uses */
    assert_alike(s, "", ",\"translation\":[1,2,3],\"weights\":[0]", true, VERTICES - 1);
    s->indices[CORNERS - 1] = VERTICES - 1;
    assert_alike(s, "", "", true, VERTICES);
    s->normals[5][1] = NAN;
    assert_alike(s, "", "", true, VERTICES);
    assert_non_null(strstr(warnings, "mesh 0 'sheet': primitive 0: 1 normals are not finite"));
    free(s);
}

TEST(what_moves_or_is_replaced_is_not_left_in_the_file) {
    sheet *s = make_sheet();
    assert_alike(s, "", ",\"weights\":[0.5]", false, VERTICES - 1);
    assert_alike(s,
                 ",\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":3,\"componentType\":5125},"
                 "\"values\":{\"bufferView\":1}}",
                 "", false, VERTICES - 1);
    free(s);
}

static void assert_refused_alike(const sheet *s, const char *position, const char *part) {
    write_sheet("a.glb", s, position, "");
    vsh_error error[2] = {{0}, {0}};
    for (int reader = 0; reader < 2; ++reader) {
        vsh_model *model;
        assert_int_equal(read_by(reader != 0, "a.glb", &model, &error[reader]), VSH_ERROR_INPUT);
    }
    assert_string_equal(error[0].message, error[1].message);
    assert_non_null(strstr(error[0].message, part));
    assert_int_equal(unlink(path_of("a.glb").text), 0);
}

TEST(wrong_arrays_are_refused_in_the_same_words) {
    sheet *s = make_sheet();
    for (int i = 0; i < 3; ++i) {
        const uint32_t bad[3] = {VERTICES, UINT32_C(1) << 31, UINT32_MAX};
        s->indices[CORNERS - 7] = bad[i];
        assert_refused_alike(s, "", "mesh 0 'sheet': primitive 0: index 37439 of 37446 is");
    }
    s->indices[CORNERS - 7] = 0;
    s->positions[SIDE][2] = -INFINITY;
    assert_refused_alike(s, "", "vertex 80 of 6400 lies at (0, 1, -inf)");
    s->positions[SIDE][2] = 0;
    assert_refused_alike(s, ",\"byteOffset\":4", "pass the");
    free(s);
}

/* --- what a reader tells of them */

static void look_at_mesh(const vsh_model *model) {
    vsh_mesh_report report;
    const vsh_mesh mesh = vsh_model_mesh(model, 0, 0);
    assert_int_not_equal(vsh_mesh_check(&mesh, &report, &failure), VSH_ERROR_ARGUMENT);
}

TEST(what_a_reader_tells_is_refused_or_sound) {
    static const uint64_t values[] = {0,
                                      1,
                                      2,
                                      3,
                                      VERTICES - 1,
                                      UINT32_MAX,
                                      UINT64_MAX,
                                      VERTICES + 1,
                                      UINT64_C(1) << 63,
                                      UINT64_C(1) << 40,
                                      BODY,
                                      UINT64_MAX / 12 + 2,
                                      64};
    sheet *s = make_sheet();
    write_sheet("a.glb", s, "", "");
    tell_wrong("a.glb", values, sizeof values / sizeof values[0], look_at_mesh, 100, 10);
    free(s);
    assert_int_equal(unlink(path_of("a.glb").text), 0);
}

TEST(a_file_that_changed_since_is_refused) {
    static _Alignas(8) unsigned char whole[4096];
    vsh_model *model = NULL;
    sheet *s = make_sheet();
    write_sheet("a.glb", s, "", "");
    const size_t size = payload_of("a.glb", whole, sizeof whole);
    assert_ok(decode(whole, size, "a.glb", 0, &model, &failure));
    vsh_model_free(model);
    assert_int_equal(decode(whole, size, "a.glb", 100000, &model, &failure), VSH_ERROR_LIMIT);
    write_sheet("b.glb", s, "", "");
    assert_int_equal(rename(path_of("b.glb").text, path_of("a.glb").text), 0);
    assert_fails(decode(whole, size, "a.glb", 0, &model, &failure), VSH_ERROR_READ,
                 "a.glb: changed while it was read");
    assert_int_equal(unlink(path_of("a.glb").text), 0);
    assert_int_equal(decode(whole, size, "a.glb", 0, &model, &failure), VSH_ERROR_READ);
    free(s);
}

int main(int argc, char **argv) {
    if (argc > 1 && strcmp(argv[1], VSH_READER_ARGUMENT) == 0) {
        return vsh_reader_serve(argc, argv);
    }
    return run_all_tests(make_folder, remove_folder);
}
