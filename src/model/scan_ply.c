/* PLY: the body holds all that the header announces, and positions are finite. Assimp 5.2 repeats the last
 * face where a file ends early, and takes memory for whatever number the header names. */
#include "base/bytes.h"
#include "base/try.h"
#include "model/scan.h"
#include "table/ply.h"

#include <string.h>

enum { ROWS_A_POLL = 4096 };

typedef struct ply_property {
    int size;       /* bytes */
    int count_size; /* bytes of a list's count; 0: no list */
    bool is_float;
    bool is_signed;   /* whole numbers */
    bool is_position; /* x, y or z of a vertex */
    bool is_corners;  /* the list of a face's vertices */
} ply_property;

typedef struct ply_header {
    vshi_ply_header head;
    ply_property property[VSHI_PLY_PROPERTIES];
    int strips;        /* the element of triangle strips; -1: none */
    const char *lines; /* that the strips' element is described in */
    const char *lines_end;
} ply_header;

/* What the properties of an element are to us. */
static void describe(ply_header *header, const vshi_ply_element *element) {
    const bool vertex = strcmp(element->name, "vertex") == 0, face = strcmp(element->name, "face") == 0;
    for (int p = element->first; p < element->end; ++p) {
        const vshi_ply_property *from = &header->head.property[p];
        const bool list = from->count_type >= 0;
        const char *name = from->name;
        header->property[p] = (ply_property){
            .size = vshi_ply_size(from->type),
            .count_size = list ? vshi_ply_size(from->count_type) : 0,
            .is_float = from->type >= VSHI_PLY_FLOAT,
            .is_signed = from->type < VSHI_PLY_FLOAT && from->type % 2 == 0,
            .is_position = vertex && !list && name[0] >= 'x' && name[0] <= 'z' && name[1] == '\0',
            .is_corners =
                face && list && (strcmp(name, "vertex_index") == 0 || strcmp(name, "vertex_indices") == 0),
        };
    }
}

static vsh_result read_header(const vshi_scan *scan, ply_header *header, const char **body,
                              vsh_error *error) {
    const char *at = scan->text, *end = scan->text + scan->size;
    vshi_ply_header *head = &header->head;
    while (!head->ended) {
        const char *stop = at < end ? memchr(at, '\n', (size_t)(end - at)) : NULL;
        if (stop == NULL) {
            return vshi_ply_fail_header(scan->path, error);
        }
        VSHI_TRY(vshi_ply_header_line(head, scan->path, at, (size_t)(stop - at), error));
        const vshi_ply_element *last = head->elements > 0 ? &head->element[head->elements - 1] : NULL;
        if (last != NULL && last->count > 0 && strcmp(last->name, "tristrips") == 0) {
            header->strips = head->elements - 1;
        }
        if (!head->ended && header->strips >= 0 && header->strips == head->elements - 1) {
            header->lines = header->lines != NULL ? header->lines : at;
            header->lines_end = stop + 1;
        }
        at = stop + 1;
    }
    for (int e = 0; e < head->elements; ++e) {
        describe(header, &head->element[e]);
    }
    *body = at;
    return VSH_OK;
}

/* Where the body is read, and which of its rows. */
typedef struct ply_cursor {
    vshi_scan *scan;
    const ply_header *header;
    const vshi_ply_element *element;
    uint64_t row;
    const char *at, *end;
} ply_cursor;

static vsh_result fail_short(const ply_cursor *c, vsh_error *error) {
    return vshi_ply_fail_short(c->scan->path, c->element, c->row, error);
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
        values = vshi_bytes_number(c->at, property->count_size, c->header->head.big_endian);
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
    const vshi_ply_element *strips = &header->head.element[header->strips];
    const ply_property *list = &header->property[strips->first];
    bool others = false;
    for (int e = 0; e < header->head.elements; ++e) {
        const char *name = header->head.element[e].name;
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
                                .ascii = header->head.ascii,
                                .big_endian = header->head.big_endian};
    for (int e = 0; e < header->head.elements; ++e) {
        const bool vertices = strcmp(header->head.element[e].name, "vertex") == 0;
        strips->vertices = vertices ? header->head.element[e].count : strips->vertices;
    }
    const vsh_result result = vshi_ply_strips_scan(strips, c->scan->path, c->end, error);
    c->at = result == VSH_OK ? strips->body_end : c->at;
    c->scan->faces += strips->triangles;
    return result;
}

static vsh_result scan_element(ply_cursor *c, vsh_error *error) {
    const ply_header *header = c->header;
    for (c->row = 0; c->row < c->element->count; ++c->row) {
        for (int p = c->element->first; p < c->element->end; ++p) {
            VSHI_TRY(header->head.ascii ? read_ascii(c, &header->property[p], error)
                                        : read_binary(c, &header->property[p], error));
        }
        if (c->row % ROWS_A_POLL == 0 && vshi_scan_poll(c->scan, c->at)) {
            return vshi_job_fail_cancelled(c->scan->job, error);
        }
    }
    return VSH_OK;
}

vsh_result vshi_scan_ply(vshi_scan *scan, vsh_error *error) {
    ply_header header = {.strips = -1};
    ply_cursor c = {.scan = scan, .header = &header, .end = scan->text + scan->size};
    VSHI_TRY(read_header(scan, &header, &c.at, error));
    if (header.strips >= 0) {
        VSHI_TRY(check_strips(scan, &header, error));
    }
    for (int e = 0; e < header.head.elements; ++e) {
        c.element = &header.head.element[e];
        if (c.element->first < c.element->end) {
            VSHI_TRY(e == header.strips ? scan_strips(&c, error) : scan_element(&c, error));
        }
    }
    return VSH_OK;
}
