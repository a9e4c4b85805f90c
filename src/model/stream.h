/* Reads a file piece by piece. The piece in memory fits the processor's cache, and is no larger than the
 * longest line or row needs. */
#ifndef VSHI_STREAM_H
#define VSHI_STREAM_H

#include "base/job.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

/* --- arrays that grow as a file is read, within the memory limit */

/* The memory that a file takes while it is read. */
typedef struct vshi_budget {
    const char *path;
    const vsh_run *run;
    double bytes; /* size of all arrays of vshi_grow() and vshi_reserve() */
} vshi_budget;

/* Grows the array at *memory (a pointer to a pointer; NULL at first) to `needed` elements of `size` bytes and
 * half as many more, and sets *capacity. Free with free(). Errors: VSH_ERROR_LIMIT, before
 * memory is taken, VSH_ERROR_MEMORY. */
vsh_result vshi_grow(vshi_budget *budget, void *memory, size_t *capacity, size_t needed, size_t size,
                     vsh_error *error);

/* Does the same for exactly `needed` elements. */
vsh_result vshi_reserve(vshi_budget *budget, void *memory, size_t *capacity, size_t needed, size_t size,
                        vsh_error *error);

/* --- the file */

/* Advances a job to `fraction` of `units`; *units_done counts those it has advanced. Returns whether it is
 * cancelled. */
bool vshi_advance_to(vshi_job *job, double fraction, size_t units, size_t *units_done);

/* A window over the file; zeros before it is opened. */
typedef struct vshi_stream {
    const char *path;
    vshi_budget *budget;
    vshi_job *job;
    size_t units, units_done; /* of the job: for the whole file; told so far */
    FILE *file;
    uint64_t size, read; /* bytes of the file; of them read */
    char *buffer;
    size_t capacity;
    const char *at, *end; /* what is there, of which the caller moves `at`; line ends stand behind `end` */
} vshi_stream;

enum { VSHI_STREAM_PADDING = 16 }; /* line ends, of which no file tells */

/* `path`, budget and job outlive the stream. Errors: VSH_ERROR_READ (also where it is empty),
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. Close after a failure too. */
vsh_result vshi_stream_open(vshi_stream *stream, const char *path, vshi_budget *budget, vshi_job *job,
                            size_t units, vsh_error *error);
void vshi_stream_close(vshi_stream *stream);

static inline bool vshi_stream_ended(const vshi_stream *stream) {
    return stream->read == stream->size;
}

/* Reads on behind what is there; pointers into the window no longer hold. At the file's end it does nothing.
 * Errors: VSH_ERROR_READ, VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_stream_fill(vshi_stream *stream, vsh_error *error);

/* Reads on until at … *stop - 1 is whole lines, that end in no '\' (which goes on in the next), or the rest
 * of the file; at == *stop: it is over. */
vsh_result vshi_stream_lines(vshi_stream *stream, const char **stop, vsh_error *error);

/* --- names, each stored once */

/* Zeros before the first. */
typedef struct vshi_words {
    json_t *numbers;    /* by name: Jansson keeps them in a hash table */
    const char **names; /* [count]: its keys */
    size_t count, capacity;
    size_t used; /* bytes of all names, with their ends */
} vshi_words;

/* Finds the number of a name, or adds the name (*is_new) with the next number. Names are cut to 1023 bytes.
 * Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_words_number(vshi_words *words, vshi_budget *budget, const char *name, size_t size,
                             size_t *number, bool *is_new, vsh_error *error);

void vshi_words_free(vshi_words *words);

/* --- tokens */

/* A run of characters that are no white space, within one file. */
typedef struct vshi_token {
    const char *text; /* NULL: there is none */
    size_t size;
} vshi_token;

/* The next token at *at, which moves behind it; stops at `end`. */
vshi_token vshi_scan_token(const char **at, const char *end);

/* All that is left of a line, without white space around it. */
vshi_token vshi_scan_rest(const char *at, const char *end);

bool vshi_token_is(vshi_token token, const char *text);

/* How messages show a token: "%.*s" with these two. Long ones are cut. */
#define VSHI_TOKEN_ARGS(token) ((token).size < 32 ? (int)(token).size : 32), (token).text

typedef enum vshi_number { VSHI_NUMBER_NONE, VSHI_NUMBER_FINITE, VSHI_NUMBER_NOT_FINITE } vshi_number;

/* Whether a token is a decimal number as mesh files write it, or "nan" and "inf" in their spellings. Does not
 * depend on the locale. */
vshi_number vshi_token_number(vshi_token token);

/* A whole number of at most 18 digits, perhaps with a sign; false where the token is none. */
bool vshi_token_integer(vshi_token token, int64_t *value);

#endif
