/* Text files of models: growing arrays within the memory limit, the file's bytes, names and tokens. */
#pragma once

#include "base/job.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* --- arrays that grow within the memory limit */

/* The memory for reading a file. */
typedef struct vshi_budget {
    const char *path;
    const vsh_run *run;
    double bytes; /* of all arrays */
} vshi_budget;

/* Grows the array at *memory (a pointer to a pointer; NULL at first) to `needed` elements of `size` bytes,
 * and half as many more, and sets *capacity. Free with free(). Errors: VSH_ERROR_LIMIT, before it allocates,
 * VSH_ERROR_MEMORY. */
vsh_result vshi_grow(vshi_budget *budget, void *memory, size_t *capacity, size_t needed, size_t size,
                     vsh_error *error);

#define VSHI_GROW(budget, array, capacity, needed, error)                                                    \
    vshi_grow((budget), &(array), &(capacity), (needed), sizeof *(array), (error))

/* Does the same for exactly `needed` elements. */
vsh_result vshi_reserve(vshi_budget *budget, void *memory, size_t *capacity, size_t needed, size_t size,
                        vsh_error *error);

#define VSHI_RESERVE(budget, array, count, error)                                                            \
    vshi_reserve((budget), &(array), &(size_t){0}, (count), sizeof *(array), (error))

/* --- the file */

/* A file in memory; zeros before it is read. */
typedef struct vshi_text {
    const char *path;
    vshi_budget *budget;
    vshi_job *job;
    size_t units, units_done; /* of the job: for the whole text; so far */
    char *bytes;              /* [size], and 16 more line ends */
    size_t size, capacity;
    const char *next_poll;
} vshi_text;

/* Reads the file, which messages call `name`. `path`, budget and job outlive the text. Errors: VSH_ERROR_READ
 * (also for empty files), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. Free the text after an error too. */
vsh_result vshi_text_read(vshi_text *text, const char *path, const char *name, vshi_budget *budget,
                          vshi_job *job, size_t units, vsh_error *error);

/* Does the same for a format whose reader takes several times the file's bytes. */
vsh_result vshi_text_read_whole(vshi_text *text, vshi_budget *budget, vshi_job *job, size_t units,
                                vsh_error *error);
void vshi_text_free(vshi_text *text);

/* Advances the job, from time to time, to the text's fraction before `at`. Errors: VSH_ERROR_CANCELLED. */
vsh_result vshi_text_poll(vshi_text *text, const char *at, vsh_error *error);

/* --- names, each stored once */

/* Zeros before the first. */
typedef struct vshi_words {
    json_t *numbers;    /* by name: Jansson keeps them in a hash table */
    const char **names; /* [count]: its keys */
    size_t count, capacity;
    size_t used; /* bytes of all names, with NUL */
} vshi_words;

/* Finds the number of a name, or adds the name (*is_new) with the next number. Names are cut to 1023 bytes.
 * Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_words_number(vshi_words *words, vshi_budget *budget, const char *name, size_t size,
                             size_t *number, bool *is_new, vsh_error *error);

void vshi_words_free(vshi_words *words);

/* --- tokens */

/* Characters of a file without white space. */
typedef struct vshi_token {
    const char *text; /* NULL: there is none */
    size_t size;
} vshi_token;

/* Finds the next token before `end`, and moves *at to its end. */
vshi_token vshi_scan_token(const char **at, const char *end);

/* Returns the rest of a line, without white space around it. */
vshi_token vshi_scan_rest(const char *at, const char *end);

bool vshi_token_is(vshi_token token, const char *text);

/* Arguments for "%.*s" in messages. Long tokens are cut. */
#define VSHI_TOKEN_ARGS(token) ((token).size < 32 ? (int)(token).size : 32), (token).text

typedef enum vshi_number { VSHI_NUMBER_NONE, VSHI_NUMBER_FINITE, VSHI_NUMBER_NOT_FINITE } vshi_number;

/* Returns whether a token is a decimal number, or "nan" or "inf" in any spelling, independent of the locale.
 */
vshi_number vshi_token_number(vshi_token token);

/* Parses a whole number of at most 18 digits, perhaps with a sign; returns false for other tokens. */
bool vshi_token_integer(vshi_token token, int64_t *value);
