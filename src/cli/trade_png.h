/* Small pictures that stand in the page itself. */
#ifndef CLI_TRADE_PNG_H
#define CLI_TRADE_PNG_H

#include <stdint.h>
#include <stdio.h>

/* Writes <img> of width × height pixels, indices into a palette of 256 colours, as a data URI of a PNG that
 * is not compressed. At most 255 × 255. */
void trade_png_write(FILE *out, int width, int height, const uint8_t *pixels, const uint8_t palette[256][3],
                     const char *alt);

#endif
