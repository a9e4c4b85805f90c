/* A wavy sheet of a million triangles as mesh files. */
#include "bench.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS = 708, SIDE = ROWS + 1, VERTICES = SIDE * SIDE, TRIANGLES = 2 * ROWS * ROWS };

typedef struct vertex {
    float position[3], normal[3], uv[2];
} vertex;

static vertex vertex_of(int v) {
    const double i = v / SIDE, k = v % SIDE;
    const double slope[2] = {-0.6 * cos(0.02 * i) * cos(0.03 * k), 0.9 * sin(0.02 * i) * sin(0.03 * k)};
    const double length = sqrt(1.0 + slope[0] * slope[0] + slope[1] * slope[1]);
    return (vertex){
        .position = {(float)(1e-2 * i), (float)(0.3 * sin(0.02 * i) * cos(0.03 * k)), (float)(1e-2 * k)},
        .normal = {(float)(slope[0] / length), (float)(1.0 / length), (float)(slope[1] / length)},
        .uv = {(float)(i / ROWS), (float)(k / ROWS)}};
}

static void triangle_of(int t, uint32_t corner[3]) {
    const uint32_t a = (uint32_t)(t / 2 / ROWS * SIDE + t / 2 % ROWS), d = a + SIDE + 1;
    memcpy(corner, (uint32_t[3]){a, t % 2 == 0 ? a + 1 : d, t % 2 == 0 ? d : a + SIDE}, sizeof(uint32_t[3]));
}

static FILE *open_file(const char *path) {
    FILE *file = fopen(path, "wb");
    if (file == NULL) {
        perror(path);
        exit(3);
    }
    return file;
}

static void close_file(FILE *file, const char *path) {
    if (fclose(file) != 0) {
        perror(path);
        exit(3);
    }
}

static void write_obj(const char *path, bool all) {
    FILE *file = open_file(path);
    for (int kind = 0; kind < (all ? 3 : 1); ++kind) {
        for (int i = 0; i < VERTICES; ++i) {
            const vertex v = vertex_of(i);
            const float *p = kind == 0 ? v.position : v.normal;
            if (kind == 1) {
                fprintf(file, "vt %.6f %.6f\n", (double)v.uv[0], (double)v.uv[1]);
            } else {
                fprintf(file, "%s %.6f %.6f %.6f\n", kind == 0 ? "v" : "vn", (double)p[0], (double)p[1],
                        (double)p[2]);
            }
        }
    }
    for (int t = 0; t < TRIANGLES; ++t) {
        uint32_t c[3];
        triangle_of(t, c);
        for (int k = 0; k < 3; ++k) {
            fprintf(file, "%s %u", k == 0 ? "f" : "", c[k] + 1);
            if (all) {
                fprintf(file, "/%u/%u", c[k] + 1, c[k] + 1);
            }
        }
        fputs("\n", file);
    }
    close_file(file, path);
}

void bench_write_obj(const char *path) {
    write_obj(path, true);
}

void bench_write_bare_obj(const char *path) {
    write_obj(path, false);
}

static void write_ply(const char *path, bool ascii) {
    FILE *file = open_file(path);
    fprintf(file,
            "ply\nformat %s 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
            "property float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty float t\n"
            "element face %d\nproperty list uchar uint vertex_indices\nend_header\n",
            ascii ? "ascii" : "binary_little_endian", VERTICES, TRIANGLES);
    for (int i = 0; i < VERTICES; ++i) {
        const vertex v = vertex_of(i);
        float number[8];
        memcpy(number, &v, sizeof number);
        for (int k = 0; ascii && k < 8; ++k) {
            fprintf(file, k < 7 ? "%.6f " : "%.6f\n", (double)number[k]);
        }
        if (!ascii) {
            fwrite(number, sizeof number, 1, file);
        }
    }
    for (int t = 0; t < TRIANGLES; ++t) {
        uint32_t c[3];
        triangle_of(t, c);
        if (ascii) {
            fprintf(file, "3 %u %u %u\n", c[0], c[1], c[2]);
        } else {
            fputc(3, file);
            fwrite(c, sizeof c, 1, file);
        }
    }
    close_file(file, path);
}

void bench_write_ascii_ply(const char *path) {
    write_ply(path, true);
}

void bench_write_ply(const char *path) {
    write_ply(path, false);
}

static void put_words(FILE *file, const char *name, uint32_t size) {
    fwrite(&size, sizeof size, 1, file);
    fwrite(name, 4, 1, file);
}

void bench_write_glb(const char *path) {
    enum { POSITIONS = 12 * VERTICES, NORMALS = 12 * VERTICES, UVS = 8 * VERTICES, INDICES = 12 * TRIANGLES };
    char json[2048];
    int size = snprintf(
        json, sizeof json,
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],"
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":1,\"TEXCOORD_0\":2},"
        "\"indices\":3}]}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":%1$d,"
        "\"type\":\"VEC3\",\"min\":[0,-0.3,0],\"max\":[7.08,0.3,7.08]},"
        "{\"bufferView\":1,\"componentType\":5126,\"count\":%1$d,\"type\":\"VEC3\"},"
        "{\"bufferView\":2,\"componentType\":5126,\"count\":%1$d,\"type\":\"VEC2\"},"
        "{\"bufferView\":3,\"componentType\":5125,\"count\":%2$d,\"type\":\"SCALAR\"}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":%3$d},"
        "{\"buffer\":0,\"byteOffset\":%3$d,\"byteLength\":%3$d},"
        "{\"buffer\":0,\"byteOffset\":%4$d,\"byteLength\":%5$d},"
        "{\"buffer\":0,\"byteOffset\":%6$d,\"byteLength\":%7$d}],\"buffers\":[{\"byteLength\":%8$d}]}",
        VERTICES, 3 * TRIANGLES, POSITIONS, POSITIONS + NORMALS, UVS, POSITIONS + NORMALS + UVS, INDICES,
        POSITIONS + NORMALS + UVS + INDICES);
    while (size % 4 != 0) {
        json[size++] = ' ';
    }
    const uint32_t body = POSITIONS + NORMALS + UVS + INDICES;
    FILE *file = open_file(path);
    fwrite("glTF\2\0\0", 8, 1, file);
    const uint32_t whole = 12 + 8 + (uint32_t)size + 8 + body;
    fwrite(&whole, sizeof whole, 1, file);
    put_words(file, "JSON", (uint32_t)size);
    fwrite(json, (size_t)size, 1, file);
    put_words(file, "BIN\0", body);
    for (int kind = 0; kind < 3; ++kind) {
        for (int i = 0; i < VERTICES; ++i) {
            const vertex v = vertex_of(i);
            fwrite(kind == 0 ? v.position : kind == 1 ? v.normal : v.uv, kind == 2 ? 8 : 12, 1, file);
        }
    }
    for (int t = 0; t < TRIANGLES; ++t) {
        uint32_t c[3];
        triangle_of(t, c);
        fwrite(c, sizeof c, 1, file);
    }
    close_file(file, path);
}
