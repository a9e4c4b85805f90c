/* Pages and other texts that are composed and then written as one file. */
#ifndef CLI_DOCUMENT_H
#define CLI_DOCUMENT_H

#include <jansson.h>
#include <stdint.h>
#include <stdio.h>

/* Composes a text in memory and writes it, whole or not at all. CLI_OK or an exit code, having said why. */
int cli_document_write(const char *path, void (*compose)(FILE *out, const void *user), const void *user);

/* A JSON string, U+FFFD for each byte that is no UTF-8: names come from files; NULL where memory is short. */
json_t *cli_utf8_json(const char *text);

/* Text within HTML or XML, attributes too: bytes that are no UTF-8 become U+FFFD. */
void cli_document_escape(FILE *out, const char *text);

/* A picture for the screen. */
typedef struct cli_pixels {
    int32_t width, height, channels; /* R, G and B; or with alpha, which is not multiplied in */
    const uint8_t *values;           /* [height][width][channels], sRGB */
} cli_pixels;

/* Writes them as the base64 of a PNG, for what stands in the page itself. CLI_OK or, having said why, an exit
 * code. */
int cli_document_png(FILE *out, const char *document, const cli_pixels *pixels);

#endif
