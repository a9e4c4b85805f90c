/* A mesh as it is cut into charts: which triangles hang together where no chart is cut, and what of them
 * stays together. */
#ifndef VSHI_UNWRAP_CUT_MESH_H
#define VSHI_UNWRAP_CUT_MESH_H

#include "base/job.h"
#include "base/vec.h"
#include "mesh/mesh.h"

#include <stdint.h>

#define VSHI_NONE UINT32_MAX

/* Side 3 i + k of triangle i runs from its corner k to corner k + 1, in the mesh's order. Normals are by that
 * order; in a mesh that is mirrored they look inwards, which no chart minds. */
typedef struct vshi_cut_mesh {
    const vsh_mesh *mesh;
    size_t count; /* triangles */
    double
        scale; /* world units in one of the surface's, in which it is about as large as 1: a power of two */
    vshi_vec *place;  /* [vertex_count]: as in the world, but for its translation */
    double *area;     /* [count]; 0: it has no place in an atlas */
    vshi_vec *normal; /* [count]: unit */
    uint32_t
        *partner;   /* [3 count]: the side beyond, running the other way; VSHI_NONE: a border or a crease */
    uint8_t *soft;  /* [3 count]: no seam of shading normals or UVs runs along the side */
    uint32_t *unit; /* [count]: triangles that stay together: parts of a plane, a quad */
    uint32_t *unit_begin; /* [unit_count + 2] in `unit_list` */
    uint32_t *unit_list;  /* triangles by unit, ascending */
    uint32_t unit_count;  /* without those of triangles that have no area */
} vshi_cut_mesh;

/* Bytes that a mesh's surface takes, with what making it and its charts takes, at most. */
double vshi_cut_mesh_bytes(const vsh_mesh *mesh);

/* Charts are cut along creases, or `by_uvs` where the mesh's UVs are not the same on both sides, and nowhere
 * else. The mesh has passed vshi_mesh_check_data(), and lives on. Errors: VSH_ERROR_LIMIT (2^32 / 3
 * triangles), VSH_ERROR_MEMORY. Free with vshi_cut_mesh_free(), after a failure too. */
vsh_result vshi_cut_mesh_make(const vsh_mesh *mesh, size_t index, bool by_uvs, vshi_cut_mesh *surface,
                              vsh_error *error);
void vshi_cut_mesh_free(vshi_cut_mesh *surface);

/* Gives each triangle the number of its chart, chart_of[count], or VSHI_NONE, and tells how many there are. A
 * chart is of whole units, hangs together, and its normals are within some 60° of their mean. The job tells
 * whether to stop. Errors: VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_grow_charts(const vshi_cut_mesh *surface, vshi_job *job, uint32_t *chart_of,
                            uint32_t *chart_count, vsh_error *error);

static inline void vshi_cut_mesh_corners(const vshi_cut_mesh *surface, size_t i, vshi_vec corner[3]) {
    for (int k = 0; k < 3; ++k) {
        corner[k] = surface->place[surface->mesh->indices[3 * i + (size_t)k]];
    }
}

static inline uint32_t vshi_next_side(uint32_t side) {
    return side % 3 == 2 ? side - 2 : side + 1;
}

static inline double vshi_side_length(const vshi_cut_mesh *s, uint32_t side) {
    return vshi_length(
        vshi_sub(s->place[s->mesh->indices[side]], s->place[s->mesh->indices[vshi_next_side(side)]]));
}

#endif
