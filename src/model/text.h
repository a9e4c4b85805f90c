/* A file of text: its bytes, memory that it takes, names and tokens in it. */
#ifndef VSHI_TEXT_H
#define VSHI_TEXT_H

#include "base/job.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

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

/* A file in memory; zeros before it is read. */
typedef struct vshi_text {
    const char *path;
    vshi_budget *budget;
    vshi_job *job;
    size_t units, units_done; /* of the job: for the whole text; told so far */
    char *bytes;              /* [size], and 16 line ends behind them, of which no file tells */
    size_t size, capacity;
    const char *next_poll;
} vshi_text;

/* Reads the file, which messages call `name`. `path`, budget and job outlive the text. Errors: VSH_ERROR_READ
 * (also where it is empty), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. Free after a failure too. */
vsh_result vshi_text_read(vshi_text *text, const char *path, const char *name, vshi_budget *budget,
                          vshi_job *job, size_t units, vsh_error *error);
void vshi_text_free(vshi_text *text);

/* Tells the job, from time to time, that all in front of `at` has been parsed. Errors: VSH_ERROR_CANCELLED.
 */
vsh_result vshi_text_poll(vshi_text *text, const char *at, vsh_error *error);

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
