/* Bytes: how many as text, and the numbers that they are. */
#ifndef VSHI_BYTES_H
#define VSHI_BYTES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum { VSHI_BYTES_ROOM = 32 };

/* "1.5 GiB", into text[capacity], which is returned. */
static inline const char *vshi_bytes_text(uint64_t bytes, char *text, size_t capacity) {
    static const char *const units[] = {"bytes", "KiB", "MiB", "GiB", "TiB"};
    double value = (double)bytes;
    size_t unit = 0;
    while (value >= 1000.0 && unit + 1 < sizeof units / sizeof units[0]) {
        value /= 1024.0;
        ++unit;
    }
    snprintf(text, capacity, "%.*f %s", unit > 0 && value < 100.0 ? 1 : 0, value, units[unit]);
    return text;
}

/* An unsigned number of 1, 2, 4 or 8 bytes in a binary file. */
static inline uint64_t vshi_bytes_number(const char *at, int size, bool big_endian) {
    uint64_t value = 0;
    for (int i = 0; i < size; ++i) {
        value = value << 8 | (unsigned char)at[big_endian ? i : size - 1 - i];
    }
    return value;
}

/* A whole number of them, perhaps signed; of 8 bytes at most INT64_MAX. */
static inline int64_t vshi_bytes_integer(const char *at, int size, bool is_signed, bool big_endian) {
    const uint64_t bits = vshi_bytes_number(at, size, big_endian), sign = UINT64_C(1) << (8 * size - 1);
    return is_signed && (bits & sign) != 0 ? (int64_t)bits - (int64_t)(2 * sign) : (int64_t)bits;
}

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
