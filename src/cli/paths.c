#include "paths.h"

#include "message.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

bool cli_has_ending(const char *path, const char *ending) {
    const char *slash = strrchr(path, '/');
    const char *dot = strrchr(slash != NULL ? slash : path, '.');
    return dot != NULL && strcasecmp(dot + 1, ending) == 0;
}

/* Folder resolved, last part as it is. */
static bool absolute(const char *path, char *result, size_t capacity) {
    char folder[PATH_MAX], real[PATH_MAX];
    const char *slash = strrchr(path, '/');
    const int length = slash == NULL ? 1 : slash == path ? 1 : (int)(slash - path);
    snprintf(folder, sizeof folder, "%.*s", length, slash == NULL ? "." : path);
    if (realpath(folder, real) == NULL) {
        return false;
    }
    snprintf(result, capacity, "%s/%s", real, slash == NULL ? path : slash + 1);
    return true;
}

bool cli_same_file(const char *a, const char *b) {
    struct stat one, other;
    const bool has_one = stat(a, &one) == 0;
    const bool has_other = stat(b, &other) == 0;
    if (has_one && has_other) {
        return one.st_dev == other.st_dev && one.st_ino == other.st_ino;
    }
    char first[2 * PATH_MAX], second[2 * PATH_MAX];
    return !has_one && !has_other && absolute(a, first, sizeof first) && absolute(b, second, sizeof second) &&
           strcmp(first, second) == 0;
}

bool cli_is_model(const char *path) {
    static const char *const endings[] = {"obj", "gltf", "glb", "fbx",   "stl",
                                          "dae", "x3d",  "3ds", "blend", "off"};
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; ++i) {
        if (cli_has_ending(path, endings[i])) {
            return true;
        }
    }
    return false;
}

bool cli_is_folder(const char *path) {
    struct stat status;
    const size_t length = strlen(path);
    return (length > 0 && path[length - 1] == '/') || (stat(path, &status) == 0 && S_ISDIR(status.st_mode));
}

/* The folder of a path into folder[PATH_MAX]; false where it is the current one. */
static bool folder_of(const char *path, char *folder) {
    const char *slash = strrchr(path, '/');
    if (slash == NULL || slash == path || slash - path >= PATH_MAX) {
        return false;
    }
    snprintf(folder, PATH_MAX, "%.*s", (int)(slash - path), path);
    return true;
}

int cli_check_folder(const char *path) {
    char folder[PATH_MAX];
    struct stat status;
    if (!folder_of(path, folder) || stat(folder, &status) == 0 || errno != ENOENT) {
        return CLI_OK;
    }
    cli_say("%s: cannot be written: there is no folder '%s'; make it first: mkdir -p '%s'", path, folder,
            folder);
    return CLI_FILE;
}

int cli_make_folder(const char *path) {
    char part[PATH_MAX];
    struct stat status;
    const size_t length = strlen(path);
    if (length >= sizeof part) {
        cli_say("%s: cannot be made: %s", path, strerror(ENAMETOOLONG));
        return CLI_FILE;
    }
    for (size_t i = 1; i <= length; ++i) {
        if (path[i] != '/' && path[i] != '\0') {
            continue;
        }
        snprintf(part, sizeof part, "%.*s", (int)i, path);
        if (mkdir(part, 0777) != 0 && !(stat(part, &status) == 0 && S_ISDIR(status.st_mode))) {
            const int why = errno == EEXIST ? ENOTDIR : errno;
            cli_say("%s: cannot be made: %s: %s", path, part, strerror(why));
            return CLI_FILE;
        }
    }
    return CLI_OK;
}
