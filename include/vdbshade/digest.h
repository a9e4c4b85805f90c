/* Hashes of files. */
#ifndef VDBSHADE_DIGEST_H
#define VDBSHADE_DIGEST_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { VSH_DIGEST_TEXT = 65 }; /* bytes of a digest as text, NUL included */

/* SHA-256 (FIPS 180-4) of a file's bytes, as 64 hexadecimal digits: what `sha256sum` prints. Errors:
 * VSH_ERROR_ARGUMENT (path NULL or empty, run), VSH_ERROR_READ (no such file, no permission, no regular
 * file), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED (under the stage "hash", 16 times a MB). */
VSH_API vsh_result vsh_file_digest(const char *path, const vsh_run *run, char digest[VSH_DIGEST_TEXT],
                                   vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
