/* Every image format but OpenEXR and PNG, through OpenImageIO. */
#ifndef VSHI_OIIO_H
#define VSHI_OIIO_H

#include "image/format.h"
#include "image/planes.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A file under way. */
typedef struct vshi_oiio_writer vshi_oiio_writer;

/* Functions of the module. A writer belongs to one thread at a time; all else is thread safe. */
typedef struct vshi_oiio_table {
    const char *version; /* of the header that it was built with */

    /* The format that the path's ending stands for, if it can be written. */
    bool (*format)(const char *path, vshi_format *format);

    /* Why an ending that OpenImageIO knows is not written; NULL for others. A static string. */
    const char *(*refusal)(const char *path);

    /* Begins a file of R, G, B and perhaps A, or R alone where the format is grey, in the existing file
     * `temporary`; messages name `path`. Both are to live as long as the writer. `bits` is one that the
     * format has; of the planes, size and number count. End with end(). Errors: VSH_ERROR_WRITE,
     * VSH_ERROR_UNSUPPORTED, VSH_ERROR_MEMORY. */
    vsh_result (*begin)(const char *temporary, const char *path, const vshi_format *format,
                        const vshi_planes *planes, int32_t bits, vshi_oiio_writer **writer, vsh_error *error);

    /* The next rows, with `values` [rows × width]. Same errors. */
    vsh_result (*add)(vshi_oiio_writer *writer, const vshi_planes *planes, int32_t rows, vsh_error *error);

    /* Closes the file and, where all rows were given, looks whether it is whole; frees the writer. Same
     * errors. */
    vsh_result (*end)(vshi_oiio_writer *writer, vsh_error *error);

    /* Bytes that writing takes at most. */
    double (*writer_bytes)(const vshi_format *format, const vshi_planes *planes, int32_t bits);

    vsh_result (*read)(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                       vsh_image_file **file, vsh_error *error); /* vshi_oiio_read() */
} vshi_oiio_table;

/* The module's one symbol. */
extern const vshi_oiio_table vshi_oiio_module;

/* Loads the module. Errors: as of vshi_module_load(), which name `path`. Thread safe. */
vsh_result vshi_oiio_load(const char *path, vsh_error *error);

/* NULL before vshi_oiio_load(). */
const vshi_oiio_table *vshi_oiio(void);

/* Loads the module and reads the file at `path`, of the format that its ending says, or `bytes`, which a
 * format is named of and messages call `path`. Within run->memory_limit; NULL is none. Errors:
 * VSH_ERROR_READ, VSH_ERROR_INPUT, VSH_ERROR_UNSUPPORTED, VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. Thread safe. */
vsh_result vshi_oiio_read(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                          vsh_image_file **file, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
