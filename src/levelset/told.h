/* What .vdb files say of themselves, without their values. */
#ifndef VSHI_LEVELSET_TOLD_H
#define VSHI_LEVELSET_TOLD_H

#include "base/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* box[0 … 2] and box[3 … 5] are the corners of the world box of level set `name` (NULL: the first), as its
 * file tells; the first larger than the last where it tells nothing. What it says may be wrong. Errors: as
 * vsh_grid_read(). */
vsh_result vshi_vdb_box(const char *path, const char *name, const vsh_run *run, double box[6],
                        vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
