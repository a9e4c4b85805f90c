/* Light that a file of integers cuts. */
#ifndef CLI_CLIPPING_H
#define CLI_CLIPPING_H

#include <vdbshade/image.h>

/* Puts an image in place, and warns where light over 1 was cut. CLI_OK or an exit code, having said why.
 * Frees the writer. */
int cli_finish_image(vsh_image_writer *writer, const char *output);

#endif
