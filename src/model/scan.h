/* What Assimp hides is looked for in the file's own bytes before Assimp reads it: files that end early,
 * indices out of range, coordinates that are no finite numbers. Assimp 5.2 drops or repeats faces, or
 * replaces numbers, where it finds such things, and reports a mesh that is not the one in the file. */
#ifndef VSHI_CASTER_SCAN_H
#define VSHI_CASTER_SCAN_H

#include "base/job.h"

typedef struct vshi_scan {
    const char *path; /* for messages */
    const char *text; /* the whole file */
    size_t size;
    vshi_job *job;
    size_t units;      /* of the job, for the whole scan */
    size_t units_done; /* told to the job so far */
    size_t faces; /* out: polygons of three corners or more that a reader must find at least; 0: not known */
    double unit;  /* out: metres in a unit of a Collada file; 0: of another */
} vshi_scan;

/* Looks the file over, by its ending (without the dot, any case); endings without a scanner pass. Errors:
 * VSH_ERROR_READ where it ends early, VSH_ERROR_INPUT where its content is bad, VSH_ERROR_CANCELLED. */
vsh_result vshi_scan_file(vshi_scan *scan, const char *ending, vsh_error *error);

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
