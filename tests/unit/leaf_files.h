/* A glTF of a card that its texture cuts out. */
#ifndef TESTS_LEAF_FILES_H
#define TESTS_LEAF_FILES_H

#include "models.h"

#include <math.h>
#include <vdbshade/image.h>

/* A card of CELLS × CELLS quads in the plane y = 1, from -1 to 1, the image's top at z = -1; on it a disc. */
enum { CELLS = 8, CORNERS = (CELLS + 1) * (CELLS + 1), TRIANGLES = 2 * CELLS * CELLS, TEXELS = 160 };
static const double CENTRE[2] = {-0.4, -0.3}, RADIUS = 0.4;

typedef struct bytes {
    unsigned char *at;
    size_t size;
} bytes;

static inline bytes read_file(const char *path) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    bytes b = {malloc(1 << 20), 0};
    b.size = fread(b.at, 1, 1 << 20, file);
    fclose(file);
    assert_true(b.size > 0 && b.size < 1 << 20);
    return b;
}

/* The disc in the alpha of an image: 1 in it, `outside` out of it. */
static inline bytes disc_image(const char *name, float outside) {
    static float alpha[TEXELS * TEXELS], grey[TEXELS * TEXELS];
    for (int y = 0; y < TEXELS; ++y) {
        for (int x = 0; x < TEXELS; ++x) {
            const double off =
                hypot(2.0 * (x + 0.5) / TEXELS - 1.0 - CENTRE[0], 2.0 * (y + 0.5) / TEXELS - 1.0 - CENTRE[1]);
            const double share = fmin(1.0, fmax(0.0, 0.5 + 20.0 * (RADIUS - off)));
            alpha[y * TEXELS + x] = outside + (1.0f - outside) * (float)share;
            grey[y * TEXELS + x] = 0.25f;
        }
    }
    const char *const names[] = {"R", "G", "B", "A"};
    const float *const planes[] = {grey, grey, grey, alpha};
    const vsh_image image = {TEXELS, TEXELS, 4, names, planes, NULL};
    vsh_image_options options = vsh_image_options_default();
    options.bits = 8;
    options.pack = "R=R,G=G,B=B,A=A";
    vsh_error error = {VSH_OK, ""};
    if (vsh_image_write(path_of(name).text, &image, &options, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    const bytes b = read_file(path_of(name).text);
    assert_int_equal(unlink(path_of(name).text), 0);
    return b;
}

static inline char *data_uri(bytes b) {
    char *text = malloc(2 * b.size + 64);
    strcpy(text, "data:image/png;base64,");
    base64(b.at, b.size, text + strlen(text));
    return text;
}

/* a.gltf, with the card under material 0; `scale` and `moved`: of its UVs. */
static inline void write_card(const char *materials, const char *sampler, const char *image_uri, float scale,
                              float moved) {
    static float positions[3 * CORNERS], uvs[2 * CORNERS];
    static uint16_t indices[3 * TRIANGLES];
    size_t at = 0;
    for (size_t i = 0; i < CORNERS; ++i) {
        const float x = (float)(i % (CELLS + 1)) / CELLS, z = (float)(i / (CELLS + 1)) / CELLS;
        const float place[3] = {2.0f * x - 1.0f, 1.0f, 2.0f * z - 1.0f};
        memcpy(positions + 3 * i, place, sizeof place);
        uvs[2 * i] = scale * x + moved;
        uvs[2 * i + 1] = scale * z + moved;
    }
    for (uint16_t cell = 0; cell < CELLS * CELLS; ++cell) {
        const uint16_t a = (uint16_t)(cell / CELLS * (CELLS + 1) + cell % CELLS);
        const uint16_t b = (uint16_t)(a + CELLS + 1);
        const uint16_t corners[6] = {a, b, (uint16_t)(b + 1), a, (uint16_t)(b + 1), (uint16_t)(a + 1)};
        memcpy(indices + at, corners, sizeof corners);
        at += 6;
    }
    enum { BODY = sizeof positions + sizeof uvs + sizeof indices };
    static unsigned char body[BODY];
    memcpy(body, positions, sizeof positions);
    memcpy(body + sizeof positions, uvs, sizeof uvs);
    memcpy(body + sizeof positions + sizeof uvs, indices, sizeof indices);
    const size_t room = 2 * BODY + strlen(image_uri) + 4096;
    char *json = malloc(room), *buffer = malloc(2 * BODY + 8);
    base64(body, BODY, buffer);
    const int size = snprintf(
        json, room,
        "{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0,\"name\":"
        "\"card\"}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1},"
        "\"indices\":2,\"material\":0}]}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":"
        "%d,\"type\":\"VEC3\"},{\"bufferView\":1,\"componentType\":5126,\"count\":%d,\"type\":\"VEC2\"},{"
        "\"bufferView\":2,\"componentType\":5123,\"count\":%d,\"type\":\"SCALAR\"}],\"bufferViews\":[{"
        "\"buffer\":0,\"byteLength\":%zu},{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu},{\"buffer\":0,"
        "\"byteOffset\":%zu,\"byteLength\":%zu}],\"materials\":[%s],\"textures\":[{\"source\":0,\"sampler\":"
        "0}],\"samplers\":[%s],\"images\":[{\"uri\":\"%s\"}],\"buffers\":[{\"byteLength\":%d,\"uri\":\"data:;"
        "base64,%s\"}]}",
        CORNERS, CORNERS, 3 * TRIANGLES, sizeof positions, sizeof positions, sizeof uvs,
        sizeof positions + sizeof uvs, sizeof indices, materials, sampler, image_uri, BODY, buffer);
    assert_in_range(size, 1, room - 1);
    write_bytes("a.gltf", json, (size_t)size);
    free(buffer);
    free(json);
}

#endif
