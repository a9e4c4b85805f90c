/* What neighbouring points share on their way to a light. */
#ifndef VSHI_BLOCKS_H
#define VSHI_BLOCKS_H

#include "shade/shadow.h"

/* Looks at points that follow each other together: one beam around the cones of 64 of them, then of 16, tells
 * that all are hidden, or from where on all are free. Those are settled, these end there: what is left to
 * march is what is near. Nothing is lost by points that lie apart but the look. */
void vshi_blocks_prove(const vshi_shadow_task *task, vshi_facing *facing, vshi_chunk *chunk,
                       vsh_shade_stats *stats);

#endif
