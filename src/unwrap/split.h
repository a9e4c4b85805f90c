/* Charts in parts that can be laid out. */
#ifndef VSHI_UNWRAP_SPLIT_H
#define VSHI_UNWRAP_SPLIT_H

#include "unwrap/patch.h"

/* Some charts of one surface. */
typedef struct vshi_patches {
    vshi_patch *list; /* [count] */
    size_t count, capacity;
} vshi_patches;

/* Takes over the patch, also where it fails. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_patches_add(vshi_patches *patches, const vshi_patch *patch, vsh_error *error);
void vshi_patches_free(vshi_patches *patches);

/* Lays triangles (ascending, taken over) out as one chart, or as many as it takes so that none folds or
 * stretches beyond the limit; adds them to `patches`. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_lay_out(const vshi_cut_mesh *surface, uint32_t *triangles, uint32_t count, double max_stretch,
                        vshi_patches *patches, vsh_error *error);

#endif
