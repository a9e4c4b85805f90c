/* Finds solids: which sides of the triangles of some meshes are air.
 *
 * Meshes consist of components, pieces connected by their edges (edges.h). Each is one of four kinds.
 * All meshes of a scene are analysed together, because a room may lie in the walls of another mesh. The parts
 * of an object (vshi_wholes) count as one mesh. */
#pragma once

#include "base/error.h"
#include "base/vec.h"
#include "geometry/mesh.h"

#include <stdbool.h>
#include <stdint.h>
#include <vdbshade/mesh.h>

VSH_BEGIN_C

/* Objects joined from their parts, one mesh for each material: a part alone is open where the next begins.
 * Meshes that follow each other, of one object, transform and solidity, become one whole. Its triangles are
 * theirs in their order. */
typedef struct vshi_wholes {
    vsh_mesh *meshes; /* [count]; a view of the part if there is only one */
    size_t *first;    /* [count + 1]: a whole's first part in the list of meshes */
    size_t count;
    float **positions;  /* [count]; NULL: the part's */
    uint32_t **indices; /* [count]; NULL: the part's */
} vshi_wholes;

/* Sides of a triangle. Seen from the front, the corners of vshi_mesh_triangle() run anticlockwise. */
enum {
    VSHI_SIDE_SHEET,  /* air on both sides */
    VSHI_SIDE_BEHIND, /* air in front; a solid or a wall behind */
    VSHI_SIDE_BEFORE  /* a flipped face: the solid or wall is in front, air is behind */
};

typedef enum vshi_kind {
    VSHI_KIND_SHEET, /* air on both sides: a card, a leaf, a curtain, an open cup */
    VSHI_KIND_SOLID, /* encloses a solid, and is closed over its holes */
    VSHI_KIND_ROOM,  /* looks inwards and lies within solids: its inside is cut out of them */
    VSHI_KIND_WALL   /* a thin wall behind its faces, with air on both sides: a lone room, a sky dome, or the
                        outer skin of a house with open rooms */
} vshi_kind;

typedef struct vshi_component {
    vshi_kind kind;
    bool inward;          /* its faces look at its inside */
    bool vessel;          /* a sheet that would be solid if its holes were closed: a cup, a house without a
                             floor. Points that see only its inner sides are hidden (shade/shade.h) */
    bool around_all;      /* a sheet, because as a solid it would bury everything else */
    uint32_t whole;       /* its number */
    size_t triangles;     /* with some area, duplicates included */
    size_t turned;        /* triangles of VSHI_SIDE_BEFORE */
    size_t open_edges;    /* 0: closed */
    size_t holes;         /* connected groups of open edges */
    double area;          /* world units² */
    double enclosed;      /* 1: it encloses all behind its faces, 1/2: a plane (part_encloses()) */
    double volume;        /* world units³; 0 if it has no inside */
    vshi_vec low, high;   /* box, world */
    const uint32_t *list; /* its triangles [triangles], ascending */
    vshi_vec (*cap)[3];   /* triangles that close its holes [open_edges], world, facing as its faces */
} vshi_component;

/* A room, and a solid that it is cut out of: numbers of components. */
typedef struct vshi_cut {
    uint32_t room, solid;
} vshi_cut;

typedef struct vshi_solidity {
    vshi_wholes wholes;
    vshi_component *components; /* whole by whole, in the order of their first triangles */
    size_t count;
    size_t *first;  /* [wholes.count + 1]: the wholes' first components */
    vshi_cut *cuts; /* sorted by solid, then by room */
    size_t cut_count, cut_capacity;
    size_t mesh_count;
    size_t *first_side; /* [mesh_count + 1]: a mesh's first triangle in these three arrays */
    uint8_t *turned;    /* runs against the faces of its component */
    uint8_t *sides, *holed;
    struct vshi_components *found; /* [wholes.count]: before later decisions */
    size_t *first_cap;             /* [wholes.count + 1] */
    vshi_vec (*caps)[3];
} vshi_solidity;

/* Analyses meshes that have passed vshi_mesh_check_data(), and must live as long as the result. A mesh's
 * `solidity` overrules the kinds found. Errors: VSH_ERROR_LIMIT (more than 2^32 / 3 triangles in one object,
 * run->memory_limit), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. Free the result with vshi_solidity_free(). */
vsh_result vshi_solidity_create(const vsh_mesh *meshes, size_t mesh_count, const vsh_run *run,
                                vshi_solidity **made, vsh_error *error);
void vshi_solidity_free(vshi_solidity *solidity); /* NULL does nothing */

/* VSHI_SIDE_… of the triangles of a mesh [triangle_count]; triangles without area are sheets. */
const uint8_t *vshi_solidity_sides(const vshi_solidity *solidity, size_t mesh);

/* VSHI_SIDE_… of the triangles of a mesh [triangle_count] in components with holes that are solids, rooms,
 * walls or vessels: rays may enter these by one hole and leave by another. VSHI_SIDE_SHEET for all others. */
const uint8_t *vshi_solidity_holed(const vshi_solidity *solidity, size_t mesh);

/* Point `number` of a triangle. Successive numbers are spread evenly over it. */
vshi_vec vshi_point_in(const vshi_vec corner[3], size_t number);

VSH_END_C
