#include "scene/inputs.h"

#include "base/try.h"
#include "model/beside.h"

#include <stdlib.h>
#include <string.h>

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

static vsh_result add_beside(void *user, char *path, vsh_error *error) {
    return add_own(user, path, error);
}

vsh_result vshi_inputs_find(const vsh_scene *scene, const char *const *files, size_t file_count,
                            const vsh_run *run, vshi_job *job, vshi_inputs *inputs, vsh_error *error) {
    for (size_t i = 0; i < file_count; ++i) {
        VSHI_TRY(add(inputs, files[i], error));
    }
    for (size_t i = 0; scene != NULL && i < scene->caster_count; ++i) {
        VSHI_TRY(add(inputs, scene->casters[i].path, error));
    }
    for (size_t i = 0; scene != NULL && i < scene->receiver_count; ++i) {
        VSHI_TRY(add(inputs, scene->receivers[i].path, error));
    }
    for (size_t i = 0; scene != NULL && i < scene->light_file_count; ++i) {
        VSHI_TRY(add(inputs, scene->light_files[i].path, error));
    }
    const size_t named = inputs->count;
    for (size_t i = 0; i < named; ++i) {
        VSHI_TRY(vshi_model_beside(inputs->paths[i], run, job, add_beside, inputs, error));
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
