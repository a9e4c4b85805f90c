/* A coarser level while it is derived: what derive.c and spread.c share. */
#ifndef VSHI_FIELD_DERIVE_H
#define VSHI_FIELD_DERIVE_H

#include "field/level.h"

enum { VSHI_FOOT_CHANGES = 7 };

typedef struct vshi_derivation {
    const vsh_field *field;
    const vshi_level *fine; /* the level below */
    vshi_below below;       /* and what is kept of it */
    vshi_blocks blocks;     /* of the new level */
    int32_t *corners;       /* [count][3], lattice coordinates of each block's first voxel */
    uint8_t *core;          /* [count][512]: value taken from the level below */
    int16_t *feet;          /* [count][3][512], as vshi_below.feet */
    int32_t *changed; /* [count][7]: the turn in which a foot next to each face last changed (low x, high
                       * x, low y …), and any of the block; -1: none is known */
    int32_t *seen;    /* [count]: the turn in which the block was last looked at; -1: not yet */
} vshi_derivation;

/* Spreads the core's feet over the band. */
vsh_result vshi_feet_spread(vshi_derivation *d, vshi_job *job, vsh_error *error);

#endif
