/* Bytes: sizes as text, numbers in binary files, hashing. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum { VSHI_BYTES_ROOM = 32 };

/* Writes a size into text[capacity], "1.5 GiB", and returns it. */
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

/* The finaliser of SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number generators",
 * 2014): mixes bits for hash tables. */
static inline uint64_t vshi_mix(uint64_t x) {
    x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
    return x ^ (x >> 31);
}

/* Reads an unsigned number of 1, 2, 4 or 8 bytes of a binary file. */
static inline uint64_t vshi_bytes_number(const char *at, int size, bool big_endian) {
    uint64_t value = 0;
    for (int i = 0; i < size; ++i) {
        value = value << 8 | (unsigned char)at[big_endian ? i : size - 1 - i];
    }
    return value;
}

/* Reads a whole number, signed if `is_signed`. An unsigned one of 8 bytes must be at most INT64_MAX. */
static inline int64_t vshi_bytes_integer(const char *at, int size, bool is_signed, bool big_endian) {
    const uint64_t bits = vshi_bytes_number(at, size, big_endian), sign = UINT64_C(1) << (8 * size - 1);
    return is_signed && (bits & sign) != 0 ? (int64_t)bits - (int64_t)(2 * sign) : (int64_t)bits;
}

/* Estimates the bytes that reading a JSON text takes at most: the text, Jansson's tree, and what the caller
 * makes of it. Objects and arrays begin with some slots; members and items double them. (Blocks of the C
 * library counted with Jansson 2.14 and glibc 2.36 on 64 bits: tests/unit/test_scene.c.) */
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
