/* A mesh file on the way in: told by its ending, and handed to who reads it. */
#ifndef VSHI_CASTER_MODEL_FILE_H
#define VSHI_CASTER_MODEL_FILE_H

#include "base/job.h"
#include "extern/importers.h"

#include <vdbshade/mesh.h>

enum { VSHI_MODEL_FILE_UNITS = 900 }; /* of the job */

/* Reads the file's meshes: an OBJ, PLY or glTF as a model; of other formats what Assimp sees, with every
 * position finite and every index in range. The other of the two is NULL. `alone`: in a reader, which may end
 * where the file does not hold still. Errors: as vsh_model_read(). Free with vshi_importers()->free(). *unit:
 * metres in one of the file, where Assimp has multiplied by them already; else 0.
 */
vsh_result vshi_model_file_read(const char *path, const vsh_run *run, vshi_job *job, bool alone,
                                vshi_import **import, vsh_model **model, double *unit, vsh_error *error);

#endif
