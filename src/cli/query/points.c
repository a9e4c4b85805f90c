/* Points as rows of files and pipes: read and checked a batch at a time, and written with their answers. */
#include "points.h"
#include "base/decimal.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/signals.h"

#include <errno.h>
#include <float.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <vdbshade/scene.h>

static const char *const point_names[VSHI_TABLE_COLUMNS] = {"x", "y", "z", "nx", "ny", "nz"};

enum {
    NX = 3,  /* columns before the normal */
    SAID = 5 /* bad rows that get a message each */
};

int cli_points_parse_format(const char *option, const char *text, int32_t *format) {
    static const char *const names[] = {"csv", "ply", "raw"};
    for (*format = 0; *format < 3; ++*format) {
        if (strcmp(text, names[*format]) == 0) {
            return CLI_OK;
        }
    }
    return cli_usage("%s '%s': expected one of csv, ply, raw", option, text);
}

int32_t cli_points_format_of_path(const char *path) {
    return cli_has_ending(path, "csv tsv txt xyz") ? VSHI_TABLE_CSV
           : cli_has_ending(path, "ply")           ? VSHI_TABLE_PLY
           : cli_has_ending(path, "raw f32 bin")   ? VSHI_TABLE_RAW
                                                   : -1;
}

/* --- batches */

size_t cli_points_bytes(bool normals, bool keep) {
    return 3 * sizeof(double) + (normals ? 3 * sizeof(float) : 0) + sizeof(uint32_t) +
           (keep ? sizeof(size_t) : 0);
}

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

/* Sets row->bad if its values cannot be used. */
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
        snprintf(row->bad, sizeof row->bad, "%s",
                 reader->face_normals != NULL ? "its faces give it no normal" : "the normal is zero");
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

/* --- normals of faces */

/* Makes each vertex's normal: the sum of its triangles' normals, weighted by area. */
static void make_normals(const vsh_mesh *mesh, cli_points_reader *reader) {
    const size_t count = mesh->vertex_count;
    float *positions = malloc(count * 3 * sizeof *positions), *normals = malloc(count * 3 * sizeof *normals);
    double *sums = calloc(count, 3 * sizeof *sums);
    for (size_t t = 0; t < mesh->triangle_count; ++t) {
        const size_t corner[] = {mesh->indices[3 * t], mesh->indices[3 * t + 1], mesh->indices[3 * t + 2]};
        const float *p = mesh->positions + 3 * corner[0];
        double a[3], b[3];
        for (size_t k = 0; k < 3; ++k) {
            a[k] = (double)mesh->positions[3 * corner[1] + k] - (double)p[k];
            b[k] = (double)mesh->positions[3 * corner[2] + k] - (double)p[k];
        }
        for (size_t i = 0; i < 9; ++i) {
            const size_t k = i % 3, x = (k + 1) % 3, y = (k + 2) % 3;
            sums[3 * corner[i / 3] + k] += a[x] * b[y] - a[y] * b[x];
        }
    }
    for (size_t v = 0; v < count; ++v) {
        const double *s = sums + 3 * v, length = sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
        for (size_t k = 0; k < 3; ++k) {
            normals[3 * v + k] = length > 0.0 ? (float)(s[k] / length) : 0.0f;
            positions[3 * v + k] = mesh->positions[3 * v + k];
        }
    }
    free(sums);
    reader->face_positions = positions;
    reader->face_normals = normals;
    reader->face_vertices = count;
    reader->has_normals = true;
}

static bool has_faces(const vshi_ply_header *ply) {
    for (int e = 0; e < ply->elements; ++e) {
        if (ply->element[e].count > 0 &&
            (strcmp(ply->element[e].name, "face") == 0 || strcmp(ply->element[e].name, "tristrips") == 0)) {
            return true;
        }
    }
    return false;
}

void cli_points_take_faces(const char *path, const vsh_run *run, cli_points_reader *reader,
                           vsh_error *error) {
    *error = (vsh_error){VSH_OK, ""};
    if (reader->has_normals || !has_faces(&reader->table.ply)) {
        return;
    }
    if (strcmp(path, "-") == 0) {
        snprintf(error->message, sizeof error->message, "normals of faces need a file, not a pipe");
        return;
    }
    vsh_model *model = NULL;
    if (vsh_model_read(path, run, &model, error) != VSH_OK) {
        return;
    }
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    make_normals(&mesh, reader);
    vsh_model_free(model);
}

/* Gives the row the normal of the next vertex of a face, if that lies there. */
static void set_normal(cli_points_reader *reader, vshi_table_row *row) {
    const size_t v = reader->next;
    bool met = v < reader->face_vertices;
    for (size_t k = 0; k < 3; ++k) {
        met = met && (float)row->value[k] == reader->face_positions[3 * v + k];
    }
    for (size_t k = 0; k < 3; ++k) {
        row->value[NX + k] = met ? (double)reader->face_normals[3 * v + k] : 0.0;
    }
    reader->next += met;
}

static int32_t look_for_interrupt(void *user, const char *stage, double fraction) {
    (void)user;
    (void)stage;
    (void)fraction;
    return cli_interrupted();
}

int cli_points_open(const char *path, int32_t format, int normals, bool strict, cli_points_reader *reader) {
    const vshi_table_columns wanted = {
        {"x", "y", "z", "nx", "ny", "nz"}, normals == 0 ? NX : NX + 3, normals == 1 ? NX + 3 : NX};
    vsh_run run = vsh_run_default();
    run.progress = look_for_interrupt;
    *reader = (cli_points_reader){.strict = strict, .job = vshi_job_begin(&run, "points", SIZE_MAX)};
    vshi_table *t = &reader->table;
    vsh_error error;
    path = strcmp(path, "-") != 0 ? path : NULL;
    if (vshi_table_open(path, format, &wanted, reader->job, t, &error) != VSH_OK) {
        struct stat status;
        const bool waits = path != NULL && error.code == VSH_ERROR_READ && stat(path, &status) == 0 &&
                           !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode);
        if (waits) {
            cli_say("%s; a pipe is read as standard input, by --points -", error.message);
            return CLI_FILE;
        }
        return cli_fail(&error);
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
        vsh_error error;
        CLI_TRY(cli_check(vshi_table_next(&reader->table, &row, &error), &error));
        if (row.bytes == NULL) {
            break;
        }
        if (row.bad[0] == '\0' && reader->face_normals != NULL) {
            set_normal(reader, &row);
        }
        if (row.bad[0] == '\0') {
            check_row(reader, &row);
        }
        if (row.bad[0] != '\0' && (++reader->bad <= SAID || reader->strict)) {
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
    free(reader->face_positions);
    free(reader->face_normals);
    reader->face_positions = reader->face_normals = NULL;
    vshi_job_end(reader->job);
    reader->job = NULL;
}

/* --- writing: the rows as they came if the format is the same, else position and normal; then answers */

enum { COUNT_WIDTH = 20 };

static int fail(const cli_points_writer *w) {
    cli_say("%s: cannot be written: %s", w->name, strerror(errno));
    return CLI_FILE;
}

/* --- heads */

/* The name of a column before the answers, if rows are not kept; NULL behind the last. */
static const char *own_name(const cli_points_writer *w, int i) {
    return w->answers_only || w->keep || i >= (w->normals ? 6 : 3) ? NULL : point_names[i];
}

static void write_csv_head(cli_points_writer *w, const cli_points_reader *reader) {
    size_t written = 0;
    if (w->keep) {
        if (reader->table.header == NULL) {
            return; /* a file without a header stays one */
        }
        fwrite(reader->table.header, 1, reader->table.header_size, w->file);
        ++written;
    }
    for (int i = 0; own_name(w, i) != NULL; ++i, ++written) {
        fprintf(w->file, "%.*s%s", written > 0, &w->delimiter, own_name(w, i));
    }
    for (size_t c = 0; c < w->answers->width; ++c, ++written) {
        fprintf(w->file, "%.*s%s", written > 0, &w->delimiter, w->answers->names[c]);
    }
    putc('\n', w->file);
}

static void write_ply_properties(const cli_points_writer *w) {
    for (int i = 0; own_name(w, i) != NULL; ++i) {
        fprintf(w->file, "property %s %s\n", i < 3 && !w->floats ? "double" : "float", own_name(w, i));
    }
    for (size_t c = 0; c < w->answers->width; ++c) {
        fprintf(w->file, "property float %s\n", w->answers->names[c]);
    }
}

/* The head is as long for any number of rows: a comment takes up the rest. */
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

static void write_kept_ply_head(const cli_points_writer *w, const cli_points_reader *reader) {
    fwrite(reader->table.header, 1, reader->table.header_insert, w->file);
    write_ply_properties(w);
    fwrite(reader->table.header + reader->table.header_insert, 1,
           reader->table.header_size - reader->table.header_insert, w->file);
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
        if (there) {
            return cli_usage("%s: it has a column '%s' already; --answers-only leaves its columns out",
                             reader->table.source.name, name);
        }
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
        write_kept_ply_head(w, reader);
    } else if (format == VSHI_TABLE_PLY) {
        write_ply_head(w, w->counted ? 0 : reader->table.ply.element[reader->table.vertex].count);
    }
    return ferror(w->file) ? fail(w) : CLI_OK;
}

/* --- rows */

static char *put_bits(const cli_points_writer *w, char *at, uint64_t bits, size_t size) {
    for (size_t i = 0; i < size; ++i) {
        at[i] = (char)(bits >> 8 * (w->big_endian ? size - 1 - i : i));
    }
    return at + size;
}

/* Text has all digits of a double even for a float's position, so that readers get the same point. */
static char *put_value(const cli_points_writer *w, char *at, double value, bool position) {
    const float single = (float)value;
    if (w->text) {
        at = position ? vshi_decimal_write_double(at, value) : vshi_decimal_write_float(at, single);
        *at++ = w->delimiter;
        return at;
    }
    if (position && !w->floats && w->format != VSHI_TABLE_RAW) {
        uint64_t bits;
        memcpy(&bits, &value, sizeof bits);
        return put_bits(w, at, bits, sizeof bits);
    }
    uint32_t bits;
    memcpy(&bits, &single, sizeof bits);
    return put_bits(w, at, bits, sizeof bits);
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
            at = put_value(w, at, points->positions[3 * i + k], true);
        }
        for (size_t k = 0; w->normals && k < 3; ++k) {
            at = put_value(w, at, points->normals[3 * i + k], false);
        }
    }
    for (size_t c = 0; c < w->answers->width; ++c) {
        at = put_value(w, at, w->answers->values[i * w->answers->width + c], false);
    }
    if (w->text) {
        at[-1] = '\n';
    }
    return fwrite(w->row, 1, (size_t)(at - w->row), w->file) == (size_t)(at - w->row);
}

int cli_points_write(cli_points_writer *w, const cli_points *points) {
    for (size_t i = 0; i < points->count; ++i) {
        if (!write_row(w, points, i)) {
            return fail(w);
        }
    }
    w->rows += points->count;
    return fflush(w->file) == 0 ? CLI_OK : fail(w);
}

/* Copies the spool to standard output. */
static int copy_spool(const cli_points_writer *w) {
    rewind(w->spool);
    char bytes[1 << 14];
    size_t got;
    while ((got = fread(bytes, 1, sizeof bytes, w->spool)) > 0) {
        if (fwrite(bytes, 1, got, stdout) != got) {
            return fail(w);
        }
    }
    return ferror(w->spool) ? fail(w) : CLI_OK;
}

int cli_points_writer_commit(cli_points_writer *w, cli_points_reader *reader) {
    vsh_error error;
    CLI_TRY(cli_check(vshi_table_rest(&reader->table, w->keep ? w->file : NULL, &error), &error));
    if (w->counted) {
        if (fseek(w->file, 0, SEEK_SET) != 0) {
            return fail(w);
        }
        write_ply_head(w, w->rows);
    }
    if (w->spool != NULL) {
        CLI_TRY(fflush(w->spool) == 0 ? copy_spool(w) : fail(w));
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
