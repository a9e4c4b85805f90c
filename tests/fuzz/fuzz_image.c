/* EXR and PNG files, which our own readers hand to OpenEXR's C core and to libpng, and what is made of their
 * pixels: a heightfield of either kind, and the outline of a mask. */
#include "fuzz.h"

#include <vdbshade/heights.h>
#include <vdbshade/image.h>
#include <vdbshade/outline.h>

static void use(const vsh_image *image, const char *path) {
    vsh_run run = fuzz_run();
    const vsh_heights_source source = {.name = path,
                                       .columns = image->width,
                                       .rows = image->height,
                                       .values = image->planes[0],
                                       .size = {1.0, 2.0},
                                       .height = 0.5};
    vsh_heights *heights;
    FUZZ_MAKE(heights, vsh_heights_create(&source, &run, &heights, fuzz_error()));
    vsh_heights_free(heights);
    vsh_model *model;
    FUZZ_MAKE(model, vsh_model_from_heights(&source, image->width % 2, &run, &model, fuzz_error()));
    vsh_model_free(model);
    run = fuzz_run();
    vsh_outline *outline;
    FUZZ_MAKE(outline, vsh_outline_from_image(path, NULL, &run, &outline, fuzz_error()));
    vsh_outline_free(outline);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (size < 4 || (data[0] != 0x89 && data[0] != 0x76)) {
        return -1; /* not of the corpus: these go to OpenImageIO, see fuzz_picture */
    }
    const char *path = fuzz_file("a.png", data, size);
    vsh_image_file *file;
    const vsh_result result = vsh_image_read(path, NULL, &file, fuzz_error());
    fuzz_ended(result, file);
    if (result == VSH_OK) {
        const vsh_image image = vsh_image_view(file);
        if ((int64_t)image.width * image.height <= 1 << 16) {
            use(&image, path);
        }
    }
    vsh_image_free(file);
    return 0;
}
