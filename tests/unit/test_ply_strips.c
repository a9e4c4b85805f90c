/* PLY files whose triangles are strips. */
#include "models.h"
#include "testing.h"

/* Six places over a plane, of which a strip is made: x, y of each. */
static const float places[6][2] = {{0, 0}, {0, 1}, {1, 0}, {1, 1}, {2, 0}, {2, 1}};

/* Sum of areas as seen from +z, and number of triangles. */
static double area_of(const vsh_model *model, size_t *triangles) {
    double area = 0.0;
    *triangles = 0;
    for (size_t m = 0; m < vsh_model_mesh_count(model); ++m) {
        const vsh_mesh mesh = vsh_model_mesh(model, m, -1);
        for (size_t t = 0; t < mesh.triangle_count; ++t, ++*triangles) {
            vshi_vec c[3];
            vshi_mesh_triangle(&mesh, t, c);
            area += 0.5 * vshi_cross(vshi_sub(c[1], c[0]), vshi_sub(c[2], c[0])).z;
        }
    }
    return area;
}

static void assert_shape(vsh_model *model, double area, size_t triangles) {
    size_t found;
    assert_true(fabs(area_of(model, &found) - area) < 1e-6);
    assert_int_equal(found, triangles);
    vsh_model_free(model);
}

#define HEAD(rows, list)                                                                                     \
    "ply\nformat ascii 1.0\ncomment of strips\nelement vertex 6\nproperty float x\nproperty float y\n"       \
    "property float z\nelement tristrips " rows "\nproperty list " list " vertex_indices\nend_header\n"      \
    "0 0 0\n0 1 0\n1 0 0\n1 1 0\n2 0 0\n2 1 0\n"

TEST(a_strip_turns_every_second_triangle) {
    assert_shape(read_text("a.ply", HEAD("1", "int int") "6 0 1 2 3 4 5\n"), -2.0, 4);
    assert_shape(read_text("a.ply", HEAD("1", "uchar short") "6 1 0 3 2 5 4\n"), 2.0, 4);
}

TEST(minus_one_and_each_row_begin_another_strip) {
    /* the second strip begins anew: its first triangle is not turned, whatever came before */
    assert_shape(read_text("a.ply", HEAD("1", "int int") "9 1 0 3 2 -1 3 2 5 4\n"), 2.0, 4);
    assert_shape(read_text("a.ply", HEAD("1", "int int") "8 1 0 3 -1 3 2 5 4\n"), 1.5, 3);
    assert_shape(read_text("a.ply", HEAD("3", "int int") "3 1 0 3\n0\n4 3 2 5 4\n"), 1.5, 3);
    assert_shape(read_text("a.ply", HEAD("1", "int int") "10 -1 -1 0 -1 0 1 -1 1 0 3\n"), 0.5, 1);
}

TEST(triangles_without_area_that_join_strips_are_left_out) {
    /* 1 0 3 and 3 2 5, joined by repeats: the turns count on */
    assert_shape(read_text("a.ply", HEAD("1", "int int") "8 1 0 3 3 3 3 2 5\n"), 0.0, 2);
    assert_shape(read_text("a.ply", HEAD("1", "int int") "7 1 0 3 3 3 2 5\n"), 1.0, 2);
}

static void put(unsigned char **to, uint64_t value, int size, bool big) {
    for (int i = 0; i < size; ++i) {
        *(*to)++ = (unsigned char)(value >> 8 * (big ? size - 1 - i : i));
    }
}

TEST(strips_are_read_in_binary_of_either_order_and_every_size) {
    static const struct {
        const char *name;
        int size;
    } types[] = {{"char", 1}, {"short", 2}, {"int", 4}};
    static const int indices[9] = {1, 0, 3, 2, -1, 3, 2, 5, 4};
    for (int big = 0; big < 2; ++big) {
        for (size_t t = 0; t < 3; ++t) {
            unsigned char bytes[1024], *to = bytes;
            to += sprintf((char *)to,
                          "ply\nformat binary_%s_endian 1.0\nelement vertex 6\nproperty float x\n"
                          "property float y\nproperty float z\nelement tristrips 1\n"
                          "property list %s %s vertex_indices\nend_header\n",
                          big ? "big" : "little", t == 1 ? "ushort" : "uchar", types[t].name);
            for (int v = 0; v < 6; ++v) {
                const float p[3] = {places[v][0], places[v][1], 0.0f};
                for (int k = 0; k < 3; ++k) {
                    uint32_t word;
                    memcpy(&word, &p[k], sizeof word);
                    put(&to, word, 4, big != 0);
                }
            }
            put(&to, 9, t == 1 ? 2 : 1, big != 0);
            for (int i = 0; i < 9; ++i) {
                put(&to, (uint64_t)(int64_t)indices[i], types[t].size, big != 0);
            }
            const size_t size = (size_t)(to - bytes);
            assert_shape(read_good("b.ply", bytes, size), 2.0, 4);
            vsh_model *model = NULL;
            assert_fails(read_bytes("b.ply", bytes, size - 1, &model, &failure), VSH_ERROR_READ, "cut short");
        }
    }
}

TEST(strips_of_bad_indices_are_refused) {
    refused("a.ply", HEAD("1", "int int") "3 0 1 6\n", VSH_ERROR_INPUT, "tristrips 0", "vertex 6");
    refused("a.ply", HEAD("2", "int int") "3 0 1 2\n3 0 -2 1\n", VSH_ERROR_INPUT, "tristrips 1", "-2");
    refused("a.ply", HEAD("1", "int int") "3 0 1.5 2\n", VSH_ERROR_INPUT, "tristrips 0", "'1.5'");
    refused("a.ply", HEAD("1", "int int") "-3 0 1 2\n", VSH_ERROR_INPUT, "tristrips 0", "-3");
    refused("a.ply", HEAD("1", "int int") "5 0 1 2\n", VSH_ERROR_READ, "cut short", "tristrips 0 of 1");
    refused("a.ply", HEAD("1", "int int") "4 0 1 -1 2\n", VSH_ERROR_INPUT, "no triangles", "a.ply");
    refused("a.ply", HEAD("1", "int float") "3 0 1 2\n", VSH_ERROR_UNSUPPORTED, "'tristrips'",
            "save it with faces");
}

TEST(strips_beside_faces_are_refused) {
    refused("a.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
            "element face 1\nproperty list uchar int vertex_indices\n"
            "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
            "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 2\n",
            VSH_ERROR_UNSUPPORTED, "'tristrips'", "beside faces");
}

/* Indices of a byte unfold to much more than the file: that is held against the limit before it is taken. */
TEST(a_limit_of_memory_holds_for_what_strips_unfold_to) {
    enum { COUNT = 60000 };
    static unsigned char bytes[COUNT + 1024];
    unsigned char *to = bytes;
    to += sprintf((char *)to, "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
                              "property float y\nproperty float z\nelement tristrips 1\n"
                              "property list int char vertex_indices\nend_header\n");
    memset(to, 0, 36);
    to += 36;
    put(&to, COUNT, 4, false);
    for (int i = 0; i < COUNT; ++i) {
        *to++ = (unsigned char)(i % 3);
    }
    write_bytes("c.ply", bytes, (size_t)(to - bytes));
    vsh_run run = run_within(1000000);
    vsh_model *model = NULL;
    assert_fails(vsh_model_read(path_of("c.ply").text, &run, &model, &failure), VSH_ERROR_LIMIT, "");
    assert_int_equal(unlink(path_of("c.ply").text), 0);
}

FIXTURE(make_folder, remove_folder)
