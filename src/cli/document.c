#include "document.h"

#include "base/uri.h"
#include "base/utf8.h"
#include "message.h"
#include "temporary.h"

#include <png.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

json_t *cli_utf8_json(const char *text) {
    char *clean = malloc(3 * strlen(text) + 1);
    size_t used = 0;
    if (clean == NULL) {
        return NULL;
    }
    while (*text != '\0') {
        const size_t length = vshi_utf8_length(text);
        memcpy(clean + used, length > 0 ? text : VSHI_NO_CHARACTER, length > 0 ? length : 3);
        used += length > 0 ? length : 3;
        text += length > 0 ? length : 1;
    }
    json_t *json = json_stringn(clean, used);
    free(clean);
    return json;
}

int cli_document_write(const char *path, void (*compose)(FILE *out, const void *user), const void *user) {
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (out == NULL) {
        return cli_out_of_memory(path);
    }
    compose(out, user);
    const bool whole = !ferror(out);
    if (fclose(out) != 0 || !whole) {
        free(text);
        return cli_out_of_memory(path);
    }
    const int code = cli_temporary_write(path, text);
    free(text);
    return code;
}

void cli_document_escape(FILE *out, const char *text) {
    for (size_t length; *text != '\0'; text += length > 0 ? length : 1) {
        length = vshi_utf8_length(text);
        switch (*text) {
        case '<':
            fputs("&lt;", out);
            break;
        case '>':
            fputs("&gt;", out);
            break;
        case '&':
            fputs("&amp;", out);
            break;
        case '"':
            fputs("&quot;", out);
            break;
        default: /* control characters are none of XML's */
            if (length == 0) {
                fputs(VSHI_NO_CHARACTER, out);
            } else if (length == 1 && ((unsigned char)*text < 0x20 || *text == 0x7f)) {
                fputc('?', out);
            } else {
                fwrite(text, 1, length, out);
            }
        }
    }
}

static void write_base64(FILE *out, const uint8_t *bytes, size_t count) {
    for (size_t i = 0; i < count; i += VSHI_BASE64_BYTES) {
        char letters[VSHI_BASE64_LETTERS];
        vshi_base64_group(bytes + i, count - i < VSHI_BASE64_BYTES ? count - i : VSHI_BASE64_BYTES, letters);
        fwrite(letters, 1, sizeof letters, out);
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
