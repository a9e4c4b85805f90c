/* OpenImageIO is loaded when the first file needs it: with it come 240 libraries of formats, which take
 * longer to load (0.2 s) than a small bake takes, and most runs read and write EXR and PNG alone. */
#include "image/oiio.h"

#include "base/threads.h"
#include "base/try.h"
#include "extern/module.h"

static vshi_module module = VSHI_MODULE("images of this kind", "oiio", 128 << 20, VSHI_OPENVDB_THREADS);

vsh_result vshi_oiio_load(const char *path, vsh_error *error) {
    vsh_error why;
    const vsh_result result = vshi_module_load(&module, &why);
    return result == VSH_OK ? VSH_OK : vshi_fail(error, result, "%s: %s", path, why.message);
}

const vshi_oiio_table *vshi_oiio(void) {
    return vshi_module_table(&module);
}

vsh_result vshi_oiio_read(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                          vsh_image_file **file, vsh_error *error) {
    *file = NULL;
    VSHI_TRY(vshi_oiio_load(path, error));
    return vshi_oiio()->read(path, bytes, run, file, error);
}
