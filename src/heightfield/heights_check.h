/* What makers of heightfields share: a checked source. */
#ifndef VSHI_HEIGHTFIELD_HEIGHTS_CHECK_H
#define VSHI_HEIGHTFIELD_HEIGHTS_CHECK_H

#include "base/error.h"

#include <vdbshade/heights.h>

/* A source whose numbers are in range. */
typedef struct vshi_checked_heights {
    const vsh_heights_source *source;
    const char *name;
    size_t samples;
    double lowest, highest; /* local units */
    double bottom;
} vshi_checked_heights;

/* Checks sizes and values. Errors: VSH_ERROR_ARGUMENT, VSH_ERROR_INPUT. `call` names the public function. */
vsh_result vshi_heights_check(const vsh_heights_source *source, const char *call,
                              vshi_checked_heights *terrain, vsh_error *error);

/* Does what vsh_model_from_heights() does. `texels` are the columns and rows of a lightmap's samples, or
 * NULL. A surface then leaves out the rows and columns of heights that lie beside none of these samples. A
 * coarse lightmap takes less memory, and its values stay the same. */
vsh_result vshi_model_of_heights(const vsh_heights_source *source, int32_t what, const size_t *texels,
                                 const vsh_run *run, vsh_model **model, vsh_error *error);

#endif
