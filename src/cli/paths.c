#include "paths.h"

#include "message.h"

#include <errno.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

const char *cli_keep_text(const char *format, ...) {
    static struct kept {
        struct kept *before;
        char text[];
    } * last; /* reaches all, so that no tool takes them for leaks */
    va_list values, again;
    va_start(values, format);
    va_copy(again, values);
    const int length = vsnprintf(NULL, 0, format, values);
    struct kept *kept = malloc(sizeof *kept + (size_t)length + 1);
    vsnprintf(kept->text, (size_t)length + 1, format, again);
    kept->before = last;
    last = kept;
    va_end(again);
    va_end(values);
    return kept->text;
}

const char *cli_file_name(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

bool cli_has_ending(const char *path, const char *endings) {
    const char *dot = strrchr(cli_file_name(path), '.');
    for (const char *at = endings; dot != NULL && *at != '\0'; at += strspn(at, " ")) {
        const size_t length = strcspn(at, " ");
        if (strlen(dot + 1) == length && strncasecmp(dot + 1, at, length) == 0) {
            return true;
        }
        at += length;
    }
    return false;
}

const char *cli_split_grid(const char **path) {
    const char *colon = NULL;
    for (const char *at = strchr(*path, ':'); at != NULL; at = strchr(at + 1, ':')) {
        colon = at - *path > 4 && strncasecmp(at - 4, ".vdb", 4) == 0 ? at : colon;
    }
    if (colon == NULL || access(*path, F_OK) == 0) {
        return NULL;
    }
    *path = cli_keep_text("%.*s", (int)(colon - *path), *path);
    return colon + 1;
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

int cli_check_apart(const char *output, const char *input, const char *what) {
    const bool apart = output == NULL || input == NULL || !cli_same_file(output, input);
    return apart ? CLI_OK : cli_usage("%s: the output is %s", output, what);
}

bool cli_is_model(const char *path) {
    return cli_has_ending(path, "obj gltf glb fbx stl dae x3d 3ds blend off");
}

bool cli_is_folder(const char *path) {
    struct stat status;
    const size_t length = strlen(path);
    return (length > 0 && path[length - 1] == '/') || (stat(path, &status) == 0 && S_ISDIR(status.st_mode));
}

const char *cli_end_path(const char *path, const char *end) {
    size_t length = strlen(path);
    while (length > 1 && path[length - 1] == '/') {
        --length;
    }
    return cli_keep_text("%.*s%s", (int)length, path, end);
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

int cli_check_input(const char *path) {
    if (access(path, R_OK) == 0) {
        return CLI_OK;
    }
    cli_say("%s: cannot be opened: %s", path, strerror(errno));
    return CLI_FILE;
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

int cli_make_folder_of(const char *path) {
    char part[PATH_MAX];
    struct stat status;
    const char *slash = strrchr(path, '/');
    const size_t length = slash != NULL ? (size_t)(slash - path) : 0;
    const int shown = (int)length;
    if (length >= sizeof part) {
        cli_say("%.*s: cannot be made: %s", shown, path, strerror(ENAMETOOLONG));
        return CLI_FILE;
    }
    for (size_t i = 1; i <= length; ++i) {
        if (path[i] != '/') {
            continue;
        }
        snprintf(part, sizeof part, "%.*s", (int)i, path);
        if (mkdir(part, 0777) != 0 && !(stat(part, &status) == 0 && S_ISDIR(status.st_mode))) {
            const int why = errno == EEXIST ? ENOTDIR : errno;
            cli_say("%.*s: cannot be made: %s: %s", shown, path, part, strerror(why));
            return CLI_FILE;
        }
    }
    return CLI_OK;
}

/* A path without "." and "..", by its words alone. False where it does not fit. */
static bool normalize(const char *path, char *result) {
    size_t used = 0;
    for (const char *at = path; *at != '\0';) {
        at += strspn(at, "/");
        const size_t length = strcspn(at, "/");
        if (length == 2 && strncmp(at, "..", 2) == 0) {
            while (used > 0 && result[--used] != '/') {
            }
        } else if (length > 0 && !(length == 1 && at[0] == '.')) {
            if (used + length + 2 > PATH_MAX) {
                return false;
            }
            result[used++] = '/';
            memcpy(result + used, at, length);
            used += length;
        }
        at += length;
    }
    result[used] = '\0';
    return true;
}

/* Where a file would be written; it and folders on the way need not be there. False where a link leads to
 * nothing. */
static bool find_place(const char *path, char *real) {
    char there[PATH_MAX], joined[2 * PATH_MAX];
    struct stat status;
    if (strlen(path) >= sizeof there) {
        return false;
    }
    strcpy(there, path);
    while (lstat(there, &status) != 0) {
        char *slash = strrchr(there, '/');
        if (slash == NULL) {
            strcpy(there, ".");
        } else {
            slash[slash == there] = '\0';
        }
    }
    if (realpath(there, real) == NULL) {
        return false;
    }
    const size_t kept = strcmp(there, ".") == 0 && path[0] != '.' ? 0 : strlen(there);
    snprintf(joined, sizeof joined, "%s/%s", real, path + kept);
    return normalize(joined, real);
}

int cli_check_links(const char *namer, const char *path) {
    char folder[PATH_MAX], home[PATH_MAX], there[2 * PATH_MAX], meant[PATH_MAX], real[PATH_MAX] = "nothing";
    const bool here = !folder_of(namer, folder);
    const char *rest = path;
    if (!here && strncmp(path, folder, strlen(folder)) == 0 && path[strlen(folder)] == '/') {
        rest += strlen(folder) + 1;
    }
    bool stays = realpath(here ? "." : folder, home) != NULL;
    if (rest[0] == '/') { /* its folder was said */
        stays = stays && absolute(path, there, sizeof there);
    } else {
        snprintf(there, sizeof there, "%s/%s", home, rest);
    }
    stays = stays && normalize(there, meant) && find_place(path, real);
    const size_t length = strcmp(home, "/") == 0 ? 0 : strlen(home);
    if (stays && (strcmp(real, meant) == 0 || (strncmp(real, home, length) == 0 && real[length] == '/'))) {
        return CLI_OK;
    }
    cli_say("%s: cannot be written: a link leads from the folder of '%s' to '%s'", path, namer, real);
    return CLI_FILE;
}

/* --- a file for each object */

const char *cli_object_output(const char *output) {
    const char *name = cli_file_name(output), *dot = strrchr(name, '.');
    if (strstr(name, CLI_OBJECT_NAME) != NULL) {
        return cli_keep_text("%s", output);
    }
    if (cli_is_folder(output) || dot == NULL || dot == name) {
        return cli_end_path(output, "/" CLI_OBJECT_NAME ".exr");
    }
    return cli_keep_text("%.*s.%s%s", (int)(dot - output), output, CLI_OBJECT_NAME, dot);
}
