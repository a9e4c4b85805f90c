/* Points as rows of files and pipes: read and checked a batch at a time, and written with their answers. */
#include "points.h"
#include "base/decimal.h"

#include <errno.h>
#include <float.h>
#include <sys/stat.h>

static const char *const point_names[VSHI_TABLE_COLUMNS] = {"x", "y", "z", "nx", "ny", "nz"};

enum {
    NX = 3,    /* columns before the normal */
    SHOWN = 5, /* bad rows that get a message each */
    COUNT_WIDTH = 20
};

/* --- batches */

cli_points cli_points_create(size_t room, bool normals, bool keep) {
    return (cli_points){.room = room,
                        .positions = malloc(room * sizeof(double[3])),
                        .normals = normals ? malloc(room * sizeof(float[3])) : NULL,
                        .texels = malloc(room * sizeof(uint32_t)),
                        .kept_end = keep ? malloc(room * sizeof(size_t)) : NULL};
}

void cli_points_free(cli_points *points) {
    free(points->positions);
    free(points->normals);
    free(points->texels);
    free(points->kept);
    free(points->kept_end);
    *points = (cli_points){0};
}

static void keep_bytes(cli_points *points, const char *bytes, size_t size) {
    if (points->kept_size + size > points->kept_room) {
        points->kept_room = 2 * (points->kept_size + size) + 4096;
        points->kept = realloc(points->kept, points->kept_room);
    }
    memcpy(points->kept + points->kept_size, bytes, size);
    points->kept_size += size;
}

/* Stores in row->bad why its values cannot be used. */
static void check_row(const cli_points_reader *reader, vshi_table_row *row) {
    bool zero = reader->has_normals;
    for (int i = 0; i < (reader->has_normals ? NX + 3 : NX); ++i) {
        const double value = row->value[i];
        if (!isfinite(value)) {
            snprintf(row->bad, sizeof row->bad, "%s is not finite", point_names[i]);
            return;
        }
        if (i >= NX && fabs(value) > FLT_MAX) {
            snprintf(row->bad, sizeof row->bad, "%s is beyond the range of floats", point_names[i]);
            return;
        }
        zero = zero && (i < NX || (float)value == 0.0f);
    }
    if (zero) {
        snprintf(row->bad, sizeof row->bad, "the normal is zero");
    }
}

/* Adds the row to the points. */
static void add_row(const cli_points_reader *reader, const vshi_table_row *row, cli_points *points) {
    const size_t i = points->count;
    memcpy(points->positions + 3 * i, row->value, 3 * sizeof *row->value);
    for (size_t axis = 0; points->normals != NULL && axis < 3; ++axis) {
        points->normals[3 * i + axis] = (float)row->value[NX + axis];
    }
    points->texels[i] = (uint32_t)(reader->table.rows - 1);
    if (points->kept_end != NULL) {
        keep_bytes(points, row->bytes, row->size);
        const char filler[] = {reader->table.delimiter, 'n', 'a', 'n'};
        for (int k = 0; k < row->missing; ++k) { /* so that answers stay in their columns */
            keep_bytes(points, filler, filler[0] == ' ' ? sizeof filler : 1);
        }
        points->kept_end[i] = points->kept_size;
    }
    ++points->count;
}

/* A vsh_progress_fn that only stops the reading. */
static int32_t check_interrupt(void *user, const char *stage, double fraction) {
    (void)user;
    (void)stage;
    (void)fraction;
    return cli_interrupted();
}

int cli_points_open(const char *path, int32_t format, int normals, bool strict, cli_points_reader *reader) {
    const vshi_table_columns wanted = {
        {"x", "y", "z", "nx", "ny", "nz"}, normals == 0 ? NX : NX + 3, normals == 1 ? NX + 3 : NX};
    vsh_run run = vsh_run_default();
    run.progress = check_interrupt;
    *reader = (cli_points_reader){.strict = strict, .job = vshi_job_begin(&run, "points", SIZE_MAX)};
    vshi_table *t = &reader->table;
    path = strcmp(path, "-") != 0 ? path : NULL;
    if (vshi_table_open(path, format, &wanted, reader->job, t, &cli_error) != VSH_OK) {
        struct stat status;
        const bool is_pipe = path != NULL && cli_error.code == VSH_ERROR_READ && stat(path, &status) == 0 &&
                             !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode);
        return is_pipe ? cli_refuse(CLI_FILE, "%s; a pipe is read as standard input, by --points -",
                                    cli_error.message)
                       : cli_check(cli_error.code);
    }
    reader->has_normals = t->columns > NX;
    reader->floats = t->format != VSHI_TABLE_CSV;
    for (int i = 0; i < NX; ++i) {
        reader->floats = reader->floats && t->type[i] != VSHI_PLY_DOUBLE;
    }
    return CLI_OK;
}

int cli_points_read(cli_points_reader *reader, size_t most_kept, cli_points *points) {
    points->count = 0;
    points->kept_size = 0;
    while (points->count < points->room && points->kept_size <= most_kept) {
        vshi_table_row row;
        CLI_TRY(cli_check(vshi_table_next(&reader->table, &row, &cli_error)));
        if (row.bytes == NULL) {
            break;
        }
        if (row.bad[0] == '\0') {
            check_row(reader, &row);
        }
        if (row.bad[0] != '\0' && (++reader->bad <= SHOWN || reader->strict)) {
            cli_say("%s: row %" PRIu64 ": %s", reader->table.source.name, reader->table.rows, row.bad);
        }
        if (row.bad[0] != '\0' && reader->strict) {
            return CLI_USAGE;
        }
        add_row(reader, &row, points);
    }
    return CLI_OK;
}

bool cli_points_can_keep(const cli_points_reader *reader) {
    return reader->table.format != VSHI_TABLE_PLY || reader->table.vertex == 0;
}

void cli_points_close(cli_points_reader *reader) {
    vshi_table_close(&reader->table);
    vshi_job_end(reader->job);
    *reader = (cli_points_reader){.job = NULL};
}

/* --- heads of the output. If the formats are equal, a row starts as in the input, else with position and
 * normal. Answers follow */

static int fail(const cli_points_writer *w) {
    return cli_refuse(CLI_FILE, "%s: cannot be written: %s", w->name, strerror(errno));
}

/* Returns the name of written column `i`: of the position and normal unless rows are kept, then of the
 * answers. NULL after the last. */
static const char *column_name(const cli_points_writer *w, size_t i) {
    const size_t own = w->answers_only || w->keep ? 0 : w->normals ? 6 : 3;
    return i < own ? point_names[i] : i - own < w->answers->width ? w->answers->names[i - own] : NULL;
}

static void write_csv_head(const cli_points_writer *w, const cli_points_reader *reader) {
    if (w->keep && reader->table.header == NULL) {
        return; /* without a header in the input, there is none in the output */
    }
    if (w->keep) {
        fwrite(reader->table.header, 1, reader->table.header_size, w->file);
    }
    for (size_t i = 0; column_name(w, i) != NULL; ++i) {
        fprintf(w->file, "%.*s%s", i > 0 || w->keep, &w->delimiter, column_name(w, i));
    }
    putc('\n', w->file);
}

static void write_ply_properties(const cli_points_writer *w) {
    for (size_t i = 0; column_name(w, i) != NULL; ++i) {
        const bool is_double = i < 3 && !w->floats && !w->keep && !w->answers_only;
        fprintf(w->file, "property %s %s\n", is_double ? "double" : "float", column_name(w, i));
    }
}

/* The head has the same length for any number of rows: a comment fills it up. */
static void write_ply_head(const cli_points_writer *w, uint64_t rows) {
    char count[COUNT_WIDTH + 8];
    const int length = snprintf(count, sizeof count, "%" PRIu64, rows);
    fprintf(w->file, "ply\nformat %s 1.0\ncomment vdbshade query%*s\nelement vertex %s\n",
            w->text         ? "ascii"
            : w->big_endian ? "binary_big_endian"
                            : "binary_little_endian",
            COUNT_WIDTH - length, "", count);
    write_ply_properties(w);
    fputs("end_header\n", w->file);
}

/* Refuses answers with the name of a column that is there already. */
static int check_names(const cli_points_writer *w, const cli_points_reader *reader) {
    for (size_t c = 0; w->keep && c < w->answers->width; ++c) {
        const char *name = w->answers->names[c];
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
        CLI_REFUSE_IF(there, "%s: it has a column '%s' already; --answers-only leaves its columns out",
                      reader->table.source.name, name);
    }
    return CLI_OK;
}

int cli_points_writer_open(const char *path, int32_t format, bool answers_only,
                           const cli_points_reader *reader, const cli_points_answers *answers,
                           cli_points_writer *w) {
    const bool standard = strcmp(path, "-") == 0, same = format == reader->table.format;
    *w = (cli_points_writer){.name = standard ? "standard output" : path,
                             .format = format,
                             .answers_only = answers_only,
                             .keep = !answers_only && same && cli_points_can_keep(reader),
                             .counted = format == VSHI_TABLE_PLY && !same,
                             .big_endian = same && reader->table.ply.big_endian,
                             .text = format == VSHI_TABLE_CSV ||
                                     (format == VSHI_TABLE_PLY && same && reader->table.ply.ascii),
                             .floats = reader->floats,
                             .normals = reader->has_normals,
                             .delimiter = format == VSHI_TABLE_PLY ? ' ' : ',',
                             .answers = answers,
                             .file = stdout};
    if (format == VSHI_TABLE_CSV && same && (w->keep || reader->table.delimiter != ' ')) {
        w->delimiter = reader->table.delimiter;
    }
    CLI_TRY(check_names(w, reader));
    if (!standard) {
        CLI_TRY(cli_temporary_begin(&w->temporary, path));
        w->file = w->temporary.file;
    } else if (w->counted) {
        w->spool = tmpfile();
        if (w->spool == NULL) {
            return fail(w);
        }
        w->file = w->spool;
    }
    w->row = malloc((6 + answers->width) * (VSHI_DECIMAL_ROOM + 1) + 1);
    if (format == VSHI_TABLE_CSV) {
        write_csv_head(w, reader);
    } else if (format == VSHI_TABLE_PLY && w->keep) {
        const vshi_table *t = &reader->table;
        fwrite(t->header, 1, t->header_insert, w->file);
        write_ply_properties(w);
        fwrite(t->header + t->header_insert, 1, t->header_size - t->header_insert, w->file);
    } else if (format == VSHI_TABLE_PLY) {
        write_ply_head(w, w->counted ? 0 : reader->table.ply.element[reader->table.vertex].count);
    }
    return ferror(w->file) ? fail(w) : CLI_OK;
}

/* --- rows */

static char *write_bits(const cli_points_writer *w, char *at, uint64_t bits, size_t size) {
    for (size_t i = 0; i < size; ++i) {
        at[i] = (char)(bits >> 8 * (w->big_endian ? size - 1 - i : i));
    }
    return at + size;
}

/* Text has all digits of a double, even for positions in floats, so that readers get the same point. */
static char *write_value(const cli_points_writer *w, char *at, double value, bool position) {
    const float single = (float)value;
    if (w->text) {
        at = position ? vshi_decimal_write_double(at, value) : vshi_decimal_write_float(at, single);
        *at++ = w->delimiter;
        return at;
    }
    if (position && !w->floats && w->format != VSHI_TABLE_RAW) {
        uint64_t bits;
        memcpy(&bits, &value, sizeof bits);
        return write_bits(w, at, bits, sizeof bits);
    }
    uint32_t bits;
    memcpy(&bits, &single, sizeof bits);
    return write_bits(w, at, bits, sizeof bits);
}

static bool write_row(const cli_points_writer *w, const cli_points *points, size_t i) {
    char *at = w->row;
    if (w->keep) {
        const size_t begin = i > 0 ? points->kept_end[i - 1] : 0, size = points->kept_end[i] - begin;
        if (fwrite(points->kept + begin, 1, size, w->file) != size) {
            return false;
        }
        if (w->text) {
            *at++ = w->delimiter;
        }
    } else if (!w->answers_only) {
        for (size_t k = 0; k < 3; ++k) {
            at = write_value(w, at, points->positions[3 * i + k], true);
        }
        for (size_t k = 0; w->normals && k < 3; ++k) {
            at = write_value(w, at, points->normals[3 * i + k], false);
        }
    }
    for (size_t c = 0; c < w->answers->width; ++c) {
        at = write_value(w, at, w->answers->values[i * w->answers->width + c], false);
    }
    if (w->text) {
        at[-1] = '\n';
    }
    return fwrite(w->row, 1, (size_t)(at - w->row), w->file) == (size_t)(at - w->row);
}

int cli_points_write(cli_points_writer *w, const cli_points *points) {
    cli_end_progress(); /* standard output may be the same terminal */
    for (size_t i = 0; i < points->count; ++i) {
        if (!write_row(w, points, i)) {
            return fail(w);
        }
    }
    w->rows += points->count;
    return fflush(w->file) == 0 ? CLI_OK : fail(w);
}

int cli_points_writer_commit(cli_points_writer *w, cli_points_reader *reader) {
    CLI_TRY(cli_check(vshi_table_rest(&reader->table, w->keep ? w->file : NULL, &cli_error)));
    if (w->counted) {
        if (fseek(w->file, 0, SEEK_SET) != 0) {
            return fail(w);
        }
        write_ply_head(w, w->rows);
    }
    if (w->spool != NULL && (fseek(w->spool, 0, SEEK_SET) != 0 || !cli_copy(w->spool, stdout))) {
        return fail(w);
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
    free(w->row);
    *w = (cli_points_writer){0};
}
