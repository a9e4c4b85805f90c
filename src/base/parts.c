/* Which parts there are beside a name. */
#include "base/job.h"
#include "base/part_file.h"
#include "base/try.h"

#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MOST_NAMED = 6 }; /* parts that are missing */

char *vshi_part_path(const char *parts, int32_t shard, int32_t count) {
    static const char *const form = "%s.%d-of-%d.part";
    const int length = snprintf(NULL, 0, form, parts, shard, count);
    char *path = length > 0 ? malloc((size_t)length + 1) : NULL;
    if (path != NULL) {
        snprintf(path, (size_t)length + 1, form, parts, shard, count);
    }
    return path;
}

/* N of "NAME.I-of-N.part"; 0: it is no such name. */
static int32_t count_of_name(const char *entry, const char *name) {
    const size_t length = strlen(name);
    int shard = 0, count = 0, used = 0;
    if (strncmp(entry, name, length) != 0 || entry[length] != '.' ||
        sscanf(entry + length, ".%5d-of-%5d.part%n", &shard, &count, &used) != 2 || used == 0 ||
        entry[length + (size_t)used] != '\0') {
        return 0;
    }
    return shard >= 1 && shard <= count && count <= VSHI_MOST_SHARDS ? count : 0;
}

vsh_result vshi_parts_count(const char *parts, int32_t *count, vsh_error *error) {
    *count = 0;
    const char *slash = strrchr(parts, '/');
    char *folder = slash == NULL ? strdup(".") : strndup(parts, slash == parts ? 1 : (size_t)(slash - parts));
    if (folder == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", parts);
    }
    DIR *open = opendir(folder);
    free(folder);
    if (open == NULL) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: its folder cannot be read: %s", parts, strerror(errno));
    }
    int32_t other = 0;
    for (const struct dirent *entry; (entry = readdir(open)) != NULL;) {
        const int32_t found = count_of_name(entry->d_name, slash != NULL ? slash + 1 : parts);
        other = found != 0 && *count != 0 && found != *count ? found : other;
        *count = found != 0 && *count == 0 ? found : *count;
    }
    closedir(open);
    if (other != 0) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: there are parts of %d and of %d shards beside it; say which, by their number",
                         parts, *count < other ? *count : other, *count < other ? other : *count);
    }
    return *count != 0
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT,
                           "%s: there are no parts beside it, %s.1-of-N.part and so on", parts, parts);
}

vsh_result vshi_parts_check_there(const char *name, int32_t count, vsh_error *error) {
    char list[256] = "";
    size_t at = 0;
    int32_t missing = 0;
    for (int32_t i = 1; i <= count; ++i) {
        char *path = vshi_part_path(name, i, count);
        if (path == NULL) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", name);
        }
        if (access(path, F_OK) != 0 && ++missing <= MOST_NAMED && at < sizeof list) {
            at += (size_t)snprintf(list + at, sizeof list - at, "%s%d", missing > 1 ? ", " : "", i);
        }
        free(path);
    }
    if (missing == 0) {
        return VSH_OK;
    }
    if (missing > MOST_NAMED && at < sizeof list) {
        snprintf(list + at, sizeof list - at, " and %d more", missing - MOST_NAMED);
    }
    return vshi_fail(error, VSH_ERROR_READ, "%s: %s missing: %s of %d; bake %s by --shard I/%d", name,
                     missing == 1 ? "a part is" : "parts are", list, count, missing == 1 ? "it" : "them",
                     count);
}

vsh_result vshi_parts_first(const char *parts, int32_t shard_count, char **path, vsh_error *error) {
    *path = NULL;
    if (shard_count == 0) {
        VSHI_TRY(vshi_parts_count(parts, &shard_count, error));
    }
    for (int32_t i = 1; i <= shard_count; ++i) {
        *path = vshi_part_path(parts, i, shard_count);
        if (*path == NULL || i == shard_count || access(*path, F_OK) == 0) {
            break;
        }
        free(*path);
    }
    return *path != NULL ? VSH_OK
                         : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", parts);
}

vsh_result vsh_part_words(const char *parts, int32_t shard_count, const vsh_run *run, char ***words,
                          size_t *count, vsh_error *error) {
    VSHI_NEEDS(words);
    VSHI_NEEDS(count);
    *words = NULL;
    *count = 0;
    VSHI_NEEDS(parts);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    if (shard_count < 0 || shard_count > VSHI_MOST_SHARDS) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "shard_count %d: expected 0 to %d", shard_count,
                         VSHI_MOST_SHARDS);
    }
    char *path;
    VSHI_TRY(vshi_parts_first(parts, shard_count, &path, error));
    vshi_part_input part;
    vshi_part_about about;
    const vsh_result result = vshi_part_input_open(path, &full, &part, &about, error);
    if (result == VSH_OK) {
        *words = about.words;
        *count = (size_t)about.word_count;
        about.words = NULL;
        about.word_count = 0;
    }
    vshi_part_about_free(&about);
    vshi_part_input_close(&part);
    free(path);
    return result;
}

void vsh_part_words_free(char **words) {
    for (size_t i = 0; words != NULL && words[i] != NULL; ++i) {
        free(words[i]);
    }
    free(words);
}
