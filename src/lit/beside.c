/* Names of what stands beside the output. */
#include "lit/images.h"

#include "base/file.h"
#include "base/uri.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

char *vshi_lit_beside_path(const char *output, const char *name) {
    const char *slash = strrchr(output, '/');
    const size_t folder = slash != NULL ? (size_t)(slash - output) + 1 : 0;
    char *path = malloc(folder + strlen(name) + 1);
    if (path != NULL) {
        memcpy(path, output, folder);
        strcpy(path + folder, name);
    }
    return path;
}

static bool is_same_file(const char *a, const char *b) {
    struct stat one, other;
    return stat(a, &one) == 0 && stat(b, &other) == 0 && one.st_dev == other.st_dev &&
           one.st_ino == other.st_ino;
}

vsh_result vshi_lit_check_replaced(const vshi_lit_document *document, const char *path, vsh_error *error) {
    static const char *const lists[] = {"buffers", "images"};
    json_t *const own[] = {json_object_get(document->gltf.root, "buffers"), document->own_images};
    for (size_t k = 0; k < sizeof lists / sizeof lists[0] && document->text != NULL; ++k) {
        size_t i;
        const json_t *item;
        json_array_foreach(own[k], i, item) {
            const char *uri = json_string_value(json_object_get(item, "uri"));
            if (uri == NULL || vshi_uri_is_data(uri) || vshi_uri_is_remote(uri)) {
                continue;
            }
            char *given = vshi_uri_path(document->gltf.path, uri);
            if (given == NULL) {
                return vshi_lit_no_memory(document, error);
            }
            const bool same = is_same_file(given, path);
            free(given);
            if (same) {
                return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: would replace %s[%zu] of %s", path, lists[k],
                                 i, document->gltf.path);
            }
        }
    }
    return VSH_OK;
}

/* With a number, unless that is 0. */
static char *make_name(const char *output, const char *mark, const char *ending, unsigned number) {
    const char *slash = strrchr(output, '/');
    const char *name = slash != NULL ? slash + 1 : output;
    const char *own = vshi_path_ending(output);
    const size_t stem = own[0] != '\0' ? (size_t)(own - name) - 1 : strlen(name);
    const size_t size = stem + strlen(mark) + strlen(ending) + 16;
    char *made = malloc(size);
    if (made != NULL && number > 0) {
        snprintf(made, size, "%.*s%s.%u.%s", (int)stem, name, mark, number, ending);
    } else if (made != NULL) {
        snprintf(made, size, "%.*s%s.%s", (int)stem, name, mark, ending);
    }
    return made;
}

vsh_result vshi_lit_beside_name(const vshi_lit_work *work, const char *mark, const char *ending, char **name,
                                vsh_error *error) {
    enum { MOST = 100 };
    for (unsigned number = 0;; ++number) {
        *name = make_name(work->output, mark, ending, number);
        char *path = *name != NULL ? vshi_lit_beside_path(work->output, *name) : NULL;
        if (path == NULL) {
            free(*name);
            *name = NULL;
            return vshi_lit_no_memory(&work->document, error);
        }
        const vsh_result result = vshi_lit_check_replaced(&work->document, path, error);
        free(path);
        if (result != VSH_ERROR_ARGUMENT || number == MOST) {
            return result;
        }
        free(*name);
    }
}
