/* Images that OpenImageIO reads; the first byte chooses the format. */
#include "fuzz.h"

#include <vdbshade/image.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const char *const names[] = {"a.tif", "a.jpg",  "a.tga", "a.bmp", "a.hdr", "a.ppm",
                                        "a.jp2", "a.webp", "a.dds", "a.gif", "a.psd"};
    if (size == 0) {
        return 0;
    }
    const char *path = fuzz_file(names[data[0] % (sizeof names / sizeof names[0])], data + 1, size - 1);
    const vsh_run run = fuzz_run();
    vsh_image_file *file;
    FUZZ_MAKE(file, vsh_image_read(path, &run, &file, fuzz_error()));
    vsh_image_free(file);
    return 0;
}
