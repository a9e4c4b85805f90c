/* One row of a PLY, in text or binary. */
#include "base/bytes.h"
#include "base/decimal.h"
#include "base/try.h"
#include "model/ply.h"
#include "model/scan.h"

#include <inttypes.h>
#include <math.h>
#include <strings.h>

/* A row on its way. */
typedef struct ply_cursor {
    vshi_ply_reader *reader;
    const char *at, *end;
    vsh_error *error;
    int64_t last[2]; /* indices of the strip, of which `length` have been read */
    size_t length;
} ply_cursor;

static bool fail(ply_cursor *c, vsh_result result) {
    c->reader->failed = result;
    return false;
}

/* The window ends: what it lacks may be there yet. */
static bool want_more(ply_cursor *c) {
    vshi_ply_reader *r = c->reader;
    return vshi_stream_ended(&r->stream) ? fail(c, vshi_ply_fail_short(r->path, r->element, r->row, c->error))
                                         : false;
}

static bool fail_value(ply_cursor *c, vshi_token token, const char *expected) {
    const vshi_ply_reader *r = c->reader;
    return fail(c, vshi_fail(c->error, VSH_ERROR_INPUT, "%s: %s %" PRIu64 " holds '%.*s', expected %s",
                             r->path, r->element->name, r->row, VSHI_TOKEN_ARGS(token), expected));
}

static bool push_corner(ply_cursor *c, uint32_t corner) {
    vshi_ply_reader *r = c->reader;
    vshi_faces *faces = &r->faces;
    const size_t at = faces->count + r->corners;
    if (at == faces->capacity) {
        const vsh_result result = vshi_grow(&r->budget, &faces->corners, &faces->capacity, at + 1,
                                            sizeof *faces->corners, c->error);
        if (result != VSH_OK) {
            return fail(c, result);
        }
    }
    faces->corners[at] = corner;
    ++r->corners;
    return true;
}

static bool check_index(ply_cursor *c, int64_t index) {
    const vshi_ply_reader *r = c->reader;
    return index >= 0 && (uint64_t)index < r->vertices
               ? true
               : fail(c, vshi_fail(c->error, VSH_ERROR_INPUT,
                                   "%s: %s %" PRIu64 " uses vertex %" PRId64 ", but there are only %" PRIu64,
                                   r->path, r->element->name, r->row, index, r->vertices));
}

/* The next index of a strip; -1 begins another. Every second triangle of a strip runs the other way around;
 * those of fewer than three vertices, by which strips are joined, are left out. */
static bool push_strip(ply_cursor *c, int64_t index) {
    if (index == -1) {
        c->length = 0;
        return true;
    }
    if (!check_index(c, index)) {
        return false;
    }
    const int64_t a = c->last[0], b = c->last[1];
    c->last[0] = b;
    c->last[1] = index;
    if (c->length++ < 2 || a == b || b == index || a == index) {
        return true;
    }
    const bool odd = c->length % 2 == 0;
    return push_corner(c, (uint32_t)(odd ? b : a)) && push_corner(c, (uint32_t)(odd ? a : b)) &&
           push_corner(c, (uint32_t)index);
}

static bool push_index(ply_cursor *c, int role, int64_t index) {
    return role == VSHI_PLY_STRIP ? push_strip(c, index)
                                  : check_index(c, index) && push_corner(c, (uint32_t)index);
}

static void push_number(ply_cursor *c, int role, float number) {
    vshi_ply_reader *r = c->reader;
    if (role < VSHI_PLY_NUMBERS) {
        r->number[role] = number;
    } else if (role == VSHI_PLY_TEXCOORDS) {
        if (r->texcoords < VSHI_PLY_MOST_TEXCOORDS) {
            r->texcoord[r->texcoords] = number;
        }
        ++r->texcoords;
    }
}

/* --- text */

/* The next token; one that the window's end may have cut is none yet. */
static bool next_token(ply_cursor *c, vshi_token *token) {
    *token = vshi_scan_token(&c->at, c->end);
    return token->text != NULL && (c->at < c->end || vshi_stream_ended(&c->reader->stream)) ? true
                                                                                            : want_more(c);
}

static bool take_text(ply_cursor *c, int role) {
    static const char finite[] = "a finite number";
    vshi_token token;
    if (!next_token(c, &token)) {
        return false;
    }
    if (role == VSHI_PLY_CORNERS || role == VSHI_PLY_STRIP) {
        int64_t index;
        return vshi_token_integer(token, &index) && (index >= 0 || role == VSHI_PLY_STRIP)
                   ? push_index(c, role, index)
                   : fail_value(c, token, "an index of a vertex");
    }
    float number;
    if (vshi_decimal_float(token.text, &number) != token.text + token.size) {
        /* no place is there, but other things may be so */
        if (vshi_token_number(token) != VSHI_NUMBER_NOT_FINITE || role < VSHI_PLY_NX) {
            return fail_value(c, token, finite);
        }
        number = NAN;
    } else if (role < VSHI_PLY_NX && !isfinite(number)) {
        return fail_value(c, token, finite);
    }
    push_number(c, role, number);
    return true;
}

static bool take_text_property(ply_cursor *c, const vshi_ply_row_property *property) {
    int64_t values = 1;
    if (property->count_type >= 0) {
        vshi_token token;
        if (!next_token(c, &token)) {
            return false;
        }
        if (!vshi_token_integer(token, &values) || values < 0) {
            return fail_value(c, token, "a list's length");
        }
    }
    for (int64_t i = 0; i < values; ++i) {
        if (!take_text(c, property->role)) {
            return false;
        }
    }
    return true;
}

/* --- binary */

/* Indices that are floats (nobody writes them so) are whole, or none. */
static int64_t index_at(const char *at, int type, bool big_endian) {
    if (type < VSHI_PLY_FLOAT) {
        return vshi_bytes_integer(at, 1 << type / 2, type % 2 == 0, big_endian);
    }
    const float number = (float)vshi_ply_number(at, type, big_endian);
    return number >= 0.0F && number <= 16777216.0F && floorf(number) == number ? (int64_t)number : -2;
}

static bool take_binary_property(ply_cursor *c, const vshi_ply_row_property *property) {
    const bool big = c->reader->head.big_endian;
    uint64_t values = 1;
    if (property->count_type >= 0) {
        if (c->end - c->at < property->count_size) {
            return want_more(c);
        }
        values = vshi_bytes_number(c->at, property->count_size, big);
        c->at += property->count_size;
    }
    if (values > (uint64_t)(c->end - c->at) / (uint64_t)property->size) {
        return want_more(c);
    }
    const char *at = c->at;
    c->at += values * (uint64_t)property->size;
    for (; property->role != VSHI_PLY_NOTHING && at < c->at; at += property->size) {
        if (property->role != VSHI_PLY_CORNERS && property->role != VSHI_PLY_STRIP) {
            push_number(c, property->role, (float)vshi_ply_number(at, property->type, big));
        } else if (!push_index(c, property->role, index_at(at, property->type, big))) {
            return false;
        }
    }
    return true;
}

const char *vshi_ply_read_row(vshi_ply_reader *reader, const char *at, vsh_error *error) {
    ply_cursor c = {.reader = reader, .at = at, .end = reader->stream.end, .error = error};
    const bool ascii = reader->head.ascii;
    reader->corners = reader->texcoords = 0;
    for (int p = reader->element->first; p < reader->element->end; ++p) {
        const vshi_ply_row_property *property = &reader->property[p];
        if (!(ascii ? take_text_property(&c, property) : take_binary_property(&c, property))) {
            return NULL;
        }
    }
    return c.at;
}
