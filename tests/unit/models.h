/* Small model files of every format, for their tests. */
#pragma once

#include "folder.h"

#include "geometry/mesh.h"

/* Assimp 5.2 loses what its FBX and glTF readers had taken when a file is cut: its leaks, by name. */
const char *__lsan_default_suppressions(void);

const char *__lsan_default_suppressions(void) {
    return "leak:libassimp.so\n";
}

/* Fails if a test left a file. */
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

/* A quad whose UVs are its positions, except for one corner, so that any flip or swap changes them. */
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

static inline void put_u32(unsigned char *to, size_t value) {
    for (int i = 0; i < 4; ++i) {
        to[i] = (unsigned char)(value >> (8 * i));
    }
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
