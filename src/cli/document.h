/* Pages and other texts that are composed and then written as one file. */
#ifndef CLI_DOCUMENT_H
#define CLI_DOCUMENT_H

#include <stddef.h>
#include <stdio.h>

/* Composes a text in memory and writes it, whole or not at all. CLI_OK or an exit code, having said why. */
int cli_document_write(const char *path, void (*compose)(FILE *out, const void *user), const void *user);

/* Text within HTML or XML, attributes too: bytes that are no UTF-8 become U+FFFD. */
void cli_document_escape(FILE *out, const char *text);

/* Name of a file beside a document, "part.png" say, that an interrupted run takes away: for what has to be a
 * file before it can stand in the document itself. */
void cli_document_part(const char *document, const char *part, char *path, size_t capacity);

/* Writes a file's bytes as base64. CLI_OK or, having said why, CLI_FILE. */
int cli_document_embed(FILE *out, const char *path);

#endif
