/* PLY: the body holds all that the header announces, and positions are finite. Assimp 5.2 repeats the last
 * face where a file ends early, and takes memory for whatever number the header names. */
#include "model/scan.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_ELEMENTS = 32, MAX_PROPERTIES = 128, ROWS_A_POLL = 4096 };

typedef struct ply_property {
    int size;       /* bytes */
    int count_size; /* bytes of a list's count; 0: no list */
    bool is_float;
    bool is_signed;   /* whole numbers */
    bool is_position; /* x, y or z of a vertex */
    bool is_corners;  /* the list of a face's vertices */
} ply_property;

typedef struct ply_element {
    char name[32];
    uint64_t count;
    int first, end; /* properties */
} ply_element;

typedef struct ply_header {
    bool ascii, big_endian;
    int strips;        /* the element of triangle strips; -1: none */
    const char *lines; /* that the strips' element is described in */
    const char *lines_end;
    ply_element element[MAX_ELEMENTS];
    ply_property property[MAX_PROPERTIES];
    int elements, properties;
} ply_header;

static const struct {
    const char *name, *other;
    int size;
    bool is_float;
} types[] = {
    {"char", "int8", 1, false},     {"uchar", "uint8", 1, false},   {"short", "int16", 2, false},
    {"ushort", "uint16", 2, false}, {"int", "int32", 4, false},     {"uint", "uint32", 4, false},
    {"float", "float32", 4, true},  {"double", "float64", 8, true},
};

static bool read_type(vshi_token token, int *size, bool *is_float, bool *is_signed) {
    for (size_t i = 0; i < sizeof types / sizeof types[0]; ++i) {
        if (vshi_token_is(token, types[i].name) || vshi_token_is(token, types[i].other)) {
            *size = types[i].size;
            *is_float = types[i].is_float;
            *is_signed = !types[i].is_float && types[i].name[0] != 'u';
            return true;
        }
    }
    return false;
}

static bool read_property(ply_header *header, const char *at, const char *end) {
    if (header->elements == 0 || header->properties == MAX_PROPERTIES) {
        return false;
    }
    const ply_element *element = &header->element[header->elements - 1];
    ply_property property = {0};
    bool ignored;
    vshi_token token = vshi_scan_token(&at, end);
    if (vshi_token_is(token, "list")) {
        if (!read_type(vshi_scan_token(&at, end), &property.count_size, &ignored, &property.is_signed) ||
            ignored) {
            return false;
        }
        token = vshi_scan_token(&at, end);
    }
    if (!read_type(token, &property.size, &property.is_float, &property.is_signed)) {
        return false;
    }
    const vshi_token name = vshi_scan_token(&at, end);
    property.is_position = strcmp(element->name, "vertex") == 0 && property.count_size == 0 &&
                           (vshi_token_is(name, "x") || vshi_token_is(name, "y") || vshi_token_is(name, "z"));
    property.is_corners = strcmp(element->name, "face") == 0 && property.count_size > 0 &&
                          (vshi_token_is(name, "vertex_index") || vshi_token_is(name, "vertex_indices"));
    header->property[header->properties++] = property;
    header->element[header->elements - 1].end = header->properties;
    return name.text != NULL;
}

static bool read_element(ply_header *header, const char *at, const char *end) {
    if (header->elements == MAX_ELEMENTS) {
        return false;
    }
    const vshi_token name = vshi_scan_token(&at, end);
    int64_t count;
    if (!vshi_token_integer(vshi_scan_token(&at, end), &count) || count < 0) {
        return false;
    }
    ply_element *element = &header->element[header->elements++];
    const size_t length = name.size < sizeof element->name ? name.size : sizeof element->name - 1;
    memcpy(element->name, name.text, length);
    element->name[length] = '\0';
    element->count = (uint64_t)count;
    if (vshi_token_is(name, "tristrips") && count > 0) {
        header->strips = header->elements - 1;
    }
    element->first = element->end = header->properties;
    return true;
}

static bool read_format(ply_header *header, const char *at, const char *end) {
    const vshi_token format = vshi_scan_token(&at, end);
    header->ascii = vshi_token_is(format, "ascii");
    header->big_endian = vshi_token_is(format, "binary_big_endian");
    return header->ascii || header->big_endian || vshi_token_is(format, "binary_little_endian");
}

/* Returns the body; NULL with the error filled where there is none. */
static const char *read_header(const vshi_scan *scan, ply_header *header, vsh_result *result,
                               vsh_error *error) {
    const char *at = scan->text, *end = scan->text + scan->size;
    for (size_t line = 1; at < end; ++line) {
        const char *stop = memchr(at, '\n', (size_t)(end - at));
        if (stop == NULL) {
            break;
        }
        const char *word = at;
        const vshi_token keyword = vshi_scan_token(&word, stop);
        bool good = true;
        if (line == 1) {
            good = vshi_token_is(keyword, "ply");
        } else if (vshi_token_is(keyword, "format")) {
            good = read_format(header, word, stop);
        } else if (vshi_token_is(keyword, "element")) {
            good = read_element(header, word, stop);
        } else if (vshi_token_is(keyword, "property")) {
            good = read_property(header, word, stop);
        } else if (vshi_token_is(keyword, "end_header")) {
            return stop + 1;
        }
        if (good && header->strips >= 0 && header->strips == header->elements - 1) {
            header->lines = header->lines != NULL ? header->lines : at;
            header->lines_end = stop + 1;
        }
        if (!good) {
            *result =
                vshi_fail(error, VSH_ERROR_INPUT, "%s: line %zu of the header is not understood: '%.*s'",
                          scan->path, line, stop - at < 60 ? (int)(stop - at) : 60, at);
            return NULL;
        }
        at = stop + 1;
    }
    *result = vshi_fail(error, VSH_ERROR_READ, "%s: cut short: the header has no 'end_header'", scan->path);
    return NULL;
}

/* Where the body is read, and which of its rows. */
typedef struct ply_cursor {
    vshi_scan *scan;
    const ply_header *header;
    const ply_element *element;
    uint64_t row;
    const char *at, *end;
} ply_cursor;

static vsh_result fail_short(const ply_cursor *c, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_READ, "%s: cut short: it ends in %s %llu of %llu", c->scan->path,
                     c->element->name, (unsigned long long)c->row, (unsigned long long)c->element->count);
}

static vsh_result fail_value(const ply_cursor *c, vshi_token token, const char *expected, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: %s %llu holds '%.*s', expected %s", c->scan->path,
                     c->element->name, (unsigned long long)c->row, VSHI_TOKEN_ARGS(token), expected);
}

static vsh_result read_ascii(ply_cursor *c, const ply_property *property, vsh_error *error) {
    int64_t values = 1;
    vshi_token token;
    if (property->count_size > 0) {
        token = vshi_scan_token(&c->at, c->end);
        if (token.text == NULL) {
            return fail_short(c, error);
        }
        if (!vshi_token_integer(token, &values) || values < 0) {
            return fail_value(c, token, "a list's length", error);
        }
    }
    for (int64_t i = 0; i < values; ++i) {
        token = vshi_scan_token(&c->at, c->end);
        if (token.text == NULL) {
            return fail_short(c, error);
        }
        const vshi_number number = vshi_token_number(token);
        if (number == VSHI_NUMBER_NONE || (number == VSHI_NUMBER_NOT_FINITE && property->is_position)) {
            return fail_value(c, token, "a finite number", error);
        }
        int64_t index;
        if (property->is_corners && (!vshi_token_integer(token, &index) || index < 0)) {
            return fail_value(c, token, "an index of a vertex", error);
        }
    }
    c->scan->faces += property->is_corners && values >= 3;
    return VSH_OK;
}

static vsh_result read_binary(ply_cursor *c, const ply_property *property, vsh_error *error) {
    uint64_t values = 1;
    if (property->count_size > 0) {
        if (c->end - c->at < property->count_size) {
            return fail_short(c, error);
        }
        values = vshi_scan_bytes(c->at, property->count_size, c->header->big_endian);
        c->at += property->count_size;
    }
    if (values > (uint64_t)(c->end - c->at) / (uint64_t)property->size) {
        return fail_short(c, error);
    }
    c->at += values * (uint64_t)property->size;
    c->scan->faces += property->is_corners && values >= 3;
    return VSH_OK;
}

/* Strips take the place of faces: there can be no others, and nothing but vertices in their rows. */
static vsh_result check_strips(const vshi_scan *scan, const ply_header *header, vsh_error *error) {
    const ply_element *strips = &header->element[header->strips];
    const ply_property *list = &header->property[strips->first];
    bool others = false;
    for (int e = 0; e < header->elements; ++e) {
        const char *name = header->element[e].name;
        others =
            others || strcmp(name, "face") == 0 || (e != header->strips && strcmp(name, "tristrips") == 0);
    }
    return strips->end == strips->first + 1 && list->count_size > 0 && !list->is_float && !others
               ? VSH_OK
               : vshi_fail(
                     error, VSH_ERROR_UNSUPPORTED,
                     "%s: its triangles are strips ('tristrips') that are no single list of indices, or "
                     "stand beside faces: save it with faces, from MeshLab or Blender",
                     scan->path);
}

static vsh_result scan_strips(ply_cursor *c, vsh_error *error) {
    const ply_header *header = c->header;
    const ply_property *list = &header->property[c->element->first];
    vshi_ply_strips *strips = &c->scan->strips;
    *strips = (vshi_ply_strips){.header = header->lines,
                                .header_end = header->lines_end,
                                .body = c->at,
                                .rows = c->element->count,
                                .count_size = list->count_size,
                                .index_size = list->size,
                                .is_signed = list->is_signed,
                                .ascii = header->ascii,
                                .big_endian = header->big_endian};
    for (int e = 0; e < header->elements; ++e) {
        const bool vertices = strcmp(header->element[e].name, "vertex") == 0;
        strips->vertices = vertices ? header->element[e].count : strips->vertices;
    }
    const vsh_result result = vshi_ply_strips_scan(strips, c->scan->path, c->end, error);
    c->at = result == VSH_OK ? strips->body_end : c->at;
    c->scan->faces += strips->triangles;
    return result;
}

vsh_result vshi_scan_ply(vshi_scan *scan, vsh_error *error) {
    ply_header header = {.strips = -1};
    vsh_result result = VSH_OK;
    const char *body = read_header(scan, &header, &result, error);
    if (body == NULL) {
        return result;
    }
    if (header.strips >= 0 && (result = check_strips(scan, &header, error)) != VSH_OK) {
        return result;
    }
    ply_cursor c = {scan, &header, NULL, 0, body, scan->text + scan->size};
    for (int e = 0; e < header.elements; ++e) {
        c.element = &header.element[e];
        if (c.element->first == c.element->end) {
            continue;
        }
        if (e == header.strips) {
            result = scan_strips(&c, error);
            if (result != VSH_OK) {
                return result;
            }
            continue;
        }
        for (c.row = 0; c.row < c.element->count; ++c.row) {
            for (int p = c.element->first; p < c.element->end; ++p) {
                result = header.ascii ? read_ascii(&c, &header.property[p], error)
                                      : read_binary(&c, &header.property[p], error);
                if (result != VSH_OK) {
                    return result;
                }
            }
            if (c.row % ROWS_A_POLL == 0 && vshi_scan_poll(scan, c.at)) {
                return vshi_job_fail_cancelled(scan->job, error);
            }
        }
    }
    return VSH_OK;
}
