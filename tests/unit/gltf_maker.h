/* A glTF that a test makes: its buffer, views and accessors. */
#pragma once

#include "models.h"

enum { BYTES = 5120, UBYTES, SHORTS, USHORTS, UINTS = 5125, FLOATS };

/* A file under construction: a buffer, and the lists of its views and accessors. */
typedef struct maker {
    unsigned char bytes[4096];
    size_t size;
    size_t beyond; /* bytes that the buffer has beyond its byteLength */
    char views[4096], accessors[4096];
    int count; /* of each */
} maker;

/* Adds a view, and an accessor of all of it. Returns the accessor's number. Views begin 4 bytes into their
 * bytes. */
static inline int add(maker *m, const void *data, size_t size, const char *view, int type, int count,
                      const char *kind, const char *more) {
    const char *comma = m->count > 0 ? "," : "";
    memset(m->bytes + m->size, 0x55, 4); /* a read before the data finds no plausible number */
    memcpy(m->bytes + m->size + 4, data, size);
    snprintf(m->views + strlen(m->views), sizeof m->views - strlen(m->views),
             "%s{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu%s}", comma, m->size, size + 4, view);
    snprintf(m->accessors + strlen(m->accessors), sizeof m->accessors - strlen(m->accessors),
             "%s{\"bufferView\":%d,\"byteOffset\":4,\"componentType\":%d,\"count\":%d,\"type\":\"%s\"%s}",
             comma, m->count, type, count, kind, more);
    m->size += (size + 4 + 3) / 4 * 4;
    return m->count++;
}

static const float QUAD[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
static const float UP[4][3] = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}};

/* Begins with accessor 0, the corners of a quad, and accessor 1, its normals. */
static inline maker *begin(void) {
    maker *m = calloc(1, sizeof *m);
    assert_non_null(m);
    add(m, QUAD, sizeof QUAD, "", FLOATS, 4, "VEC3", "");
    add(m, UP, sizeof UP, "", FLOATS, 4, "VEC3", "");
    return m;
}

/* The file's text: `rest` is all but buffer, views and accessors. */
static inline const char *text_of(const maker *m, const char *rest) {
    static char json[1 << 17], text[1 << 14];
    base64(m->bytes, m->size, text);
    const int size = snprintf(json, sizeof json,
                              "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":%zu,\"uri\":"
                              "\"data:application/octet-stream;base64,%s\"}],\"bufferViews\":[%s],"
                              "\"accessors\":[%s],%s}",
                              m->size - m->beyond, text, m->views, m->accessors, rest);
    assert_in_range(size, 1, sizeof json - 1);
    return json;
}

#define MESH(attributes, more) "\"meshes\":[{\"primitives\":[{\"attributes\":{" attributes "}" more "}]}]"
#define NODE(more) "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0" more "}],"
#define ALONE NODE("")

/* Writes and reads the file, and frees the maker. */
static inline vsh_model *read_made(maker *m, const char *rest) {
    vsh_model *model = read_text("a.gltf", text_of(m, rest));
    free(m);
    return model;
}
