/* Reading PNG through libpng itself: OpenImageIO leaves libpng's handler in place, which prints to standard
 * error. */
#ifndef VSHI_PNG_H
#define VSHI_PNG_H

#include "image/planes.h"

/* Values are 0 … 1 as they stand in the file: no gamma, no alpha multiplied in. Channels are Y, Y A, R G B or
 * R G B A. Within run->memory_limit; NULL is none. Errors: VSH_ERROR_READ, VSH_ERROR_INPUT, VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY. Thread safe. */
vsh_result vshi_png_read(const char *path, const vsh_run *run, vsh_image_file **file, vsh_error *error);

#endif
