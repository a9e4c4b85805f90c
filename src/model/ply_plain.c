/* Rows of a PLY as nearly all files have them: vertices of numbers only, and faces that are one list of
 * indices. What is not so, or is wrong, is left to the reader of single rows. */
#include "base/decimal.h"
#include "base/try.h"
#include "model/ply.h"

#include <math.h>

enum { MOST_CORNERS = 8 };

/* The number of bytes that a row of an element without lists takes in a binary file; 0: it has lists. */
static size_t row_bytes(const vshi_ply_reader *r) {
    size_t bytes = 0;
    for (int p = r->element->first; p < r->element->end; ++p) {
        if (r->property[p].count_type >= 0) {
            return 0;
        }
        bytes += (size_t)r->property[p].size;
    }
    return bytes;
}

static void binary_vertex(vshi_ply_reader *r, const char *at) {
    for (int p = r->element->first; p < r->element->end; at += r->property[p++].size) {
        const vshi_ply_row_property *property = &r->property[p];
        if (property->role < VSHI_PLY_NUMBERS) {
            r->number[property->role] = (float)vshi_ply_number(at, property->type, r->head.big_endian);
        }
    }
}

static inline const char *skip_space(const char *c, const char *end) {
    while (c < end && (*c == ' ' || (*c >= '\t' && *c <= '\r'))) {
        ++c;
    }
    return c;
}

/* Behind the row; NULL: it is not plain. `end` is far enough from the window's for all tokens of a plain row.
 */
static const char *text_vertex(vshi_ply_reader *r, const char *at) {
    for (int p = r->element->first; p < r->element->end; ++p) {
        float number;
        at = skip_space(at, r->stream.end);
        const char *next = vshi_decimal_float(at, &number);
        if (next == NULL || (*next != ' ' && *next != '\n' && *next != '\r') || !isfinite(number)) {
            return NULL;
        }
        at = next;
        if (r->property[p].role < VSHI_PLY_NUMBERS) {
            r->number[r->property[p].role] = number;
        }
    }
    return at;
}

/* The end of the last line in the window: rows of text before it are whole, and end there. */
static const char *safe_end(const vshi_ply_reader *r) {
    const char *c = r->stream.end;
    while (c > r->stream.at && c[-1] != '\n') {
        --c;
    }
    return c;
}

static vsh_result read_vertices(vshi_ply_reader *r, vsh_error *error) {
    const size_t bytes = row_bytes(r);
    const char *const end = r->head.ascii ? safe_end(r) : r->stream.end;
    while (bytes > 0 && r->row < r->element->count) {
        const char *next = r->stream.at + bytes;
        if (!r->head.ascii && (size_t)(end - r->stream.at) >= bytes) {
            binary_vertex(r, r->stream.at);
        } else {
            next = r->head.ascii && r->stream.at < end ? text_vertex(r, r->stream.at) : NULL;
        }
        if (next == NULL || next > end) {
            break;
        }
        VSHI_TRY(vshi_ply_keep_vertex(r, error));
        r->stream.at = next;
        ++r->row;
    }
    return VSH_OK;
}

/* The corners of a face; behind it, or NULL. */
static const char *binary_face(const vshi_ply_reader *r, const char *at, const char *end, uint32_t *corners,
                               size_t *count) {
    if (at == end) {
        return NULL;
    }
    *count = (unsigned char)*at++;
    if (*count > MOST_CORNERS || (size_t)(end - at) < 4 * *count) {
        return NULL;
    }
    for (size_t i = 0; i < *count; ++i, at += 4) {
        corners[i] = vshi_ply_word(at, r->head.big_endian);
    }
    return at;
}

static const char *text_face(const char *at, const char *end, uint32_t *corners, size_t *count) {
    enum { MOST_DIGITS = 9 };
    at = skip_space(at, end);
    for (size_t i = 0; i == 0 || i <= *count; ++i) {
        const char *first = at;
        uint32_t number = 0;
        for (; (unsigned char)(*at - '0') < 10; ++at) {
            number = 10 * number + (unsigned char)(*at - '0');
        }
        if (at == first || at - first > MOST_DIGITS || (*at != ' ' && *at != '\n' && *at != '\r')) {
            return NULL;
        }
        if (i > 0) {
            corners[i - 1] = number;
        } else if (number > MOST_CORNERS) {
            return NULL;
        } else {
            *count = number;
        }
        at += *at == ' ' && i < *count;
    }
    return at;
}

static bool in_range(const vshi_ply_reader *r, const uint32_t *corners, size_t count) {
    uint32_t most = 0;
    for (size_t i = 0; i < count; ++i) {
        most = corners[i] > most ? corners[i] : most;
    }
    return most < r->vertices;
}

static vsh_result read_faces(vshi_ply_reader *r, vsh_error *error) {
    const vshi_ply_row_property *list = &r->property[r->element->first];
    vshi_faces *faces = &r->faces;
    if (r->element->end != r->element->first + 1 || r->vertices == 0 ||
        (!r->head.ascii && (list->count_size != 1 || list->size != 4 || list->type >= VSHI_PLY_FLOAT))) {
        return VSH_OK;
    }
    const char *const end = r->head.ascii ? safe_end(r) : r->stream.end;
    while (r->row < r->element->count && r->stream.at < end) {
        size_t count = 0;
        VSHI_TRY(vshi_grow(&r->budget, &faces->corners, &faces->capacity, faces->count + MOST_CORNERS,
                           sizeof *faces->corners, error));
        uint32_t *corners = faces->corners + faces->count;
        const char *next = r->head.ascii ? text_face(r->stream.at, end, corners, &count)
                                         : binary_face(r, r->stream.at, end, corners, &count);
        if (next == NULL || next > end || !in_range(r, corners, count)) {
            break;
        }
        faces->count += count;
        VSHI_TRY(vshi_faces_end_face(faces, &r->budget, 0, count, error));
        r->stream.at = next;
        ++r->row;
    }
    return VSH_OK;
}

vsh_result vshi_ply_read_plain_rows(vshi_ply_reader *reader, int role, vsh_error *error) {
    return role < VSHI_PLY_NUMBERS    ? read_vertices(reader, error)
           : role == VSHI_PLY_CORNERS ? read_faces(reader, error)
                                      : VSH_OK;
}
