#include "paths.h"

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
