/* What the assembly of casters reads of a scene's assets. */
#ifndef VSHI_ASSETS_H
#define VSHI_ASSETS_H

#include <stdbool.h>
#include <string.h>
#include <vdbshade/scene.h>

/* Whether a caster is in a layer, or (NULL) in none. */
static inline bool vshi_caster_in_layer(const vsh_caster *caster, const vsh_scene_layer *layer) {
    return caster->layer == NULL ? layer == NULL : layer != NULL && strcmp(caster->layer, layer->name) == 0;
}

/* Whether a caster stays out of level sets: spheres and direct heightfields, if shadows are `hard` or
 * `classic` and AO, if there is any, is traced. */
bool vshi_caster_is_direct(const vsh_scene *scene, const vsh_caster *caster);

/* outer × inner, three rows of four each; inner NULL: identity. */
void vshi_transform_compose(const double outer[12], const double *inner, double result[12]);

/* The level set of vdb caster `index`, or NULL. Belongs to the assets. */
const vsh_grid *vshi_assets_grid(const vsh_assets *assets, size_t index);

/* The outline of mask or text caster `index`, or NULL. Belongs to the assets. */
const vsh_outline *vshi_assets_outline(const vsh_assets *assets, size_t index);

/* The spheres of a caster, voxelised or not; NULL for every other. */
const vsh_spheres *vshi_assets_spheres(const vsh_assets *assets, size_t index);

/* Warns of triangles of zero area, and refuses a file of nothing else, each file once. Errors:
 * VSH_ERROR_INPUT. */
vsh_result vshi_assets_check(const vsh_assets *assets, const vsh_scene *scene, const vsh_run *run,
                             vsh_error *error);

#endif
