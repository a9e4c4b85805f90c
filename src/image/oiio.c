/* OpenImageIO is loaded when the first file needs it: with it come 240 libraries of formats, which take
 * longer to load (0.2 s) than a small bake takes, and most runs read and write EXR and PNG alone. */
#include "image/oiio.h"

#include "base/threads.h"
#include "base/try.h"
#include "extern/module.h"
#include "image/oiio_table.h"

static vshi_module module = VSHI_MODULE("images of this kind", "oiio", 128 << 20, VSHI_OPENVDB_THREADS);

static const vshi_oiio_table *at(void) {
    return vshi_module_table(&module);
}

vsh_result vshi_oiio_have(const char *path, vsh_error *error) {
    vsh_error why;
    const vsh_result result = vshi_module_load(&module, &why);
    return result == VSH_OK ? VSH_OK : vshi_fail(error, result, "%s: %s", path, why.message);
}

bool vshi_oiio_format(const char *path, vshi_format *format) {
    return at()->format(path, format);
}

const char *vshi_oiio_refusal(const char *path) {
    return at()->refusal(path);
}

const char *vshi_oiio_endings(void) {
    return "tif, jpg, tga, bmp, hdr, ppm, pgm, webp, jp2, dpx, gif, sgi, iff, rla, ico, heic, avif";
}

vsh_result vshi_oiio_begin(const char *temporary, const char *path, const vshi_format *format,
                           const vshi_planes *planes, int32_t bits, vshi_oiio_writer **writer,
                           vsh_error *error) {
    return at()->begin(temporary, path, format, planes, bits, writer, error);
}

vsh_result vshi_oiio_add(vshi_oiio_writer *writer, const vshi_planes *planes, int32_t rows,
                         vsh_error *error) {
    return at()->add(writer, planes, rows, error);
}

vsh_result vshi_oiio_end(vshi_oiio_writer *writer, vsh_error *error) {
    return writer != NULL ? at()->end(writer, error) : VSH_OK;
}

double vshi_oiio_writer_bytes(const vshi_format *format, const vshi_planes *planes, int32_t bits) {
    return at()->writer_bytes(format, planes, bits);
}

vsh_result vshi_oiio_read(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                          vsh_image_file **file, vsh_error *error) {
    *file = NULL;
    VSHI_TRY(vshi_oiio_have(path, error));
    return at()->read(path, bytes, run, file, error);
}
