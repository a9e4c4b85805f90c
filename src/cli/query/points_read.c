/* Rows of points: what the formats share, CSV, and raw floats. */
#include "base/decimal.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/signals.h"
#include "points.h"

#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum {
    TOLD = 5,     /* bad rows that are told one by one */
    POLL = 65536, /* rows between looks at an interrupt */
    RAW_COLUMN = sizeof(float)
};

static const char *const format_names[] = {"csv", "ply", "raw"};

static const struct {
    const char *ending;
    int32_t format;
} endings[] = {
    {"csv", CLI_POINTS_CSV}, {"tsv", CLI_POINTS_CSV}, {"txt", CLI_POINTS_CSV}, {"xyz", CLI_POINTS_CSV},
    {"ply", CLI_POINTS_PLY}, {"raw", CLI_POINTS_RAW}, {"f32", CLI_POINTS_RAW}, {"bin", CLI_POINTS_RAW},
};

int32_t cli_points_format(const char *name) {
    for (int32_t i = 0; i < 3; ++i) {
        if (strcmp(name, format_names[i]) == 0) {
            return i;
        }
    }
    return -1;
}

const char *cli_points_format_name(int32_t format) {
    return format >= 0 && format < 3 ? format_names[format] : NULL;
}

int32_t cli_points_format_of_path(const char *path) {
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; ++i) {
        if (cli_has_ending(path, endings[i].ending)) {
            return endings[i].format;
        }
    }
    return -1;
}

/* --- batches */

size_t cli_points_bytes(bool normals, bool keep) {
    return 3 * sizeof(double) + (normals ? 3 * sizeof(float) : 0) + sizeof(uint32_t) +
           (keep ? sizeof(size_t) : 0);
}

int cli_points_create(size_t room, bool normals, bool keep, cli_points *points) {
    *points = (cli_points){.room = room};
    points->positions = malloc(room * 3 * sizeof *points->positions);
    points->normals = normals ? malloc(room * 3 * sizeof *points->normals) : NULL;
    points->texels = malloc(room * sizeof *points->texels);
    points->kept_end = keep ? malloc(room * sizeof *points->kept_end) : NULL;
    if (points->positions == NULL || points->texels == NULL || (normals && points->normals == NULL) ||
        (keep && points->kept_end == NULL)) {
        cli_points_free(points);
        cli_say("points: the system refused memory");
        return CLI_LIMIT;
    }
    return CLI_OK;
}

void cli_points_free(cli_points *points) {
    free(points->positions);
    free(points->normals);
    free(points->texels);
    free(points->kept);
    free(points->kept_end);
    *points = (cli_points){0};
}

int points_bad(cli_points_reader *reader, const char *format, ...) {
    char why[160];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(why, sizeof why, format, arguments);
    va_end(arguments);
    ++reader->bad;
    if (reader->bad <= TOLD || reader->strict) {
        cli_say("%s: row %" PRIu64 ": %s", reader->source.name, reader->rows + 1, why);
    }
    return reader->strict ? CLI_USAGE : CLI_OK;
}

static int keep_row(cli_points *points, const char *raw, size_t size) {
    if (points->kept_size + size > points->kept_room) {
        const size_t room = 2 * (points->kept_size + size) + 4096;
        char *more = realloc(points->kept, room);
        if (more == NULL) {
            cli_say("points: the system refused memory");
            return CLI_LIMIT;
        }
        points->kept = more;
        points->kept_room = room;
    }
    memcpy(points->kept + points->kept_size, raw, size);
    points->kept_size += size;
    points->kept_end[points->count] = points->kept_size;
    return CLI_OK;
}

int points_take_row(cli_points_reader *reader, const double slot[CLI_POINTS_SLOTS], const char *raw,
                    size_t size, cli_points *points) {
    double *p = points->positions + 3 * points->count;
    memcpy(p, slot, 3 * sizeof *p);
    if (points->normals != NULL) {
        for (int axis = 0; axis < 3; ++axis) {
            points->normals[3 * points->count + (size_t)axis] = (float)slot[CLI_POINTS_NX + axis];
        }
    }
    points->texels[points->count] = (uint32_t)reader->rows;
    const int code = points->kept_end != NULL ? keep_row(points, raw, size) : CLI_OK;
    ++points->count;
    ++reader->rows;
    return code;
}

int points_check_row(cli_points_reader *reader, const double slot[CLI_POINTS_SLOTS]) {
    static const char *const names[] = {"x", "y", "z", "nx", "ny", "nz"};
    const int slots = reader->has_normals ? CLI_POINTS_SLOTS : CLI_POINTS_NX;
    bool zero = reader->has_normals;
    for (int i = 0; i < slots; ++i) {
        if (!isfinite(slot[i])) {
            return points_bad(reader, "%s is not finite", names[i]);
        }
        if (i >= CLI_POINTS_NX && fabs(slot[i]) > 3.4028234663852886e38) {
            return points_bad(reader, "%s is beyond the range of floats", names[i]);
        }
        zero = zero && (i < CLI_POINTS_NX || (float)slot[i] == 0.0f);
    }
    return zero ? points_bad(reader, "the normal is zero") : CLI_OK;
}

/* --- text */

typedef struct field {
    const char *text, *end;
} field;

static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v';
}

/* The field at *at, without blanks and quotes around it; *at moves behind its delimiter, and past `end`
 * behind the last. */
static field next_field(const char **at, const char *end, char delimiter) {
    const char *c = *at;
    while (c < end && is_blank(*c) && *c != delimiter) {
        ++c;
    }
    if (delimiter == ' ') {
        while (c < end && is_blank(*c)) {
            ++c;
        }
    }
    field f = {c, c};
    if (c < end && *c == '"') {
        ++c;
        const char *close = memchr(c, '"', (size_t)(end - c));
        f = (field){c, close != NULL ? close : end};
        c = f.end;
    }
    while (c < end && (delimiter == ' ' ? !is_blank(*c) : *c != delimiter)) {
        ++c;
    }
    if (f.end == f.text) {
        f.end = c;
        while (f.end > f.text && is_blank(f.end[-1])) {
            --f.end;
        }
    }
    *at = c + 1;
    if (delimiter == ' ') {
        while (c < end && is_blank(*c)) {
            ++c;
        }
        *at = c < end ? c : end + 1;
    }
    return f;
}

int points_text_row(cli_points_reader *reader, const char *line, size_t size, cli_points *points) {
    double slot[CLI_POINTS_SLOTS] = {NAN, NAN, NAN, NAN, NAN, NAN};
    const char *at = line, *end = line + size;
    int code = CLI_OK;
    bool good = true;
    int missing = 0;
    for (int column = 0; column < reader->columns && good; ++column) {
        if (at > end) {
            code = points_bad(reader, "%d columns, expected at least %d", column, reader->columns);
            good = false;
            missing = reader->width - column;
            break;
        }
        const field f = next_field(&at, end, reader->delimiter);
        const int which = reader->slot_of[column];
        if (which >= 0 && !vshi_decimal_read(f.text, f.end, &slot[which])) {
            const int shown = f.end - f.text < 40 ? (int)(f.end - f.text) : 40;
            code = points_bad(reader, "column %d is '%.*s', expected a number", column + 1, shown, f.text);
            good = false;
        }
    }
    if (good) {
        code = points_check_row(reader, slot);
    } else {
        for (int i = 0; i < CLI_POINTS_SLOTS; ++i) {
            slot[i] = (double)NAN;
        }
    }
    code = code == CLI_OK ? points_take_row(reader, slot, line, size, points) : code;
    for (; code == CLI_OK && missing > 0 && points->kept_end != NULL; --missing) {
        --points->count; /* once more, so that answers stay in their columns */
        const char filler[] = {reader->delimiter, 'n', 'a', 'n'};
        code = keep_row(points, filler, reader->delimiter == ' ' ? sizeof filler : 1);
        ++points->count;
    }
    return code;
}

static bool is_empty(const char *line, size_t size) {
    while (size > 0 && is_blank(*line)) {
        ++line;
        --size;
    }
    return size == 0 || *line == '#';
}

/* What stands between columns: the first of these that the line holds. */
static char delimiter_of(const char *line, size_t size) {
    static const char delimiters[] = {';', ',', '\t'};
    for (size_t i = 0; i < sizeof delimiters; ++i) {
        if (memchr(line, delimiters[i], size) != NULL) {
            return delimiters[i];
        }
    }
    return ' ';
}

static int slot_of_name(field f) {
    static const char *const names[] = {"x", "y", "z", "nx", "ny", "nz"};
    for (int i = 0; i < CLI_POINTS_SLOTS; ++i) {
        if (strlen(names[i]) == (size_t)(f.end - f.text) &&
            strncasecmp(names[i], f.text, (size_t)(f.end - f.text)) == 0) {
            return i;
        }
    }
    return -1;
}

/* Columns by the names of a header, or by their order. */
static int lay_columns(cli_points_reader *reader, const char *line, size_t size, bool named, int normals) {
    int count = 0;
    for (const char *at = line; at <= line + size; next_field(&at, line + size, reader->delimiter)) {
        ++count;
    }
    reader->width = count;
    reader->slot_of = calloc((size_t)count + CLI_POINTS_SLOTS, 1);
    if (reader->slot_of == NULL) {
        cli_say("%s: the system refused memory", reader->source.name);
        return CLI_LIMIT;
    }
    bool found[CLI_POINTS_SLOTS] = {false};
    const char *at = line;
    for (int column = 0; column < count; ++column) {
        const field f = next_field(&at, line + size, reader->delimiter);
        const int slot = named ? slot_of_name(f) : column < CLI_POINTS_SLOTS ? column : -1;
        const bool fresh = slot >= 0 && !found[slot];
        reader->slot_of[column] = (int8_t)(fresh ? slot : -1);
        if (fresh) {
            found[slot] = true;
        }
    }
    reader->has_normals = normals != 0 && found[3] && found[4] && found[5];
    if (!named) { /* the first row may be a bad one */
        reader->has_normals = normals == 1 || reader->has_normals;
        for (int i = 0; i < CLI_POINTS_SLOTS; ++i) {
            reader->slot_of[i] = (int8_t)i;
        }
        count = CLI_POINTS_SLOTS;
    } else if (!found[0] || !found[1] || !found[2]) {
        return cli_usage("%s: the header names no column %s", reader->source.name,
                         !found[0]   ? "x"
                         : !found[1] ? "y"
                                     : "z");
    } else if (normals == 1 && !reader->has_normals) {
        return cli_usage("%s: the header names no columns nx, ny, nz", reader->source.name);
    }
    for (int column = 0; column < count; ++column) {
        if (reader->slot_of[column] >= CLI_POINTS_NX && !reader->has_normals) {
            reader->slot_of[column] = -1;
        }
        if (reader->slot_of[column] >= 0) {
            reader->columns = column + 1;
        }
    }
    return CLI_OK;
}

static bool has_number(const char *line, size_t size, char delimiter) {
    const char *at = line;
    while (at <= line + size) {
        const field f = next_field(&at, line + size, delimiter);
        double value;
        if (vshi_decimal_read(f.text, f.end, &value)) {
            return true;
        }
    }
    return false;
}

int points_csv_open(cli_points_reader *reader, int normals) {
    points_source *source = &reader->source;
    const char *line;
    size_t size, available;
    int code = points_source_peek(source, 3, &line, &available);
    if (code == CLI_OK && available == 3 && memcmp(line, "\xef\xbb\xbf", 3) == 0) {
        points_source_take(source, 3);
    }
    /* the line stays, unless it is a header */
    do {
        code = code == CLI_OK ? points_source_line(source, &line, &size) : code;
        if (code != CLI_OK || line == NULL) {
            reader->has_normals = normals == 1;
            return code;
        }
    } while (is_empty(line, size));
    reader->delimiter = delimiter_of(line, size);
    const bool named = !has_number(line, size, reader->delimiter);
    if (named) {
        reader->header = malloc(size + 1);
        if (reader->header == NULL) {
            cli_say("%s: the system refused memory", source->name);
            return CLI_LIMIT;
        }
        memcpy(reader->header, line, size);
        reader->header_size = size;
    } else {
        const size_t before = (size_t)(line - source->buffer);
        source->taken -= source->begin - before;
        source->begin = before;
    }
    return lay_columns(reader, line, size, named, normals);
}

static int csv_row(cli_points_reader *reader, cli_points *points, bool *end) {
    const char *line;
    size_t size;
    const int code = points_source_line(&reader->source, &line, &size);
    *end = code == CLI_OK && line == NULL;
    if (code != CLI_OK || *end || is_empty(line, size)) {
        return code;
    }
    return points_text_row(reader, line, size, points);
}

/* --- raw floats, little endian */

static int raw_row(cli_points_reader *reader, cli_points *points, bool *end) {
    const size_t columns = reader->has_normals ? CLI_POINTS_SLOTS : CLI_POINTS_NX;
    const size_t size = columns * RAW_COLUMN;
    const char *bytes;
    size_t available;
    int code = points_source_peek(&reader->source, size, &bytes, &available);
    *end = code == CLI_OK && available == 0;
    if (code != CLI_OK || *end) {
        return code;
    }
    if (available < size) {
        cli_say("%s: cut short: row %" PRIu64 " has %zu bytes of %zu", reader->source.name, reader->rows + 1,
                available, size);
        return CLI_FILE;
    }
    double slot[CLI_POINTS_SLOTS] = {0};
    for (size_t i = 0; i < columns; ++i) {
        const unsigned char *b = (const unsigned char *)bytes + RAW_COLUMN * i;
        const uint32_t bits = b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
        float value;
        memcpy(&value, &bits, sizeof value);
        slot[i] = (double)value;
    }
    code = points_check_row(reader, slot);
    code = code == CLI_OK ? points_take_row(reader, slot, bytes, size, points) : code;
    points_source_take(&reader->source, size);
    return code;
}

/* --- any of them */

int cli_points_open(const char *path, int32_t format, int normals, bool strict, cli_points_reader *reader) {
    *reader = (cli_points_reader){.format = format, .strict = strict, .delimiter = ','};
    int code = points_source_open(path, &reader->source);
    if (code != CLI_OK) {
        return code;
    }
    switch (format) {
    case CLI_POINTS_CSV:
        return points_csv_open(reader, normals);
    case CLI_POINTS_PLY:
        return points_ply_open(reader, normals);
    default:
        reader->has_normals = normals == 1;
        reader->floats = true;
        return CLI_OK;
    }
}

int cli_points_read(cli_points_reader *reader, size_t most_kept, cli_points *points) {
    points->count = 0;
    points->kept_size = 0;
    points->first = reader->rows;
    int code = CLI_OK;
    bool end = false;
    while (code == CLI_OK && !end && points->count < points->room && points->kept_size <= most_kept) {
        code = reader->format == CLI_POINTS_CSV   ? csv_row(reader, points, &end)
               : reader->format == CLI_POINTS_PLY ? points_ply_row(reader, points, &end)
                                                  : raw_row(reader, points, &end);
        if (points->count % POLL == 0 && cli_interrupted()) {
            const vsh_error cancelled = {VSH_ERROR_CANCELLED, ""};
            return cli_fail(&cancelled);
        }
    }
    return code;
}

void cli_points_close(cli_points_reader *reader) {
    points_source_close(&reader->source);
    free(reader->header);
    free(reader->slot_of);
    reader->header = NULL;
    reader->slot_of = NULL;
}
