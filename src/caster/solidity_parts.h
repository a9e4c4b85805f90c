/* What the files behind caster/solidity.h share. */
#ifndef VSHI_SOLIDITY_PARTS_H
#define VSHI_SOLIDITY_PARTS_H

#include "caster/components.h"
#include "caster/enclosure.h"
#include "caster/solidity.h"

struct vshi_solidity {
    vshi_wholes wholes;
    vshi_components *found; /* [wholes.count] */
    uint8_t *sides;         /* of all meshes */
    uint8_t *holed;         /* likewise */
    size_t *first_side;     /* [mesh count + 1] */
    vshi_component *components;
    size_t count;
    size_t *first; /* [wholes.count + 1]: the wholes' first components */
    vshi_vec (*caps)[3];
    size_t cap_count;
    vshi_cut *cuts;
    size_t cut_count, cut_room;
};

/* Measures all components, closes their holes, and tells sheets, solids and walls apart, each for itself. */
vsh_result vshi_kinds_find(vshi_solidity *solidity, vsh_error *error);

/* Turns what encloses something to face the other way. */
void vshi_component_turn(vshi_solidity *solidity, vshi_component *component);

/* A component as a part of its whole. */
vshi_surface_part vshi_component_part(const vshi_solidity *solidity, const vshi_component *component);

/* Tells rooms from walls by what lies around them, and finds what they are cut out of. */
vsh_result vshi_rooms_find(vshi_solidity *solidity, vsh_error *error);

#endif
