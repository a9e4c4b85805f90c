/* Base64 (RFC 4648). */
#ifndef VSHI_BASE64_H
#define VSHI_BASE64_H

#include <stddef.h>
#include <stdint.h>

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

#endif
