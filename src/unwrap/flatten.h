/* Laying a chart out flat. */
#ifndef VSHI_UNWRAP_FLATTEN_H
#define VSHI_UNWRAP_FLATTEN_H

#include "unwrap/patch.h"

/* What came of it. */
enum {
    VSHI_FLAT = 0,      /* no triangle flips, none lies over another, the stretch is within the limit */
    VSHI_STRETCHED = 1, /* beyond the limit, but else as it should be */
    VSHI_FOLDED = 2     /* triangles flip or lie over each other */
};

/* Fills the patch's uv and stretch. Parts of a plane are projected; else least squares conformal maps (Lévy
 * and others, 2002), made as rigid as possible (Liu and others, "A local/global approach to mesh
 * parameterization", 2008) where that stretches less. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_flatten(vshi_patch *patch, double max_stretch, int *came_to, vsh_error *error);

/* Scales uv to the patch's area and measures its stretch; false where a triangle flips or has no area. */
bool vshi_flatten_measure(vshi_patch *patch);

#endif
