/* Shared by the files behind mesh/solidity.h. */
#ifndef VSHI_SOLIDITY_PARTS_H
#define VSHI_SOLIDITY_PARTS_H

#include "base/job.h"
#include "mesh/mesh.h"
#include "mesh/solidity.h"

#include <stdint.h>

/* --- the components of a mesh: pieces that hang together by their edges, turned to face one way */

/* An open edge, from vertex a to b as the triangle beside it runs once it is turned. */
typedef struct vshi_rim {
    uint32_t component;
    uint32_t a, b;
} vshi_rim;

typedef struct vshi_components {
    size_t count;
    uint8_t *turned;  /* [triangle_count]: against the others of its component */
    uint8_t *doubled; /* [triangle_count]: there is one with the same corners that faces the other way */
    uint32_t *begin;  /* [count + 2] in `list` */
    uint32_t *list;   /* triangles by component, ascending */
    uint8_t *twisted; /* [at least count]: no turning makes all its faces agree (a Moebius strip); none is
                         turned */
    vshi_rim *rims;   /* sorted by component, then by triangle */
    size_t rim_count;
} vshi_components;

/* Vertices count as one where their positions are equal. Two triangles at an edge hang together; where there
 * are more, those that have a solid between them do. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. Free the
 * result with vshi_components_free(), after a failure too. */
vsh_result vshi_components_find(const vsh_mesh *mesh, size_t index, vshi_components *found, vsh_error *error);
void vshi_components_free(vshi_components *components);

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

/* How often a part goes around a point: 1 inside of a closed surface, 0 outside of it; between them where it
 * is open, and 1/2 on it. */
double vshi_winding(const vshi_surface_part *part, vshi_vec point);

/* The point of a triangle that has a number: those of numbers that follow each other are spread over it. */
vshi_vec vshi_point_in(const vshi_vec corner[3], size_t number);

/* `count` points spread over a part by area. */
void vshi_part_samples(const vshi_surface_part *part, double area, size_t count, vshi_vec *samples);

/* --- components */

struct vshi_solidity {
    vshi_wholes wholes;
    vshi_components *found; /* [wholes.count]: as they are by themselves */
    bool *lent;             /* [wholes.count]: of another solidity, where a whole was found before */
    size_t mesh_count;
    uint8_t *turned;    /* of all meshes: found[].turned, changed by later decisions */
    uint8_t *sides;     /* of all meshes */
    uint8_t *holed;     /* likewise */
    size_t *first_side; /* [mesh_count + 1] */
    vshi_component *components;
    size_t count;
    size_t *first; /* [wholes.count + 1]: the wholes' first components */
    vshi_vec (*caps)[3];
    size_t cap_count;
    vshi_cut *cuts;
    size_t cut_count, cut_capacity;
};

/* Of the triangles of the component's whole: which run against what their component faces. */
static inline uint8_t *vshi_solidity_turned(const vshi_solidity *s, const vshi_component *component) {
    return s->turned + s->first_side[s->wholes.first[component->whole]];
}

/* Measures all components, closes their holes, and tells sheets, solids and walls apart, each for itself. */
vsh_result vshi_kinds_find(vshi_solidity *solidity, vshi_job *job, vsh_error *error);

/* An open surface that encloses this share counts as closed. Measured solids: a ball with small holes has
 * 0.98 and more, a head open at its neck 0.95, a tree's trunk 0.96. Measured sheets: a cup has 0.91, a box
 * without its lid 0.90, half a sphere 0.82, a short tube 0.79, a tent 0.64, a curtain 0.60. A cup that is
 * filled by mistake buries its content, so the limit is above it. */
#define VSHI_SOLID_ENCLOSES 0.945

/* A component as a part of its whole. */
vshi_surface_part vshi_component_part(const vshi_solidity *solidity, const vshi_component *component);

/* Tells rooms from walls by the solids around them, and finds the solids that rooms are cut out of. */
vsh_result vshi_rooms_find(vshi_solidity *solidity, vsh_error *error);

#endif
