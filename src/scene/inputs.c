#include "scene/inputs.h"

#include "base/file.h"
#include "base/input.h"
#include "base/try.h"
#include "base/uri.h"
#include "scene/tile.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Bytes of a glTF that is looked through for its buffers. */
static const uint64_t MOST_JSON = (uint64_t)1 << 30;

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

/* Takes `path` over. A buffer outside of the model's folder is not read, so nothing is to be told of it. */
static vsh_result add_buffer(vshi_inputs *inputs, const char *model, char *path, bool outside,
                             vsh_error *error) {
    if (path != NULL && !outside && !vshi_input_is_beside(model, path)) {
        free(path);
        return VSH_OK;
    }
    return add_own(inputs, path, error);
}

/* A glTF's buffers, which hold its vertices. What cannot be read as one has none. */
static vsh_result add_buffers(vshi_inputs *inputs, const char *model, bool outside, vsh_error *error) {
    FILE *file;
    uint64_t size;
    vsh_error ignored;
    if (vshi_input_open(model, model, MOST_JSON, &file, &size, &ignored) != VSH_OK) {
        return VSH_OK;
    }
    json_t *root = json_loadf(file, 0, NULL);
    fclose(file);
    vsh_result result = VSH_OK;
    size_t i;
    json_t *buffer;
    json_array_foreach(json_object_get(root, "buffers"), i, buffer) {
        const char *uri = json_string_value(json_object_get(buffer, "uri"));
        if (uri != NULL && !vshi_uri_is_data(uri) && !vshi_uri_is_remote(uri)) {
            VSHI_TRY_DONE(add_buffer(inputs, model, vshi_uri_path(model, uri), outside, error));
        }
    }
done:
    json_decref(root);
    return result;
}

vsh_result vshi_inputs_find(const vsh_scene *scene, const char *const *files, size_t file_count, bool outside,
                            vshi_inputs *inputs, vsh_error *error) {
    for (size_t i = 0; i < file_count; ++i) {
        VSHI_TRY(add(inputs, files[i], error));
    }
    for (size_t i = 0; scene != NULL && i < scene->caster_count; ++i) {
        VSHI_TRY(add(inputs, vshi_caster_is_left(scene, i) ? scene->casters[i].path : NULL, error));
    }
    for (size_t i = 0; scene != NULL && i < scene->receiver_count; ++i) {
        VSHI_TRY(add(inputs, scene->receivers[i].path, error));
    }
    for (size_t i = 0; scene != NULL && i < scene->light_file_count; ++i) {
        VSHI_TRY(add(inputs, scene->light_files[i].path, error));
    }
    const size_t named = inputs->count;
    for (size_t i = 0; i < named; ++i) {
        if (strcasecmp(vshi_path_ending(inputs->paths[i]), "gltf") == 0) {
            VSHI_TRY(add_buffers(inputs, inputs->paths[i], outside, error));
        }
    }
    return VSH_OK;
}

void vshi_inputs_free(vshi_inputs *inputs) {
    for (size_t i = 0; i < inputs->count; ++i) {
        free(inputs->paths[i]);
    }
    free(inputs->paths);
    *inputs = (vshi_inputs){NULL, 0, 0};
}
