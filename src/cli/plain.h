/* Text for terminals: names come from files, and terminals obey control characters. */
#ifndef CLI_PLAIN_H
#define CLI_PLAIN_H

#include <stddef.h>

/* Control characters but newlines become '?': those of ASCII, and those that UTF-8 has of its own. */
void cli_plain(char *text, size_t size);

/* From here on standard output is text, and goes through cli_plain(). */
void cli_plain_output(void);

#endif
