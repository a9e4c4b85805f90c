/* OBJ: what its statements become, and what strangers may write into it. */
#include "models.h"
#include "testing.h"

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
    PARTS("o A\nf 1 2 3\nusemtl y\nf 1 3 4\n", "A 1 2 4;"); /* what had no material takes the first */
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

/* What other programs write, and what Assimp 5.2 did not read. */
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
    assert_non_null(text);
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
TEST(a_place_with_many_vertices_takes_no_longer) {
    enum { COUNT = 100000 };
    FREED char *text = malloc(COUNT * 64);
    char *to = text;
    assert_non_null(text);
    to += sprintf(to, "%s", corners);
    for (int i = 1; i <= COUNT; ++i) {
        to += sprintf(to, "vn 0 0 %d\nf 1//%d 2 3\n", i, i);
    }
    OWNED(vsh_model) *model = read_good("tip.obj", text, (size_t)(to - text));
    assert_int_equal(vsh_model_mesh(model, 0, 0).vertex_count, COUNT + 2);
}

TEST(materials_beside_the_file_say_what_is_blended) {
    static const char materials[] = "newmtl clear\nd 0.5\n\tnewmtl solid \r\nTr 0\nnewmtl thin\nTr 0.25\n"
                                    "newmtl edge\nd -halo 0.0\nnewmtl last\nd 1.0\n";
    static const char *const names[] = {"clear", "solid", "thin", "edge", "last", "other"};
    static const bool blended[] = {true, false, true, true, false, false};
    write_bytes("own.mtl", materials, sizeof materials - 1);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        char text[512];
        snprintf(text, sizeof text, "mtllib %s\n%susemtl %s\nf 1 2 3\n", i % 2 == 0 ? "own.mtl" : "gone.mtl",
                 corners, names[i]);
        OWNED(vsh_model) *model =
            read_text("own.obj", text); /* whose own materials are read where the others are not */
        assert_int_equal(vsh_model_mesh(model, 0, 0).alpha,
                         blended[i] ? VSH_ALPHA_BLENDED : VSH_ALPHA_OPAQUE);
        const int32_t material = vsh_model_mesh_material(model, 0);
        assert_in_range(material, 0, vsh_model_material_count(model) - 1);
        const vsh_model_material told = vsh_model_get_material(model, (size_t)material);
        assert_string_equal(told.name, names[i]);
        assert_int_equal(told.alpha, blended[i] ? VSH_ALPHA_BLENDED : VSH_ALPHA_OPAQUE);
        assert_string_equal(vsh_model_mesh(model, 0, 0).material_name, names[i]);
    }
    write_bytes("own.mtl", "newmtl a\nd x\n", 13);
    vsh_model *none = NULL;
    assert_fails(read_bytes("own.obj", "mtllib own.mtl\n", 15, &none, &failure), VSH_ERROR_INPUT,
                 "own.mtl: line 2: 'd' is 'x'");
    assert_int_equal(unlink(path_of("own.mtl").text), 0);
}

/* What a small file can make of itself is held against the limit first. */
TEST(memory_is_held_against_the_limit) {
    enum { COUNT = 50000 };
    FREED char *text = malloc(COUNT * 8 + sizeof corners);
    char *to = text;
    assert_non_null(text);
    to += sprintf(to, "%s", corners);
    for (int i = 0; i < COUNT; ++i) {
        to += sprintf(to, "f 1 2 3\n");
    }
    write_bytes("limit.obj", text, (size_t)(to - text));
    vsh_run run = vsh_run_default();
    OWNED(vsh_model) *model = NULL;
    run.memory_limit = 1000000;
    assert_fails(vsh_model_read(path_of("limit.obj").text, &run, &model, &failure), VSH_ERROR_LIMIT,
                 "limit.obj");
    assert_null(model);
    run.memory_limit = 3000000;
    assert_ok(vsh_model_read(path_of("limit.obj").text, &run, &model, &failure));
    assert_int_equal(unlink(path_of("limit.obj").text), 0);
}

FIXTURE(make_folder, remove_folder)
