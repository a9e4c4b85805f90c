/* PLY, ascii and binary of both orders (G. Turk, "The PLY polygon file format", 1994): the positions and
 * normals of the element `vertex`, whose rows are of one size; other properties and elements are passed over
 * or on. */
#include "cli/message.h"
#include "points.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { HEADER_MOST = 1 << 20 };

/* --- the header */

static int keep_line(cli_points_reader *reader, const char *line, size_t size) {
    char *more = reader->header_size + size + 1 < HEADER_MOST
                     ? realloc(reader->header, reader->header_size + size + 1)
                     : NULL;
    if (more == NULL) {
        return cli_usage("%s: a header of more than %d bytes", reader->source.name, HEADER_MOST);
    }
    memcpy(more + reader->header_size, line, size);
    reader->header = more;
    reader->header_size += size;
    reader->header[reader->header_size++] = '\n';
    return CLI_OK;
}

static int read_header(cli_points_reader *reader) {
    vshi_ply_header *h = &reader->ply;
    reader->vertex = -1;
    while (!h->ended) {
        const char *line;
        size_t size;
        int code = points_source_line(&reader->source, &line, &size);
        if (code == CLI_OK && line == NULL) {
            cli_say(h->lines == 0 ? "%s: no PLY: it is empty"
                                  : "%s: cut short: the header has no 'end_header'",
                    reader->source.name);
            return h->lines == 0 ? CLI_USAGE : CLI_FILE;
        }
        code = code == CLI_OK ? keep_line(reader, line, size) : code;
        if (code != CLI_OK) {
            return code;
        }
        const int before = h->elements;
        if (!vshi_ply_header_line(h, line, size)) {
            return cli_usage("%s: line %d of the header is not understood: '%.*s'", reader->source.name,
                             h->lines, size < 60 ? (int)size : 60, line);
        }
        if (h->elements > before && reader->vertex < 0 && strcmp(h->element[before].name, "vertex") == 0) {
            reader->vertex = before;
        }
        if (!h->ended && reader->vertex >= 0 && reader->vertex == h->elements - 1) {
            reader->header_insert = reader->header_size;
        }
    }
    return CLI_OK;
}

/* Where in a row positions and normals are. */
static int lay_row(cli_points_reader *reader, int normals) {
    static const char *const names[] = {"x", "y", "z", "nx", "ny", "nz"};
    const vshi_ply_header *h = &reader->ply;
    if (reader->vertex < 0) {
        return cli_usage("%s: it has no element 'vertex'", reader->source.name);
    }
    const vshi_ply_element *e = &h->element[reader->vertex];
    bool found[CLI_POINTS_SLOTS] = {false};
    reader->slot_of = malloc((size_t)(e->end - e->first) + 1);
    if (reader->slot_of == NULL) {
        cli_say("%s: the system refused memory", reader->source.name);
        return CLI_LIMIT;
    }
    for (int p = e->first; p < e->end; ++p) {
        const vshi_ply_property *property = &h->property[p];
        if (property->count_type >= 0) {
            return cli_usage("%s: property '%s' of its vertices is a list", reader->source.name,
                             property->name);
        }
        reader->slot_of[p - e->first] = -1;
        for (int i = 0; i < CLI_POINTS_SLOTS; ++i) {
            if (strcmp(property->name, names[i]) == 0 && !found[i]) {
                found[i] = true;
                reader->slot_of[p - e->first] = (int8_t)i;
                reader->offset[i] = (int)reader->row_size;
                reader->type[i] = property->type;
            }
        }
        reader->row_size += (size_t)vshi_ply_size(property->type);
    }
    reader->has_normals = normals != 0 && found[3] && found[4] && found[5];
    for (int i = 0; i < CLI_POINTS_NX; ++i) {
        if (!found[i]) {
            return cli_usage("%s: its vertices have no property '%s'", reader->source.name, names[i]);
        }
    }
    if (normals == 1 && !reader->has_normals) {
        return cli_usage("%s: its vertices have no normals", reader->source.name);
    }
    for (int p = e->first; p < e->end; ++p) {
        int8_t *slot = &reader->slot_of[p - e->first];
        *slot = *slot >= CLI_POINTS_NX && !reader->has_normals ? -1 : *slot;
    }
    reader->columns = reader->width = e->end - e->first;
    reader->floats = reader->type[0] != VSHI_PLY_DOUBLE && reader->type[1] != VSHI_PLY_DOUBLE &&
                     reader->type[2] != VSHI_PLY_DOUBLE;
    return CLI_OK;
}

/* --- rows */

static uint64_t bits_of(const char *bytes, int size, bool big_endian) {
    uint64_t bits = 0;
    for (int i = 0; i < size; ++i) {
        bits = bits << 8 | (unsigned char)bytes[big_endian ? i : size - 1 - i];
    }
    return bits;
}

static double number_of(const char *bytes, int type, bool big_endian) {
    const uint64_t bits = bits_of(bytes, vshi_ply_size(type), big_endian);
    const uint32_t low = (uint32_t)bits;
    float single;
    double wide;
    switch (type) {
    case 0:
        return (double)(int8_t)low;
    case 2:
        return (double)(int16_t)low;
    case 4:
        return (double)(int32_t)low;
    case VSHI_PLY_FLOAT:
        memcpy(&single, &low, sizeof single);
        return (double)single;
    case VSHI_PLY_DOUBLE:
        memcpy(&wide, &bits, sizeof wide);
        return wide;
    default:
        return (double)bits;
    }
}

static int fail_short(const cli_points_reader *reader, const vshi_ply_element *e, uint64_t row) {
    cli_say("%s: cut short: it ends in %s %" PRIu64 " of %" PRIu64, reader->source.name, e->name, row,
            e->count);
    return CLI_FILE;
}

/* Passes over a row of an element, or on to `to`. */
static int pass_row(cli_points_reader *reader, const vshi_ply_element *e, uint64_t row, FILE *to) {
    points_source *source = &reader->source;
    const char *bytes;
    size_t size = 0, available;
    int code = CLI_OK;
    if (reader->ply.ascii) {
        do {
            code = points_source_line(source, &bytes, &size);
        } while (code == CLI_OK && bytes != NULL && size == 0);
        if (code == CLI_OK && bytes == NULL) {
            return fail_short(reader, e, row);
        }
        if (code == CLI_OK && to != NULL) {
            fwrite(bytes, 1, size, to);
            putc('\n', to);
        }
        return code;
    }
    for (int p = e->first; p < e->end; ++p) {
        const vshi_ply_property *property = &reader->ply.property[p];
        uint64_t count = 1;
        if (property->count_type >= 0) {
            const size_t width = (size_t)vshi_ply_size(property->count_type);
            code = points_source_peek(source, size + width, &bytes, &available);
            if (code != CLI_OK || available < size + width) {
                return code != CLI_OK ? code : fail_short(reader, e, row);
            }
            count = bits_of(bytes + size, (int)width, reader->ply.big_endian);
            size += width;
        }
        size += count * (size_t)vshi_ply_size(property->type);
        code = points_source_peek(source, size, &bytes, &available);
        if (code != CLI_OK || available < size) {
            return code != CLI_OK ? code : fail_short(reader, e, row);
        }
    }
    if (to != NULL && size > 0) {
        fwrite(bytes, 1, size, to);
    }
    points_source_take(source, size);
    return code;
}

static int pass_element(cli_points_reader *reader, int number, FILE *to) {
    const vshi_ply_element *e = &reader->ply.element[number];
    int code = CLI_OK;
    for (uint64_t row = 0; code == CLI_OK && e->first < e->end && row < e->count; ++row) {
        code = pass_row(reader, e, row, to);
    }
    return code;
}

int points_ply_open(cli_points_reader *reader, int normals) {
    reader->delimiter = ' ';
    int code = read_header(reader);
    code = code == CLI_OK ? lay_row(reader, normals) : code;
    for (int e = 0; e < reader->vertex && code == CLI_OK; ++e) {
        code = pass_element(reader, e, NULL);
    }
    return code;
}

int points_ply_row(cli_points_reader *reader, cli_points *points, bool *end) {
    const vshi_ply_header *h = &reader->ply;
    const vshi_ply_element *e = &h->element[reader->vertex];
    const char *bytes;
    size_t size = reader->row_size, available = 0;
    *end = reader->rows == e->count;
    if (*end) {
        return CLI_OK;
    }
    int code;
    if (h->ascii) {
        do {
            code = points_source_line(&reader->source, &bytes, &size);
        } while (code == CLI_OK && bytes != NULL && size == 0);
        if (code == CLI_OK && bytes == NULL) {
            return fail_short(reader, e, reader->rows);
        }
        return code == CLI_OK ? points_text_row(reader, bytes, size, points) : code;
    }
    code = points_source_peek(&reader->source, size, &bytes, &available);
    if (code != CLI_OK || available < size) {
        return code != CLI_OK ? code : fail_short(reader, e, reader->rows);
    }
    double slot[CLI_POINTS_SLOTS] = {0};
    for (int i = 0; i < (reader->has_normals ? CLI_POINTS_SLOTS : CLI_POINTS_NX); ++i) {
        slot[i] = number_of(bytes + reader->offset[i], reader->type[i], h->big_endian);
    }
    code = points_check_row(reader, slot);
    code = code == CLI_OK ? points_take_row(reader, slot, bytes, size, points) : code;
    points_source_take(&reader->source, size);
    return code;
}

int points_ply_rest(cli_points_reader *reader, FILE *to) {
    int code = CLI_OK;
    for (int e = reader->vertex + 1; e < reader->ply.elements && code == CLI_OK; ++e) {
        code = pass_element(reader, e, to);
    }
    return code;
}

bool cli_points_can_keep(const cli_points_reader *reader) {
    return reader->format != CLI_POINTS_PLY || reader->vertex == 0;
}
