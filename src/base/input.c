#define _GNU_SOURCE
#include "base/input.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static vsh_result fail(const char *name, const char *why, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", name, why);
}

static vsh_result check(int file, const char *name, uint64_t most, uint64_t *size, vsh_error *error) {
    struct stat status;
    if (fstat(file, &status) != 0) {
        return fail(name, strerror(errno), error);
    }
    if (!S_ISREG(status.st_mode)) {
        return fail(name, S_ISDIR(status.st_mode) ? "it is a folder" : "it is no regular file", error);
    }
    *size = (uint64_t)status.st_size;
    if (*size > most) {
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "%s: is larger than the %" PRIu64 " bytes that such a file may have", name, most);
    }
    return VSH_OK;
}

vsh_result vshi_input_open(const char *path, const char *name, uint64_t most, FILE **file, uint64_t *size,
                           vsh_error *error) {
    *file = NULL;
    *size = 0;
    const int opened = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (opened < 0) {
        return fail(name, strerror(errno), error);
    }
    vsh_result result = check(opened, name, most, size, error);
    if (result == VSH_OK) {
        *file = fdopen(opened, "rb");
        result = *file != NULL ? VSH_OK
                               : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", name);
    }
    if (result != VSH_OK) {
        close(opened);
    }
    return result;
}

/* Cuts the last part off a whole path; "/" stays. */
static void cut_last(char *path) {
    char *slash = strrchr(path, '/');
    slash[slash == path ? 1 : 0] = '\0';
}

static bool lies_in(const char *folder, const char *path) {
    const size_t length = strlen(folder);
    return strncmp(path, folder, length) == 0 && (folder[length - 1] == '/' || path[length] == '/');
}

bool vshi_input_is_beside(const char *model, const char *path) {
    char file[PATH_MAX], folder[PATH_MAX], given[PATH_MAX];
    if (realpath(path, file) == NULL) {
        return errno == ENOENT;
    }
    if (realpath(model, folder) != NULL) {
        cut_last(folder);
        if (lies_in(folder, file)) {
            return true;
        }
    }
    const char *slash = strrchr(model, '/');
    const size_t length = slash != NULL ? (size_t)(slash - model) + 1 : 0;
    if (length >= sizeof given) {
        return false;
    }
    memcpy(given, length > 0 ? model : ".", length > 0 ? length : 1);
    given[length > 0 ? length : 1] = '\0';
    return realpath(given, folder) != NULL && lies_in(folder, file);
}
