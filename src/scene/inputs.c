#include "scene/inputs.h"

#include "base/file.h"

#include <jansson.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static vsh_result out_of_memory(vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_MEMORY, "inputs: the system refused memory");
}

/* Takes `path` over, which is NULL where memory was short. */
static vsh_result add_own(vshi_inputs *inputs, char *path, vsh_error *error) {
    if (path == NULL) {
        return out_of_memory(error);
    }
    for (size_t i = 0; i < inputs->count; ++i) {
        if (strcmp(inputs->paths[i], path) == 0) {
            free(path);
            return VSH_OK;
        }
    }
    if (inputs->count == inputs->capacity) {
        const size_t capacity = 2 * inputs->capacity + 16;
        char **paths = realloc(inputs->paths, capacity * sizeof *paths);
        if (paths == NULL) {
            free(path);
            return out_of_memory(error);
        }
        inputs->paths = paths;
        inputs->capacity = capacity;
    }
    inputs->paths[inputs->count++] = path;
    return VSH_OK;
}

static vsh_result add(vshi_inputs *inputs, const char *path, vsh_error *error) {
    return path != NULL ? add_own(inputs, strdup(path), error) : VSH_OK;
}

static int hex_digit(char c) {
    const char *const digits = "0123456789abcdef";
    const char lower = c >= 'A' && c <= 'F' ? (char)(c - 'A' + 'a') : c;
    const char *at = lower != '\0' ? strchr(digits, lower) : NULL;
    return at != NULL ? (int)(at - digits) : -1;
}

/* The path of a URI beside `model`, "%20" and the like decoded (RFC 3986). */
static char *beside(const char *model, const char *uri) {
    const char *slash = strrchr(model, '/');
    const size_t folder = slash != NULL && uri[0] != '/' ? (size_t)(slash - model) + 1 : 0;
    char *path = malloc(folder + strlen(uri) + 1);
    if (path == NULL) {
        return NULL;
    }
    memcpy(path, model, folder);
    char *to = path + folder;
    for (const char *from = uri; *from != '\0'; ++from) {
        const int high = *from == '%' ? hex_digit(from[1]) : -1;
        const int low = high >= 0 ? hex_digit(from[2]) : -1;
        *to++ = low >= 0 ? (char)(16 * high + low) : *from;
        from += low >= 0 ? 2 : 0;
    }
    *to = '\0';
    return path;
}

/* A glTF's buffers, which hold its vertices. What cannot be read as one has none. */
static vsh_result add_buffers(vshi_inputs *inputs, const char *model, vsh_error *error) {
    json_t *root = json_load_file(model, 0, NULL);
    vsh_result result = VSH_OK;
    size_t i;
    json_t *buffer;
    json_array_foreach(json_object_get(root, "buffers"), i, buffer) {
        const char *uri = json_string_value(json_object_get(buffer, "uri"));
        if (result == VSH_OK && uri != NULL && strncasecmp(uri, "data:", 5) != 0) {
            result = add_own(inputs, beside(model, uri), error);
        }
    }
    json_decref(root);
    return result;
}

vsh_result vshi_inputs_find(const vsh_scene *scene, const char *const *files, size_t file_count,
                            vshi_inputs *inputs, vsh_error *error) {
    vsh_result result = VSH_OK;
    for (size_t i = 0; i < file_count && result == VSH_OK; ++i) {
        result = add(inputs, files[i], error);
    }
    for (size_t i = 0; scene != NULL && i < scene->caster_count && result == VSH_OK; ++i) {
        result = add(inputs, scene->casters[i].path, error);
    }
    for (size_t i = 0; scene != NULL && i < scene->receiver_count && result == VSH_OK; ++i) {
        result = add(inputs, scene->receivers[i].path, error);
    }
    const size_t named = inputs->count;
    for (size_t i = 0; i < named && result == VSH_OK; ++i) {
        if (strcasecmp(vshi_path_ending(inputs->paths[i]), "gltf") == 0) {
            result = add_buffers(inputs, inputs->paths[i], error);
        }
    }
    return result;
}

void vshi_inputs_free(vshi_inputs *inputs) {
    for (size_t i = 0; i < inputs->count; ++i) {
        free(inputs->paths[i]);
    }
    free(inputs->paths);
    *inputs = (vshi_inputs){NULL, 0, 0};
}
