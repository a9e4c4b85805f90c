/* Rows of points with their answers behind them: the rows as they came where the format is the same, position
 * and normal else. */
#include "base/decimal.h"
#include "cli/message.h"
#include "cli/try.h"
#include "points.h"

#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

enum { BUFFER = 1 << 20, ROW_ROOM = 6 * VSHI_DECIMAL_ROOM + 16, COUNT_WIDTH = 20 };

static int fail(const cli_points_writer *w) {
    cli_say("%s: cannot be written: %s", w->name, strerror(errno));
    return CLI_FILE;
}

/* --- heads */

/* "x", "y" … of what stands before the answers, where rows are not kept; NULL behind the last. */
static const char *own_name(const cli_points_writer *w, int i) {
    static const char *const names[] = {"x", "y", "z", "nx", "ny", "nz"};
    return w->answers_only || w->keep || i >= (w->normals ? 6 : 3) ? NULL : names[i];
}

static void write_csv_head(cli_points_writer *w, const cli_points_reader *reader) {
    const char *between = "";
    const char delimiter[2] = {w->delimiter, '\0'};
    if (w->keep) {
        if (reader->table.header == NULL) {
            return; /* none came, none goes */
        }
        fwrite(reader->table.header, 1, reader->table.header_size, w->file);
        between = delimiter;
    }
    for (int i = 0; own_name(w, i) != NULL; ++i) {
        fprintf(w->file, "%s%s", between, own_name(w, i));
        between = delimiter;
    }
    for (size_t c = 0; c < w->column_count; ++c) {
        fprintf(w->file, "%s%s", between, w->columns[c].name);
        between = delimiter;
    }
    putc('\n', w->file);
}

static void write_ply_properties(const cli_points_writer *w) {
    for (int i = 0; own_name(w, i) != NULL; ++i) {
        fprintf(w->file, "property %s %s\n", i < 3 && !w->floats ? "double" : "float", own_name(w, i));
    }
    for (size_t c = 0; c < w->column_count; ++c) {
        fprintf(w->file, "property float %s\n", w->columns[c].name);
    }
}

/* As long for any number of rows: what the number leaves goes into a comment. */
static void write_ply_head(const cli_points_writer *w, uint64_t rows) {
    char count[COUNT_WIDTH + 8];
    const int length = snprintf(count, sizeof count, "%" PRIu64, rows);
    fprintf(w->file, "ply\nformat %s 1.0\ncomment vdbshade query%*s\nelement vertex %s\n",
            w->ascii        ? "ascii"
            : w->big_endian ? "binary_big_endian"
                            : "binary_little_endian",
            COUNT_WIDTH - length, "", count);
    write_ply_properties(w);
    fputs("end_header\n", w->file);
}

static void write_kept_ply_head(const cli_points_writer *w, const cli_points_reader *reader) {
    fwrite(reader->table.header, 1, reader->table.header_insert, w->file);
    write_ply_properties(w);
    fwrite(reader->table.header + reader->table.header_insert, 1,
           reader->table.header_size - reader->table.header_insert, w->file);
}

/* Names that are there already would stand for two things. */
static int check_names(const cli_points_writer *w, const cli_points_reader *reader) {
    for (size_t c = 0; w->keep && c < w->column_count; ++c) {
        const char *name = w->columns[c].name;
        const size_t size = strlen(name);
        bool there = false;
        if (reader->table.format == VSHI_TABLE_PLY) {
            const vshi_ply_element *e = &reader->table.ply.element[reader->table.vertex];
            for (int p = e->first; p < e->end; ++p) {
                there = there || strcmp(reader->table.ply.property[p].name, name) == 0;
            }
        } else if (reader->table.header != NULL) {
            const char *end = reader->table.header + reader->table.header_size;
            for (const char *at = reader->table.header; at + size <= end; ++at) {
                const bool begins = at == reader->table.header || strchr(",;\t \"", at[-1]) != NULL;
                const bool ends = at + size == end || strchr(",;\t \"", at[size]) != NULL;
                there = there || (begins && ends && memcmp(at, name, size) == 0);
            }
        }
        if (there) {
            return cli_usage("%s: it has a column '%s' already; --answers-only leaves its columns out",
                             reader->table.source.name, name);
        }
    }
    return CLI_OK;
}

int cli_points_writer_open(const char *path, int32_t format, bool answers_only,
                           const cli_points_reader *reader, const cli_points_column *columns,
                           size_t column_count, cli_points_writer *w) {
    const bool standard = strcmp(path, "-") == 0, same = format == reader->table.format;
    *w = (cli_points_writer){.name = standard ? "standard output" : path,
                             .format = format,
                             .answers_only = answers_only,
                             .keep = !answers_only && same && cli_points_can_keep(reader),
                             .ascii = same && reader->table.ply.ascii,
                             .big_endian = same && reader->table.ply.big_endian,
                             .floats = reader->floats,
                             .normals = reader->has_normals,
                             .delimiter =
                                 same && reader->table.delimiter != ' ' ? reader->table.delimiter : ',',
                             .columns = columns,
                             .column_count = column_count,
                             .file = stdout,
                             .count_at = -1};
    if (w->keep && reader->table.format == VSHI_TABLE_CSV) {
        w->delimiter = reader->table.delimiter;
    }
    CLI_TRY(check_names(w, reader));
    const bool counted = format == VSHI_TABLE_PLY && reader->table.format != VSHI_TABLE_PLY;
    if (!standard) {
        CLI_TRY(cli_temporary_begin(&w->temporary, path));
        w->file = w->temporary.file;
    } else if (counted) {
        w->file = w->spool = tmpfile();
        if (w->spool == NULL) {
            return fail(w);
        }
    }
    w->buffer = malloc(BUFFER);
    if (w->buffer == NULL) {
        return cli_out_of_memory(w->name);
    }
    if (format == VSHI_TABLE_CSV) {
        write_csv_head(w, reader);
    } else if (format == VSHI_TABLE_PLY && w->keep) {
        write_kept_ply_head(w, reader);
    } else if (format == VSHI_TABLE_PLY) {
        w->count_at = counted && w->spool == NULL ? 0 : -1;
        if (w->spool == NULL) {
            write_ply_head(w, counted ? 0 : reader->table.ply.element[reader->table.vertex].count);
        }
    }
    return ferror(w->file) ? fail(w) : CLI_OK;
}

/* --- rows */

static bool drain(cli_points_writer *w) {
    const size_t size = w->used;
    w->used = 0;
    return size == 0 || fwrite(w->buffer, 1, size, w->file) == size;
}

/* Room for `size` more bytes, no more than BUFFER; NULL where writing failed. */
static char *room(cli_points_writer *w, size_t size) {
    if (w->used + size > BUFFER && !drain(w)) {
        return NULL;
    }
    return w->buffer + w->used;
}

static bool put_bytes(cli_points_writer *w, const char *bytes, size_t size) {
    if (size > BUFFER / 2) {
        return drain(w) && fwrite(bytes, 1, size, w->file) == size;
    }
    char *to = room(w, size);
    if (to != NULL) {
        memcpy(to, bytes, size);
        w->used += size;
    }
    return to != NULL;
}

static char *put_binary(const cli_points_writer *w, char *at, const void *value, size_t size) {
    uint64_t bits = 0;
    uint32_t low;
    if (size == sizeof low) {
        memcpy(&low, value, sizeof low);
        bits = low;
    } else {
        memcpy(&bits, value, sizeof bits);
    }
    for (size_t i = 0; i < size; ++i) {
        at[i] = (char)(bits >> 8 * (w->big_endian ? size - 1 - i : i));
    }
    return at + size;
}

static char *put_position(const cli_points_writer *w, char *at, double value) {
    const float single = (float)value;
    const bool floats = w->floats || w->format == VSHI_TABLE_RAW;
    return floats ? put_binary(w, at, &single, sizeof single) : put_binary(w, at, &value, sizeof value);
}

static bool put_binary_row(cli_points_writer *w, const cli_points *points, size_t i) {
    char *at = room(w, ROW_ROOM + sizeof(float) * w->column_count), *start = at;
    if (at == NULL) {
        return false;
    }
    if (!w->keep && !w->answers_only) {
        for (size_t k = 0; k < 3; ++k) {
            at = put_position(w, at, points->positions[3 * i + k]);
        }
        for (size_t k = 0; w->normals && k < 3; ++k) {
            at = put_binary(w, at, &points->normals[3 * i + k], sizeof(float));
        }
    }
    for (size_t c = 0; c < w->column_count; ++c) {
        at = put_binary(w, at, &w->columns[c].values[i * w->columns[c].stride], sizeof(float));
    }
    w->used += (size_t)(at - start);
    return true;
}

static bool put_text_row(cli_points_writer *w, const cli_points *points, size_t i) {
    char *at = room(w, ROW_ROOM + (VSHI_DECIMAL_ROOM + 1) * w->column_count), *start = at;
    if (at == NULL) {
        return false;
    }
    const char delimiter = w->format == VSHI_TABLE_PLY ? ' ' : w->delimiter;
    if (!w->keep && !w->answers_only) {
        for (size_t k = 0; k < 3; ++k) {
            /* of a float too all digits that its double has: who reads it gets the same point */
            at = vshi_decimal_write_double(at, points->positions[3 * i + k]);
            *at++ = delimiter;
        }
        for (size_t k = 0; w->normals && k < 3; ++k) {
            at = vshi_decimal_write_float(at, points->normals[3 * i + k]);
            *at++ = delimiter;
        }
    } else if (w->keep) {
        *at++ = delimiter;
    }
    for (size_t c = 0; c < w->column_count; ++c) {
        at = vshi_decimal_write_float(at, w->columns[c].values[i * w->columns[c].stride]);
        *at++ = delimiter;
    }
    at[-1] = '\n';
    w->used += (size_t)(at - start);
    return true;
}

int cli_points_write(cli_points_writer *w, const cli_points *points) {
    const bool text = w->format == VSHI_TABLE_CSV || (w->format == VSHI_TABLE_PLY && w->ascii);
    bool good = true;
    for (size_t i = 0; good && i < points->count; ++i) {
        if (w->keep) {
            const size_t begin = i > 0 ? points->kept_end[i - 1] : 0;
            good = put_bytes(w, points->kept + begin, points->kept_end[i] - begin);
        }
        good = good && (text ? put_text_row(w, points, i) : put_binary_row(w, points, i));
    }
    w->rows += points->count;
    return good && drain(w) ? CLI_OK : fail(w);
}

int cli_points_writer_flush(cli_points_writer *w) {
    return fflush(w->file) == 0 ? CLI_OK : fail(w);
}

/* The head and then what waits in the spool. */
static int write_spool(cli_points_writer *w) {
    FILE *spool = w->spool;
    if (fflush(spool) != 0 || fseek(spool, 0, SEEK_SET) != 0) {
        return fail(w);
    }
    w->file = stdout;
    write_ply_head(w, w->rows);
    size_t got;
    while ((got = fread(w->buffer, 1, BUFFER, spool)) > 0) {
        if (fwrite(w->buffer, 1, got, stdout) != got) {
            return fail(w);
        }
    }
    return ferror(spool) ? fail(w) : CLI_OK;
}

int cli_points_writer_commit(cli_points_writer *w, cli_points_reader *reader) {
    vsh_error error;
    if (vshi_table_rest(&reader->table, w->keep ? w->file : NULL, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    CLI_TRY(w->spool != NULL ? write_spool(w) : CLI_OK);
    if (w->count_at >= 0) {
        if (fseek(w->file, w->count_at, SEEK_SET) != 0) {
            return fail(w);
        }
        write_ply_head(w, w->rows);
    }
    if (w->temporary.file != NULL) {
        return cli_temporary_commit(&w->temporary);
    }
    return fflush(stdout) == 0 && !ferror(stdout) ? CLI_OK : fail(w);
}

void cli_points_writer_free(cli_points_writer *w) {
    cli_temporary_abandon(&w->temporary);
    if (w->spool != NULL) {
        fclose(w->spool);
    }
    free(w->buffer);
    *w = (cli_points_writer){0};
}
