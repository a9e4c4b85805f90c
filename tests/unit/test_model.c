/* vsh_model_read() on files that are written here: what comes out is known, and what is bad is refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "caster/mesh.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Assimp 5.2 loses what its FBX and glTF readers had taken when a file is cut: its leaks, by name. */
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) {
    return "leak:libassimp.so\n";
}

static char folder[] = "/tmp/vdbshade_model_XXXXXX";

static int make_folder(void **state) {
    (void)state;
    return mkdtemp(folder) == NULL;
}

static int remove_folder(void **state) {
    (void)state;
    return rmdir(folder); /* fails where a test left a file */
}

typedef struct file_path {
    char text[128];
} file_path;

static file_path path_of(const char *name) {
    file_path path;
    snprintf(path.text, sizeof path.text, "%s/%s", folder, name);
    return path;
}

static void write_bytes(const char *name, const void *bytes, size_t size) {
    FILE *file = fopen(path_of(name).text, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static char warnings[4096];

static void keep_warning(void *user, const char *message) {
    (void)user;
    strncat(warnings, message, sizeof warnings - strlen(warnings) - 1);
}

/* Writes, reads, removes. */
static vsh_result read_bytes(const char *name, const void *bytes, size_t size, vsh_model **model,
                             vsh_error *error) {
    vsh_run run = vsh_run_default();
    run.warning = keep_warning;
    warnings[0] = '\0';
    write_bytes(name, bytes, size);
    const vsh_result result = vsh_model_read(path_of(name).text, &run, model, error);
    assert_int_equal(unlink(path_of(name).text), 0);
    return result;
}

static vsh_model *read_good(const char *name, const void *bytes, size_t size) {
    vsh_model *model = NULL;
    vsh_error error = {0};
    if (read_bytes(name, bytes, size, &model, &error) != VSH_OK) {
        fail_msg("%s: %s", name, error.message);
    }
    return model;
}

static vsh_model *read_text(const char *name, const char *text) {
    return read_good(name, text, strlen(text));
}

static void refused(const char *name, const char *text, vsh_result code, const char *part,
                    const char *other) {
    vsh_model *model = NULL;
    vsh_error error = {0};
    const vsh_result result = read_bytes(name, text, strlen(text), &model, &error);
    if (result != code || strstr(error.message, part) == NULL || strstr(error.message, other) == NULL ||
        strstr(error.message, name) == NULL || strchr(error.message, '\n') != NULL) {
        fail_msg("%s: %s '%s', expected %s with '%s' and '%s'", name, vsh_result_name(result), error.message,
                 vsh_result_name(code), part, other);
    }
    assert_null(model);
}

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance)) {
        fail_msg("%.17g, expected %.17g within %g", value, expected, tolerance);
    }
}

static vsh_mesh_report check(const vsh_model *model, size_t index) {
    const vsh_mesh mesh = vsh_model_mesh(model, index, -1);
    vsh_mesh_report report;
    vsh_error error = {0};
    if (vsh_mesh_check(&mesh, &report, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    return report;
}

/* ---- files ---- */

/* A quad whose UVs are its positions, but for one corner: no flip and no swap leaves them alone. */
static const float quad_uv[4][2] = {{0.125F, 0.25F}, {1, 0}, {1, 1}, {0, 0.75F}};

static const char quad_obj[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
                               "vt 0.125 0.25\nvt 1 0\nvt 1 1\nvt 0 0.75\n"
                               "o quad\nf 1/1 2/2 3/3 4/4\n";

static const char quad_ply[] = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                               "property float z\nproperty float s\nproperty float t\nelement face 1\n"
                               "property list uchar int vertex_indices\nend_header\n"
                               "0 0 0 0.125 0.25\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 0.75\n4 0 1 2 3\n";

static const char triangle_stl[] = "solid a b\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                                   "vertex 0 1 0\nendloop\nendfacet\nendsolid a b\n";

static const char quad_fbx[] =
    "; FBX 7.3.0 project file\nFBXHeaderExtension:  {\n\tFBXHeaderVersion: 1003\n\tFBXVersion: 7300\n}\n"
    "GlobalSettings:  {\n\tVersion: 1000\n\tProperties70:  {\n"
    "\t\tP: \"UpAxis\", \"int\", \"Integer\", \"\",1\n\t\tP: \"UpAxisSign\", \"int\", \"Integer\", \"\",1\n"
    "\t\tP: \"FrontAxis\", \"int\", \"Integer\", \"\",2\n\t\tP: \"FrontAxisSign\", \"int\", \"Integer\", "
    "\"\",1\n"
    "\t\tP: \"CoordAxis\", \"int\", \"Integer\", \"\",0\n\t\tP: \"CoordAxisSign\", \"int\", \"Integer\", "
    "\"\",1\n"
    "\t\tP: \"UnitScaleFactor\", \"double\", \"Number\", \"\",1\n\t}\n}\n"
    "Objects:  {\n\tGeometry: 100, \"Geometry::quad\", \"Mesh\" {\n"
    "\t\tVertices: *12 {\n\t\t\ta: 0,0,0,1,0,0,1,1,0,0,1,0\n\t\t}\n"
    "\t\tPolygonVertexIndex: *4 {\n\t\t\ta: 0,1,2,-4\n\t\t}\n\t\tGeometryVersion: 124\n"
    "\t\tLayerElementUV: 0 {\n\t\t\tVersion: 101\n\t\t\tName: \"UVMap\"\n"
    "\t\t\tMappingInformationType: \"ByPolygonVertex\"\n\t\t\tReferenceInformationType: \"IndexToDirect\"\n"
    "\t\t\tUV: *8 {\n\t\t\t\ta: 0.125,0.25,1,0,1,1,0,0.75\n\t\t\t}\n\t\t\tUVIndex: *4 {\n\t\t\t\ta: 0,1,2,3\n"
    "\t\t\t}\n\t\t}\n\t\tLayer: 0 {\n\t\t\tVersion: 100\n\t\t\tLayerElement:  {\n"
    "\t\t\t\tType: \"LayerElementUV\"\n\t\t\t\tTypedIndex: 0\n\t\t\t}\n\t\t}\n\t}\n"
    "\tModel: 200, \"Model::quad\", \"Mesh\" {\n\t\tVersion: 232\n\t}\n}\n"
    "Connections:  {\n\tC: \"OO\",200,0\n\tC: \"OO\",100,200\n}\n";

/* positions 48, first UVs 32, second UVs 32, indices 12 bytes */
enum { BUFFER = 124 };

static void quad_buffer(unsigned char bytes[BUFFER], const float *corner2, uint16_t last_index) {
    float positions[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    float first[4][2], second[4][2];
    const uint16_t indices[6] = {0, 1, 2, 0, 2, last_index};
    if (corner2 != NULL) {
        memcpy(positions[2], corner2, sizeof positions[2]);
    }
    for (int i = 0; i < 4; ++i) {
        first[i][0] = quad_uv[i][0];
        first[i][1] = 1.0F - quad_uv[i][1]; /* glTF's v points down */
        second[i][0] = 0.5F * quad_uv[i][0];
        second[i][1] = 1.0F - 0.5F * quad_uv[i][1];
    }
    memcpy(bytes, positions, 48);
    memcpy(bytes + 48, first, 32);
    memcpy(bytes + 80, second, 32);
    memcpy(bytes + 112, indices, 12);
}

static void base64(const unsigned char *bytes, size_t size, char *text) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        uint32_t three = 0;
        for (size_t k = 0; k < 3; ++k) {
            three = three << 8 | (i + k < size ? bytes[i + k] : 0);
        }
        for (size_t k = 0; k < 4; ++k) {
            *text++ = i + k > size ? '=' : digits[three >> (18 - 6 * k) & 63];
        }
    }
    *text = '\0';
}

static const char one_node[] = "{\"name\":\"here\",\"mesh\":0}";

/* The root turns by 90° about z, doubles, and moves by (1, 2, 3); one child moves by (1, 0, 0), one mirrors
 * x. */
static const char instances[] =
    "{\"name\":\"root\",\"children\":[1,2],\"translation\":[1,2,3],\"scale\":[2,2,2],"
    "\"rotation\":[0,0,0.70710678118654752,0.70710678118654752]},"
    "{\"name\":\"moved\",\"mesh\":0,\"translation\":[1,0,0]},"
    "{\"name\":\"mirrored\",\"mesh\":0,\"matrix\":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}";

/* The JSON of the quad; `uri` is "" or "\"uri\":…," of the buffer. */
static void quad_json(char json[4096], const char *nodes, const char *uri) {
    const int size = snprintf(
        json, 4096,
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[%s],"
        "\"meshes\":[{\"name\":\"quad\",\"primitives\":[{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1,"
        "\"TEXCOORD_1\":2},\"indices\":3}]}],\"accessors\":["
        "{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},"
        "{\"bufferView\":1,\"componentType\":5126,\"count\":4,\"type\":\"VEC2\"},"
        "{\"bufferView\":2,\"componentType\":5126,\"count\":4,\"type\":\"VEC2\"},"
        "{\"bufferView\":3,\"componentType\":5123,\"count\":6,\"type\":\"SCALAR\"}],\"bufferViews\":["
        "{\"buffer\":0,\"byteOffset\":0,\"byteLength\":48},{\"buffer\":0,\"byteOffset\":48,\"byteLength\":32}"
        ","
        "{\"buffer\":0,\"byteOffset\":80,\"byteLength\":32},{\"buffer\":0,\"byteOffset\":112,\"byteLength\":"
        "12}],"
        "\"buffers\":[{%s\"byteLength\":%d}]}",
        nodes, uri, BUFFER);
    assert_in_range(size, 1, 4095);
}

static void quad_gltf(char json[4096], const char *nodes, const float *corner2, uint16_t last_index) {
    unsigned char buffer[BUFFER];
    char text[BUFFER * 2], uri[512];
    quad_buffer(buffer, corner2, last_index);
    base64(buffer, BUFFER, text);
    snprintf(uri, sizeof uri, "\"uri\":\"data:application/octet-stream;base64,%s\",", text);
    quad_json(json, nodes, uri);
}

static void put_u32(unsigned char *to, size_t value) {
    for (int i = 0; i < 4; ++i) {
        to[i] = (unsigned char)(value >> (8 * i));
    }
}

static size_t quad_glb(unsigned char bytes[8192]) {
    char json[4096];
    quad_json(json, one_node, "");
    size_t size = strlen(json);
    while (size % 4 != 0) {
        json[size++] = ' ';
    }
    const size_t all = 20 + size + 8 + BUFFER;
    memcpy(bytes, "glTF", 4);
    put_u32(bytes + 4, 2);
    put_u32(bytes + 8, all);
    put_u32(bytes + 12, size);
    memcpy(bytes + 16, "JSON", 4);
    memcpy(bytes + 20, json, size);
    put_u32(bytes + 20 + size, BUFFER);
    memcpy(bytes + 24 + size, "BIN", 4);
    quad_buffer(bytes + 28 + size, NULL, 3);
    return all;
}

static size_t binary_stl(unsigned char *bytes, const float (*corners)[3], size_t triangles) {
    memset(bytes, 0, 84 + 50 * triangles);
    put_u32(bytes + 80, triangles);
    for (size_t i = 0; i < triangles; ++i) {
        memcpy(bytes + 84 + 50 * i + 12, corners[3 * i], 36);
    }
    return 84 + 50 * triangles;
}

static size_t binary_ply(unsigned char *bytes, bool big_endian) {
    static const float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    int size =
        sprintf((char *)bytes,
                "ply\nformat binary_%s_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n",
                big_endian ? "big" : "little");
    for (int i = 0; i < 9; ++i) {
        uint32_t bits;
        memcpy(&bits, &positions[i], sizeof bits);
        put_u32(bytes + size, big_endian ? __builtin_bswap32(bits) : bits);
        size += 4;
    }
    for (uint32_t f = 0; f < 2; ++f) {
        bytes[size++] = 3;
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t index = f == 0 ? k : 2 - k;
            put_u32(bytes + size, big_endian ? __builtin_bswap32(index) : index);
            size += 4;
        }
    }
    return (size_t)size;
}

/* ---- what comes out ---- */

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

/* ---- what is refused ---- */

static void bad_obj_is_refused_with_line_and_value(void **state) {
    (void)state;
#define CORNERS "v 0 0 0\nv 1 0 0\nv 1 1 0\n"
    refused("a.obj", "v nan 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n", VSH_ERROR_INPUT, "line 1", "'nan'");
    refused("a.obj", "v 0 0 0\nv 1 -inf 0\nv 1 1 0\nf 1 2 3\n", VSH_ERROR_INPUT, "line 2", "'-inf'");
    refused("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 1e39\nf 1 2 3\n", VSH_ERROR_INPUT, "vertex 2", "inf");
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
    refused("a.obj", CORNERS "f 1 2 3\n f 1 3 2\n", VSH_ERROR_INPUT, "line 5", "indented");
    refused("a.obj", CORNERS "l 1 2\n", VSH_ERROR_INPUT, "holds no triangles", "");
    refused("a.obj", CORNERS, VSH_ERROR_INPUT, "holds no triangles", "");
#undef CORNERS
    vsh_model_free(read_text("late.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\nv 1 1 0\n"));
    vsh_model_free(read_text("dos.obj", "v 0 0 0\r\nv 1 0 0 # corner\r\nv 1 1 0\r\nf 1 2 \\\r\n3\r\n"));
}

static void bad_ply_and_stl_are_refused(void **state) {
    (void)state;
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
#undef HEAD
    refused("a.stl",
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 inf 0\nvertex 0 1 0\nendloop\n"
            "endfacet\nendsolid a\n",
            VSH_ERROR_INPUT, "vertex 1 of facet 0", "'inf'");
    const float bad[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, NAN, 0}};
    unsigned char bytes[84 + 50];
    vsh_model *model = NULL;
    vsh_error error = {0};
    assert_int_equal(read_bytes("b.stl", bytes, binary_stl(bytes, bad, 1), &model, &error), VSH_ERROR_INPUT);
    assert_non_null(strstr(error.message, "nan"));
}

static void bad_gltf_is_refused(void **state) {
    (void)state;
    char gltf[4096];
    quad_gltf(gltf, one_node, (float[]){1, NAN, 0}, 3);
    refused("a.gltf", gltf, VSH_ERROR_INPUT, "'quad'", "vertex 2");
    quad_gltf(gltf, one_node, (float[]){INFINITY, 1, 0}, 3);
    refused("a.gltf", gltf, VSH_ERROR_INPUT, "'quad'", "inf");
    quad_gltf(gltf, one_node, NULL, 4);
    refused("a.gltf", gltf, VSH_ERROR_INPUT, "1 of its 2", "out of range");
    memcpy(strstr(gltf, "\"scene\""), "\"xcene\"", 7); /* the first scene is meant then */
    refused("a.gltf", gltf, VSH_ERROR_INPUT, "1 of its 2", "out of range");
    quad_gltf(gltf, "{\"name\":\"far\",\"mesh\":0,\"translation\":[1e39,0,0]}", NULL, 3);
    refused("a.gltf", gltf, VSH_ERROR_INPUT, "far/quad", "row 0 column 3");
    quad_gltf(gltf, "{\"name\":\"empty\"}", NULL, 3);
    refused("a.gltf", gltf, VSH_ERROR_INPUT, "holds no triangles", "a.gltf");
    refused("a.gltf", "{\"asset\": {\"version\": 2.0 \"x\"}}", VSH_ERROR_INPUT, "line 1", "column");
}

static void files_that_cannot_be_read_say_why(void **state) {
    (void)state;
    vsh_model *model;
    vsh_error error = {0};
    assert_int_equal(vsh_model_read(path_of("missing.obj").text, NULL, &model, &error), VSH_ERROR_READ);
    assert_non_null(strstr(error.message, "missing.obj: No such file"));
    assert_null(model);
    char as_folder[160];
    snprintf(as_folder, sizeof as_folder, "%s/.", folder);
    assert_int_equal(vsh_model_read(as_folder, NULL, &model, NULL), VSH_ERROR_INPUT);
    refused("empty.obj", "", VSH_ERROR_READ, "is empty", "");
    refused("other.xyzzy", quad_obj, VSH_ERROR_INPUT, ".xyzzy", "no mesh format");
    refused("none", quad_obj, VSH_ERROR_INPUT, "no ending", "");
    refused("text.fbx", "hello, world", VSH_ERROR_READ, "damaged or cut short", "");
    assert_int_equal(vsh_model_read(NULL, NULL, &model, &error), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_model_read("x.obj", NULL, NULL, &error), VSH_ERROR_ARGUMENT);
    vsh_model_free(NULL);
}

static void the_memory_limit_is_checked(void **state) {
    (void)state;
    write_bytes("limit.obj", quad_obj, strlen(quad_obj));
    vsh_run run = vsh_run_default();
    vsh_model *model;
    vsh_error error = {0};
    run.memory_limit = 100;
    assert_int_equal(vsh_model_read(path_of("limit.obj").text, &run, &model, &error), VSH_ERROR_LIMIT);
    assert_non_null(strstr(error.message, "limit.obj"));
    run.memory_limit = 1 << 20;
    assert_int_equal(vsh_model_read(path_of("limit.obj").text, &run, &model, &error), VSH_OK);
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

static void progress_rises_to_one_and_can_cancel_anywhere(void **state) {
    (void)state;
    static const double stops[] = {2.0, 0.0, 0.1, 0.5, 0.99, 1.0};
    write_bytes("watch.obj", quad_obj, strlen(quad_obj));
    for (size_t i = 0; i < sizeof stops / sizeof stops[0]; ++i) {
        watch w = {0.0, stops[i], 0};
        vsh_run run = vsh_run_default();
        run.progress = watch_progress;
        run.user = &w;
        vsh_model *model;
        const vsh_result result = vsh_model_read(path_of("watch.obj").text, &run, &model, NULL);
        assert_int_equal(result, stops[i] > 1.0 ? VSH_OK : VSH_ERROR_CANCELLED);
        assert_int_equal(model == NULL, stops[i] <= 1.0);
        assert_true(w.calls >= 1 && (stops[i] <= 1.0 || w.last == 1.0));
        vsh_model_free(model);
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
        vsh_model *model = NULL;
        vsh_error error = {0};
        const vsh_result result = read_bytes(name, copy, length, &model, &error);
        if (result == VSH_OK) {
            for (size_t i = 0; i < vsh_model_mesh_count(model); ++i) {
                check(model, i);
            }
            if (knows_its_length) {
                fail_msg("%s: nothing noticed at %zu of %zu bytes", name, length, size);
            }
        } else if (strstr(error.message, name) == NULL) {
            fail_msg("%s at %zu bytes: '%s' does not name the file", name, length, error.message);
        }
        vsh_model_free(model);
    }
    free(copy);
}

static void files_cut_at_any_length_do_no_harm(void **state) {
    (void)state;
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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(uvs_point_up_whatever_the_format),
        cmocka_unit_test(the_second_uv_set_is_the_default),
        cmocka_unit_test(nodes_are_instances_that_share_arrays),
        cmocka_unit_test(a_node_scaled_to_nothing_is_left_out_with_a_warning),
        cmocka_unit_test(meshes_objects_and_polygons_become_triangles_and_lines_are_dropped),
        cmocka_unit_test(a_cube_in_stl_is_closed),
        cmocka_unit_test(binary_ply_of_either_byte_order_is_read),
        cmocka_unit_test(bad_obj_is_refused_with_line_and_value),
        cmocka_unit_test(bad_ply_and_stl_are_refused),
        cmocka_unit_test(bad_gltf_is_refused),
        cmocka_unit_test(files_that_cannot_be_read_say_why),
        cmocka_unit_test(the_memory_limit_is_checked),
        cmocka_unit_test(progress_rises_to_one_and_can_cancel_anywhere),
        cmocka_unit_test(files_cut_at_any_length_do_no_harm),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
