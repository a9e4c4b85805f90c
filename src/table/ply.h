/* The header of a PLY file, line by line (G. Turk, "The PLY polygon file format", 1994). */
#ifndef VSHI_PLY_H
#define VSHI_PLY_H

#include "base/bytes.h"
#include "base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* Types of numbers: those below are whole, every second one of them unsigned. */
enum { VSHI_PLY_FLOAT = 6, VSHI_PLY_DOUBLE = 7 };

enum { VSHI_PLY_PROPERTIES = 256, VSHI_PLY_ELEMENTS = 32, VSHI_PLY_NAME = 64 };

typedef struct vshi_ply_property {
    char name[VSHI_PLY_NAME];
    int8_t type, count_type; /* count_type -1: no list */
} vshi_ply_property;

typedef struct vshi_ply_element {
    char name[VSHI_PLY_NAME];
    uint64_t count;
    int first, end; /* properties */
} vshi_ply_element;

/* Begins as zeros. */
typedef struct vshi_ply_header {
    int lines;
    bool ascii, big_endian, ended;
    int elements, properties;
    vshi_ply_element element[VSHI_PLY_ELEMENTS];
    vshi_ply_property property[VSHI_PLY_PROPERTIES];
} vshi_ply_header;

/* Takes the next line of file `name`, without its end; `ended` tells that it was the last. Names are cut to
 * VSHI_PLY_NAME - 1 bytes. Errors: VSH_ERROR_INPUT (not understood). */
vsh_result vshi_ply_header_line(vshi_ply_header *header, const char *name, const char *line, size_t size,
                                vsh_error *error);

/* VSH_ERROR_READ: file `name` ends in its header; in that row of an element. */
vsh_result vshi_ply_fail_header(const char *name, vsh_error *error);
vsh_result vshi_ply_fail_short(const char *name, const vshi_ply_element *element, uint64_t row,
                               vsh_error *error);

/* Bytes of a binary number. */
static inline int vshi_ply_size(int type) {
    return type < VSHI_PLY_FLOAT ? 1 << type / 2 : type == VSHI_PLY_FLOAT ? 4 : 8;
}

/* Four bytes of a binary file, by one load. */
static inline uint32_t vshi_ply_word(const char *bytes, bool big_endian) {
    uint32_t word;
    memcpy(&word, bytes, sizeof word);
    return big_endian != (__BYTE_ORDER__ == __ORDER_BIG_ENDIAN__) ? __builtin_bswap32(word) : word;
}

/* A number of a binary file. */
static inline double vshi_ply_number(const char *bytes, int type, bool big_endian) {
    if (type == VSHI_PLY_FLOAT) {
        const uint32_t bits = vshi_ply_word(bytes, big_endian);
        float number;
        memcpy(&number, &bits, sizeof number);
        return (double)number;
    }
    if (type == VSHI_PLY_DOUBLE) {
        const uint64_t bits = vshi_bytes_number(bytes, sizeof bits, big_endian);
        double number;
        memcpy(&number, &bits, sizeof number);
        return number;
    }
    return (double)vshi_bytes_integer(bytes, vshi_ply_size(type), type % 2 == 0, big_endian);
}

#endif
