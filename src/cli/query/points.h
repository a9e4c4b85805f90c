/* Points as rows of files and pipes: CSV, PLY and raw floats, read and written a batch at a time.
 *
 * A row is bad where it has too few columns, a column that is no number, a position or normal that is not
 * finite, or a normal of zero. Bad rows keep their place, and their values are NaN; what could be read of
 * them stays. */
#ifndef CLI_POINTS_H
#define CLI_POINTS_H

#include "cli/temporary.h"
#include "table/table.h"

/* Parses an option's "csv", "ply" or "raw" to VSHI_TABLE_CSV, …; returns an exit code. */
int cli_points_parse_format(const char *option, const char *text, int32_t *format);
int32_t cli_points_format_of_path(const char *path); /* by its ending; -1 */

/* Rows in memory. */
typedef struct cli_points {
    size_t room, count;
    double *positions; /* [room][3] */
    float *normals;    /* [room][3]; NULL where there are none */
    uint32_t *texels;  /* [room]: the rows' numbers */
    /* the rows' own bytes, without the end of a line; NULL where they are not kept */
    char *kept;
    size_t kept_size, kept_room;
    size_t *kept_end; /* [room] */
} cli_points;

/* Bytes that a row takes, its own bytes but for text's included. */
size_t cli_points_bytes(bool normals, bool keep);
int cli_points_create(size_t room, bool normals, bool keep, cli_points *points);
void cli_points_free(cli_points *points);

typedef struct cli_points_reader {
    vshi_table table;
    vshi_job *job;            /* looks for interrupts */
    bool has_normals, floats; /* floats: positions came as such */
    bool strict;              /* a bad row ends it */
    uint64_t bad;             /* rows so far */
    /* the vertices of a PLY's faces in the order of its rows, without those that no face has; NULL: normals,
     * if any, are in the rows */
    float *face_positions, *face_normals; /* [face_vertices][3] */
    size_t face_vertices, next;           /* next: to be met */
} cli_points_reader;

/* Opens a file, or standard input for "-", and reads its header. `normals`: 1 they are there and are taken, 0
 * they are not, -1 where they are there. These return CLI_OK or an exit code, having said why. */
int cli_points_open(const char *path, int32_t format, int normals, bool strict, cli_points_reader *reader);

/* Gives a PLY's points the normals of its faces, if they have none. Why it did not into error->message: ""
 * where there are no faces. */
void cli_points_take_faces(const char *path, const vsh_run *run, cli_points_reader *reader, vsh_error *error);

/* Up to points->room rows; fewer only at the end, or where the room of kept bytes is used up. */
int cli_points_read(cli_points_reader *reader, size_t most_kept, cli_points *points);
void cli_points_close(cli_points_reader *reader);

/* Whether the rows can be kept, with what is in the file beside them. */
bool cli_points_can_keep(const cli_points_reader *reader);

/* --- writing */

typedef struct cli_points_column {
    char name[80];
    const float *values;
    size_t stride; /* floats */
} cli_points_column;

typedef struct cli_points_writer {
    const char *name;
    int32_t format;
    bool answers_only, keep;
    bool text, big_endian, floats, normals; /* of the rows */
    char delimiter;
    const cli_points_column *columns;
    size_t column_count;
    FILE *file;  /* where rows go */
    FILE *spool; /* which is this where the head needs their number, and standard output cannot go back */
    cli_temporary temporary;
    uint64_t rows;
    bool counted; /* the head is written again with the number of rows */
    char *row;    /* room for one */
} cli_points_writer;

/* Begins a file, or standard output for "-". The reader's header is open. */
int cli_points_writer_open(const char *path, int32_t format, bool answers_only,
                           const cli_points_reader *reader, const cli_points_column *columns,
                           size_t column_count, cli_points_writer *writer);
int cli_points_write(cli_points_writer *writer, const cli_points *points);
int cli_points_writer_flush(cli_points_writer *writer); /* what a pipe's other end waits for */
int cli_points_writer_commit(cli_points_writer *writer, cli_points_reader *reader);
void cli_points_writer_free(cli_points_writer *writer); /* abandons what is not committed */

#endif
