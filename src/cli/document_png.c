#include "document.h"
#include "message.h"

#include <png.h>
#include <stdlib.h>
#include <string.h>

/* RFC 4648. */
static void write_base64(FILE *out, const uint8_t *bytes, size_t count) {
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < count; i += 3) {
        const size_t rest = count - i < 3 ? count - i : 3;
        uint32_t word = 0;
        for (size_t k = 0; k < 3; ++k) {
            word = word << 8 | (k < rest ? bytes[i + k] : 0u);
        }
        for (size_t k = 0; k < 4; ++k) {
            fputc(k <= rest ? letters[word >> (18 - 6 * k) & 63] : '=', out);
        }
    }
}

int cli_document_png(FILE *out, const char *document, const cli_pixels *pixels) {
    png_image image = {.version = PNG_IMAGE_VERSION,
                       .width = (png_uint_32)pixels->width,
                       .height = (png_uint_32)pixels->height,
                       .format = pixels->channels == 4 ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB};
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    uint8_t *bytes = malloc(size);
    if (bytes == NULL || !png_image_write_to_memory(&image, bytes, &size, 0, pixels->values, 0, NULL)) {
        free(bytes);
        return cli_out_of_memory(document); /* nothing else can fail */
    }
    write_base64(out, bytes, size);
    free(bytes);
    return CLI_OK;
}
