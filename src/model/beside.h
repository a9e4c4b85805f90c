/* The files beside a model that decide what it is and where light comes through, without reading it whole. */
#ifndef VSHI_MODEL_BESIDE_H
#define VSHI_MODEL_BESIDE_H

#include "base/job.h"

/* Gets the path of such a file, which it has to free; also where it fails. */
typedef vsh_result vshi_beside_fn(void *user, char *path, vsh_error *error);

/* Tells of the files that a model names and that are read with it, each perhaps more than once: the buffers
 * of a glTF, whether they are there or not, and where they can be opened those of a GLB, the textures of
 * materials that are not opaque, the material libraries of an OBJ and what cuts its materials out. What lies
 * outside of the model's folder is read, and told of, only with run->allow_outside. A model that cannot be
 * read as what its name says has none. Of the job, which may cancel it, it takes nothing. Errors:
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED, and what `take` returns. */
vsh_result vshi_model_beside(const char *path, const vsh_run *run, vshi_job *job, vshi_beside_fn *take,
                             void *user, vsh_error *error);

#endif
