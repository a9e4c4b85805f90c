/* What the files behind mesh/solidity.h share. */
#ifndef VSHI_SOLIDITY_PARTS_H
#define VSHI_SOLIDITY_PARTS_H

#include "base/job.h"
#include "mesh/components.h"
#include "mesh/mesh.h"
#include "mesh/solidity.h"

#include <stdint.h>

/* --- the share of its back that a surface encloses, and winding numbers */

/* Some of a mesh's triangles, of which some are turned over. */
typedef struct vshi_surface_part {
    const vsh_mesh *mesh;
    const uint32_t *list; /* [count] */
    size_t count;
    const uint8_t *turned; /* of the mesh's triangles */
} vshi_surface_part;

/* World corners of a triangle that a part lists. */
void vshi_part_corners(const vshi_surface_part *part, size_t at, vshi_vec corner[3]);

/* Solid angle of a triangle seen from a point, -2π … 2π: positive from behind it. */
double vshi_solid_angle(const vshi_vec corner[3], vshi_vec point);

/* How often a part goes around a point: 1 inside of a closed surface, 0 outside of it; between them where it
 * is open, and 1/2 on it. */
double vshi_winding(const vshi_surface_part *part, vshi_vec point);

/* The point of a triangle that has a number: those of numbers that follow each other are spread over it. */
vshi_vec vshi_point_in(const vshi_vec corner[3], size_t number);

/* `count` points spread over a part by area. */
void vshi_part_samples(const vshi_surface_part *part, double area, size_t count, vshi_vec *samples);

/* The share of one of its sides that a part encloses: 1 if it is closed, 1/2 for a plane. `caps` are
 * triangles over its holes. */
double vshi_part_encloses(const vshi_surface_part *part, double area, const vshi_vec (*caps)[3],
                          size_t cap_count);

/* --- components */

struct vshi_solidity {
    vshi_wholes wholes;
    vshi_components *found; /* [wholes.count]: as they are by themselves */
    bool *lent;             /* [wholes.count]: of another solidity, where a whole was found before */
    size_t mesh_count;
    uint8_t *turned;    /* of all meshes: found[].turned, and what was decided since */
    uint8_t *sides;     /* of all meshes */
    uint8_t *holed;     /* likewise */
    size_t *first_side; /* [mesh_count + 1] */
    vshi_component *components;
    size_t count;
    size_t *first; /* [wholes.count + 1]: the wholes' first components */
    vshi_vec (*caps)[3];
    size_t cap_count;
    vshi_cut *cuts;
    size_t cut_count, cut_room;
};

/* Of the triangles of the component's whole: which run against what their component faces. */
static inline uint8_t *vshi_solidity_turned(const vshi_solidity *s, const vshi_component *component) {
    return s->turned + s->first_side[s->wholes.first[component->whole]];
}

/* Measures all components, closes their holes, and tells sheets, solids and walls apart, each for itself. */
vsh_result vshi_kinds_find(vshi_solidity *solidity, vshi_job *job, vsh_error *error);

/* Turns what encloses something to face the other way. */
void vshi_component_turn(vshi_solidity *solidity, vshi_component *component);

/* An open surface that encloses this share (vshi_part_encloses()) counts as closed. Measured: a ball with
 * small holes 0.98 and more, a head open at its neck 0.95, a tree's trunk 0.96; a cup 0.91, a box without its
 * lid 0.90, half a sphere 0.82, a short tube 0.79, a tent 0.64, a curtain 0.60. A cup that is filled by
 * mistake buries its content, so the limit is above it. */
#define VSHI_SOLID_ENCLOSES 0.945

/* A component as a part of its whole. */
vshi_surface_part vshi_component_part(const vshi_solidity *solidity, const vshi_component *component);

/* Tells rooms from walls by what lies around them, and finds what they are cut out of. */
vsh_result vshi_rooms_find(vshi_solidity *solidity, vsh_error *error);

#endif
