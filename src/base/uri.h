/* URIs as glTF files name their buffers by. */
#ifndef VSHI_URI_H
#define VSHI_URI_H

#include "base/error.h"

#include <stdbool.h>

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

#ifdef __cplusplus
}
#endif
#endif
