#include "table/ply.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

enum { WORDS = 5, DIGITS = 18 };

typedef char word[VSHI_PLY_NAME];

static int type_of(const char *name) {
    static const char *const names[][2] = {{"char", "int8"},     {"uchar", "uint8"},   {"short", "int16"},
                                           {"ushort", "uint16"}, {"int", "int32"},     {"uint", "uint32"},
                                           {"float", "float32"}, {"double", "float64"}};
    for (int i = 0; i <= VSHI_PLY_DOUBLE; ++i) {
        if (strcmp(name, names[i][0]) == 0 || strcmp(name, names[i][1]) == 0) {
            return i;
        }
    }
    return -1;
}

static bool read_format(vshi_ply_header *h, int words, word *w) {
    h->ascii = words == 3 && strcmp(w[1], "ascii") == 0;
    h->big_endian = words == 3 && strcmp(w[1], "binary_big_endian") == 0;
    return h->ascii || h->big_endian || (words == 3 && strcmp(w[1], "binary_little_endian") == 0);
}

static bool read_element(vshi_ply_header *h, int words, word *w) {
    const size_t digits = words == 3 ? strspn(w[2], "0123456789") : 0;
    if (digits == 0 || digits > DIGITS || w[2][digits] != '\0' || h->elements == VSHI_PLY_ELEMENTS) {
        return false;
    }
    vshi_ply_element *e = &h->element[h->elements++];
    memcpy(e->name, w[1], sizeof e->name);
    e->count = strtoull(w[2], NULL, 10);
    e->first = e->end = h->properties;
    return true;
}

static bool read_property(vshi_ply_header *h, int words, word *w) {
    const bool list = words == 5 && strcmp(w[1], "list") == 0;
    if ((!list && words != 3) || h->elements == 0 || h->properties == VSHI_PLY_PROPERTIES) {
        return false;
    }
    vshi_ply_property *p = &h->property[h->properties++];
    p->count_type = (int8_t)(list ? type_of(w[2]) : -1);
    p->type = (int8_t)type_of(w[list ? 3 : 1]);
    memcpy(p->name, w[words - 1], sizeof p->name);
    h->element[h->elements - 1].end = h->properties;
    return p->type >= 0 && (!list || (p->count_type >= 0 && p->count_type < VSHI_PLY_FLOAT));
}

static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r';
}

/* Words of a line; more than there is room for count as one more. */
static int split(const char *line, size_t size, word w[WORDS]) {
    int words = 0;
    for (size_t i = 0; i < size;) {
        if (is_blank(line[i])) {
            ++i;
            continue;
        }
        size_t length = 0;
        while (i + length < size && !is_blank(line[i + length])) {
            ++length;
        }
        if (words == WORDS) {
            return WORDS + 1;
        }
        const size_t kept = length < VSHI_PLY_NAME ? length : VSHI_PLY_NAME - 1;
        memset(w[words], 0, sizeof w[words]);
        memcpy(w[words++], line + i, kept);
        i += length;
    }
    return words;
}

static bool take_line(vshi_ply_header *h, const char *line, size_t size) {
    word w[WORDS] = {""};
    const int words = split(line, size, w);
    if (h->lines++ == 0) {
        return words == 1 && strcmp(w[0], "ply") == 0;
    }
    if (strcmp(w[0], "format") == 0) {
        return read_format(h, words, w);
    }
    if (strcmp(w[0], "element") == 0) {
        return read_element(h, words, w);
    }
    if (strcmp(w[0], "property") == 0) {
        return read_property(h, words, w);
    }
    h->ended = strcmp(w[0], "end_header") == 0;
    return true; /* comments, and what is not known */
}

vsh_result vshi_ply_header_line(vshi_ply_header *h, const char *name, const char *line, size_t size,
                                vsh_error *error) {
    return take_line(h, line, size)
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT, "%s: line %d of the header is not understood: '%.*s'",
                           name, h->lines, size < 60 ? (int)size : 60, line);
}

vsh_result vshi_ply_fail_header(const char *name, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_READ, "%s: cut short: the header has no 'end_header'", name);
}

vsh_result vshi_ply_fail_short(const char *name, const vshi_ply_element *e, uint64_t row, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_READ, "%s: cut short: it ends in %s %" PRIu64 " of %" PRIu64, name,
                     e->name, row, e->count);
}
