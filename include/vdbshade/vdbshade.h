/* vdbshade: soft shadows and ambient occlusion baked from signed distance fields.
 *
 *     casters ─▶ vsh_grid (level set) ─▶ vsh_field (pyramid) ─▶ vsh_shade_… (points) ─▶ vsh_bake_…
 * (lightmaps)
 *
 * The library prints nothing, ends nothing and keeps no state of its own: every call that can fail returns a
 * vsh_result and fills the caller's vsh_error. World space is right-handed, in scene units; angles are
 * radians. Option structs begin with their size and are filled by a …_default() function, so programs that
 * were compiled against an older header go on working. NULL for an options parameter stands for its defaults.
 */
#ifndef VDBSHADE_H
#define VDBSHADE_H

#include "bake.h"
#include "base.h"
#include "field.h"
#include "grid.h"
#include "image.h"
#include "light.h"
#include "mesh.h"
#include "scene.h"
#include "sdf.h"
#include "shade.h"

#endif
