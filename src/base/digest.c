/* SHA-256 of files, by Nettle. */
#include "base/digest.h"

#include "base/file.h"

#include <nettle/sha2.h>
#include <stdio.h>

_Static_assert(VSH_DIGEST_TEXT == 2 * SHA256_DIGEST_SIZE + 1, "a digest's text");

static vsh_result digest_stream(FILE *file, const char *path, char *digest, vshi_job *job, vsh_error *error) {
    struct sha256_ctx context;
    sha256_init(&context);
    unsigned char bytes[1 << 14];
    size_t count;
    while ((count = fread(bytes, 1, sizeof bytes, file)) > 0) {
        sha256_update(&context, count, bytes);
        if (vshi_job_advance(job, 0)) {
            return vshi_job_fail_cancelled(job, error);
        }
    }
    if (ferror(file)) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read", path);
    }
    uint8_t sum[SHA256_DIGEST_SIZE];
    sha256_digest(&context, sizeof sum, sum);
    for (size_t i = 0; i < sizeof sum; ++i) {
        snprintf(digest + 2 * i, 3, "%02x", sum[i]);
    }
    return VSH_OK;
}

vsh_result vshi_file_digest(const char *path, char digest[VSH_DIGEST_TEXT], vshi_job *job, vsh_error *error) {
    FILE *file;
    uint64_t size;
    vsh_result result = vshi_input_open(path, path, UINT64_MAX, &file, &size, error);
    if (result != VSH_OK) {
        return result;
    }
    result = digest_stream(file, path, digest, job, error);
    fclose(file);
    return result;
}

vsh_result vsh_file_digest(const char *path, const vsh_run *run, char digest[VSH_DIGEST_TEXT],
                           vsh_error *error) {
    VSHI_NEEDS(path);
    VSHI_NEEDS(digest);
    if (path[0] == '\0') {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "digest: no path");
    }
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vshi_job *job = vshi_job_begin(&full, "hash", 1);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    const vsh_result result = vshi_file_digest(path, digest, job, error);
    vshi_job_end(job);
    return result;
}
