#include "document.h"

#include "message.h"
#include "signals.h"
#include "temporary.h"

#include <png.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* What stands for a byte that is part of no character: U+FFFD. */
static const char no_character[] = "\xef\xbf\xbd";

/* The well-formed sequences (The Unicode Standard, table 3-7): the first byte's range, the second's, and how
 * many there are. */
static const struct {
    unsigned char first, last, second_first, second_last;
    size_t length;
} sequences[] = {{0x01, 0x7f, 0x00, 0xff, 1}, {0xc2, 0xdf, 0x80, 0xbf, 2}, {0xe0, 0xe0, 0xa0, 0xbf, 3},
                 {0xe1, 0xec, 0x80, 0xbf, 3}, {0xed, 0xed, 0x80, 0x9f, 3}, {0xee, 0xef, 0x80, 0xbf, 3},
                 {0xf0, 0xf0, 0x90, 0xbf, 4}, {0xf1, 0xf3, 0x80, 0xbf, 4}, {0xf4, 0xf4, 0x80, 0x8f, 4}};

/* Bytes of the character that a text begins with; 0 where it is none of UTF-8's, or none that XML takes. */
static size_t utf8_length(const char *text) {
    const unsigned char *c = (const unsigned char *)text;
    for (size_t i = 0; i < sizeof sequences / sizeof sequences[0]; ++i) {
        if (c[0] < sequences[i].first || c[0] > sequences[i].last || c[1] < sequences[i].second_first ||
            c[1] > sequences[i].second_last) {
            continue;
        }
        for (size_t k = 2; k < sequences[i].length; ++k) {
            if (c[k] < 0x80 || c[k] > 0xbf) {
                return 0;
            }
        }
        return c[0] == 0xef && c[1] == 0xbf && c[2] >= 0xbe ? 0 : sequences[i].length; /* U+FFFE, U+FFFF */
    }
    return 0;
}

json_t *cli_utf8_json(const char *text) {
    char *clean = malloc(3 * strlen(text) + 1);
    size_t used = 0;
    if (clean == NULL) {
        return NULL;
    }
    while (*text != '\0') {
        const size_t length = utf8_length(text);
        memcpy(clean + used, length > 0 ? text : no_character, length > 0 ? length : 3);
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
    cli_signals_writing(path);
    const int code = cli_temporary_write(path, text);
    cli_signals_writing(NULL);
    free(text);
    return code;
}

void cli_document_escape(FILE *out, const char *text) {
    for (size_t length; *text != '\0'; text += length > 0 ? length : 1) {
        length = utf8_length(text);
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
                fputs(no_character, out);
            } else if (length == 1 && ((unsigned char)*text < 0x20 || *text == 0x7f)) {
                fputc('?', out);
            } else {
                fwrite(text, 1, length, out);
            }
        }
    }
}

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
