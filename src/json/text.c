/* The text of a file of JSON, brought into memory within a limit. */
#include "base/bytes.h"
#include "base/file.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "json/json.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const size_t MAX_BYTES = (size_t)64 << 20;

static vsh_result fail_read(const char *path, int reason, vsh_error *error) {
    char why[128] = "";
    if (strerror_r(reason, why, sizeof why) != 0) {
        snprintf(why, sizeof why, "error %d", reason);
    }
    return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", path, why);
}

/* Read in pieces, not by the size that the system told: the file may grow. */
static vsh_result read_all(const char *path, FILE *file, char **text, size_t *size, vsh_error *error) {
    size_t capacity = 0;
    do {
        capacity = capacity == 0 ? (size_t)1 << 16 : 2 * capacity;
        capacity = capacity > MAX_BYTES ? MAX_BYTES + 1 : capacity;
        char *grown = realloc(*text, capacity + 1);
        if (grown == NULL) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused %zu bytes", path, capacity);
        }
        *text = grown;
        errno = 0;
        *size += fread(*text + *size, 1, capacity - *size, file);
        if (ferror(file)) {
            return fail_read(path, errno, error);
        }
        if (*size > MAX_BYTES) {
            return vshi_fail(error, VSH_ERROR_LIMIT, "%s: is larger than the %zu bytes that a scene may have",
                             path, MAX_BYTES);
        }
    } while (*size == capacity);
    return VSH_OK;
}

vsh_result vshi_json_text(const char *path, const vsh_run *run, char **text, size_t *size, vsh_error *error) {
    *text = NULL;
    *size = 0;
    FILE *file;
    uint64_t told;
    VSHI_TRY(vshi_input_open(path, path, UINT64_MAX, &file, &told, error));
    vsh_result result;
    VSHI_TRY_DONE(read_all(path, file, text, size, error));
    VSHI_TRY_DONE(vshi_check_limit(run, vshi_json_bytes(*text, *size), path, error));
done:
    fclose(file);
    if (result != VSH_OK) {
        free(*text);
        *text = NULL;
    }
    return result;
}
