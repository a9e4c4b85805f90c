/* CSV and its like, and rows of it. */
#include "table/table.h"

#include "base/decimal.h"
#include "base/memory.h"
#include "base/try.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>
#include <strings.h>

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

/* What stands between fields: the first of these that the line holds. */
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

vsh_result vshi_table_open_csv(vshi_table *t, vsh_error *error) {
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

void vshi_table_parse(const vshi_table *t, vshi_table_row *row) {
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
