/* Which texels of a lightmap have values, and how many have none. */
#ifndef VSHI_BAKE_COVERAGE_H
#define VSHI_BAKE_COVERAGE_H

#include "bake/origins.h"
#include "bake/padding.h"

/* Writes the planes `coverage` and `invalid` of a lightmap whose rows are those held, where it has them, and
 * counts the band's texels, those without a value by the mesh of their first sample. */
void vshi_coverage_write(const vsh_texels *texels, const vshi_origins *origins, const uint8_t *state,
                         const vsh_lightmap *lightmap, vsh_bake_stats *stats);

#endif
