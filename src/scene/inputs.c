#include "scene/inputs.h"

#include "base/floats.h"
#include "base/try.h"
#include "model/model.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

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
        const vsh_receiver *receiver = &scene->receivers[i];
        VSHI_TRY(add(inputs, receiver->type != VSH_RECEIVER_PLANE ? receiver->path : NULL, error));
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

/* --- outputs */

static vsh_result check_output(const char *output, const struct stat *status, const vshi_inputs *inputs,
                               vsh_error *error) {
    for (size_t i = 0; i < inputs->count; ++i) {
        struct stat input;
        if (stat(inputs->paths[i], &input) == 0 && input.st_ino == status->st_ino &&
            input.st_dev == status->st_dev) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: the output is also an input: %s", output,
                             inputs->paths[i]);
        }
    }
    return VSH_OK;
}

vsh_result vsh_scene_check_outputs(const vsh_scene *scene, const char *const *outputs, size_t output_count,
                                   const vsh_run *run, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(scene);
    VSHI_NEEDS_OF(output_count, outputs);
    for (size_t i = 0; i < output_count; ++i) {
        VSHI_NEEDS(outputs[i]);
    }
    vsh_run settings;
    VSHI_TRY(vshi_run_resolve(run, &settings, error));
    vshi_inputs inputs = {NULL, 0, 0};
    vshi_job *job = NULL;
    vsh_result result = VSH_OK;
    for (size_t i = 0; i < output_count; ++i) {
        struct stat status;
        if (stat(outputs[i], &status) != 0) {
            continue;
        }
        if (job == NULL) {
            job = vshi_job_begin(&settings, "hash", 1);
            VSHI_TRY_DONE(job != NULL ? VSH_OK : out_of_memory(error));
            VSHI_TRY_DONE(vshi_inputs_find(scene, NULL, 0, &settings, job, &inputs, error));
        }
        VSHI_TRY_DONE(check_output(outputs[i], &status, &inputs, error));
    }
done:
    vshi_job_end(job);
    vshi_inputs_free(&inputs);
    return result;
}
