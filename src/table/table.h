/* Tables of numbers in files and pipes: CSV, the vertices of a PLY, and raw floats; some of their columns,
 * read a row at a time. */
#ifndef VSHI_TABLE_H
#define VSHI_TABLE_H

#include "base/job.h"
#include "table/ply.h"

#include <stdio.h>

/* --- bytes of a file or a pipe, in lines or runs */

/* Begins as zeros. Functions fail with VSH_ERROR_READ, VSH_ERROR_MEMORY, and as they say. */
typedef struct vshi_source {
    const char *name; /* for messages */
    vshi_job *job; /* takes the bytes that are read as units, and may cancel (VSH_ERROR_CANCELLED); or NULL */
    FILE *file;    /* NULL: standard input */
    bool ended;
    char *buffer;
    size_t begin, end, room;
    uint64_t taken; /* bytes given out */
    uint64_t size;  /* bytes of a regular file; 0: not known */
} vshi_source;

/* Opens a regular file of at most `most` bytes, or (NULL) standard input. Errors: as of vshi_input_open().
 * Close it in any case. */
vsh_result vshi_source_open(const char *path, uint64_t most, vshi_source *source, vsh_error *error);
void vshi_source_close(vshi_source *source);

/* Takes a byte order mark, if the next bytes are one. */
vsh_result vshi_source_pass_mark(vshi_source *source, vsh_error *error);

/* The next line without its end (\n or \r\n), which is taken; *line NULL at the end of the bytes. Holds until
 * the next call. Errors: VSH_ERROR_INPUT (longer than 64 MiB). */
vsh_result vshi_source_line(vshi_source *source, const char **line, size_t *size, vsh_error *error);

/* The next `size` bytes, which are not taken; *available tells how many there are, fewer at the end only.
 * Errors: VSH_ERROR_INPUT (more than 64 MiB). */
vsh_result vshi_source_peek(vshi_source *source, size_t size, const char **bytes, size_t *available,
                            vsh_error *error);
void vshi_source_take(vshi_source *source, size_t size);

/* Gives back the line that was taken last. */
void vshi_source_give_back(vshi_source *source, const char *line);

/* --- rows */

enum { VSHI_TABLE_CSV, VSHI_TABLE_PLY, VSHI_TABLE_RAW };

enum { VSHI_TABLE_COLUMNS = 6 };

/* Columns that are wanted. Files without names have them first, in this order. */
typedef struct vshi_table_columns {
    const char *names[VSHI_TABLE_COLUMNS]; /* of any case in CSV */
    int count;
    int needed; /* the first so many; others are taken where all of them are there, and not of raw floats */
} vshi_table_columns;

typedef struct vshi_table {
    vshi_source source;
    int32_t format;
    vshi_table_columns wanted;
    int columns;   /* of them that are taken: `needed` or `count` */
    uint64_t rows; /* so far */
    char *header;  /* lines of the header as they came, with their ends (CSV: one, without); NULL: none */
    size_t header_size, header_insert; /* where a PLY's new properties go */
    vshi_ply_header ply;               /* zeros where it is none */
    int vertex;                        /* number of that element */
    int8_t *column_of;                 /* [fields of a row]: which column it is, or -1 */
    /* rows of text */
    char delimiter;    /* between fields: a character, or VSHI_BETWEEN_BLANKS */
    int fields, width; /* that a row has at least; that the first line has */
    /* rows of bytes */
    size_t row_size;                                          /* 0: of text */
    int offset[VSHI_TABLE_COLUMNS], type[VSHI_TABLE_COLUMNS]; /* of the columns: bytes, types as of PLY */
} vshi_table;

typedef struct vshi_table_row {
    const char *bytes; /* as they came, without a line's end, until the next call; NULL: no more rows */
    size_t size;
    double value[VSHI_TABLE_COLUMNS]; /* [columns]; NaN where the row is bad */
    char bad[96];                     /* why it could not be read; "": it could */
    int missing;                      /* fields that it has fewer than the first line, where it has too few */
} vshi_table_row;

/* Opens a file, or (NULL) standard input, and reads its header. `job` (may be NULL) takes all bytes that are
 * read as units, and outlives the table. Close it in any case. Errors: VSH_ERROR_READ, VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED, VSH_ERROR_INPUT (a header that is none, columns that are not there). */
VSHI_SHARED vsh_result vshi_table_open(const char *path, int32_t format, const vshi_table_columns *wanted,
                                       vshi_job *job, vshi_table *table, vsh_error *error);
VSHI_SHARED void vshi_table_close(vshi_table *table);

/* The next row. Errors: VSH_ERROR_READ (also where the file ends within it), VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED, VSH_ERROR_INPUT (of more than 64 MiB). */
VSHI_SHARED vsh_result vshi_table_next(vshi_table *table, vshi_table_row *row, vsh_error *error);

/* Reads what follows the rows, a PLY's other elements, and writes it to `to`, where that is not NULL, as it
 * came. Errors: as above. */
VSHI_SHARED vsh_result vshi_table_rest(vshi_table *table, FILE *to, vsh_error *error);

/* --- fields of lines */

typedef struct vshi_field {
    const char *text, *end;
} vshi_field;

/* What stands between fields, if it is no character: any blanks; or a comma, a semicolon or blanks, between
 * any two of them. */
enum { VSHI_BETWEEN_BLANKS = ' ', VSHI_BETWEEN_ANY = '\0' };

/* The field at *at, without blanks and quotes around it; *at moves behind its delimiter, and past `end`
 * behind the last. */
vshi_field vshi_field_next(const char **at, const char *end, char delimiter);

/* Whether a line is to be left out: blanks, or a comment behind '#'. */
bool vshi_line_is_empty(const char *line, size_t size);

/* --- the parts of ply.c and table.c */

/* The header of a PLY, and how its rows lie. Errors: as vshi_table_open(). */
vsh_result vshi_table_open_ply(vshi_table *table, vsh_error *error);

/* Sets `columns`, and makes fields -1 whose column is not taken. Returns the name of a column that is needed
 * and not found, or NULL. */
const char *vshi_table_choose(vshi_table *table, const bool found[VSHI_TABLE_COLUMNS], int fields);

#endif
