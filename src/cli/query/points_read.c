/* Rows of points, checked, a batch at a time. */
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/signals.h"
#include "cli/try.h"
#include "points.h"

#include <float.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <vdbshade/scene.h>

enum { NX = 3 }; /* columns before the normal */

enum { TOLD = 5 }; /* bad rows that are told one by one */

static const struct {
    const char *ending;
    int32_t format;
} endings[] = {
    {"csv", VSHI_TABLE_CSV}, {"tsv", VSHI_TABLE_CSV}, {"txt", VSHI_TABLE_CSV}, {"xyz", VSHI_TABLE_CSV},
    {"ply", VSHI_TABLE_PLY}, {"raw", VSHI_TABLE_RAW}, {"f32", VSHI_TABLE_RAW}, {"bin", VSHI_TABLE_RAW},
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
        return cli_out_of_memory("points");
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

static int keep_row(cli_points *points, const char *raw, size_t size) {
    if (points->kept_size + size > points->kept_room) {
        const size_t room = 2 * (points->kept_size + size) + 4096;
        char *more = realloc(points->kept, room);
        if (more == NULL) {
            return cli_out_of_memory("points");
        }
        points->kept = more;
        points->kept_room = room;
    }
    memcpy(points->kept + points->kept_size, raw, size);
    points->kept_size += size;
    return CLI_OK;
}

/* Fields that a bad row lacks, so that answers stay in their columns. */
static int keep_fillers(cli_points *points, char delimiter, int missing) {
    const char filler[] = {delimiter, 'n', 'a', 'n'};
    for (; missing > 0; --missing) {
        CLI_TRY(keep_row(points, filler, delimiter == ' ' ? sizeof filler : 1));
    }
    return CLI_OK;
}

/* Says what a row that can be read has against it. */
static void check_row(const cli_points_reader *reader, vshi_table_row *row) {
    const char *const *names = reader->table.wanted.names;
    bool zero = reader->has_normals;
    for (int i = 0; i < (reader->has_normals ? NX + 3 : NX); ++i) {
        const double value = row->value[i];
        if (!isfinite(value)) {
            snprintf(row->bad, sizeof row->bad, "%s is not finite", names[i]);
            return;
        }
        if (i >= NX && fabs(value) > FLT_MAX) {
            snprintf(row->bad, sizeof row->bad, "%s is beyond the range of floats", names[i]);
            return;
        }
        zero = zero && (i < NX || (float)value == 0.0f);
    }
    if (zero) {
        snprintf(row->bad, sizeof row->bad, "%s",
                 reader->face_normals != NULL ? "its faces give it no normal" : "the normal is zero");
    }
}

/* Into points[count], which is counted. */
static int take_row(const cli_points_reader *reader, const vshi_table_row *row, cli_points *points) {
    const size_t i = points->count;
    memcpy(points->positions + 3 * i, row->value, 3 * sizeof *row->value);
    for (size_t axis = 0; points->normals != NULL && axis < 3; ++axis) {
        points->normals[3 * i + axis] = (float)row->value[NX + axis];
    }
    points->texels[i] = (uint32_t)(reader->table.rows - 1);
    if (points->kept_end != NULL) {
        CLI_TRY(keep_row(points, row->bytes, row->size));
        CLI_TRY(keep_fillers(points, reader->table.delimiter, row->missing));
        points->kept_end[i] = points->kept_size;
    }
    ++points->count;
    return CLI_OK;
}

/* --- normals of faces */

/* Sums of the triangles' normals by area at each vertex, and its position. */
static bool sum_normals(const vsh_mesh *mesh, cli_points_reader *reader) {
    const size_t count = mesh->vertex_count;
    float *positions = malloc(count * 3 * sizeof *positions), *normals = malloc(count * 3 * sizeof *normals);
    double *sums = calloc(count, 3 * sizeof *sums);
    const bool good = positions != NULL && normals != NULL && sums != NULL;
    for (size_t t = 0; good && t < mesh->triangle_count; ++t) {
        const uint32_t *corner = mesh->indices + 3 * t;
        double a[3], b[3];
        for (int k = 0; k < 3; ++k) {
            const double at = (double)mesh->positions[3 * (size_t)corner[0] + (size_t)k];
            a[k] = (double)mesh->positions[3 * (size_t)corner[1] + (size_t)k] - at;
            b[k] = (double)mesh->positions[3 * (size_t)corner[2] + (size_t)k] - at;
        }
        for (int i = 0; i < 3; ++i) {
            for (int k = 0; k < 3; ++k) {
                sums[3 * (size_t)corner[i] + (size_t)k] +=
                    a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
            }
        }
    }
    for (size_t v = 0; good && v < count; ++v) {
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
    return good;
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
        snprintf(error->message, sizeof error->message, "those of its faces need a file, not a pipe");
        return;
    }
    vsh_model *model = NULL;
    if (vsh_model_read(path, run, &model, error) != VSH_OK) {
        return;
    }
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    reader->has_normals = sum_normals(&mesh, reader);
    vsh_model_free(model);
    if (!reader->has_normals) {
        snprintf(error->message, sizeof error->message, "the system refused memory");
    }
}

/* The faces' normal of a row: of the next of their vertices, if that lies there. */
static void find_normal(cli_points_reader *reader, vshi_table_row *row) {
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
        if (vshi_table_next(&reader->table, &row, &error) != VSH_OK) {
            return cli_fail(&error);
        }
        if (row.bytes == NULL) {
            break;
        }
        if (row.bad[0] == '\0' && reader->face_normals != NULL) {
            find_normal(reader, &row);
        }
        if (row.bad[0] == '\0') {
            check_row(reader, &row);
        }
        if (row.bad[0] != '\0' && (++reader->bad <= TOLD || reader->strict)) {
            cli_say("%s: row %" PRIu64 ": %s", reader->table.source.name, reader->table.rows, row.bad);
        }
        if (row.bad[0] != '\0' && reader->strict) {
            return CLI_USAGE;
        }
        CLI_TRY(take_row(reader, &row, points));
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
