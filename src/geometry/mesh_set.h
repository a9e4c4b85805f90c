/* Sets of meshes that are checked and analysed once. Views of such meshes refer to the result
 * (vsh_mesh.checked), so later sets and calls reuse it. */
#pragma once

#include "geometry/mesh.h"
#include "geometry/solidity.h"

VSH_BEGIN_C

/* The result of checking a mesh. */
struct vsh_checked_mesh {
    vsh_mesh of;                   /* to detect a view that was changed since */
    vsh_mesh_report report;        /* without edges, which are 0 */
    const vshi_solidity *solidity; /* of all meshes analysed together; NULL: not yet */
    size_t place;                  /* among those */
};

typedef struct vshi_mesh_set {
    vsh_mesh *meshes; /* [count]: views that refer to `checked` */
    size_t count;
    struct vsh_checked_mesh *checked; /* [count] */
    const vshi_solidity *solidity;    /* of exactly these meshes; NULL before vshi_mesh_set_solve() */
    vshi_solidity *own;               /* if the set has solved it */
    vshi_tight_meshes tight;
} vshi_mesh_set;

/* The result of checking this unchanged mesh, or NULL. */
const struct vsh_checked_mesh *vshi_mesh_known(const vsh_mesh *mesh);

/* VSHI_SIDE_… of the triangles of a mesh, or NULL if its solidity is unknown. */
const uint8_t *vshi_mesh_sides(const vsh_mesh *mesh);

/* Checks the meshes without a result. Their arrays, and the results of others, must outlive the set. Errors:
 * as vsh_mesh_check(), with a mesh's place in the list. Free it with vshi_mesh_set_free(), even after a
 * failure. */
VSHI_SHARED vsh_result vshi_mesh_set_create(const vsh_mesh *meshes, size_t count, vshi_mesh_set *set,
                                            vsh_error *error);
VSHI_SHARED void vshi_mesh_set_free(vshi_mesh_set *set);

/* Finds the solidity, unless exactly these meshes have one. It takes a small part of a second for a million
 * triangles, so it is no stage of the progress. Errors: as vshi_solidity_create(). */
VSHI_SHARED vsh_result vshi_mesh_set_solve(vshi_mesh_set *set, const vsh_run *run, vsh_error *error);

/* Sends notes on the sheets, the solids with holes and the flipped faces of a solved set. Sheets become
 * shells of `shell` voxels of size `voxel`; `shell` is 0 without voxels. */
VSHI_SHARED void vshi_mesh_set_note(const vshi_mesh_set *set, double shell, double voxel, const vsh_run *run);

VSH_END_C
