/* OpenImageIO is loaded when the first file needs it: with it come 240 libraries of formats, which take
 * longer to load (0.2 s) than a small bake takes, and most runs read and write EXR alone. */
#include "shim/oiio.h"

#include "shim/module.h"
#include "shim/oiio_table.h"

#include <pthread.h>

/* Written once, by load(). */
static const vshi_oiio_table *table;
static char reason[512];

static void load(void) {
    table =
        vshi_module_table("libvdbshade_oiio.so." VSHI_SOVERSION, "vshi_oiio_module", reason, sizeof reason);
}

static const vshi_oiio_table *module_table(void) {
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, load);
    return table;
}

vsh_result vshi_oiio_have(const char *path, vsh_error *error) {
    return module_table() != NULL
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                           "%s: needs the module of image formats, which cannot be had: %s", path, reason);
}

bool vshi_oiio_format(const char *path, vshi_format *format) {
    return table->format(path, format);
}

const char *vshi_oiio_refusal(const char *path) {
    return table->refusal(path);
}

const char *vshi_oiio_endings(void) {
    return "png, tif, jpg, tga, bmp, hdr, ppm, pgm, webp, jp2, dpx, gif, sgi, iff, rla, ico, heic, avif";
}

vsh_result vshi_oiio_begin(const char *temporary, const char *path, const vshi_format *format,
                           const vshi_planes *planes, int32_t bits, vshi_oiio_writer **writer,
                           vsh_error *error) {
    return table->begin(temporary, path, format, planes, bits, writer, error);
}

vsh_result vshi_oiio_add(vshi_oiio_writer *writer, const vshi_planes *planes, int32_t rows,
                         vsh_error *error) {
    return table->add(writer, planes, rows, error);
}

vsh_result vshi_oiio_end(vshi_oiio_writer *writer, vsh_error *error) {
    return writer != NULL ? table->end(writer, error) : VSH_OK;
}

double vshi_oiio_writer_bytes(const vshi_format *format, const vshi_planes *planes, int32_t bits) {
    return table->writer_bytes(format, planes, bits);
}

vsh_result vshi_oiio_read(const char *path, const vsh_run *run, vsh_image_file **file, vsh_error *error) {
    *file = NULL;
    const vsh_result result = vshi_oiio_have(path, error);
    return result == VSH_OK ? table->read(path, run, file, error) : result;
}
