/* What callers make of a reader's payload. Everything in it is checked; errors: VSH_ERROR_READ where it does
 * not hold, and as for what was made in this process. */
#ifndef VSHI_READ_TAKERS_H
#define VSHI_READ_TAKERS_H

#include "caster/outline.h"
#include "read/reader.h"

#include <vdbshade/image.h>
#include <vdbshade/mesh.h>

#ifdef __cplusplus
extern "C" {
#endif

vsh_result vshi_model_take(vshi_take *take, const char *path, vsh_model **model, vsh_error *error);
vsh_result vshi_image_take(vshi_take *take, const char *path, vsh_image_file **file, vsh_error *error);
vsh_result vshi_contours_take(vshi_take *take, vshi_contours *contours, const char *path, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
