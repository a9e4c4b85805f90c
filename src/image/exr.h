/* OpenEXR files through OpenEXR's C core. */
#ifndef VSHI_EXR_H
#define VSHI_EXR_H

#include "image/planes.h"

/* Writes the channels (ZIP, scan lines) as 16-bit half or 32-bit float into the existing file `temporary`;
 * messages name `path`. Errors: VSH_ERROR_WRITE, VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. Thread safe. */
vsh_result vshi_exr_write(const char *temporary, const char *path, const vshi_planes *planes, int32_t bits,
                          vsh_error *error);

/* Reads the first part of a file, scan lines or the finest level of tiles; half and integers become float.
 * Errors: VSH_ERROR_READ, VSH_ERROR_INPUT, VSH_ERROR_UNSUPPORTED (deep data, subsampled channels, DWA),
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. Thread safe. */
vsh_result vshi_exr_read(const char *path, vsh_image_file **file, vsh_error *error);

#endif
