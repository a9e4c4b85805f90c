/* Files that the command line writes itself, whole or not at all as the library does, and text in them. */
#ifndef CLI_TEMPORARY_H
#define CLI_TEMPORARY_H

#include "base/file.h"

#include <jansson.h>
#include <stdio.h>

/* A file under way, written through `file`. */
typedef struct cli_temporary {
    FILE *file; /* NULL: nothing is under way */
    const char *target;
    vshi_output output;
} cli_temporary;

/* Removes what killed runs have left of `target`, and begins it. CLI_OK or an exit code, having said why.
 * After success, end with commit, which also returns one of them and puts the file in its place, or with
 * abandon. */
int cli_temporary_begin(cli_temporary *temporary, const char *target);
int cli_temporary_commit(cli_temporary *temporary);
void cli_temporary_abandon(cli_temporary *temporary);

/* Writes a text file: whole, or not at all. Returns CLI_OK or an exit code, having said why. */
int cli_temporary_write(const char *target, const char *text);

/* Whether cli_temporary_write() is likely to succeed: CLI_OK or an exit code, having said why. */
int cli_temporary_check(const char *target);

/* Makes a JSON number, or null of NaN and infinity. */
json_t *cli_number_json(double value);

/* Makes a JSON string, or null of NULL. Names come from files: each byte that is no UTF-8 becomes U+FFFD. */
json_t *cli_utf8_json(const char *text);

/* Writes text within HTML or XML, attributes too. Bytes that are no UTF-8 become U+FFFD. */
void cli_escape(FILE *out, const char *text);

#endif
