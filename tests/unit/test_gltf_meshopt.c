/* Buffer views under EXT_meshopt_compression: they unpack to what meshoptimizer packed, through filters as
 * near as their bits, and damaged ones are refused. */
#include "gltf_maker.h"
#include "handles.h"

#include <meshoptimizer.h>

enum { SIDE = 24, VERTICES = SIDE * SIDE, CORNERS = 6 * (SIDE - 1) * (SIDE - 1), PACKED = 1 << 16 };

static float positions[VERTICES][3];
static uint32_t indices[CORNERS];

static void make_sheet(void) {
    for (uint32_t v = 0; v < VERTICES; ++v) {
        const float x = (float)(v % SIDE), y = (float)(v / SIDE);
        memcpy(positions[v], (float[3]){x, y, 0.125F * x * y}, sizeof positions[v]);
    }
    for (uint32_t q = 0; q < CORNERS / 6; ++q) {
        const uint32_t a = q / (SIDE - 1) * SIDE + q % (SIDE - 1), d = a + SIDE + 1;
        memcpy(indices + 6 * (size_t)q, (uint32_t[6]){a, a + 1, d, a, d, a + SIDE}, sizeof(uint32_t[6]));
    }
}

/* A compressed view, as its file has it. */
typedef struct view {
    const char *mode, *filter; /* NULL: not said */
    size_t count, stride, size;
    long byte_length; /* of the view; 0: count × stride */
    unsigned char bytes[PACKED];
} view;

/* Views of the sheet: positions, normals (none if their size is 0), indices. */
static view views[3];
static const char *normal_type = "5120,\"normalized\":true";
static int index_type = 5123;

static void pack_sheet(bool triangles, size_t index_size) {
    memset(views, 0, sizeof views);
    views[0] = (view){.mode = "ATTRIBUTES", .count = VERTICES, .stride = sizeof positions[0]};
    views[0].size =
        meshopt_encodeVertexBuffer(views[0].bytes, PACKED, positions, VERTICES, sizeof positions[0]);
    views[2] = (view){.mode = triangles ? "TRIANGLES" : "INDICES", .count = CORNERS, .stride = index_size};
    views[2].size = triangles ? meshopt_encodeIndexBuffer(views[2].bytes, PACKED, indices, CORNERS)
                              : meshopt_encodeIndexSequence(views[2].bytes, PACKED, indices, CORNERS);
    assert_true(views[0].size > 0 && views[2].size > 0);
    index_type = index_size == 2 ? 5123 : 5125;
}

/* The file of the three views. The buffer of the unpacked data is empty. */
static const char *packed_json(void) {
    static char json[4 * PACKED + 8192], text[2 * PACKED];
    static unsigned char all[3 * PACKED];
    size_t used = 0, offsets[3];
    for (int i = 0; i < 3; ++i) {
        offsets[i] = used;
        memcpy(all + used, views[i].bytes, views[i].size);
        used += (views[i].size + 3) / 4 * 4;
    }
    assert_true(used < PACKED);
    base64(all, used, text);
    const bool normals = views[1].size > 0;
    size_t length = (size_t)snprintf(
        json, sizeof json,
        "{\"asset\":{\"version\":\"2.0\"},\"extensionsRequired\":[\"EXT_meshopt_compression\"],\"scenes\":[{"
        "\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":"
        "0%s},"
        "\"indices\":2}]}],\"buffers\":[{\"byteLength\":%zu,\"uri\":\"data:;base64,%s\"},{\"byteLength\":"
        "1000000,\"extensions\":{\"EXT_meshopt_compression\":{\"fallback\":true}}}],\"accessors\":["
        "{\"bufferView\":0,\"componentType\":5126,\"count\":%d,\"type\":\"VEC3\"},"
        "{\"bufferView\":1,\"componentType\":%s,\"count\":%d,\"type\":\"VEC3\"},"
        "{\"bufferView\":2,\"componentType\":%d,\"count\":%d,\"type\":\"SCALAR\"}],\"bufferViews\":[",
        normals ? ",\"NORMAL\":1" : "", used, text, VERTICES, normal_type, VERTICES, index_type, CORNERS);
    for (int i = 0; i < 3; ++i) {
        const view *v = &views[i];
        const long bytes = v->byte_length != 0 ? v->byte_length : (long)(v->count * v->stride);
        char filter[64] = "", stride[64] = "";
        if (v->filter != NULL) {
            snprintf(filter, sizeof filter, ",\"filter\":\"%s\"", v->filter);
        }
        if (i < 2) {
            snprintf(stride, sizeof stride, ",\"byteStride\":%zu", v->stride);
        }
        length += (size_t)snprintf(
            json + length, sizeof json - length,
            "%s{\"buffer\":1,\"byteLength\":%ld%s,\"extensions\":{\"EXT_meshopt_compression\":{\"buffer\":0,"
            "\"byteOffset\":%zu,\"byteLength\":%zu,\"byteStride\":%zu,\"count\":%zu,\"mode\":\"%s\"%s}}}",
            i > 0 ? "," : "", bytes, stride, offsets[i], v->size, v->stride, v->count,
            v->mode != NULL ? v->mode : "ATTRIBUTES", filter);
    }
    snprintf(json + length, sizeof json - length, "]}");
    return json;
}

TEST(meshes_come_out_as_they_were_packed) {
    make_sheet();
    for (int k = 0; k < 4; ++k) {
        pack_sheet(k % 2 == 0, k < 2 ? 2 : 4);
        OWNED(vsh_model) *model = read_text("a.gltf", packed_json());
        const vsh_mesh mesh = vsh_model_mesh(model, 0, 0);
        assert_int_equal(mesh.vertex_count, VERTICES);
        assert_int_equal(3 * mesh.triangle_count, CORNERS);
        assert_memory_equal(mesh.positions, positions, sizeof positions);
        for (size_t t = 0; t < mesh.triangle_count; ++t) { /* which may begin at another corner */
            const uint32_t *a = mesh.indices + 3 * t, *b = indices + 3 * t;
            const size_t turn = a[0] == b[0] ? 0 : a[0] == b[1] ? 1 : 2;
            for (size_t c = 0; c < 3; ++c) {
                assert_int_equal(a[c], b[(c + turn) % 3]);
            }
        }
    }
}

/* A direction of each vertex: all around. */
static void direction(size_t v, float d[4]) {
    const double z = 1.0 - 2.0 * ((double)v + 0.5) / VERTICES, r = sqrt(1.0 - z * z);
    d[0] = (float)(r * cos(2.4 * (double)v));
    d[1] = (float)(r * sin(2.4 * (double)v));
    d[2] = (float)z;
    d[3] = 0.0F;
}

/* Steps of 1 / most: on the octahedron x and y are half a step off and z as much as both, which grows by √3
 * where its middle is stretched to the sphere; and the result is half a step off. */
static const double octahedral_steps = 1.7321 + 0.5 + 0.01;

TEST(directions_on_an_octahedron_come_out_again) {
    static float given[VERTICES][4];
    static unsigned char folded[8 * VERTICES];
    make_sheet();
    for (int bytes = 1; bytes <= 2; ++bytes) {
        const size_t stride = 4 * (size_t)bytes;
        const double most = bytes == 1 ? 127.0 : 32767.0;
        pack_sheet(true, 2);
        for (size_t v = 0; v < VERTICES; ++v) {
            direction(v, given[v]);
        }
        meshopt_encodeFilterOct(folded, VERTICES, stride, 8 * bytes, given[0]);
        views[1] = (view){.mode = "ATTRIBUTES", .filter = "OCTAHEDRAL", .count = VERTICES, .stride = stride};
        views[1].size = meshopt_encodeVertexBuffer(views[1].bytes, PACKED, folded, VERTICES, stride);
        normal_type = bytes == 1 ? "5120,\"normalized\":true" : "5122,\"normalized\":true";
        OWNED(vsh_model) *model = read_text("a.gltf", packed_json());
        const vsh_mesh mesh = vsh_model_mesh(model, 0, 0);
        for (size_t v = 0; v < VERTICES; ++v) {
            for (size_t c = 0; c < 3; ++c) {
                assert_near(mesh.normals[3 * v + c], given[v][c], octahedral_steps / most);
            }
        }
    }
}

TEST(floats_with_an_exponent_come_out_again) {
    static uint32_t folded[VERTICES][3];
    make_sheet();
    pack_sheet(true, 2);
    views[0].filter = "EXPONENTIAL";
    /* of every exponent that gives a finite number */
    for (size_t v = 0; v < VERTICES; ++v) {
        for (size_t c = 0; c < 3; ++c) {
            const uint32_t exponent = (uint32_t)((int)(v % 232) - 128) & 0xff;
            folded[v][c] = exponent << 24 | (uint32_t)(0x9e3779b9u * (v * 3 + c + 1)) >> 8;
        }
    }
    views[0].size = meshopt_encodeVertexBuffer(views[0].bytes, PACKED, folded, VERTICES, sizeof folded[0]);
    OWNED(vsh_model) *model = read_text("a.gltf", packed_json());
    const float *made = vsh_model_mesh(model, 0, 0).positions;
    for (size_t v = 0; v < VERTICES; ++v) {
        for (size_t c = 0; c < 3; ++c) {
            const int exponent = (int8_t)(folded[v][c] >> 24), mantissa = (int32_t)(folded[v][c] << 8) >> 8;
            assert_true(made[3 * v + c] == (float)ldexp(mantissa, exponent));
        }
    }
}

/* The meshes of instances, each turned. */
TEST(quaternions_come_out_again) {
    static float given[VERTICES][4];
    static int16_t folded[VERTICES][4];
    enum { COUNT = 64 };
    for (size_t v = 0; v < COUNT; ++v) {
        direction(9 * v, given[v]);
        const double half = 0.1 * (double)v;
        for (int c = 0; c < 3; ++c) {
            given[v][c] *= (float)sin(half);
        }
        given[v][3] = (float)cos(half);
    }
    meshopt_encodeFilterQuat(folded, COUNT, 8, 16, given[0]);
    maker *made = begin();
    const size_t size = meshopt_encodeVertexBuffer(made->bytes + made->size, sizeof made->bytes - made->size,
                                                   folded, COUNT, 8);
    snprintf(made->views + strlen(made->views), 400,
             ",{\"buffer\":0,\"byteLength\":%d,\"extensions\":{\"EXT_meshopt_compression\":{\"buffer\":0,"
             "\"byteOffset\":%zu,\"byteLength\":%zu,\"byteStride\":8,\"count\":%d,\"mode\":\"ATTRIBUTES\","
             "\"filter\":\"QUATERNION\"}}}",
             8 * COUNT, made->size, size, COUNT);
    strcat(made->accessors, ",{\"bufferView\":2,\"componentType\":5122,\"normalized\":true,\"count\":64,"
                            "\"type\":\"VEC4\"}");
    made->size += size;
    OWNED(vsh_model) *model = read_made(
        made, NODE(",\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"ROTATION\":2}}}")
                  MESH("\"POSITION\":0", ""));
    assert_int_equal(vsh_model_mesh_count(model), COUNT);
    for (size_t i = 0; i < COUNT; ++i) {
        const double x = (double)given[i][0], y = (double)given[i][1], z = (double)given[i][2];
        const double w = (double)given[i][3];
        const double *m = vsh_model_mesh(model, i, 0).transform;
        assert_true(fabs(m[0] - (1.0 - 2.0 * (y * y + z * z))) < 4e-4);
        assert_true(fabs(m[4] - 2.0 * (x * y + z * w)) < 4e-4);
        assert_true(fabs(m[8] - 2.0 * (x * z - y * w)) < 4e-4);
        assert_true(fabs(m[9] - 2.0 * (y * z + x * w)) < 4e-4);
    }
}

TEST(bad_compression_is_refused) {
    enum { KEPT = -1, OLD_VERSION = 0xa1 /* KHR_meshopt_compression's */ };
    static const struct {
        int view;
        const char *mode, *filter;                         /* NULL: as packed */
        long count, stride, byte_length, first_byte, size; /* KEPT: as packed */
        vsh_result code;
        const char *part;
    } cases[] = {
        {0, "MESHLETS", NULL, KEPT, KEPT, 0, KEPT, KEPT, VSH_ERROR_UNSUPPORTED, "mode 'MESHLETS'"},
        {0, NULL, "COLOR", KEPT, KEPT, 0, KEPT, KEPT, VSH_ERROR_UNSUPPORTED, "filter 'COLOR'"},
        {0, NULL, "OCTAHEDRAL", KEPT, KEPT, 0, KEPT, KEPT, VSH_ERROR_INPUT,
         "count 576 and byteStride 12, which ATTRIBUTES with filter OCTAHEDRAL"},
        {2, NULL, "EXPONENTIAL", KEPT, KEPT, 0, KEPT, KEPT, VSH_ERROR_INPUT,
         "TRIANGLES with filter EXPONENTIAL"},
        {2, NULL, NULL, CORNERS - 1, KEPT, 0, KEPT, KEPT, VSH_ERROR_INPUT, "count 3173"},
        {0, NULL, NULL, KEPT, 260, 0, KEPT, KEPT, VSH_ERROR_INPUT, "byteStride 260"},
        {0, NULL, NULL, KEPT, 0, 12, KEPT, KEPT, VSH_ERROR_INPUT, "byteStride 0"},
        {0, NULL, NULL, KEPT, KEPT, 12 * VERTICES + 4, KEPT, KEPT, VSH_ERROR_INPUT,
         "its byteLength is 6916, but it unpacks to 6912 bytes"},
        {0, NULL, NULL, KEPT, KEPT, 0, OLD_VERSION, KEPT, VSH_ERROR_UNSUPPORTED,
         "of version 1; up to version 0 is read"},
        {0, NULL, NULL, KEPT, KEPT, 0, KEPT, 0, VSH_ERROR_INPUT, "damaged: 0 bytes"},
        {0, NULL, NULL, 4000000000, KEPT, 0, KEPT, KEPT, VSH_ERROR_INPUT, /* 48 GB from some KB */
         "cannot hold 4000000000 elements of 12 bytes"},
        {2, NULL, NULL, 2999999997, KEPT, 0, KEPT, KEPT, VSH_ERROR_INPUT, "cannot hold"},
    };
    make_sheet();
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        pack_sheet(true, 2);
        view *v = &views[cases[i].view];
        v->mode = cases[i].mode != NULL ? cases[i].mode : v->mode;
        v->filter = cases[i].filter;
        v->count = cases[i].count != KEPT ? (size_t)cases[i].count : v->count;
        v->stride = cases[i].stride != KEPT ? (size_t)cases[i].stride : v->stride;
        v->size = cases[i].size != KEPT ? (size_t)cases[i].size : v->size;
        v->byte_length = cases[i].byte_length;
        v->bytes[0] = cases[i].first_byte != KEPT ? (unsigned char)cases[i].first_byte : v->bytes[0];
        refused("a.gltf", packed_json(), cases[i].code, cases[i].part, "bufferViews[");
    }
}

/* Each byte of it turned in one bit or all, and cut there: an error of a line, or a mesh. */
TEST(damaged_data_are_refused_or_a_mesh) {
    int refused_count = 0, read = 0;
    make_sheet();
    for (int which = 0; which < 3; which += 2) {
        pack_sheet(which == 0, 2);
        const view whole = views[which];
        for (size_t at = 0; at < whole.size; at += which == 0 ? 7 : 41) {
            for (int k = 0; k < 3; ++k) {
                views[which] = whole;
                views[which].size = k == 2 ? at : whole.size;
                views[which].bytes[at] ^= k == 0 ? 0x10 : 0xff;
                vsh_model *model = NULL;
                const char *json = packed_json();
                if (read_bytes("a.gltf", json, strlen(json), &model, &failure) != VSH_OK) {
                    assert_null(strchr(failure.message, '\n'));
                    assert_non_null(strstr(failure.message, "a.gltf: "));
                    ++refused_count;
                    continue;
                }
                assert_int_not_equal(k, 2);
                vsh_model_free(model);
                ++read;
            }
        }
    }
    assert_in_range(refused_count, 100, 100000);
    assert_in_range(read, 10, 100000);
}

TEST(the_memory_limit_holds_for_unpacked_data) {
    make_sheet();
    memset(positions, 0, sizeof positions); /* packed 60 times as small */
    pack_sheet(true, 2);
    const char *json = packed_json();
    write_all(at("a.gltf"), json, strlen(json));
    vsh_run run = run_within(6 * strlen(json) + 1000);
    vsh_model *model;
    assert_int_equal(vsh_model_read(at("a.gltf"), &run, &model, &failure), VSH_ERROR_LIMIT);
    assert_int_equal(unlink(at("a.gltf")), 0);
}

FIXTURE(make_folder, remove_empty_folder)
