/* SHA-256 of files, by libmd. */
#include "base/error.h"

#include <errno.h>
#include <fcntl.h>
#include <sha256.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <vdbshade/provenance.h>

_Static_assert(VSH_DIGEST_TEXT == SHA256_DIGEST_STRING_LENGTH, "a digest's text");

static vsh_result fail(const char *path, const char *reason, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", path, reason);
}

static vsh_result digest_file(int file, const char *path, char *digest, vsh_error *error) {
    struct stat status;
    if (fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) {
        return fail(path, S_ISDIR(status.st_mode) ? "it is a folder" : "it is no regular file", error);
    }
    SHA2_CTX context;
    SHA256Init(&context);
    unsigned char bytes[1 << 16];
    for (;;) {
        const ssize_t count = read(file, bytes, sizeof bytes);
        if (count == 0) {
            SHA256End(&context, digest);
            return VSH_OK;
        }
        if (count > 0) {
            SHA256Update(&context, bytes, (size_t)count);
        } else if (errno != EINTR) {
            return fail(path, strerror(errno), error);
        }
    }
}

vsh_result vsh_file_digest(const char *path, char digest[VSH_DIGEST_TEXT], vsh_error *error) {
    VSHI_NEEDS(path);
    VSHI_NEEDS(digest);
    if (path[0] == '\0') {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "digest: no path");
    }
    const int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); /* a pipe would wait for its writer */
    if (file < 0) {
        return fail(path, strerror(errno), error);
    }
    const vsh_result result = digest_file(file, path, digest, error);
    close(file);
    return result;
}
