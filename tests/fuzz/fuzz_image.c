/* EXR and PNG files, which our own readers pass to OpenEXR's C core and to libpng. From their pixels it makes
 * heightfields of both kinds and the outline of a mask. */
#include "fuzz.h"

#include <vdbshade/image.h>
#include <vdbshade/mesh.h>

static void use(const vsh_image *image, const char *path) {
    vsh_run run = fuzz_run();
    const vsh_heights_source source = {.name = path,
                                       .columns = image->width,
                                       .rows = image->height,
                                       .values = image->planes[0],
                                       .size = {1.0, 2.0},
                                       .height = 0.5};
    FUZZ_TRY(vshi_heights, heights, vshi_heights_create(&source, &run, &heights, fuzz_error()));
    FUZZ_TRY(vsh_model, model, vsh_model_from_heights(&source, image->width % 2, &run, &model, fuzz_error()));
    run = fuzz_run();
    FUZZ_TRY(vsh_outline, outline, vshi_outline_from_image(path, NULL, &run, &outline, fuzz_error()));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (size < 4 || (data[0] != 0x89 && data[0] != 0x76)) {
        return -1; /* do not add it to the corpus: OpenImageIO reads such files (fuzz_picture) */
    }
    const char *path = fuzz_file("a.png", data, size);
    vsh_image_file *file;
    if (FUZZ_MAKE(file, vsh_image_read(path, NULL, &file, fuzz_error())) == VSH_OK) {
        const vsh_image image = vsh_image_view(file);
        if ((int64_t)image.width * image.height <= 1 << 16) {
            use(&image, path);
        }
    }
    vsh_image_free(file);
    return 0;
}
