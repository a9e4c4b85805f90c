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
 * or its first bytes. If a file cannot be read, its ending decides. Thread safe. */
vsh_result vshi_unsupported_check(const char *path, vsh_error *error);

/* --- files that a model is read with (beside.c) */

/* Receives the path of such a file and frees it, after an error too. */
typedef vsh_result vshi_beside_fn(void *user, char *path, vsh_error *error);

/* Lists the files that are read with a model, some more than once: buffers of a glTF, also missing ones;
 * textures of materials that are not opaque; material libraries of an OBJ and their masks. Files outside of
 * the model's folder are listed only with run->allow_outside. A file that is no model of its ending names
 * none. The job may cancel this; its units are not advanced. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED, and what `take` returns. */
vsh_result vshi_model_beside(const char *path, const vsh_run *run, vshi_job *job, vshi_beside_fn *take,
                             void *user, vsh_error *error);

#endif
