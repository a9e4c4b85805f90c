/* Opening a file that the command line reads itself. */
#ifndef CLI_INPUT_H
#define CLI_INPUT_H

#include <stdint.h>
#include <stdio.h>

/* A descriptor of a regular file of at most `most` bytes, opened without waiting (a pipe would wait for its
 * writer), or -1 and *why. */
int cli_input_open(const char *path, uint64_t most, const char **why);

/* The same as a stream, or NULL. */
FILE *cli_input_stream(const char *path, uint64_t most, const char **why);

#endif
