/* Reading a mesh file: its ending chooses the reader. */
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

/* Reads a PLY, for `units` of the job. Errors: as vsh_model_read(). */
vsh_result vshi_ply_read(const char *path, const vsh_run *run, vshi_job *job, size_t units, vsh_model **model,
                         vsh_error *error);

/* --- scene formats that are refused by name */

/* The advice of errors about other formats. */
#define VSHI_FORMATS                                                                                         \
    "give a mesh as OBJ, glTF, GLB, PLY, STL, FBX or DAE, a level set as .vdb, or a scene as .json"

/* VSH_ERROR_INPUT, with the formats that are read, where a file is of Blender, Alembic or USD by its ending
 * or its first bytes. A file that cannot be read is told apart by its ending only. Thread safe. */
vsh_result vshi_unsupported_check(const char *path, vsh_error *error);

/* --- files that a model is read with (beside.c) */

/* Receives the path of such a file and frees it, after an error too. */
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
