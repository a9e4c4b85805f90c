/* vdbshade: soft shadows and ambient occlusion baked from signed distance fields.
 *
 *     casters ─▶ vsh_occluders ─▶ vsh_shade_… (points), vsh_query_…
 *                               ├▶ vsh_bake_…  (lightmaps, volumes)
 *                               └▶ vsh_render  (pictures)
 *
 * The library runs on Linux only. World space is right-handed, in scene units; angles are radians. base.h has
 * the rules of all calls. A lightmap from arrays of one's own (examples/lightmap.c):
 *
 *     // The shadow that casters throw on a receiver under a sun of six degrees, into shadow[SIZE * SIZE].
 *     static vsh_result bake(const vsh_mesh *casters, size_t count, const vsh_mesh *receiver, float *shadow,
 *                            vsh_error *error) {
 *         vsh_occluders *occluders = NULL; // what casts
 *         vsh_charts *charts = NULL;       // what receives
 *         vsh_lightmap_options options = vsh_lightmap_options_default();
 *         options.width = options.height = SIZE;
 *         vsh_light sun = vsh_light_default();
 *         sun.direction[0] = 0.5; // towards it; y is 1
 *         sun.angle = 0.1;
 *         const vsh_lightmap lightmap = {.shadow = &shadow};
 *         vsh_result result = vsh_occluders_create(casters, count, NULL, NULL, &occluders, error);
 *         if (result == VSH_OK) {
 *             result = vsh_charts_create(receiver, 1, &options, NULL, NULL, &charts, error);
 *         }
 *         if (result == VSH_OK) {
 *             result = vsh_bake_lightmap(occluders, charts, &sun, 1, NULL, NULL, &lightmap, NULL, error);
 *         }
 *         vsh_charts_free(charts);
 *         vsh_occluders_free(occluders);
 *         return result;
 *     }
 */
#pragma once

#include "base.h"
#include "compare.h"
#include "grid.h"
#include "image.h"
#include "light.h"
#include "lightmap.h"
#include "mesh.h"
#include "occluders.h"
#include "picture.h"
#include "scene.h"
#include "volume.h"
