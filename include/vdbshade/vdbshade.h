/* vdbshade: soft shadows and ambient occlusion baked from signed distance fields.
 *
 *     casters ─▶ vsh_grid (level set) ─▶ vsh_field (pyramid) ─▶ vsh_shade_… (points), vsh_query_…
 *                                                            ├▶ vsh_bake_…  (lightmaps, volumes)
 *                                                            └▶ vsh_render  (pictures)
 *
 * World space is right-handed, in scene units; angles are radians. What holds for every call stands in
 * base.h. */
#ifndef VDBSHADE_H
#define VDBSHADE_H

#include "bake.h"
#include "base.h"
#include "compare.h"
#include "field.h"
#include "flat.h"
#include "grid.h"
#include "heights.h"
#include "image.h"
#include "layer.h"
#include "light.h"
#include "mesh.h"
#include "outline.h"
#include "provenance.h"
#include "query.h"
#include "reader.h"
#include "render.h"
#include "scene.h"
#include "sdf.h"
#include "shade.h"
#include "solidity.h"
#include "spheres.h"
#include "trace.h"
#include "volume.h"

#endif
