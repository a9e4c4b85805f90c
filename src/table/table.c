#include "table/table.h"

#include "base/try.h"

#include <inttypes.h>
#include <stdlib.h>

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
        return vshi_table_open_csv(t, error);
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
    vshi_table_parse(t, row);
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
