/* What values of a glTF come to in the model: offsets, sparse parts, poses and transforms, each where a
 * reader that is off by a little would give something else. */
#include "models.h"
#include "testing.h"

enum { FLOATS = 5126, BYTES = 5120, UBYTES = 5121, USHORTS = 5123 };

/* A file on its way: a buffer, and the lists of its views and accessors. */
typedef struct maker {
    unsigned char bytes[4096];
    size_t size;
    size_t beyond; /* bytes that the buffer has beyond its byteLength */
    char views[4096], accessors[4096];
    int count; /* of each */
} maker;

/* Bytes behind some others, their view; returns its number. */
static int add_view(maker *m, const void *data, size_t size, const char *more) {
    memset(m->bytes + m->size, 0x55, 4); /* what is read by mistake is no number that is meant */
    memcpy(m->bytes + m->size + 4, data, size);
    snprintf(m->views + strlen(m->views), sizeof m->views - strlen(m->views),
             "%s{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu%s}", m->count > 0 ? "," : "", m->size,
             size + 4, more);
    m->size += (size + 4 + 3) / 4 * 4;
    return m->count;
}

/* An accessor of all of a view of its own; returns its number. Each begins 4 bytes into its view. */
static int add(maker *m, const void *data, size_t size, const char *view, int type, int count,
               const char *kind, const char *more) {
    add_view(m, data, size, view);
    snprintf(m->accessors + strlen(m->accessors), sizeof m->accessors - strlen(m->accessors),
             "%s{\"bufferView\":%d,\"byteOffset\":4,\"componentType\":%d,\"count\":%d,\"type\":\"%s\"%s}",
             m->count > 0 ? "," : "", m->count, type, count, kind, more);
    return m->count++;
}

static const float QUAD[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
static const float UP[4][3] = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}};

/* One with the corners of a quad, accessor 0, and its normals, accessor 1. */
static maker *begin(void) {
    maker *m = calloc(1, sizeof *m);
    assert_non_null(m);
    add(m, QUAD, sizeof QUAD, "", FLOATS, 4, "VEC3", "");
    add(m, UP, sizeof UP, "", FLOATS, 4, "VEC3", "");
    return m;
}

/* The file's text: `rest` is all but buffer, views and accessors. */
static const char *text_of(const maker *m, const char *rest) {
    static char json[1 << 16], text[1 << 14];
    base64(m->bytes, m->size, text);
    snprintf(json, sizeof json,
             "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":%zu,\"uri\":"
             "\"data:application/octet-stream;base64,%s\"}],\"bufferViews\":[%s],\"accessors\":[%s],%s}",
             m->size - m->beyond, text, m->views, m->accessors, rest);
    return json;
}

#define MESH(attributes, more) "\"meshes\":[{\"primitives\":[{\"attributes\":{" attributes "}" more "}]}]"
#define ALONE "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],"

static vsh_model *read_made(maker *m, const char *rest) {
    vsh_model *model = read_text("a.gltf", text_of(m, rest));
    free(m);
    return model;
}

static void refuse_made(maker *m, const char *rest, const char *part) {
    refused("a.gltf", text_of(m, rest), VSH_ERROR_INPUT, part, "");
    free(m);
}

static void assert_corner(const vsh_model *model, size_t mesh, int k, double x, double y, double z) {
    const vsh_mesh view = vsh_model_mesh(model, mesh, 0);
    vshi_vec corner[3];
    vshi_mesh_triangle(&view, 0, corner);
    if (!(fabs(corner[k].x - x) < 1e-6 && fabs(corner[k].y - y) < 1e-6 && fabs(corner[k].z - z) < 1e-6)) {
        fail_msg("corner %d of mesh %zu at %g %g %g, expected %g %g %g", k, mesh, corner[k].x, corner[k].y,
                 corner[k].z, x, y, z);
    }
}

static void assert_normal(const vsh_model *model, size_t vertex, double x, double y, double z) {
    const float *n = vsh_model_mesh(model, 0, 0).normals + 3 * vertex;
    if (!(fabs((double)n[0] - x) < 1e-6 && fabs((double)n[1] - y) < 1e-6 && fabs((double)n[2] - z) < 1e-6)) {
        fail_msg("normal %zu is %g %g %g, expected %g %g %g", vertex, (double)n[0], (double)n[1],
                 (double)n[2], x, y, z);
    }
}

TEST(offsets_of_views_and_accessors_add_up) {
    vsh_model *model = read_made(begin(), ALONE MESH("\"POSITION\":0,\"NORMAL\":1", ""));
    assert_corner(model, 0, 1, 1, 0, 0);
    assert_corner(model, 0, 2, 1, 1, 0);
    assert_normal(model, 2, 0, 0, 1);
    vsh_model_free(model);
    maker *m = begin(); /* a view that begins in the buffer and ends behind it */
    snprintf(m->views + strlen(m->views), 200, ",{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":48}",
             m->size - 44);
    strcat(m->accessors, ",{\"bufferView\":2,\"componentType\":5126,\"count\":1,\"type\":\"VEC3\"}");
    refuse_made(m, ALONE MESH("\"POSITION\":2", ""), "bufferViews[2]: 48 bytes");
    m = begin(); /* and one that ends behind its byteLength */
    m->beyond = 4;
    refuse_made(m, ALONE MESH("\"POSITION\":1", ""), "bufferViews[1]: 52 bytes");
    m = begin(); /* an accessor that ends behind its view, where the buffer goes on */
    strcat(m->accessors,
           ",{\"bufferView\":0,\"byteOffset\":8,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}");
    refuse_made(m, ALONE MESH("\"POSITION\":2", ""), "bufferViews[0]");
}

#define SPARSE(count, type, values)                                                                          \
    ",\"sparse\":{\"count\":" count                                                                          \
    ",\"indices\":{\"bufferView\":2,\"byteOffset\":4,\"componentType\":" type                                \
    "},\"values\":{\"bufferView\":" values ",\"byteOffset\":4}}"

TEST(sparse_parts_have_offsets_and_types_of_their_own) {
    static const uint16_t which[2] = {1, 2};
    static const float moved[2][3] = {{5, 0, 0}, {0, 7, 0}};
    static const uint16_t order[6] = {0, 1, 2, 0, 0, 0}, corners[2] = {3, 2};
    for (int of = 0; of < 3; ++of) { /* of positions, of indices; of more than there are */
        maker *m = begin();
        add(m, which, sizeof which, "", USHORTS, 2, "SCALAR", "");
        add(m, moved, sizeof moved, "", FLOATS, 2, "VEC3", "");
        add(m, corners, sizeof corners, "", USHORTS, 2, "SCALAR", "");
        add(m, QUAD, sizeof QUAD, "", FLOATS, 4, "VEC3", SPARSE("2", "5123", "3"));
        add(m, order, sizeof order, "", USHORTS, 3, "SCALAR", SPARSE("2", "5123", "4"));
        add(m, QUAD, sizeof QUAD, "", FLOATS, 1, "VEC3", SPARSE("2", "5123", "3"));
        if (of == 2) {
            refuse_made(m, ALONE MESH("\"POSITION\":7", ""), "its sparse part is wrong");
            continue;
        }
        OWNED(vsh_model) *model = read_made(m, of == 0 ? ALONE MESH("\"POSITION\":5", "")
                                                       : ALONE MESH("\"POSITION\":0", ",\"indices\":6"));
        assert_corner(model, 0, 0, 0, 0, 0);
        assert_corner(model, 0, 1, of == 0 ? 5 : 0, of == 0 ? 0 : 1, 0);
        assert_corner(model, 0, 2, of == 0 ? 0 : 1, of == 0 ? 7 : 1, 0);
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

/* A quad skinned to joints 1 (at 0, 4, 0, turned by a right angle about z) and 2 (at 10, 0, 0). */
static const char *skinned(const char *joints, const char *scene) {
    static char rest[2048];
    snprintf(rest, sizeof rest,
             "\"scenes\":[{\"nodes\":[0%s]}],\"nodes\":[{\"mesh\":0,\"skin\":0},{\"translation\":[0,4,0],"
             "\"rotation\":[0,0,0.70710678,0.70710678]},{\"translation\":[10,0,0]}],\"skins\":[{\"joints\":"
             "[1,2]}]," MESH("\"POSITION\":0,\"NORMAL\":3%s", ""),
             scene, joints);
    return rest;
}

TEST(skins_scale_weights_add_sets_and_turn_normals) {
    static const float sideways[4][3] = {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}};
    static const uint8_t first[4][8] = {{0}, {0}, {0}, {0}}, second[4][8] = {{1}, {1}, {1}, {1}};
    static const float half[4][4] = {{0.5F}, {0.5F}, {0.5F}, {0}};
    static const float none[4][4] = {{0}, {0.5F}, {0}, {0}};
    for (int wrong = 0; wrong < 3; ++wrong) {
        maker *m = begin();
        add(m, half, sizeof half, "", FLOATS, 4, "VEC4", "");
        add(m, sideways, sizeof sideways, "", FLOATS, 4, "VEC3", "");
        add(m, first, sizeof first, ",\"byteStride\":8", UBYTES, wrong == 1 ? 3 : 4, "VEC4", "");
        add(m, second, sizeof second, ",\"byteStride\":8", UBYTES, 4, "VEC4", "");
        add(m, none, sizeof none, "", FLOATS, 4, "VEC4", "");
        const char *rest = skinned(",\"JOINTS_0\":4,\"WEIGHTS_0\":2,\"JOINTS_1\":5,\"WEIGHTS_1\":6",
                                   wrong == 2 ? ",1" : ",1,2");
        if (wrong != 0) {
            refuse_made(m, rest, wrong == 1 ? "joints are no four bytes" : "joint 1 is no node of the scene");
            continue;
        }
        OWNED(vsh_model) *model = read_made(m, rest);
        assert_corner(model, 0, 0, 0, 4, 0);                    /* half of a joint is all of it */
        assert_corner(model, 0, 1, 0.5 * (0 + 11), 0.5 * 5, 0); /* two sets */
        assert_corner(model, 0, 2, -1, 5, 0);                   /* turned */
        assert_normal(model, 0, 0, 1, 0);
    }
    maker *m = begin(); /* one matrix for two joints */
    static const float one[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    add(m, one, sizeof one, "", FLOATS, 1, "MAT4", "");
    refuse_made(
        m,
        "\"scenes\":[{\"nodes\":[0,1]}],\"nodes\":[{\"mesh\":0,\"skin\":0},{}],\"skins\":[{\"joints\":"
        "[1,1],\"inverseBindMatrices\":2}]," MESH("\"POSITION\":0", ""),
        "2 joints, but 1 matrices");
}

TEST(strips_leave_out_what_has_no_area_and_lists_what_is_over) {
    static const uint16_t strip[6] = {0, 1, 2, 2, 2, 3};
    for (int mode = 4; mode <= 5; ++mode) {
        maker *m = begin();
        add(m, strip, sizeof strip, "", USHORTS, mode == 4 ? 5 : 6, "SCALAR", "");
        OWNED(vsh_model) *model =
            read_made(m, mode == 4 ? ALONE MESH("\"POSITION\":0", ",\"indices\":2")
                                   : ALONE MESH("\"POSITION\":0", ",\"indices\":2,\"mode\":5"));
        assert_int_equal(vsh_model_mesh(model, 0, 0).triangle_count, 1);
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

TEST(nodes_stand_by_rotation_matrix_and_scene) {
    static const struct {
        const char *rest;
        double second[3], third[3]; /* corners */
    } files[] = {
        /* a right angle about x, by a quaternion of length 1 and of length 2 */
        {"\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0,\"rotation\":[0.70710678,0,0,0.70710678]}],",
         {1, 0, 0},
         {1, 0, 1}},
        {"\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0,\"rotation\":[0,1.41421356,0,1.41421356]}],",
         {0, 0, -1},
         {0, 1, -1}},
        /* columns: x to y, y to z, z to x, then a move */
        {"\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0,\"matrix\":[0,1,0,0, 0,0,1,0, 1,0,0,0, "
         "5,6,7,1]}],",
         {5, 7, 7},
         {5, 7, 8}},
        {"\"scene\":1,\"scenes\":[{\"nodes\":[0]},{\"nodes\":[1]}],\"nodes\":[{\"mesh\":0},{\"mesh\":0,"
         "\"translation\":[0,0,9]}],",
         {1, 0, 9},
         {1, 1, 9}},
        /* no scene: what is nobody's child */
        {"\"nodes\":[{\"mesh\":0},{\"children\":[0],\"translation\":[0,3,0]}],", {1, 3, 0}, {1, 4, 0}},
    };
    for (size_t i = 0; i < sizeof files / sizeof files[0]; ++i) {
        char rest[1024];
        snprintf(rest, sizeof rest, "%s" MESH("\"POSITION\":0", ""), files[i].rest);
        OWNED(vsh_model) *model = read_made(begin(), rest);
        assert_int_equal(vsh_model_mesh_count(model), 1);
        const double *b = files[i].second, *c = files[i].third;
        assert_corner(model, 0, 1, b[0], b[1], b[2]);
        assert_corner(model, 0, 2, c[0], c[1], c[2]);
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

TEST(instances_turn_by_four_numbers_and_have_equally_many_of_each) {
    static const float moves[3][3] = {{0, 0, 0}, {4, 0, 0}, {0, 0, 0}};
    static const float turns[2][4] = {{0, 0, 0, 1}, {0, 0, 0.70710678F, 0.70710678F}};
    for (int wrong = 0; wrong < 2; ++wrong) {
        maker *m = begin();
        add(m, moves, sizeof moves, "", FLOATS, wrong ? 3 : 2, "VEC3", "");
        add(m, turns, sizeof turns, "", FLOATS, 2, "VEC4", "");
        const char *rest =
            "\"extensionsUsed\":[\"EXT_mesh_gpu_instancing\"],\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{"
            "\"mesh\":0,\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"TRANSLATION\":2,"
            "\"ROTATION\":3}}}}]," MESH("\"POSITION\":0", "");
        if (wrong) {
            refuse_made(m, rest, "ROTATION has 2 elements for 3");
            continue;
        }
        OWNED(vsh_model) *model = read_made(m, rest);
        assert_corner(model, 0, 1, 1, 0, 0);
        assert_corner(model, 1, 1, 4, 1, 0);
    }
}

FIXTURE(make_folder, remove_folder)
