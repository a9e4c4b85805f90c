/* What makers of heightfields share: a checked source. */
#ifndef VSHI_ANALYTIC_SOURCE_H
#define VSHI_ANALYTIC_SOURCE_H

#include "base/error.h"

#include <vdbshade/heights.h>

/* A source whose numbers are in range. */
typedef struct vshi_terrain {
    const vsh_heights_source *source;
    const char *name;
    size_t samples;
    double lowest, highest; /* local units */
    double bottom;
} vshi_terrain;

/* Checks sizes and values. Errors: VSH_ERROR_ARGUMENT, VSH_ERROR_INPUT. `call` names the public function. */
vsh_result vshi_terrain_check(const vsh_heights_source *source, const char *call, vshi_terrain *terrain,
                              vsh_error *error);

#endif
