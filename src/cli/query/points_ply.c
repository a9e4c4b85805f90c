/* PLY, ascii and binary of both orders (G. Turk, "The PLY polygon file format", 1994): the positions and
 * normals of the element `vertex`, whose rows are of one size; other properties and elements are passed over
 * or on. */
#include "cli/message.h"
#include "points.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TYPE_FLOAT = 6, TYPE_DOUBLE = 7, HEADER_MOST = 1 << 20 };

static const struct {
    const char *name, *other;
    int size;
} types[] = {
    {"char", "int8", 1}, {"uchar", "uint8", 1}, {"short", "int16", 2},   {"ushort", "uint16", 2},
    {"int", "int32", 4}, {"uint", "uint32", 4}, {"float", "float32", 4}, {"double", "float64", 8},
};

static int type_of(const char *name) {
    for (int i = 0; i < 8; ++i) {
        if (strcmp(name, types[i].name) == 0 || strcmp(name, types[i].other) == 0) {
            return i;
        }
    }
    return -1;
}

/* --- the header */

static bool read_property(ply_header *h, int words, char word[][64]) {
    if (h->elements == 0 || h->properties == PLY_MAX_PROPERTIES) {
        return false;
    }
    ply_property *p = &h->property[h->properties++];
    const bool list = words == 5 && strcmp(word[1], "list") == 0;
    if (!list && words != 3) {
        return false;
    }
    p->count_type = (int8_t)(list ? type_of(word[2]) : -1);
    p->type = (int8_t)type_of(word[list ? 3 : 1]);
    memcpy(p->name, word[words - 1], sizeof p->name);
    h->element[h->elements - 1].end = h->properties;
    return p->type >= 0 && (!list || (p->count_type >= 0 && p->count_type < TYPE_FLOAT));
}

static bool read_element(ply_header *h, int words, char word[][64]) {
    char *end = NULL;
    if (words != 3 || h->elements == PLY_MAX_ELEMENTS || word[2][0] < '0' || word[2][0] > '9') {
        return false;
    }
    ply_element *e = &h->element[h->elements];
    memcpy(e->name, word[1], sizeof e->name);
    e->count = strtoull(word[2], &end, 10);
    e->first = e->end = h->properties;
    if (strcmp(e->name, "vertex") == 0 && h->vertex < 0) {
        h->vertex = h->elements;
    }
    ++h->elements;
    return *end == '\0' && strlen(word[2]) < 19;
}

static bool read_format(ply_header *h, int words, char word[][64]) {
    h->ascii = words == 3 && strcmp(word[1], "ascii") == 0;
    h->big_endian = words == 3 && strcmp(word[1], "binary_big_endian") == 0;
    return h->ascii || h->big_endian || (words == 3 && strcmp(word[1], "binary_little_endian") == 0);
}

/* Words of a line, up to 5 of 63 letters; more or longer ones make it 6. */
static int split(const char *line, size_t size, char word[5][64]) {
    int words = 0;
    for (size_t i = 0; i < size;) {
        if (line[i] == ' ' || line[i] == '\t') {
            ++i;
            continue;
        }
        size_t length = 0;
        while (i + length < size && line[i + length] != ' ' && line[i + length] != '\t') {
            ++length;
        }
        if (words == 5 || length > 63) {
            return 6;
        }
        memcpy(word[words], line + i, length);
        word[words++][length] = '\0';
        i += length;
    }
    return words;
}

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
    ply_header *h = &reader->ply;
    h->vertex = -1;
    for (int number = 1;; ++number) {
        const char *line;
        size_t size;
        char word[5][64] = {""};
        int code = points_source_line(&reader->source, &line, &size);
        if (code == CLI_OK && line == NULL) {
            cli_say(number == 1 ? "%s: no PLY: it is empty" : "%s: cut short: the header has no 'end_header'",
                    reader->source.name);
            return number == 1 ? CLI_USAGE : CLI_FILE;
        }
        code = code == CLI_OK ? keep_line(reader, line, size) : code;
        if (code != CLI_OK) {
            return code;
        }
        const int words = split(line, size, word);
        bool good = true;
        if (number == 1) {
            good = words == 1 && strcmp(word[0], "ply") == 0;
        } else if (strcmp(word[0], "format") == 0) {
            good = read_format(h, words, word);
        } else if (strcmp(word[0], "element") == 0) {
            good = read_element(h, words, word);
        } else if (strcmp(word[0], "property") == 0) {
            good = read_property(h, words, word);
        } else if (strcmp(word[0], "end_header") == 0) {
            return CLI_OK;
        }
        if (!good) {
            return cli_usage("%s: line %d of the header is not understood: '%.*s'", reader->source.name,
                             number, size < 60 ? (int)size : 60, line);
        }
        if (h->vertex >= 0 && h->vertex == h->elements - 1) {
            reader->header_insert = reader->header_size;
        }
    }
}

/* Where in a row positions and normals are. */
static int lay_row(cli_points_reader *reader, int normals) {
    static const char *const names[] = {"x", "y", "z", "nx", "ny", "nz"};
    ply_header *h = &reader->ply;
    if (h->vertex < 0) {
        return cli_usage("%s: it has no element 'vertex'", reader->source.name);
    }
    const ply_element *e = &h->element[h->vertex];
    bool found[CLI_POINTS_SLOTS] = {false};
    reader->slot_of = malloc((size_t)(e->end - e->first) + 1);
    if (reader->slot_of == NULL) {
        cli_say("%s: the system refused memory", reader->source.name);
        return CLI_LIMIT;
    }
    for (int p = e->first; p < e->end; ++p) {
        const ply_property *property = &h->property[p];
        if (property->count_type >= 0) {
            return cli_usage("%s: property '%s' of its vertices is a list", reader->source.name,
                             property->name);
        }
        reader->slot_of[p - e->first] = -1;
        for (int i = 0; i < CLI_POINTS_SLOTS; ++i) {
            if (strcmp(property->name, names[i]) == 0 && !found[i]) {
                found[i] = true;
                reader->slot_of[p - e->first] = (int8_t)i;
                h->offset[i] = (int)h->row_size;
                h->type[i] = property->type;
            }
        }
        h->row_size += (size_t)types[property->type].size;
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
    reader->floats = h->type[0] != TYPE_DOUBLE && h->type[1] != TYPE_DOUBLE && h->type[2] != TYPE_DOUBLE;
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
    const uint64_t bits = bits_of(bytes, types[type].size, big_endian);
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
    case TYPE_FLOAT:
        memcpy(&single, &low, sizeof single);
        return (double)single;
    case TYPE_DOUBLE:
        memcpy(&wide, &bits, sizeof wide);
        return wide;
    default:
        return (double)bits;
    }
}

static int fail_short(const cli_points_reader *reader, const ply_element *e, uint64_t row) {
    cli_say("%s: cut short: it ends in %s %" PRIu64 " of %" PRIu64, reader->source.name, e->name, row,
            e->count);
    return CLI_FILE;
}

/* Passes over a row of an element, or on to `to`. */
static int pass_row(cli_points_reader *reader, const ply_element *e, uint64_t row, FILE *to) {
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
        const ply_property *property = &reader->ply.property[p];
        uint64_t count = 1;
        if (property->count_type >= 0) {
            const size_t width = (size_t)types[property->count_type].size;
            code = points_source_peek(source, size + width, &bytes, &available);
            if (code != CLI_OK || available < size + width) {
                return code != CLI_OK ? code : fail_short(reader, e, row);
            }
            count = bits_of(bytes + size, (int)width, reader->ply.big_endian);
            size += width;
        }
        size += count * (size_t)types[property->type].size;
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
    const ply_element *e = &reader->ply.element[number];
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
    for (int e = 0; e < reader->ply.vertex && code == CLI_OK; ++e) {
        code = pass_element(reader, e, NULL);
    }
    return code;
}

int points_ply_row(cli_points_reader *reader, cli_points *points, bool *end) {
    const ply_header *h = &reader->ply;
    const ply_element *e = &h->element[h->vertex];
    const char *bytes;
    size_t size = h->row_size, available = 0;
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
        slot[i] = number_of(bytes + h->offset[i], h->type[i], h->big_endian);
    }
    code = points_check_row(reader, slot);
    code = code == CLI_OK ? points_take_row(reader, slot, bytes, size, points) : code;
    points_source_take(&reader->source, size);
    return code;
}

int points_ply_rest(cli_points_reader *reader, FILE *to) {
    int code = CLI_OK;
    for (int e = reader->ply.vertex + 1; e < reader->ply.elements && code == CLI_OK; ++e) {
        code = pass_element(reader, e, to);
    }
    return code;
}

bool cli_points_can_keep(const cli_points_reader *reader) {
    return reader->format != CLI_POINTS_PLY || reader->ply.vertex == 0;
}
