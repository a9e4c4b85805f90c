/* Small model files of every format, for their tests. */
#pragma once

#include "folder.h"

#include "geometry/mesh.h"

/* Assimp 5.2 loses what its FBX and glTF readers had taken when a file is cut: its leaks, by name. */
const char *__lsan_default_suppressions(void);

const char *__lsan_default_suppressions(void) {
    return "leak:libassimp.so\n";
}

/* Fails where a test left a file. */
static inline int remove_empty_folder(void **state) {
    return rmdir(folder);
}

static char warnings[4096];

static inline void keep_warning(void *user, const char *message) {
    strncat(warnings, message, sizeof warnings - strlen(warnings) - 1);
}

/* Writes, reads, removes. */
static inline vsh_result read_bytes(const char *name, const void *bytes, size_t size, vsh_model **model,
                                    vsh_error *error) {
    vsh_run run = vsh_run_default();
    run.warning = keep_warning;
    run.notes = 1;
    warnings[0] = '\0';
    write_all(at(name), bytes, size);
    const vsh_result result = vsh_model_read(at(name), &run, model, error);
    assert_int_equal(unlink(at(name)), 0);
    return result;
}

static inline vsh_model *read_good(const char *name, const void *bytes, size_t size) {
    vsh_model *model = NULL;
    vsh_error error = {0};
    assert_that(read_bytes(name, bytes, size, &model, &error) == VSH_OK, "%s: %s", name, error.message);
    return model;
}

static inline vsh_model *read_text(const char *name, const char *text) {
    return read_good(name, text, strlen(text));
}

static inline void refused(const char *name, const char *text, vsh_result code, const char *part,
                           const char *other) {
    vsh_model *model = NULL;
    vsh_error error = {0};
    const vsh_result result = read_bytes(name, text, strlen(text), &model, &error);
    assert_that(result == code && strstr(error.message, part) != NULL &&
                    strstr(error.message, other) != NULL && strstr(error.message, name) != NULL &&
                    strchr(error.message, '\n') == NULL,
                "%s: %s '%s', expected %s with '%s' and '%s'", name, vsh_result_name(result), error.message,
                vsh_result_name(code), part, other);
    assert_null(model);
}

static inline vsh_mesh_report check(const vsh_model *model, size_t index) {
    const vsh_mesh mesh = vsh_model_mesh(model, index, -1);
    vsh_mesh_report report;
    assert_ok(vsh_mesh_check(&mesh, &report, &failure));
    return report;
}

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
    "\t\tP: \"UnitScaleFactor\", \"double\", \"Number\", \"\",100\n\t}\n}\n"
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

static inline void quad_buffer(unsigned char bytes[BUFFER], const float *corner2, uint16_t last_index) {
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

static inline void base64(const unsigned char *bytes, size_t size, char *text) {
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
static inline void quad_json(char json[4096], const char *nodes, const char *uri) {
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

static inline void quad_gltf(char json[4096], const char *nodes, const float *corner2, uint16_t last_index) {
    unsigned char buffer[BUFFER];
    char text[BUFFER * 2], uri[512];
    quad_buffer(buffer, corner2, last_index);
    base64(buffer, BUFFER, text);
    snprintf(uri, sizeof uri, "\"uri\":\"data:application/octet-stream;base64,%s\",", text);
    quad_json(json, nodes, uri);
}

static inline void put_u32(unsigned char *to, size_t value) {
    for (int i = 0; i < 4; ++i) {
        to[i] = (unsigned char)(value >> (8 * i));
    }
}

static inline size_t quad_glb(unsigned char bytes[8192]) {
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

static inline size_t binary_stl(unsigned char *bytes, const float (*corners)[3], size_t triangles) {
    memset(bytes, 0, 84 + 50 * triangles);
    put_u32(bytes + 80, triangles);
    for (size_t i = 0; i < triangles; ++i) {
        memcpy(bytes + 84 + 50 * i + 12, corners[3 * i], 36);
    }
    return 84 + 50 * triangles;
}

static inline size_t binary_ply(unsigned char *bytes, bool big_endian) {
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
