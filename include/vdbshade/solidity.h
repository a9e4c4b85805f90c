/* What meshes are taken for: solids, rooms, walls or sheets. */
#ifndef VDBSHADE_SOLIDITY_H
#define VDBSHADE_SOLIDITY_H

#include "mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A mesh's components, the pieces that hang together by their edges, by what each is taken for
 * (vsh_mesh.solidity). Surfaces that are open but enclose nearly all of what is behind their faces, told by
 * the generalized winding number (Jacobson, Kavan and Sorkine-Hornung 2013), count among the closed ones. */
typedef struct vsh_solidity_report {
    size_t solids;      /* faces outwards */
    size_t rooms;       /* faces inwards, within solids: cut out of them */
    size_t walls;       /* faces inwards and not within solids, or the skin of a hollow house: a thin wall
                           behind the faces, air on both sides of it */
    size_t sheets;      /* air on both sides, shell_thickness apart */
    size_t closed_over; /* of the solids and rooms: those that are closed over holes of their own */
    size_t holes;       /* of those */
    size_t open_edges;  /* around these holes */
    size_t turned_triangles; /* that face the other way than those around, and are taken as turned over */
    size_t open_solids;      /* solids that lack a side: a house without a floor, a cup. Level sets have their
                                faces      as sheets; for rays, points that see only their inner sides are hidden */
} vsh_solidity_report;

/* Looks at meshes that cast together, and fills reports[mesh_count]; parts of one object (vsh_mesh.object)
 * that follow each other have one report. Errors: as vsh_mesh_check(); VSH_ERROR_LIMIT (run->memory_limit,
 * more than 2^32 / 3 triangles in one object), VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_mesh_solidity(const vsh_mesh *meshes, size_t mesh_count, const vsh_run *run,
                                     vsh_solidity_report *reports, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
