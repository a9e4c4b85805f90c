/* OpenEXR files through OpenEXR's C core. */
#ifndef VSHI_EXR_H
#define VSHI_EXR_H

#include "image/planes.h"

/* A file under way: channels in scan lines (ZIP), as 16-bit half or 32-bit float. */
typedef struct vshi_exr_writer vshi_exr_writer;

/* Begins in the existing file `temporary`; messages name `path`, which is to live as long. Of the planes,
 * names and constants are used. End with vshi_exr_end(). Errors: VSH_ERROR_WRITE, VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY. One thread at a time. */
vsh_result vshi_exr_begin(const char *temporary, const char *path, const vshi_planes *planes, int32_t bits,
                          vshi_exr_writer **writer, vsh_error *error);

/* The next rows, of the planes given at the beginning, with `values` [rows × width]. Errors: VSH_ERROR_WRITE,
 * VSH_ERROR_MEMORY. */
vsh_result vshi_exr_add(vshi_exr_writer *writer, const vshi_planes *planes, int32_t rows, vsh_error *error);

/* Frees the writer; NULL does nothing. Errors: VSH_ERROR_WRITE, VSH_ERROR_MEMORY. */
vsh_result vshi_exr_end(vshi_exr_writer *writer, vsh_error *error);

/* Bytes that a writer takes. */
double vshi_exr_writer_bytes(const vshi_planes *planes, int32_t bits);

/* Reads the first part of a file, scan lines or the finest level of tiles; half and integers become float.
 * Within run->memory_limit; NULL is none. Errors: VSH_ERROR_READ, VSH_ERROR_INPUT, VSH_ERROR_UNSUPPORTED
 * (deep data, subsampled channels, DWA), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. Thread safe. */
vsh_result vshi_exr_read(const char *path, const vsh_run *run, vsh_image_file **file, vsh_error *error);

#endif
