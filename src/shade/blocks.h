/* What neighbouring points share on their way to a light. */
#ifndef VSHI_BLOCKS_H
#define VSHI_BLOCKS_H

#include "shade/shadow.h"

/* Looks at points that follow each other together: one beam around the cones of 64 of them, then of 16, tells
 * that all are hidden, or from where on all are free. Those are settled, these end there: what is left to
 * march is what is near. Nothing is lost by points that lie apart but the look. */
void vshi_blocks_prove(const vshi_shadow_task *task, vshi_facing *facing, vshi_chunk *chunk,
                       vsh_shade_stats *stats);

/* Points anywhere in each of `count` balls, at most VSHI_CHUNK, of free space: VSHI_PROVED_FREE where all of
 * them see the whole light, VSHI_PROVED_FULL where none sees any of it, else VSHI_UNPROVED. Centres and radii
 * are finest voxels, in field space. */
void vshi_blocks_prove_balls(const vshi_shadow_task *task, size_t count, const vshi_vec *centre,
                             const double *radius, int8_t *proof, vsh_shade_stats *stats);

#endif
