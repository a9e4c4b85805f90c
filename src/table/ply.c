/* PLY, ascii and binary of both orders (G. Turk, "The PLY polygon file format", 1994): the header, and as a
 * table the numbers of the element `vertex`, whose rows are of one size; other properties and elements are
 * passed over or on. */
#include "table/ply.h"

#include "base/bytes.h"
#include "base/memory.h"
#include "table/table.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

/* --- the header */

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

/* Words of a line; more than there is room for count as one more. */
static int split(const char *line, size_t size, word w[WORDS]) {
    const char *at = line, *end = line + size;
    for (int words = 0;; ++words) {
        const vshi_field field = vshi_field_next(&at, end, VSHI_BETWEEN_BLANKS);
        const size_t length = (size_t)(field.end - field.text);
        if (length == 0 || words == WORDS) {
            return length > 0 ? WORDS + 1 : words;
        }
        memset(w[words], 0, sizeof w[words]);
        memcpy(w[words], field.text, length < VSHI_PLY_NAME ? length : VSHI_PLY_NAME - 1);
    }
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

/* --- tables */

enum { HEADER_MOST = 1 << 20 };

static vsh_result keep_line(vshi_table *t, const char *line, size_t size, vsh_error *error) {
    char *more =
        t->header_size + size + 1 < HEADER_MOST ? realloc(t->header, t->header_size + size + 1) : NULL;
    if (more == NULL) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: a header of more than %d bytes", t->source.name,
                         HEADER_MOST);
    }
    memcpy(more + t->header_size, line, size);
    t->header = more;
    t->header_size += size;
    t->header[t->header_size++] = '\n';
    return VSH_OK;
}

static vsh_result read_header(vshi_table *t, vsh_error *error) {
    vshi_ply_header *h = &t->ply;
    t->vertex = -1;
    while (!h->ended) {
        const char *line;
        size_t size;
        VSHI_TRY(vshi_source_line(&t->source, &line, &size, error));
        if (line == NULL && h->lines == 0) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s: no PLY: it is empty", t->source.name);
        }
        if (line == NULL) {
            return vshi_ply_fail_header(t->source.name, error);
        }
        VSHI_TRY(keep_line(t, line, size, error));
        const int before = h->elements;
        VSHI_TRY(vshi_ply_header_line(h, t->source.name, line, size, error));
        if (h->elements > before && t->vertex < 0 && strcmp(h->element[before].name, "vertex") == 0) {
            t->vertex = before;
        }
        if (!h->ended && t->vertex >= 0 && t->vertex == h->elements - 1) {
            t->header_insert = t->header_size;
        }
    }
    return VSH_OK;
}

/* Where in a row the columns are. */
static vsh_result lay_row(vshi_table *t, vsh_error *error) {
    const vshi_ply_header *h = &t->ply;
    const char *name = t->source.name;
    if (t->vertex < 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: it has no element 'vertex'", name);
    }
    const vshi_ply_element *e = &h->element[t->vertex];
    bool found[VSHI_TABLE_COLUMNS] = {false};
    size_t row_size = 0;
    t->fields = t->width = e->end - e->first;
    VSHI_TRY(vshi_allocate((void **)&t->column_of, (size_t)t->fields, 1, name, error));
    for (int p = 0; p < t->fields; ++p) {
        const vshi_ply_property *property = &h->property[e->first + p];
        if (property->count_type >= 0) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s: property '%s' of its vertices is a list", name,
                             property->name);
        }
        t->column_of[p] = -1;
        for (int i = 0; i < t->wanted.count; ++i) {
            if (strcmp(property->name, t->wanted.names[i]) == 0 && !found[i]) {
                found[i] = true;
                t->column_of[p] = (int8_t)i;
                t->offset[i] = (int)row_size;
                t->type[i] = property->type;
            }
        }
        row_size += (size_t)vshi_ply_size(property->type);
    }
    t->row_size = h->ascii ? 0 : row_size;
    const char *missing = vshi_table_choose(t, found, t->fields);
    return missing == NULL
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT, "%s: its vertices have no property '%s'", name, missing);
}

/* The first *size bytes of a row. Errors: VSH_ERROR_READ where there are fewer. */
static vsh_result peek(vshi_table *t, const vshi_ply_element *e, uint64_t row, const char **bytes,
                       size_t size, vsh_error *error) {
    size_t available;
    VSHI_TRY(vshi_source_peek(&t->source, size, bytes, &available, error));
    return available < size ? vshi_ply_fail_short(t->source.name, e, row, error) : VSH_OK;
}

/* A row of an element's, which stays, and its bytes. Errors: VSH_ERROR_READ where it is not whole. */
static vsh_result peek_row(vshi_table *t, const vshi_ply_element *e, uint64_t row, const char **bytes,
                           size_t *size, vsh_error *error) {
    *size = 0;
    for (int p = e->first; p < e->end; ++p) {
        const vshi_ply_property *property = &t->ply.property[p];
        uint64_t count = 1;
        if (property->count_type >= 0) {
            const int width = vshi_ply_size(property->count_type);
            *size += (size_t)width;
            VSHI_TRY(peek(t, e, row, bytes, *size, error));
            count = vshi_bytes_number(*bytes + *size - width, width, t->ply.big_endian);
        }
        *size += count * (size_t)vshi_ply_size(property->type);
        VSHI_TRY(peek(t, e, row, bytes, *size, error));
    }
    return VSH_OK;
}

/* Passes over a row of an element, or on to `to`. */
static vsh_result pass_row(vshi_table *t, const vshi_ply_element *e, uint64_t row, FILE *to,
                           vsh_error *error) {
    const char *bytes;
    size_t size = 0;
    if (!t->ply.ascii) {
        VSHI_TRY(peek_row(t, e, row, &bytes, &size, error));
        vshi_source_take(&t->source, size);
    }
    while (t->ply.ascii && size == 0) {
        VSHI_TRY(vshi_source_line(&t->source, &bytes, &size, error));
        if (bytes == NULL) {
            return vshi_ply_fail_short(t->source.name, e, row, error);
        }
    }
    if (to != NULL) {
        fwrite(bytes, 1, size, to);
        fputs(t->ply.ascii ? "\n" : "", to);
    }
    return VSH_OK;
}

static vsh_result pass_elements(vshi_table *t, int first, int end, FILE *to, vsh_error *error) {
    for (int i = first; i < end; ++i) {
        const vshi_ply_element *e = &t->ply.element[i];
        for (uint64_t row = 0; e->first < e->end && row < e->count; ++row) {
            VSHI_TRY(pass_row(t, e, row, to, error));
        }
    }
    return VSH_OK;
}

vsh_result vshi_table_open_ply(vshi_table *t, vsh_error *error) {
    t->delimiter = VSHI_BETWEEN_BLANKS;
    VSHI_TRY(read_header(t, error));
    VSHI_TRY(lay_row(t, error));
    return pass_elements(t, 0, t->vertex, NULL, error);
}

vsh_result vshi_table_rest(vshi_table *t, FILE *to, vsh_error *error) {
    return t->format == VSHI_TABLE_PLY ? pass_elements(t, t->vertex + 1, t->ply.elements, to, error) : VSH_OK;
}
