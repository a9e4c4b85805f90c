/* Triangles of a vsh_mesh in the world, and what casters, receivers and messages need to know of a mesh. */
#ifndef VSHI_CASTER_MESH_H
#define VSHI_CASTER_MESH_H

#include "base/error.h"
#include "base/vec.h"

#include <vdbshade/mesh.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A mesh's name in a message: "mesh 'sail'", "mesh 3" where it has none, and "mesh" where `index` is
 * VSHI_MESH_ALONE. To be used within one expression: vshi_mesh_label(mesh, i).text. */
typedef struct vshi_mesh_name {
    char text[160];
} vshi_mesh_name;

#define VSHI_MESH_ALONE ((size_t)-1)

VSHI_SHARED vshi_mesh_name vshi_mesh_label(const vsh_mesh *mesh, size_t index);

/* Counts the meshes from `first` on (< count) that are one object: a row of one number above 0, else one
 * mesh. */
static inline size_t vshi_mesh_object_size(const vsh_mesh *meshes, size_t first, size_t count) {
    size_t end = first + 1;
    while (end < count && meshes[first].object > 0 && meshes[end].object == meshes[first].object) {
        ++end;
    }
    return end - first;
}

/* Checks a mesh as vsh_mesh_check() does. A function that gets meshes from a caller calls this first, or
 * makes a set of them (mesh/mesh_set.h). A mesh that is known to pass costs nothing. `index` is the mesh's
 * place in a list, for messages. */
vsh_result vshi_mesh_check_data(const vsh_mesh *mesh, size_t index, vsh_error *error);

/* The same, whatever is known. */
vsh_result vshi_mesh_validate(const vsh_mesh *mesh, size_t index, vsh_error *error);

/* Validates a mesh, and fills the report but for its edges. */
vsh_result vshi_mesh_look_over(const vsh_mesh *mesh, size_t index, vsh_mesh_report *report, vsh_error *error);

/* The transform's part of it: finite, and no flattening. */
vsh_result vshi_mesh_check_transform(const vsh_mesh *mesh, size_t index, vsh_error *error);

/* NULL, the identity, is like itself only. */
bool vshi_mesh_same_transform(const double *a, const double *b);

/* World place of a vertex. */
static inline vshi_vec vshi_mesh_place(const vsh_mesh *mesh, size_t vertex) {
    return vshi_transform_point(mesh->transform, vshi_vec_off(mesh->positions + 3 * vertex));
}

/* World corners of triangle i, anticlockwise from outside also where the transform mirrors. The mesh has
 * passed vshi_mesh_check_data(). Returns the vertices behind them in `vertex` (may be NULL), in the same
 * order. */
static inline void vshi_mesh_triangle_of(const vsh_mesh *mesh, size_t i, vshi_vec corner[3],
                                         uint32_t vertex[3]) {
    const uint32_t *given = mesh->indices + 3 * i;
    const bool mirrored = vshi_transform_determinant(mesh->transform) < 0.0;
    const uint32_t order[3] = {given[0], given[mirrored ? 2 : 1], given[mirrored ? 1 : 2]};
    for (int k = 0; k < 3; ++k) {
        corner[k] = vshi_mesh_place(mesh, order[k]);
        if (vertex != NULL) {
            vertex[k] = order[k];
        }
    }
}

static inline void vshi_mesh_triangle(const vsh_mesh *mesh, size_t i, vshi_vec corner[3]) {
    vshi_mesh_triangle_of(mesh, i, corner, NULL);
}

/* Whether triangle i has no area, so that everything skips it. Decided on the local positions: the products
 * of differences of floats are nearly always exact in double, so that collinear corners give 0 and not a
 * rounding's worth of area, as they would after a rotation. */
VSHI_SHARED bool vshi_mesh_degenerate(const vsh_mesh *mesh, size_t i);

/* --- where a point of a triangle lies in the world and which way it faces */

/* One triangle, ready to be evaluated. Corners are anticlockwise from outside. */
typedef struct vshi_surface {
    vshi_vec corner[3];
    vshi_vec normal[3]; /* of the corners, unit; the geometric one where the mesh has none that serves */
    vshi_vec geometric; /* unit */
    bool lifts[3];      /* whether the tangent plane at the corner lifts samples */
    bool smooth;
    bool mirrored; /* corners 1 and 2 have changed places */
} vshi_surface;

/* False where the triangle has no area. */
bool vshi_surface_set(const vsh_mesh *mesh, size_t triangle, vshi_surface *surface);

/* Position and normal at barycentric weights of the triangle's corners as the mesh's indices give them, and
 * how far the position is off the triangle. */
void vshi_surface_at(const vshi_surface *surface, const double weight[3], vshi_vec *position,
                     vshi_vec *normal, vshi_vec *lift);

/* The direction in which a triangle's u grows, unit, and 1 or -1: the side of normal × tangent on which v
 * grows. A zero vector where the UVs have no area. */
vshi_vec vshi_surface_tangent(const vsh_mesh *mesh, size_t triangle, double *handedness);

/* --- terrains */

/* A grid of heights: a surface, or a closed solid. Its vertices are the samples, row by row, and of a solid
 * the bottom below each sample of the edge, from the first row's on around, then the bottom's middle. */
typedef struct vshi_terrain {
    size_t columns, rows; /* samples, at least 2 */
    bool solid;
} vshi_terrain;

/* Samples along the edge. */
static inline size_t vshi_terrain_edge_length(vshi_terrain t) {
    return 2 * (t.columns - 1) + 2 * (t.rows - 1);
}

static inline size_t vshi_terrain_triangle_count(vshi_terrain t) {
    return 2 * (t.columns - 1) * (t.rows - 1) + (t.solid ? 3 * vshi_terrain_edge_length(t) : 0);
}

static inline size_t vshi_terrain_vertex_count(vshi_terrain t) {
    return t.columns * t.rows + (t.solid ? vshi_terrain_edge_length(t) + 1 : 0);
}

/* The vertices of triangle i: two for each cell, then of a solid two of the sides and one of the bottom for
 * each sample of the edge. */
void vshi_terrain_triangle(vshi_terrain terrain, size_t i, uint32_t vertex[3]);

/* Whether a mesh has the triangles of a terrain, all of them in order, and its samples lie apart: x grows
 * with columns, z with rows. */
bool vshi_mesh_is_terrain(const vsh_mesh *mesh, vshi_terrain *terrain);

/* Whether its samples stand on a grid of even steps, but for the rounding of floats. */
bool vshi_terrain_is_even(const vsh_mesh *mesh, vshi_terrain terrain);

/* weld[v] = the lowest vertex at the very position of v (-0 is 0), for the mesh's vertex_count vertices.
 * Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_mesh_weld(const vsh_mesh *mesh, uint32_t *weld, vsh_error *error);

/* Edges between welded vertices: fills open_edges and flipped_edges. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_mesh_count_edges(const vsh_mesh *mesh, vsh_mesh_report *report, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
