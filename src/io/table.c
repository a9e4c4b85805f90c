/* Tables of numbers: CSV, raw floats, and PLY, ascii and binary of both orders (G. Turk, "The PLY polygon
 * file format", 1994). */
#include "io/table.h"

#include "base/decimal.h"
#include "base/file.h"
#include "base/memory.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

/* --- bytes */

enum { ROOM = 1 << 18, MOST = 1 << 26 /* bytes of a line or run */ };

static vsh_result open_standard(vshi_source *source, vsh_error *error) {
    struct stat status;
    if (fstat(STDIN_FILENO, &status) != 0 || S_ISDIR(status.st_mode)) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: it is a folder", source->name);
    }
    source->size = S_ISREG(status.st_mode) ? (uint64_t)status.st_size : 0;
    return VSH_OK;
}

vsh_result vshi_source_open(const char *path, uint64_t most, vshi_source *source, vsh_error *error) {
    *source = (vshi_source){.name = path != NULL ? path : "standard input", .room = ROOM};
    VSHI_TRY(path != NULL ? vshi_input_open(path, path, most, &source->file, &source->size, error)
                          : open_standard(source, error));
    source->buffer = malloc(source->room);
    return source->buffer != NULL ? VSH_OK : vshi_fail_memory(error, source->name);
}

void vshi_source_close(vshi_source *source) {
    if (source->file != NULL) {
        fclose(source->file);
    }
    free(source->buffer);
    source->buffer = NULL;
    source->file = NULL;
}

/* Reads more bytes. The bytes in the buffer may move. */
static vsh_result fill_buffer(vshi_source *s, vsh_error *error) {
    if (s->begin > 0 && s->end == s->room) {
        memmove(s->buffer, s->buffer + s->begin, s->end - s->begin);
        s->end -= s->begin;
        s->begin = 0;
    }
    if (s->end == s->room) {
        char *more = s->room < MOST ? realloc(s->buffer, 2 * s->room) : NULL;
        if (more == NULL) {
            return vshi_fail(error, s->room < MOST ? VSH_ERROR_MEMORY : VSH_ERROR_INPUT,
                             "%s: a row of more than %zu bytes", s->name, s->room);
        }
        s->buffer = more;
        s->room *= 2;
    }
    ssize_t got;
    do {
        got = read(s->file != NULL ? fileno(s->file) : STDIN_FILENO, s->buffer + s->end, s->room - s->end);
    } while (got < 0 && errno == EINTR);
    if (got < 0) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", s->name, strerror(errno));
    }
    s->ended = got == 0;
    s->end += (size_t)got;
    return s->job != NULL ? vshi_job_step(s->job, (size_t)got, error) : VSH_OK;
}

static void skip_bytes(vshi_source *s, size_t size) {
    s->begin += size;
    s->taken += size;
}

vsh_result vshi_source_line(vshi_source *s, const char **line, size_t *size, vsh_error *error) {
    *line = NULL;
    for (size_t searched = 0;;) {
        char *start = s->buffer + s->begin;
        const size_t held = s->end - s->begin;
        const char *stop = memchr(start + searched, '\n', held - searched);
        if (stop != NULL || (s->ended && held > 0)) {
            const size_t length = stop != NULL ? (size_t)(stop - start) : held;
            skip_bytes(s, length + (stop != NULL));
            *line = start;
            *size = length - (length > 0 && start[length - 1] == '\r');
            return VSH_OK;
        }
        if (s->ended) {
            return VSH_OK;
        }
        searched = held;
        VSHI_TRY(fill_buffer(s, error));
    }
}

/* Finds the next `size` bytes without skipping them. *available is less at the end only. Errors:
 * VSH_ERROR_INPUT (more than 64 MiB). */
static vsh_result peek_bytes(vshi_source *s, size_t size, const char **bytes, size_t *available,
                             vsh_error *error) {
    while (s->end - s->begin < size && !s->ended) {
        VSHI_TRY(fill_buffer(s, error));
    }
    *bytes = s->buffer + s->begin;
    *available = s->end - s->begin < size ? s->end - s->begin : size;
    return VSH_OK;
}

vsh_result vshi_source_skip_mark(vshi_source *s, vsh_error *error) {
    static const char mark[] = {'\xef', '\xbb', '\xbf'};
    const char *bytes;
    size_t available;
    VSHI_TRY(peek_bytes(s, sizeof mark, &bytes, &available, error));
    if (available == sizeof mark && memcmp(bytes, mark, sizeof mark) == 0) {
        skip_bytes(s, sizeof mark);
    }
    return VSH_OK;
}

/* --- fields */

static bool is_blank(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

/* Returns the end of the field at `c`, with the blanks after it if the delimiter is another character. */
static const char *field_end(const char *c, const char *end, char delimiter) {
    static const bool between[256] = {
        [' '] = true, ['\t'] = true, ['\r'] = true, ['\f'] = true, ['\v'] = true, [','] = true, [';'] = true};
    const char *stop = NULL;
    switch (delimiter) {
    case VSHI_BETWEEN_ANY:
        while (c < end && !between[(unsigned char)*c]) {
            ++c;
        }
        return c;
    case VSHI_BETWEEN_BLANKS:
        while (c < end && !is_blank(*c)) {
            ++c;
        }
        return c;
    default:
        stop = memchr(c, delimiter, (size_t)(end - c));
        return stop != NULL ? stop : end;
    }
}

vshi_field vshi_field_next(const char **at, const char *end, char delimiter) {
    const bool blanks = delimiter == VSHI_BETWEEN_BLANKS || delimiter == VSHI_BETWEEN_ANY;
    const char *c = *at;
    while (c < end && is_blank(*c) && (blanks || *c != delimiter)) {
        ++c;
    }
    vshi_field f = {c, c};
    if (c < end && *c == '"') {
        ++c;
        const char *close = memchr(c, '"', (size_t)(end - c));
        f = (vshi_field){c, close != NULL ? close : end};
        c = f.end;
    }
    c = field_end(c, end, delimiter);
    if (f.end == f.text) {
        f.end = c;
        while (f.end > f.text && is_blank(f.end[-1])) {
            --f.end;
        }
    }
    while (blanks && c < end && is_blank(*c)) {
        ++c;
    }
    const bool between = !blanks || (delimiter == VSHI_BETWEEN_ANY && c < end && (*c == ',' || *c == ';'));
    *at = between || c == end ? c + 1 : c;
    return f;
}

bool vshi_line_is_empty(const char *line, size_t size) {
    while (size > 0 && is_blank(*line)) {
        ++line;
        --size;
    }
    return size == 0 || *line == '#';
}

/* --- the first line */

/* Returns the first of these delimiters that the line contains. */
static char find_delimiter(const char *line, size_t size) {
    static const char delimiters[] = {';', ',', '\t'};
    for (size_t i = 0; i < sizeof delimiters; ++i) {
        if (memchr(line, delimiters[i], size) != NULL) {
            return delimiters[i];
        }
    }
    return VSHI_BETWEEN_BLANKS;
}

static bool has_number(const char *line, size_t size, char delimiter) {
    for (const char *at = line; at <= line + size;) {
        const vshi_field f = vshi_field_next(&at, line + size, delimiter);
        double value;
        if (vshi_decimal_read(f.text, f.end, &value)) {
            return true;
        }
    }
    return false;
}

static int find_column(const vshi_table_columns *wanted, vshi_field f) {
    const size_t size = (size_t)(f.end - f.text);
    for (int i = 0; i < wanted->count; ++i) {
        if (strlen(wanted->names[i]) == size && strncasecmp(wanted->names[i], f.text, size) == 0) {
            return i;
        }
    }
    return -1;
}

/* Sets `columns`, and removes columns from the fields that are not used. Returns the name of a needed column
 * that was not found, or NULL. */
static const char *choose_columns(vshi_table *t, const bool found[VSHI_TABLE_COLUMNS], int fields) {
    t->columns = t->wanted.count;
    for (int i = t->wanted.needed; i < t->wanted.count; ++i) {
        t->columns = found[i] ? t->columns : t->wanted.needed;
    }
    for (int i = 0; i < fields; ++i) {
        t->column_of[i] = t->column_of[i] < t->columns ? t->column_of[i] : -1;
    }
    for (int i = 0; i < t->wanted.needed; ++i) {
        if (!found[i]) {
            return t->wanted.names[i];
        }
    }
    return NULL;
}

/* Finds the columns by the names of a header. */
static vsh_result find_named_columns(vshi_table *t, const char *line, size_t size, vsh_error *error) {
    bool found[VSHI_TABLE_COLUMNS] = {false};
    const char *at = line, *name = t->source.name;
    VSHI_TRY(VSHI_ALLOCATE(t->column_of, (size_t)t->width, name, error));
    for (int i = 0; i < t->width; ++i) {
        const int column = find_column(&t->wanted, vshi_field_next(&at, line + size, t->delimiter));
        t->column_of[i] = (int8_t)(column >= 0 && !found[column] ? column : -1);
        if (column >= 0) {
            found[column] = true;
        }
    }
    const char *missing = choose_columns(t, found, t->width);
    for (int i = 0; i < t->width; ++i) {
        t->fields = t->column_of[i] >= 0 ? i + 1 : t->fields;
    }
    return missing == NULL
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT, "%s: the header names no column %s", name, missing);
}

/* Finds the columns by their order. */
static vsh_result find_ordered_columns(vshi_table *t, vsh_error *error) {
    t->columns = t->fields = t->width < t->wanted.count ? t->wanted.needed : t->wanted.count;
    VSHI_TRY(VSHI_ALLOCATE(t->column_of, VSHI_TABLE_COLUMNS, t->source.name, error));
    for (int i = 0; i < t->columns; ++i) {
        t->column_of[i] = (int8_t)i;
    }
    return VSH_OK;
}

static vsh_result open_csv(vshi_table *t, vsh_error *error) {
    const char *line;
    size_t size;
    VSHI_TRY(vshi_source_skip_mark(&t->source, error));
    t->columns = t->wanted.needed;
    do {
        VSHI_TRY(vshi_source_line(&t->source, &line, &size, error));
        if (line == NULL) {
            return VSH_OK;
        }
    } while (vshi_line_is_empty(line, size));
    t->delimiter = find_delimiter(line, size);
    for (const char *at = line; at <= line + size; vshi_field_next(&at, line + size, t->delimiter)) {
        ++t->width;
    }
    if (has_number(line, size, t->delimiter)) {
        const size_t back = (size_t)(t->source.buffer + t->source.begin - line);
        t->source.begin -= back;
        t->source.taken -= back;
        return find_ordered_columns(t, error);
    }
    VSHI_TRY(VSHI_ALLOCATE(t->header, size, t->source.name, error));
    memcpy(t->header, line, size);
    t->header_size = size;
    return find_named_columns(t, line, size, error);
}

/* --- the header of a PLY */

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

/* Splits a line into words. Returns their number, or WORDS + 1 if there are more. */
static int split_line(const char *line, size_t size, word w[WORDS]) {
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

static bool parse_line(vshi_ply_header *h, const char *line, size_t size) {
    word w[WORDS] = {""};
    const int words = split_line(line, size, w);
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
    return true; /* comments and unknown keywords */
}

vsh_result vshi_ply_header_line(vshi_ply_header *h, const char *name, const char *line, size_t size,
                                vsh_error *error) {
    return parse_line(h, line, size)
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

/* --- PLY as a table: the numbers of element `vertex`, whose rows have one size */

enum { HEADER_MOST = 1 << 20 };

static vsh_result keep_line(vshi_table *t, const char *line, size_t size, vsh_error *error) {
    char *grown =
        t->header_size + size + 1 < HEADER_MOST ? realloc(t->header, t->header_size + size + 1) : NULL;
    if (grown == NULL) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: a header of more than %d bytes", t->source.name,
                         HEADER_MOST);
    }
    memcpy(grown + t->header_size, line, size);
    t->header = grown;
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

/* Finds the place of each column in a row. */
static vsh_result find_ply_columns(vshi_table *t, vsh_error *error) {
    const vshi_ply_header *h = &t->ply;
    const char *name = t->source.name;
    if (t->vertex < 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: it has no element 'vertex'", name);
    }
    const vshi_ply_element *e = &h->element[t->vertex];
    bool found[VSHI_TABLE_COLUMNS] = {false};
    size_t row_size = 0;
    t->fields = t->width = e->end - e->first;
    VSHI_TRY(VSHI_ALLOCATE(t->column_of, (size_t)t->fields, name, error));
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
    const char *missing = choose_columns(t, found, t->fields);
    return missing == NULL
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT, "%s: its vertices have no property '%s'", name, missing);
}

/* Finds the first `size` bytes of a row. Errors: VSH_ERROR_READ (there are fewer). */
static vsh_result peek_in_row(vshi_table *t, const vshi_ply_element *e, uint64_t row, const char **bytes,
                              size_t size, vsh_error *error) {
    size_t available;
    VSHI_TRY(peek_bytes(&t->source, size, bytes, &available, error));
    return available < size ? vshi_ply_fail_short(t->source.name, e, row, error) : VSH_OK;
}

/* Finds a row of an element without skipping it. Errors: VSH_ERROR_READ (it is not whole). */
static vsh_result peek_row(vshi_table *t, const vshi_ply_element *e, uint64_t row, const char **bytes,
                           size_t *size, vsh_error *error) {
    *size = 0;
    for (int p = e->first; p < e->end; ++p) {
        const vshi_ply_property *property = &t->ply.property[p];
        uint64_t count = 1;
        if (property->count_type >= 0) {
            const int width = vshi_ply_size(property->count_type);
            *size += (size_t)width;
            VSHI_TRY(peek_in_row(t, e, row, bytes, *size, error));
            count = vshi_bytes_number(*bytes + *size - width, width, t->ply.big_endian);
        }
        *size += count * (size_t)vshi_ply_size(property->type);
        VSHI_TRY(peek_in_row(t, e, row, bytes, *size, error));
    }
    return VSH_OK;
}

/* Skips a row of an element, or copies it to `to`. */
static vsh_result skip_row(vshi_table *t, const vshi_ply_element *e, uint64_t row, FILE *to,
                           vsh_error *error) {
    const char *bytes;
    size_t size = 0;
    if (!t->ply.ascii) {
        VSHI_TRY(peek_row(t, e, row, &bytes, &size, error));
        skip_bytes(&t->source, size);
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

static vsh_result skip_elements(vshi_table *t, int first, int end, FILE *to, vsh_error *error) {
    for (int i = first; i < end; ++i) {
        const vshi_ply_element *e = &t->ply.element[i];
        for (uint64_t row = 0; e->first < e->end && row < e->count; ++row) {
            VSHI_TRY(skip_row(t, e, row, to, error));
        }
    }
    return VSH_OK;
}

static vsh_result open_ply(vshi_table *t, vsh_error *error) {
    t->delimiter = VSHI_BETWEEN_BLANKS;
    VSHI_TRY(read_header(t, error));
    VSHI_TRY(find_ply_columns(t, error));
    return skip_elements(t, 0, t->vertex, NULL, error);
}

/* --- rows */

static void __attribute__((format(printf, 2, 3))) mark_bad(vshi_table_row *row, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(row->bad, sizeof row->bad, format, arguments);
    va_end(arguments);
    for (int i = 0; i < VSHI_TABLE_COLUMNS; ++i) {
        row->value[i] = (double)NAN;
    }
}

static void parse_row(const vshi_table *t, vshi_table_row *row) {
    const char *at = row->bytes, *end = row->bytes + row->size;
    for (int i = 0; i < t->fields; ++i) {
        if (at > end) {
            row->missing = t->width - i;
            mark_bad(row, "%d columns, expected at least %d", i, t->fields);
            return;
        }
        const vshi_field f = vshi_field_next(&at, end, t->delimiter);
        const int column = t->column_of[i];
        if (column >= 0 && !vshi_decimal_read(f.text, f.end, &row->value[column])) {
            const int shown = f.end - f.text < 40 ? (int)(f.end - f.text) : 40;
            mark_bad(row, "column %d is '%.*s', expected a number", i + 1, shown, f.text);
            return;
        }
    }
}

/* --- tables */

vsh_result vshi_table_open(const char *path, int32_t format, const vshi_table_columns *wanted, vshi_job *job,
                           vshi_table *t, vsh_error *error) {
    *t = (vshi_table){.format = format, .wanted = *wanted, .delimiter = ','};
    VSHI_TRY(vshi_source_open(path, UINT64_MAX, &t->source, error));
    t->source.job = job;
    switch (format) {
    case VSHI_TABLE_CSV:
        return open_csv(t, error);
    case VSHI_TABLE_PLY:
        return open_ply(t, error);
    default:
        break;
    }
    t->columns = wanted->needed;
    t->row_size = (size_t)t->columns * sizeof(float);
    for (int i = 0; i < t->columns; ++i) {
        t->offset[i] = i * (int)sizeof(float);
        t->type[i] = VSHI_PLY_FLOAT;
    }
    return VSH_OK;
}

void vshi_table_close(vshi_table *t) {
    vshi_source_close(&t->source);
    free(t->header);
    free(t->column_of);
    t->header = NULL;
    t->column_of = NULL;
}

static vsh_result fail_short(const vshi_table *t, size_t available, vsh_error *error) {
    if (t->format == VSHI_TABLE_RAW) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cut short: row %" PRIu64 " has %zu bytes of %zu",
                         t->source.name, t->rows + 1, available, t->row_size);
    }
    return vshi_ply_fail_short(t->source.name, &t->ply.element[t->vertex], t->rows, error);
}

static vsh_result next_line(vshi_table *t, vshi_table_row *row, vsh_error *error) {
    const bool ply = t->format == VSHI_TABLE_PLY;
    do {
        VSHI_TRY(vshi_source_line(&t->source, &row->bytes, &row->size, error));
        if (row->bytes == NULL) {
            return ply ? fail_short(t, 0, error) : VSH_OK;
        }
    } while (ply ? row->size == 0 : vshi_line_is_empty(row->bytes, row->size));
    parse_row(t, row);
    ++t->rows;
    return VSH_OK;
}

vsh_result vshi_table_next(vshi_table *t, vshi_table_row *row, vsh_error *error) {
    row->bytes = NULL;
    row->bad[0] = '\0';
    row->missing = 0;
    if (t->format == VSHI_TABLE_PLY && t->rows == t->ply.element[t->vertex].count) {
        return VSH_OK;
    }
    if (t->row_size == 0) {
        return next_line(t, row, error);
    }
    const char *bytes;
    size_t available;
    VSHI_TRY(peek_bytes(&t->source, t->row_size, &bytes, &available, error));
    if (available == 0 && t->format == VSHI_TABLE_RAW) {
        return VSH_OK;
    }
    if (available < t->row_size) {
        return fail_short(t, available, error);
    }
    for (int i = 0; i < t->columns; ++i) {
        row->value[i] = vshi_ply_number(bytes + t->offset[i], t->type[i], t->ply.big_endian);
    }
    row->bytes = bytes;
    row->size = t->row_size;
    skip_bytes(&t->source, t->row_size);
    ++t->rows;
    return VSH_OK;
}

vsh_result vshi_table_rest(vshi_table *t, FILE *to, vsh_error *error) {
    return t->format == VSHI_TABLE_PLY ? skip_elements(t, t->vertex + 1, t->ply.elements, to, error) : VSH_OK;
}
