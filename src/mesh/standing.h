/* What the files that find what stands on something share. */
#ifndef VSHI_STANDING_H
#define VSHI_STANDING_H

#include "mesh/face_tree.h"
#include "mesh/solidity_parts.h"

/* How far from a hole's plane is just beyond it, of the square root of the hole's area: a gap that nobody
 * sees through. */
#define VSHI_STANDING_GAP 0.04

/* A tree of all faces that are near any of the components that are vessels; `faces` must outlive it. Errors:
 * VSH_ERROR_MEMORY. */
vsh_result vshi_faces_near_vessels(const vshi_solidity *solidity, vshi_face **faces, vshi_face_tree **tree,
                                   vsh_error *error);

enum {
    VSHI_VESSEL_HOLES = 32,  /* at most: one with more is a grating */
    VSHI_VESSEL_TARGETS = 64 /* points of it that segments are aimed at */
};

/* A vessel whose holes are looked at. */
typedef struct vshi_vessel {
    const vshi_solidity *s;
    const vshi_face_tree *tree;
    const vshi_component *component;
    uint32_t number;         /* of the component */
    const uint32_t *hole_of; /* [open_edges] */
    vshi_vec targets[VSHI_VESSEL_TARGETS];
    vshi_vec axes[VSHI_VESSEL_HOLES]; /* across the holes, as long as their areas */
    double open[VSHI_VESSEL_HOLES];   /* of each hole: the share that is not closed, or not covered */
} vshi_vessel;

/* False where it has too many holes. */
bool vshi_vessel_begin(vshi_vessel *vessel, const vshi_solidity *solidity, const vshi_face_tree *tree,
                       uint32_t component);

/* Sets `open` to the shares that others do not close; returns whether they close any. */
bool vshi_vessel_find_closed(vshi_vessel *vessel);

/* Then, of holes that nothing closes, to the shares that no back covers, as a roof does at a distance. */
void vshi_vessel_find_covered(vshi_vessel *vessel);

#endif
