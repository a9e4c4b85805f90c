/* What reading a text of JSON takes. */
#ifndef VSHI_JSON_BYTES_H
#define VSHI_JSON_BYTES_H

#include <stdbool.h>
#include <stddef.h>

/* Bytes, at most, that reading a text takes: its own, Jansson's tree of it, and what is made of that. Objects
 * and arrays bring the first slots of their tables; members and items double them. (The C library's blocks
 * counted, Jansson 2.14 and glibc 2.36 on 64 bits: tests/unit/test_scene.c.) */
static inline double vshi_json_bytes(const char *text, size_t size) {
    double objects = 0.0, arrays = 0.0, members = 0.0, items = 0.0;
    bool in_string = false;
    for (size_t i = 0; i < size; ++i) {
        const char c = text[i];
        i += in_string && c == '\\';
        in_string ^= c == '"';
        if (!in_string) {
            objects += c == '{';
            arrays += c == '[';
            members += c == ':';
            items += c == ',';
        }
    }
    return 288.0 * objects + 176.0 * arrays + 144.0 * members + 112.0 * items + 3.0 * (double)size;
}

#endif
