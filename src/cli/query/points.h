/* Points as rows of files and pipes: CSV, PLY and raw floats, read and written a batch at a time.
 *
 * A row is bad where it has too few columns, a column that is no number, a position or normal that is not
 * finite, or a normal of zero. Bad rows keep their place, and their values are NaN; what could be read of
 * them stays. */
#ifndef CLI_POINTS_H
#define CLI_POINTS_H

#include "base/ply.h"
#include "cli/temporary.h"

#include <stdint.h>

enum { CLI_POINTS_CSV, CLI_POINTS_PLY, CLI_POINTS_RAW };

/* "csv" to CLI_POINTS_CSV and back; -1 and NULL for what is none. */
int32_t cli_points_format(const char *name);
const char *cli_points_format_name(int32_t format);
int32_t cli_points_format_of_path(const char *path); /* by its ending; -1 */

enum { CLI_POINTS_X, CLI_POINTS_NX = 3, CLI_POINTS_SLOTS = 6 };

/* Rows in memory. */
typedef struct cli_points {
    size_t room, count;
    uint64_t first;    /* rows before these */
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

/* Bytes from a file or a pipe, in lines or runs. */
typedef struct points_source {
    const char *name; /* for messages */
    FILE *file;       /* NULL: standard input */
    bool ended;
    char *buffer;
    size_t begin, end, room;
    uint64_t taken; /* bytes given out */
    uint64_t size;  /* of a regular file; 0: not known */
} points_source;

/* "-" is standard input. These return CLI_OK or an exit code, having said why. */
int points_source_open(const char *path, points_source *source);
void points_source_close(points_source *source);

/* The next line without its end (\n or \r\n), which is taken; *line NULL at the end of the bytes. Holds until
 * the next call. */
int points_source_line(points_source *source, const char **line, size_t *size);

/* The next `size` bytes, which are not taken; *available tells how many there are, fewer at the end only. */
int points_source_peek(points_source *source, size_t size, const char **bytes, size_t *available);
void points_source_take(points_source *source, size_t size);

typedef struct cli_points_reader {
    points_source source;
    int32_t format;
    bool has_normals, floats;          /* floats: positions came as such */
    bool strict;                       /* a bad row ends it */
    uint64_t rows, bad;                /* so far */
    char *header;                      /* lines of the header as they came, with their ends; NULL: none */
    size_t header_size, header_insert; /* where a PLY's new properties go */
    /* text */
    char delimiter;  /* ' ': any blanks */
    int columns;     /* that a row has at least */
    int width;       /* that the first line has */
    int8_t *slot_of; /* [columns]: CLI_POINTS_…, or -1 */
    vshi_ply_header ply;
    int vertex;      /* number of that element */
    size_t row_size; /* of a vertex, binary */
    int offset[CLI_POINTS_SLOTS], type[CLI_POINTS_SLOTS];
} cli_points_reader;

/* Opens a file, or standard input for "-", and reads its header. `normals`: 1 they are there and are taken, 0
 * they are not, -1 where they are there. These return CLI_OK or an exit code, having said why. */
int cli_points_open(const char *path, int32_t format, int normals, bool strict, cli_points_reader *reader);

/* Up to points->room rows; fewer only at the end, or where the room of kept bytes is used up. */
int cli_points_read(cli_points_reader *reader, size_t most_kept, cli_points *points);
void cli_points_close(cli_points_reader *reader);

/* Whether the rows can be kept, with what is in the file beside them. */
bool cli_points_can_keep(const cli_points_reader *reader);

/* The formats' own parts of the above. */
int points_csv_open(cli_points_reader *reader, int normals);
int points_ply_open(cli_points_reader *reader, int normals);
int points_ply_row(cli_points_reader *reader, cli_points *points, bool *end);
int points_ply_rest(cli_points_reader *reader, FILE *to); /* elements behind the vertices, as they are */

/* One row of text into points[count], which is counted. */
int points_text_row(cli_points_reader *reader, const char *line, size_t size, cli_points *points);

/* One row of numbers in slots: what it has against it, and into points[count], which is counted. */
int points_check_row(cli_points_reader *reader, const double slot[CLI_POINTS_SLOTS]);
int points_take_row(cli_points_reader *reader, const double slot[CLI_POINTS_SLOTS], const char *raw,
                    size_t size, cli_points *points);

/* Says that the row that comes next is bad; CLI_OK but where that is strictly an error. */
int points_bad(cli_points_reader *reader, const char *format, ...) __attribute__((format(printf, 2, 3)));

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
    bool ascii, big_endian, floats, normals; /* of the rows */
    char delimiter;
    const cli_points_column *columns;
    size_t column_count;
    FILE *file;  /* where rows go */
    FILE *spool; /* which is this where the head needs their number, and standard output cannot go back */
    cli_temporary temporary;
    uint64_t rows;
    long count_at; /* of the head that is written again with the number of rows; -1: none */
    char *buffer;
    size_t used;
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
