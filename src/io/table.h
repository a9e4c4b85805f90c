/* Tables of numbers in files and pipes: CSV, the vertices of a PLY, and raw floats. Reads some of their
 * columns, a row at a time. */
#pragma once

#include "base/bytes.h"
#include "base/job.h"

#include <string.h>

/* --- bytes of a file or a pipe */

/* Begins as zeros. Functions fail with VSH_ERROR_READ, VSH_ERROR_MEMORY, and as they say. */
typedef struct vshi_source {
    const char *name; /* for messages */
    vshi_job *job;    /* its units are bytes; it may cancel (VSH_ERROR_CANCELLED); may be NULL */
    FILE *file;       /* NULL: standard input */
    bool ended;
    char *buffer;
    size_t begin, end, room;
    uint64_t taken; /* bytes that were skipped */
    uint64_t size;  /* bytes of a regular file; 0: not known */
} vshi_source;

/* Opens a regular file of at most `most` bytes, or (NULL) standard input. Errors: as vshi_input_open().
 * Close it even after an error. */
vsh_result vshi_source_open(const char *path, uint64_t most, vshi_source *source, vsh_error *error);
void vshi_source_close(vshi_source *source);

/* Skips a byte order mark. */
vsh_result vshi_source_skip_mark(vshi_source *source, vsh_error *error);

/* Reads the next line, without its end (\n or \r\n). *line is NULL at the end of the bytes, and valid until
 * the next call. Errors: VSH_ERROR_INPUT (longer than 64 MiB). */
vsh_result vshi_source_line(vshi_source *source, const char **line, size_t *size, vsh_error *error);

/* --- the header of a PLY (G. Turk, "The PLY polygon file format", 1994) */

/* Types of numbers. Lower ones are whole numbers of 1, 1, 2, 2, 4 and 4 bytes; odd ones are unsigned. */
enum { VSHI_PLY_FLOAT = 6, VSHI_PLY_DOUBLE = 7 };

enum { VSHI_PLY_PROPERTIES = 256, VSHI_PLY_ELEMENTS = 32, VSHI_PLY_NAME = 64 };

typedef struct vshi_ply_property {
    char name[VSHI_PLY_NAME];
    int8_t type, count_type; /* count_type -1: no list */
} vshi_ply_property;

typedef struct vshi_ply_element {
    char name[VSHI_PLY_NAME];
    uint64_t count;
    int first, end; /* properties */
} vshi_ply_element;

/* Begins as zeros. */
typedef struct vshi_ply_header {
    int lines;
    bool ascii, big_endian, ended;
    int elements, properties;
    vshi_ply_element element[VSHI_PLY_ELEMENTS];
    vshi_ply_property property[VSHI_PLY_PROPERTIES];
} vshi_ply_header;

/* Parses the next line of file `name`, without its end. The last one sets `ended`. Names are cut to
 * VSHI_PLY_NAME - 1 bytes. Errors: VSH_ERROR_INPUT. */
vsh_result vshi_ply_header_line(vshi_ply_header *header, const char *name, const char *line, size_t size,
                                vsh_error *error);

/* Fail with VSH_ERROR_READ: file `name` ends in its header, or in that row of an element. */
vsh_result vshi_ply_fail_header(const char *name, vsh_error *error);
vsh_result vshi_ply_fail_short(const char *name, const vshi_ply_element *element, uint64_t row,
                               vsh_error *error);

/* Returns the bytes of a binary number. */
static inline int vshi_ply_size(int type) {
    return type < VSHI_PLY_FLOAT ? 1 << type / 2 : type == VSHI_PLY_FLOAT ? 4 : 8;
}

/* Reads a number of a binary file. */
static inline double vshi_ply_number(const char *bytes, int type, bool big_endian) {
    if (type == VSHI_PLY_FLOAT) {
        uint32_t bits; /* one load, because most numbers are floats */
        float number;
        memcpy(&bits, bytes, sizeof bits);
        bits = big_endian != (__BYTE_ORDER__ == __ORDER_BIG_ENDIAN__) ? __builtin_bswap32(bits) : bits;
        memcpy(&number, &bits, sizeof number);
        return (double)number;
    }
    if (type == VSHI_PLY_DOUBLE) {
        const uint64_t bits = vshi_bytes_number(bytes, sizeof bits, big_endian);
        double number;
        memcpy(&number, &bits, sizeof number);
        return number;
    }
    return (double)vshi_bytes_integer(bytes, vshi_ply_size(type), type % 2 == 0, big_endian);
}

/* --- rows */

enum { VSHI_TABLE_CSV, VSHI_TABLE_PLY, VSHI_TABLE_RAW };

enum { VSHI_TABLE_COLUMNS = 6 };

/* The columns that a caller wants. Files without names have them first, in this order. */
typedef struct vshi_table_columns {
    const char *names[VSHI_TABLE_COLUMNS]; /* of any case in CSV */
    int count;
    int needed; /* number of required ones, which come first. The others are read if a file has all of them,
                   but never from raw floats */
} vshi_table_columns;

typedef struct vshi_table {
    vshi_source source;
    int32_t format;
    vshi_table_columns wanted;
    int columns;   /* that are read: `needed` or `count` */
    uint64_t rows; /* so far */
    char *header;  /* lines of the header, with their ends (CSV: one line, without); NULL: none */
    size_t header_size, header_insert; /* the place for new properties of a PLY */
    vshi_ply_header ply;               /* zeros for other formats */
    int vertex;                        /* number of that element */
    int8_t *column_of;                 /* [fields of a row]: the column, or -1 */
    /* rows of text */
    char delimiter;    /* between fields: a character, or VSHI_BETWEEN_BLANKS */
    int fields, width; /* fields that a row needs; fields of the first line */
    /* rows of bytes */
    size_t row_size;                                          /* 0: of text */
    int offset[VSHI_TABLE_COLUMNS], type[VSHI_TABLE_COLUMNS]; /* of the columns: bytes, types as of PLY */
} vshi_table;

typedef struct vshi_table_row {
    const char *bytes; /* without a line's end, valid until the next call; NULL: no more rows */
    size_t size;
    double value[VSHI_TABLE_COLUMNS]; /* [columns]; NaN where the row is bad */
    char bad[96];                     /* why the row is bad; "": it is good */
    int missing;                      /* fields that a bad row lacks */
} vshi_table_row;

/* Opens a file, or (NULL) standard input, and reads its header. The units of `job` are bytes; it outlives the
 * table, and may be NULL. Close the table even after an error. Errors: VSH_ERROR_READ, VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED, VSH_ERROR_INPUT (a bad header, missing columns). */
VSHI_SHARED vsh_result vshi_table_open(const char *path, int32_t format, const vshi_table_columns *wanted,
                                       vshi_job *job, vshi_table *table, vsh_error *error);
VSHI_SHARED void vshi_table_close(vshi_table *table);

/* Reads the next row. Errors: VSH_ERROR_READ (also if the file ends within it), VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED, VSH_ERROR_INPUT (longer than 64 MiB). */
VSHI_SHARED vsh_result vshi_table_next(vshi_table *table, vshi_table_row *row, vsh_error *error);

/* Reads a PLY's elements after the rows, and copies them to `to`, if that is not NULL. Errors: as above. */
VSHI_SHARED vsh_result vshi_table_rest(vshi_table *table, FILE *to, vsh_error *error);

/* --- fields of lines */

typedef struct vshi_field {
    const char *text, *end;
} vshi_field;

/* Delimiters that are no single character: any blanks; or a comma, a semicolon or blanks. */
enum { VSHI_BETWEEN_BLANKS = ' ', VSHI_BETWEEN_ANY = '\0' };

/* Reads the field at *at, without blanks and quotes around it. *at moves to the next field, and past `end`
 * after the last. */
vshi_field vshi_field_next(const char **at, const char *end, char delimiter);

/* Whether a line holds only blanks, or a comment after '#'. */
bool vshi_line_is_empty(const char *line, size_t size);
