/* A mesh file on the way in: opened, measured, looked over, handed to Assimp. */
#ifndef VSHI_CASTER_MODEL_FILE_H
#define VSHI_CASTER_MODEL_FILE_H

#include "base/job.h"
#include "shim/assimp.h"

enum { VSHI_MODEL_FILE_UNITS = 900 }; /* of the job */

/* Reads the file's meshes as Assimp sees them, with every face a triangle (or a line or a point), every
 * position finite and every index in range. Errors: as vsh_model_read(). Free with vshi_import_free(). */
vsh_result vshi_model_file_read(const char *path, const vsh_run *run, vshi_job *job, vshi_import **import,
                                vsh_error *error);

#endif
