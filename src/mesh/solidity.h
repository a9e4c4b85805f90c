/* What is solid: which side of every triangle of some meshes is air, and which is not.
 *
 * Meshes fall apart into components, pieces that hang together by their edges (mesh/edges.h); each is
 * one of four kinds. All meshes of a scene are looked at together, because a room is a room in the walls of
 * another mesh too, and the parts of an object (vshi_wholes) as one mesh. */
#ifndef VSHI_SOLIDITY_H
#define VSHI_SOLIDITY_H

#include "base/error.h"
#include "base/vec.h"
#include "mesh/mesh.h"

#include <stdbool.h>
#include <stdint.h>
#include <vdbshade/mesh.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Objects put together from the meshes that are their parts, one for each material: by itself such a part is
 * open where the next begins. Meshes that follow each other, of one object, transform and solidity, become
 * one whole; its triangles are theirs in their order. */
typedef struct vshi_wholes {
    vsh_mesh *meshes; /* [count]; a view of the one part where there is only one */
    size_t *first;    /* [count + 1]: the parts that a whole is made of follow each other in the list */
    size_t count;
    float **positions;  /* [count]; NULL: the part's */
    uint32_t **indices; /* [count]; NULL: the part's */
    size_t *of;         /* [meshes]: the whole that each is a part of */
} vshi_wholes;

/* Air or a solid on the two sides of a triangle. Seen from the front, the corners that vshi_mesh_triangle()
 * gives run anticlockwise. */
enum {
    VSHI_SIDE_SHEET,  /* air on both */
    VSHI_SIDE_BEHIND, /* air in front; a solid or a wall behind */
    VSHI_SIDE_BEFORE  /* a face that looks the wrong way: the solid or wall is in front, air is behind */
};

typedef enum vshi_kind {
    VSHI_KIND_SHEET, /* air on both sides: a card, a leaf, a curtain, an open cup */
    VSHI_KIND_SOLID, /* encloses a solid, and is closed over its holes */
    VSHI_KIND_ROOM,  /* looks inwards and lies within solids: what it encloses is cut out of them */
    VSHI_KIND_WALL   /* a thin wall behind its faces, air on both sides of it: a room or a sky dome by
                        itself, or the outer skin of a house with open rooms */
} vshi_kind;

typedef struct vshi_component {
    vshi_kind kind;
    bool inward;          /* its faces look at what it encloses */
    bool vessel;          /* a sheet that would be solid if its holes were closed: a cup, a house without a
                             floor. Points that see only its inner sides are hidden (shade/inside.h) */
    bool around_all;      /* a sheet, because as a solid it would bury everything else */
    uint32_t whole;       /* of vshi_solidity_wholes() */
    size_t triangles;     /* with some area, and those given twice */
    size_t turned;        /* of them: VSHI_SIDE_BEFORE */
    size_t open_edges;    /* 0: closed */
    size_t holes;         /* groups of open edges that hang together */
    double area;          /* world units² */
    double enclosed;      /* 1: it encloses all that lies behind its faces, 1/2: a plane (part_encloses()) */
    double volume;        /* world units³; 0 if it has no inside */
    vshi_vec low, high;   /* box, world */
    const uint32_t *list; /* its triangles [triangles], ascending */
    const vshi_vec (*cap)[3]; /* triangles that close its holes [open_edges], world, facing as its faces */
} vshi_component;

typedef struct vshi_solidity vshi_solidity;

/* Looks at meshes that have passed vshi_mesh_check_data(), which must live as long as the result, as must
 * the solidity that they are known from (mesh/mesh_set.h): what it found of a whole is not found again. A
 * mesh's `solidity` overrules what is found of its components. Errors: VSH_ERROR_LIMIT (more than 2^32 / 3
 * triangles in one object, run->memory_limit), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. Free the result with
 * vshi_solidity_free(). */
VSHI_SHARED vsh_result vshi_solidity_create(const vsh_mesh *meshes, size_t mesh_count, const vsh_run *run,
                                            vshi_solidity **made, vsh_error *error);
VSHI_SHARED void vshi_solidity_free(vshi_solidity *solidity); /* NULL does nothing */

/* VSHI_SIDE_… of the triangles of a mesh [triangle_count]; those without area are sheets. */
const uint8_t *vshi_solidity_sides(const vshi_solidity *solidity, size_t mesh);

/* VSHI_SIDE_… of the triangles of a mesh [triangle_count] by their own component if it has holes and is a
 * solid, a room, a wall or a vessel: rays may enter it by one hole and leave by another. VSHI_SIDE_SHEET for
 * all others. */
const uint8_t *vshi_solidity_holed(const vshi_solidity *solidity, size_t mesh);

/* The objects, put together from the meshes. */
VSHI_SHARED const vshi_wholes *vshi_solidity_wholes(const vshi_solidity *solidity);

/* The components, whole by whole, in the order of their first triangles. */
VSHI_SHARED const vshi_component *vshi_solidity_components(const vshi_solidity *solidity, size_t *count);

/* The components of one whole: *count of them, from the returned one on. */
VSHI_SHARED const vshi_component *vshi_solidity_of_whole(const vshi_solidity *solidity, size_t whole,
                                                         size_t *count);

/* The point of a triangle that has a number: those of numbers that follow each other are spread over it. */
vshi_vec vshi_point_in(const vshi_vec corner[3], size_t number);

/* A room, and a solid that it is cut out of: places in the list of components. */
typedef struct vshi_cut {
    uint32_t room, solid;
} vshi_cut;

/* Sorted by solid, then by room. */
VSHI_SHARED const vshi_cut *vshi_solidity_cuts(const vshi_solidity *solidity, size_t *count);

#ifdef __cplusplus
}
#endif

#endif
