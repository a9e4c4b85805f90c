/* A coarser level while it is derived: what derive.c and reach_out.c share. */
#ifndef VSHI_FIELD_DERIVE_H
#define VSHI_FIELD_DERIVE_H

#include "field/kernel/feet.h"
#include "field/level.h"

/* One bit a voxel of a block: word x, bit y · 8 + z. */
typedef uint64_t vshi_bits[8];

/* A coarser level while it is derived. */
typedef struct vshi_derivation {
    const vsh_field *field;
    const vshi_level *fine; /* the level below */
    vshi_below below;       /* and what is kept of it */
    vshi_blocks blocks;     /* of the new level */
    int32_t *corners;       /* [count][3], lattice coordinates of each block's first voxel */
    vshi_bits *core;        /* [count]: value taken from the level below */
    vshi_bits *inside;      /* [count]: negative */
    vshi_bits *rim;         /* [count]: core voxels that know their feet and touch others */
    int16_t *feet;          /* [count][3][512], as vshi_below.feet */
    const vshi_feet_kernel *kernel;
} vshi_derivation;

/* Keeps a foot that has slid. Feet of core voxels, too, are within a band and a step of theirs. */
static inline void vshi_foot_keep(const vshi_derivation *d, size_t block, const vshi_slides *slides,
                                  size_t i) {
    const float steps = VSHI_FOOT_STEPS / d->blocks.scale;
    for (size_t axis = 0; axis < 3; ++axis) {
        d->feet[(block * 3 + axis) * 512 + slides->voxel[i]] =
            vshi_round((slides->foot[axis][i] - slides->place[axis][i]) * steps);
    }
}

/* A voxel whose foot is to slide. */
static inline void vshi_slide_add(vshi_slides *slides, const float p[3], const float foot[3], int voxel) {
    const size_t i = slides->count++;
    for (int axis = 0; axis < 3; ++axis) {
        slides->place[axis][i] = p[axis];
        slides->foot[axis][i] = foot[axis];
    }
    slides->voxel[i] = (uint16_t)voxel;
}

/* Distances and feet of what is not of the core. */
vsh_result vshi_reach_out(vshi_derivation *d, vshi_job *job, vsh_error *error);

#endif
