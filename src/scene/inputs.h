/* The files that a scene is made of. */
#ifndef VSHI_SCENE_INPUTS_H
#define VSHI_SCENE_INPUTS_H

#include "base/job.h"

#include <vdbshade/scene.h>

typedef struct vshi_inputs {
    char **paths;
    size_t count, capacity;
} vshi_inputs;

/* `files`, then what casters, receivers and lights name, then what is read with the models among them
 * (model/model.h); each path once. `scene` may be NULL. Files that cannot be read are listed all the
 * same. To be freed also where it fails. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_inputs_find(const vsh_scene *scene, const char *const *files, size_t file_count,
                            const vsh_run *run, vshi_job *job, vshi_inputs *inputs, vsh_error *error);
void vshi_inputs_free(vshi_inputs *inputs);

#endif
