/* Reading a file with Assimp. Its C API keeps the last error in one global string, shows no progress and
 * cannot be stopped; an importer of its own for each file has none of this. */
#ifndef VSHI_ASSIMP_H
#define VSHI_ASSIMP_H

#include "base/job.h"

#ifdef __cplusplus
extern "C" {
#endif

struct aiScene;
struct aiString;
typedef struct vshi_import vshi_import;

/* Reads the file as it is: polygons stay polygons, nothing is joined, generated or transformed. What the file
 * names is opened where it is a regular file, and in the file's folder or `outside`: else VSH_ERROR_INPUT.
 * Advances the job by up to `units`. Errors: VSH_ERROR_READ with Assimp's reason, VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED (the readers of OBJ and a few others listen). Free with vshi_import_free(). */
vsh_result vshi_import_read(const char *path, bool outside, vshi_job *job, size_t units, vshi_import **import,
                            vsh_error *error);

/* Metres in one unit of an FBX, by which Assimp does not multiply; 0: of another format. */
double vshi_import_unit(const vshi_import *import);

/* Belongs to the import. */
const struct aiScene *vshi_import_scene(const vshi_import *import);

/* Of a material of it: 1 where it tells none; false where it tells no name. */
float vshi_import_opacity(const struct aiScene *scene, unsigned material);
bool vshi_import_material_name(const struct aiScene *scene, unsigned material, struct aiString *name);

void vshi_import_free(vshi_import *import); /* NULL does nothing */

#ifdef __cplusplus
}
#endif
#endif
