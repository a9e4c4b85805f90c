/* File names: endings, and whether two name one file. */
#ifndef CLI_PATHS_H
#define CLI_PATHS_H

#include <stdbool.h>
#include <stddef.h>

/* Whether `path` ends in ".ENDING", in any case. */
bool cli_has_ending(const char *path, const char *ending);

/* Whether the two name one file, whether by links or through folders; also where it does not exist yet. */
bool cli_same_file(const char *a, const char *b);

#endif
