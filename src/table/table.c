#include "table/table.h"

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
    return source->buffer != NULL
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", source->name);
}

void vshi_source_close(vshi_source *source) {
    if (source->file != NULL) {
        fclose(source->file);
    }
    free(source->buffer);
    source->buffer = NULL;
    source->file = NULL;
}

/* Some more bytes behind those that there are, which may move. */
static vsh_result fill(vshi_source *s, vsh_error *error) {
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
    return s->job != NULL && vshi_job_advance(s->job, (size_t)got) ? vshi_job_fail_cancelled(s->job, error)
                                                                   : VSH_OK;
}

vsh_result vshi_source_line(vshi_source *s, const char **line, size_t *size, vsh_error *error) {
    *line = NULL;
    for (size_t looked = 0;;) {
        char *start = s->buffer + s->begin;
        const size_t held = s->end - s->begin;
        const char *stop = memchr(start + looked, '\n', held - looked);
        if (stop != NULL || (s->ended && held > 0)) {
            const size_t length = stop != NULL ? (size_t)(stop - start) : held;
            vshi_source_take(s, length + (stop != NULL));
            *line = start;
            *size = length - (length > 0 && start[length - 1] == '\r');
            return VSH_OK;
        }
        if (s->ended) {
            return VSH_OK;
        }
        looked = held;
        VSHI_TRY(fill(s, error));
    }
}

vsh_result vshi_source_peek(vshi_source *s, size_t size, const char **bytes, size_t *available,
                            vsh_error *error) {
    while (s->end - s->begin < size && !s->ended) {
        VSHI_TRY(fill(s, error));
    }
    *bytes = s->buffer + s->begin;
    *available = s->end - s->begin < size ? s->end - s->begin : size;
    return VSH_OK;
}

void vshi_source_take(vshi_source *s, size_t size) {
    s->begin += size;
    s->taken += size;
}

void vshi_source_give_back(vshi_source *s, const char *line) {
    const size_t size = (size_t)(s->buffer + s->begin - line);
    s->begin -= size;
    s->taken -= size;
}

vsh_result vshi_source_pass_mark(vshi_source *s, vsh_error *error) {
    static const char mark[] = {'\xef', '\xbb', '\xbf'};
    const char *bytes;
    size_t available;
    VSHI_TRY(vshi_source_peek(s, sizeof mark, &bytes, &available, error));
    if (available == sizeof mark && memcmp(bytes, mark, sizeof mark) == 0) {
        vshi_source_take(s, sizeof mark);
    }
    return VSH_OK;
}

/* --- fields */

static bool is_blank(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

/* Where the field at `c` ends, with the blanks behind it where others may follow. */
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

/* The delimiter between fields is the first of these that the line holds. */
static char delimiter_of(const char *line, size_t size) {
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

static int column_of_name(const vshi_table_columns *wanted, vshi_field f) {
    const size_t size = (size_t)(f.end - f.text);
    for (int i = 0; i < wanted->count; ++i) {
        if (strlen(wanted->names[i]) == size && strncasecmp(wanted->names[i], f.text, size) == 0) {
            return i;
        }
    }
    return -1;
}

/* Columns by the names of a header, or by their order. */
static vsh_result lay_columns(vshi_table *t, const char *line, size_t size, bool named, vsh_error *error) {
    const char *end = line + size;
    for (const char *at = line; at <= end; vshi_field_next(&at, end, t->delimiter)) {
        ++t->width;
    }
    VSHI_TRY(vshi_allocate((void **)&t->column_of, (size_t)t->width + VSHI_TABLE_COLUMNS, 1, t->source.name,
                           error));
    bool found[VSHI_TABLE_COLUMNS] = {false};
    const char *at = line;
    for (int i = 0; i < t->width; ++i) {
        const vshi_field f = vshi_field_next(&at, end, t->delimiter);
        const int column = named ? column_of_name(&t->wanted, f) : i < t->wanted.count ? i : -1;
        const bool fresh = column >= 0 && !found[column];
        t->column_of[i] = (int8_t)(fresh ? column : -1);
        if (fresh) {
            found[column] = true;
        }
    }
    const char *missing = vshi_table_choose(t, found, t->width);
    if (!named) { /* the first row may be a bad one */
        for (int i = 0; i < t->columns; ++i) {
            t->column_of[i] = (int8_t)i;
        }
        t->fields = t->columns;
        return VSH_OK;
    }
    for (int i = 0; i < t->width; ++i) {
        t->fields = t->column_of[i] >= 0 ? i + 1 : t->fields;
    }
    return missing == NULL ? VSH_OK
                           : vshi_fail(error, VSH_ERROR_INPUT, "%s: the header names no column %s",
                                       t->source.name, missing);
}

static vsh_result open_csv(vshi_table *t, vsh_error *error) {
    const char *line;
    size_t size;
    VSHI_TRY(vshi_source_pass_mark(&t->source, error));
    t->columns = t->wanted.needed;
    do {
        VSHI_TRY(vshi_source_line(&t->source, &line, &size, error));
        if (line == NULL) {
            return VSH_OK;
        }
    } while (vshi_line_is_empty(line, size));
    t->delimiter = delimiter_of(line, size);
    const bool named = !has_number(line, size, t->delimiter);
    if (!named) {
        vshi_source_give_back(&t->source, line);
        return lay_columns(t, line, size, false, error);
    }
    VSHI_TRY(vshi_allocate((void **)&t->header, size, 1, t->source.name, error));
    memcpy(t->header, line, size);
    t->header_size = size;
    return lay_columns(t, line, size, true, error);
}

/* --- rows */

static void __attribute__((format(printf, 2, 3))) be_bad(vshi_table_row *row, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(row->bad, sizeof row->bad, format, arguments);
    va_end(arguments);
    for (int i = 0; i < VSHI_TABLE_COLUMNS; ++i) {
        row->value[i] = (double)NAN;
    }
}

static void parse(const vshi_table *t, vshi_table_row *row) {
    const char *at = row->bytes, *end = row->bytes + row->size;
    for (int i = 0; i < t->fields; ++i) {
        if (at > end) {
            row->missing = t->width - i;
            be_bad(row, "%d columns, expected at least %d", i, t->fields);
            return;
        }
        const vshi_field f = vshi_field_next(&at, end, t->delimiter);
        const int column = t->column_of[i];
        if (column >= 0 && !vshi_decimal_read(f.text, f.end, &row->value[column])) {
            const int shown = f.end - f.text < 40 ? (int)(f.end - f.text) : 40;
            be_bad(row, "column %d is '%.*s', expected a number", i + 1, shown, f.text);
            return;
        }
    }
}

/* --- tables */

const char *vshi_table_choose(vshi_table *t, const bool found[VSHI_TABLE_COLUMNS], int fields) {
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

vsh_result vshi_table_open(const char *path, int32_t format, const vshi_table_columns *wanted, vshi_job *job,
                           vshi_table *t, vsh_error *error) {
    *t = (vshi_table){.format = format, .wanted = *wanted, .delimiter = ','};
    VSHI_TRY(vshi_source_open(path, UINT64_MAX, &t->source, error));
    t->source.job = job;
    switch (format) {
    case VSHI_TABLE_CSV:
        return open_csv(t, error);
    case VSHI_TABLE_PLY:
        return vshi_table_open_ply(t, error);
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
    parse(t, row);
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
    VSHI_TRY(vshi_source_peek(&t->source, t->row_size, &bytes, &available, error));
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
    vshi_source_take(&t->source, t->row_size);
    ++t->rows;
    return VSH_OK;
}
