/* Files of the command line's own that appear whole or not at all, as the library's do. */
#ifndef CLI_TEMPORARY_H
#define CLI_TEMPORARY_H

#include "base/file.h"

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

#endif
