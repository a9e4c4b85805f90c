/* What a reader parses by OpenVDB. */
#ifndef VSHI_LEVELSET_SERVE_H
#define VSHI_LEVELSET_SERVE_H

#include "sandbox/reader.h"

#ifdef __cplusplus
extern "C" {
#endif

vshi_serve_fn vshi_serve_grid, vshi_serve_list, vshi_serve_voxels, vshi_serve_copy;

#ifdef __cplusplus
}
#endif
#endif
