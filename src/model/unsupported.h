/* Scene formats that are not read, told by name so that nobody looks for the fault in his file. */
#ifndef VSHI_MODEL_UNSUPPORTED_H
#define VSHI_MODEL_UNSUPPORTED_H

#include "base/error.h"

/* What is said to whoever gives another. */
#define VSHI_FORMATS                                                                                         \
    "give a mesh as OBJ, glTF, GLB, PLY, STL, FBX or DAE, a level set as .vdb, or a scene as .json"

/* VSH_ERROR_INPUT, with the formats that are read, where a file is of Blender, Alembic or USD by its ending
 * or its first bytes. A file that cannot be read is told apart by its ending only. Thread safe. */
vsh_result vshi_unsupported_check(const char *path, vsh_error *error);

#endif
