/* What the module of OpenImageIO's formats gives: the functions of oiio.h, which oiio.c passes on. */
#ifndef VSHI_OIIO_TABLE_H
#define VSHI_OIIO_TABLE_H

#include "image/oiio.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vshi_oiio_table {
    const char *version; /* vsh_version() that it was built with */
    bool (*format)(const char *, vshi_format *);
    const char *(*refusal)(const char *);
    vsh_result (*begin)(const char *, const char *, const vshi_format *, const vshi_planes *, int32_t,
                        vshi_oiio_writer **, vsh_error *);
    vsh_result (*add)(vshi_oiio_writer *, const vshi_planes *, int32_t, vsh_error *);
    vsh_result (*end)(vshi_oiio_writer *, vsh_error *);
    double (*writer_bytes)(const vshi_format *, const vshi_planes *, int32_t);
    vsh_result (*read)(const char *, const vshi_image_bytes *, const vsh_run *, vsh_image_file **,
                       vsh_error *);
} vshi_oiio_table;

/* The module's one symbol. */
extern const vshi_oiio_table vshi_oiio_module;

#ifdef __cplusplus
}
#endif
#endif
