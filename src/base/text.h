/* Texts: UTF-8, known words, lines that files carry, and URIs. */
#pragma once

#include "base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

VSH_BEGIN_C

/* --- UTF-8 in texts of others */

/* U+FFFD replaces bytes that are not UTF-8. */
#define VSHI_NO_CHARACTER "\xef\xbf\xbd"

/* Returns the bytes of the first character of a text that ends in NUL; 0 if it is not UTF-8, or not allowed
 * in XML. */
VSHI_SHARED size_t vshi_utf8_length(const char *text);

/* Copies `text` into clean[3 × its length + 1], with VSHI_NO_CHARACTER for each byte that is not UTF-8. */
VSHI_SHARED void vshi_utf8_clean(const char *text, char *clean);

/* --- misspelt words */

/* Number of single-character changes (V. Levenshtein, "Binary codes capable of correcting deletions,
 * insertions, and reversals", 1966), or SIZE_MAX where one word has more than 63 characters. */
VSHI_SHARED size_t vshi_edit_distance(const char *a, const char *b);

/* Whether a distance is small enough to suggest `word`. */
bool vshi_is_near(size_t distance, const char *word);

/* --- attributes: lines of text that files carry */

/* Fails with VSH_ERROR_ARGUMENT, naming `path` and the attribute, if one breaks the rules of vsh_attribute.
 */
VSHI_SHARED vsh_result vshi_attributes_check(const char *path, const vsh_attribute *attributes, size_t count,
                                             vsh_error *error);

/* A list that owns its texts; begins as zeros. */
typedef struct vshi_attributes {
    vsh_attribute *list; /* [count] */
    size_t count, capacity;
} vshi_attributes;

/* Adds copies of both texts, with '?' for control characters. Returns false if memory is short. */
bool vshi_attributes_add(vshi_attributes *attributes, const char *name, const char *value);
void vshi_attributes_free(vshi_attributes *attributes);

/* --- URIs of glTF files */

/* Whether the URI holds its data itself ("data:…"). */
bool vshi_uri_is_data(const char *uri);

/* Whether the URI names no file ("https:…"). */
bool vshi_uri_is_remote(const char *uri);

/* Returns the path of a relative URI beside the file `base`, with "%20" and the like decoded (RFC 3986), in
 * new memory; NULL if memory is short. */
char *vshi_uri_path(const char *base, const char *uri);

/* Decodes a data URI in base64 (RFC 2397, RFC 4648) into *bytes, *size of them; free with free(). Returns
 * false for other URIs (*bytes is then NULL, and *size 0), and if memory is short (*size is not 0). */
bool vshi_uri_data(const char *uri, unsigned char **bytes, size_t *size);

enum { VSHI_BASE64_BYTES = 3, VSHI_BASE64_LETTERS = 4 };

/* Encodes three bytes, or one or two at the end, as base64 (RFC 4648). */
static inline void vshi_base64_group(const uint8_t *bytes, size_t count, char letters[VSHI_BASE64_LETTERS]) {
    static const char alphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    uint32_t word = 0;
    for (size_t k = 0; k < VSHI_BASE64_BYTES; ++k) {
        word = word << 8 | (k < count ? bytes[k] : 0u);
    }
    for (size_t k = 0; k < VSHI_BASE64_LETTERS; ++k) {
        letters[k] = k <= count ? alphabet[word >> (18 - 6 * k) & 63] : '=';
    }
}

VSH_END_C
