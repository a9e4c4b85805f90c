#include "model/ply_strips.h"

#include "base/bytes.h"
#include "base/memory.h"
#include "base/try.h"
#include "model/scan.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

enum { LONGEST_LINE = 40, LONGEST_HEADER = 128 };

/* The rows on their way. */
typedef struct unrolling {
    const vshi_ply_strips *strips;
    const char *path, *at, *end;
    uint64_t row;
    int64_t last[2]; /* indices of the strip, of which `length` have been read */
    size_t length;
    size_t triangles;
    char *to; /* where faces are written; NULL: they are counted */
} unrolling;

static vsh_result fail_short(const unrolling *u, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_READ, "%s: cut short: it ends in tristrips %" PRIu64 " of %" PRIu64,
                     u->path, u->row, u->strips->rows);
}

static vsh_result read_ascii(unrolling *u, int64_t *value, vsh_error *error) {
    const vshi_token token = vshi_scan_token(&u->at, u->end);
    if (token.text == NULL) {
        return fail_short(u, error);
    }
    if (!vshi_token_integer(token, value)) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: tristrips %" PRIu64 " holds '%.*s', expected an index",
                         u->path, u->row, VSHI_TOKEN_ARGS(token));
    }
    return VSH_OK;
}

static vsh_result read_binary(unrolling *u, int size, bool is_signed, int64_t *value, vsh_error *error) {
    if (u->end - u->at < size) {
        return fail_short(u, error);
    }
    *value = vshi_bytes_integer(u->at, size, is_signed, u->strips->big_endian);
    u->at += size;
    return VSH_OK;
}

static void write_number(char *to, uint32_t value, bool big_endian) {
    for (int i = 0; i < 4; ++i) {
        to[i] = (char)(unsigned char)(value >> 8 * (big_endian ? 3 - i : i));
    }
}

static void write_face(unrolling *u, const int64_t corner[3]) {
    if (u->strips->ascii) {
        u->to += snprintf(u->to, LONGEST_LINE, "3 %" PRId64 " %" PRId64 " %" PRId64 "\n", corner[0],
                          corner[1], corner[2]);
        return;
    }
    *u->to++ = 3;
    for (int k = 0; k < 3; ++k, u->to += 4) {
        write_number(u->to, (uint32_t)corner[k], u->strips->big_endian);
    }
}

/* The next index of a list. Every second triangle of a strip runs the other way around; those of fewer than
 * three vertices, by which strips are joined, are left out. */
static vsh_result push(unrolling *u, int64_t index, vsh_error *error) {
    if (index == -1) {
        u->length = 0;
        return VSH_OK;
    }
    if (index < 0 || (uint64_t)index >= u->strips->vertices) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: tristrips %" PRIu64 " uses vertex %" PRId64 ", but there are only %" PRIu64,
                         u->path, u->row, index, u->strips->vertices);
    }
    const int64_t a = u->last[0], b = u->last[1];
    if (u->length >= 2 && a != b && b != index && a != index) {
        const bool odd = u->length % 2 != 0;
        ++u->triangles;
        if (u->to != NULL) {
            write_face(u, (const int64_t[3]){odd ? b : a, odd ? a : b, index});
        }
    }
    u->last[0] = b;
    u->last[1] = index;
    ++u->length;
    return VSH_OK;
}

static vsh_result read_row(unrolling *u, vsh_error *error) {
    const vshi_ply_strips *s = u->strips;
    int64_t count = 0;
    VSHI_TRY(s->ascii ? read_ascii(u, &count, error) : read_binary(u, s->count_size, false, &count, error));
    if (count < 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: tristrips %" PRIu64 " is a list of %" PRId64, u->path,
                         u->row, count);
    }
    u->length = 0;
    for (int64_t i = 0; i < count; ++i) {
        int64_t index = 0;
        VSHI_TRY(s->ascii ? read_ascii(u, &index, error)
                          : read_binary(u, s->index_size, s->is_signed, &index, error));
        VSHI_TRY(push(u, index, error));
    }
    return VSH_OK;
}

vsh_result vshi_ply_strips_scan(vshi_ply_strips *strips, const char *path, const char *end,
                                vsh_error *error) {
    unrolling u = {.strips = strips, .path = path, .at = strips->body, .end = end};
    for (; u.row < strips->rows; ++u.row) {
        VSHI_TRY(read_row(&u, error));
    }
    strips->body_end = u.at;
    strips->triangles = u.triangles;
    return VSH_OK;
}

/* Of a face at most. */
static size_t face_bytes(const vshi_ply_strips *strips) {
    enum { BINARY = 1 + 3 * 4 };
    return strips->ascii
               ? (size_t)snprintf(NULL, 0, "3 %1$" PRIu64 " %1$" PRIu64 " %1$" PRIu64 "\n", strips->vertices)
               : BINARY;
}

double vshi_ply_strips_bytes(const vshi_ply_strips *strips, size_t size) {
    return (double)size + LONGEST_HEADER + LONGEST_LINE +
           (double)face_bytes(strips) * (double)strips->triangles;
}

/* Copies text up to `end`. */
static const char *copy_up_to(char **to, const char *from, const char *end) {
    const size_t size = (size_t)(end - from);
    memcpy(*to, from, size);
    *to += size;
    return end;
}

vsh_result vshi_ply_strips_unroll(const vshi_ply_strips *strips, const char *path, const char *text,
                                  size_t size, char **made, size_t *made_size, vsh_error *error) {
    const size_t bytes = (size_t)vshi_ply_strips_bytes(strips, size);
    *made = NULL;
    VSHI_TRY(vshi_allocate((void **)made, bytes, 1, path, error));
    char *to = *made;
    copy_up_to(&to, text, strips->header);
    to += snprintf(to, LONGEST_HEADER, "element face %zu\nproperty list uchar int vertex_indices\n",
                   strips->triangles);
    copy_up_to(&to, strips->header_end, strips->body);
    if (strips->ascii) {
        *to++ = '\n'; /* rows may follow each other in one line */
    }
    unrolling u = {.strips = strips, .path = path, .at = strips->body, .end = strips->body_end, .to = to};
    for (; u.row < strips->rows; ++u.row) {
        VSHI_TRY(read_row(&u, error));
    }
    to = u.to;
    copy_up_to(&to, strips->body_end, text + size);
    *made_size = (size_t)(to - *made);
    return VSH_OK;
}
