/* URIs as glTF files name their buffers by. */
#ifndef VSHI_URI_H
#define VSHI_URI_H

#include "base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Whether the URI holds its data itself ("data:…"). */
bool vshi_uri_is_data(const char *uri);

/* Whether the URI names no file, "https:…". */
bool vshi_uri_is_remote(const char *uri);

/* The path of a relative URI beside the file `base`, "%20" and the like decoded (RFC 3986), in new memory;
 * NULL where memory is short. */
char *vshi_uri_path(const char *base, const char *uri);

/* The bytes of a data URI in base64 (RFC 2397, RFC 4648) into *bytes, *size of them; free with free(). False
 * where it is none or holds other characters (*bytes is then NULL, and *size 0), or memory is short (*size is
 * what was needed). */
bool vshi_uri_data(const char *uri, unsigned char **bytes, size_t *size);

/* --- base64 (RFC 4648) */

enum { VSHI_BASE64_BYTES = 3, VSHI_BASE64_LETTERS = 4 };

/* The four letters of three bytes, or at the end of one or two. */
static inline void vshi_base64_group(const uint8_t *bytes, size_t count, char letters[VSHI_BASE64_LETTERS]) {
    static const char alphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    uint32_t word = 0;
    for (size_t k = 0; k < VSHI_BASE64_BYTES; ++k) {
        word = word << 8 | (k < count ? bytes[k] : 0u);
    }
    for (size_t k = 0; k < VSHI_BASE64_LETTERS; ++k) {
        letters[k] = '=';
        if (k <= count) {
            letters[k] = alphabet[word >> (18 - 6 * k) & 63];
        }
    }
}

#ifdef __cplusplus
}
#endif
#endif
