/* Hashes of files. */
#ifndef VDBSHADE_DIGEST_H
#define VDBSHADE_DIGEST_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { VSH_DIGEST_TEXT = 65 }; /* bytes of a digest as text, NUL included */

/* SHA-256 (FIPS 180-4) of a file's bytes, as 64 hexadecimal digits: what `sha256sum` prints. Errors:
 * VSH_ERROR_ARGUMENT (path NULL or empty), VSH_ERROR_READ (no such file, no permission, no regular file). */
VSH_API vsh_result vsh_file_digest(const char *path, char digest[VSH_DIGEST_TEXT], vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
