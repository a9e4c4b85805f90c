/* Points as rows of files and pipes: CSV, PLY and raw floats, read and written a batch at a time.
 *
 * A row is bad if a column is missing or no number, if a position or normal is not finite, or if a normal is
 * zero. A bad row keeps its place and the values that could be read; the others are NaN. */
#pragma once

#include "cli/cli.h"
#include "io/table.h"

/* Rows in memory. */
typedef struct cli_points {
    size_t room, count;
    double *positions; /* [room][3] */
    float *normals;    /* [room][3]; NULL: the points have none */
    uint32_t *texels;  /* [room]: the rows' numbers */
    /* the rows' own bytes, without the end of a line; NULL: they are not kept */
    char *kept;
    size_t kept_size, kept_room;
    size_t *kept_end; /* [room] */
} cli_points;

cli_points cli_points_create(size_t room, bool normals, bool keep);
void cli_points_free(cli_points *points);

typedef struct cli_points_reader {
    vshi_table table;
    vshi_job *job;            /* sees interrupts */
    bool has_normals, floats; /* floats: positions are floats in the file */
    bool strict;              /* a bad row ends the reading */
    uint64_t bad;             /* bad rows so far */
} cli_points_reader;

/* Opens a file, or standard input for "-", and reads its header. `normals`: 1 requires them, 0 ignores them,
 * -1 reads them if there are any. Close it even after a failure. */
int cli_points_open(const char *path, int32_t format, int normals, bool strict, cli_points_reader *reader);

/* Reads up to points->room rows; fewer at the end, or if they have more than `most_kept` bytes. */
int cli_points_read(cli_points_reader *reader, size_t most_kept, cli_points *points);
void cli_points_close(cli_points_reader *reader);

/* Whether rows can be written as they came: not if a PLY has other elements before its vertices. */
bool cli_points_can_keep(const cli_points_reader *reader);

/* --- writing */

/* The answers of a batch. */
typedef struct cli_points_answers {
    char (*names)[80]; /* [width] */
    float *values;     /* [rows of the batch][width] */
    size_t width;
} cli_points_answers;

typedef struct cli_points_writer {
    const char *name;
    int32_t format;
    bool answers_only, keep;
    bool text, big_endian, floats, normals; /* of the rows */
    char delimiter;
    const cli_points_answers *answers;
    FILE *file;  /* for head and rows */
    FILE *spool; /* the same file, if standard output needs the number of rows first; else NULL */
    cli_temporary temporary;
    uint64_t rows;
    bool counted; /* the head is written again with the number of rows */
    char *row;    /* room for one */
} cli_points_writer;

/* Begins a file, or standard output for "-". The reader is open. */
int cli_points_writer_open(const char *path, int32_t format, bool answers_only,
                           const cli_points_reader *reader, const cli_points_answers *answers,
                           cli_points_writer *writer);
/* Writes a batch, and sends it into a pipe now. */
int cli_points_write(cli_points_writer *writer, const cli_points *points);
int cli_points_writer_commit(cli_points_writer *writer, cli_points_reader *reader);
void cli_points_writer_free(cli_points_writer *writer); /* abandons an output that is not committed */
