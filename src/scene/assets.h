/* What the assembly of casters reads of a scene's assets. */
#ifndef VSHI_ASSETS_H
#define VSHI_ASSETS_H

#include <vdbshade/scene.h>

/* outer × inner, three rows of four each; inner NULL: identity. */
void vshi_transform_compose(const double outer[12], const double *inner, double result[12]);

/* The level set of vdb caster `index`, or NULL. Belongs to the assets. */
const vsh_grid *vshi_assets_grid(const vsh_assets *assets, size_t index);

/* The outline of mask or text caster `index`, or NULL. Belongs to the assets. */
const vsh_outline *vshi_assets_outline(const vsh_assets *assets, size_t index);

#endif
