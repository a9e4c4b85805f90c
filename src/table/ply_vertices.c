/* PLY, ascii and binary of both orders (G. Turk, "The PLY polygon file format", 1994): numbers of the element
 * `vertex`, whose rows are of one size; other properties and elements are passed over or on. */
#include "base/bytes.h"
#include "base/memory.h"
#include "base/try.h"
#include "table/table.h"

#include <stdlib.h>
#include <string.h>

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

/* A row of an element's, which stays, and its bytes. Errors: VSH_ERROR_READ where it is not whole. */
static vsh_result peek_row(vshi_table *t, const vshi_ply_element *e, uint64_t row, const char **bytes,
                           size_t *size, vsh_error *error) {
    size_t available;
    *size = 0;
    for (int p = e->first; p < e->end; ++p) {
        const vshi_ply_property *property = &t->ply.property[p];
        uint64_t count = 1;
        if (property->count_type >= 0) {
            const size_t before = *size;
            const int width = vshi_ply_size(property->count_type);
            *size += (size_t)width;
            VSHI_TRY(vshi_source_peek(&t->source, *size, bytes, &available, error));
            if (available < *size) {
                return vshi_ply_fail_short(t->source.name, e, row, error);
            }
            count = vshi_bytes_number(*bytes + before, width, t->ply.big_endian);
        }
        *size += count * (size_t)vshi_ply_size(property->type);
        VSHI_TRY(vshi_source_peek(&t->source, *size, bytes, &available, error));
        if (available < *size) {
            return vshi_ply_fail_short(t->source.name, e, row, error);
        }
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
