/* A vsh_mesh in the world: its checks, its triangles, its surface, its name in messages. */
#pragma once

#include "base/error.h"
#include "base/vec.h"

#include <vdbshade/mesh.h>

VSH_BEGIN_C

/* Whether `pattern` matches a mesh (vsh_selection). "material:PATTERN" matches its material's name. 1 or 0; 0
 * if either is NULL. */
int32_t vshi_mesh_matches(const vsh_mesh *mesh, const char *pattern);

/* A mesh's name in a message: "mesh 'sail'", else "mesh 3", or "mesh" if `index` is VSHI_MESH_ALONE. Use it
 * within one expression: vshi_mesh_label(mesh, i).text. */
typedef struct vshi_mesh_name {
    char text[160];
} vshi_mesh_name;

#define VSHI_MESH_ALONE ((size_t)-1)

VSHI_SHARED vshi_mesh_name vshi_mesh_label(const vsh_mesh *mesh, size_t index);

/* Counts the meshes from `first` (< count) that are one object: successive ones with the same number above 0,
 * else one mesh. */
static inline size_t vshi_mesh_object_size(const vsh_mesh *meshes, size_t first, size_t count) {
    size_t end = first + 1;
    while (end < count && meshes[first].object > 0 && meshes[end].object == meshes[first].object) {
        ++end;
    }
    return end - first;
}

/* Checks a mesh as vsh_mesh_check() does. A function that gets meshes from a caller calls this first, or
 * makes a set of them (mesh_set.h). A mesh that has passed before costs nothing. `index` is the mesh's place
 * in a list, for messages. */
vsh_result vshi_mesh_check_data(const vsh_mesh *mesh, size_t index, vsh_error *error);

/* Checks a mesh even if it has passed before. Refuses strides and 16-bit indices. */
vsh_result vshi_mesh_validate(const vsh_mesh *mesh, size_t index, vsh_error *error);

/* Meshes without strides and 16-bit indices: the caller's own, or copies in `memory`. */
typedef struct vshi_tight_meshes {
    const vsh_mesh *meshes; /* [count] */
    void *memory;           /* free() it; NULL: there are no copies */
    size_t bytes;           /* of the copies */
} vshi_tight_meshes;

/* Copies the meshes that have strides or 16-bit indices. Errors: VSH_ERROR_ARGUMENT (arrays, counts and
 * strides), VSH_ERROR_MEMORY. */
VSHI_SHARED vsh_result vshi_meshes_tighten(const vsh_mesh *meshes, size_t count, vshi_tight_meshes *tight,
                                           vsh_error *error);

/* Checks that a transform is finite and does not flatten. */
vsh_result vshi_mesh_check_transform(const vsh_mesh *mesh, size_t index, vsh_error *error);

/* Whether two transforms are equal. NULL, the identity, equals NULL only. */
bool vshi_mesh_same_transform(const double *a, const double *b);

/* World position of a vertex. */
static inline vshi_vec vshi_mesh_place(const vsh_mesh *mesh, size_t vertex) {
    return vshi_transform_point(mesh->transform, vshi_vec_off(mesh->positions + 3 * vertex));
}

/* World corners of triangle i of a checked mesh, anticlockwise from outside even if the transform mirrors,
 * and their vertices in the same order. */
static inline void vshi_mesh_triangle_of(const vsh_mesh *mesh, size_t i, vshi_vec corner[3],
                                         uint32_t vertex[3]) {
    const uint32_t *given = mesh->indices + 3 * i;
    const bool mirrored = vshi_transform_determinant(mesh->transform) < 0.0;
    const uint32_t order[3] = {given[0], given[mirrored ? 2 : 1], given[mirrored ? 1 : 2]};
    for (int k = 0; k < 3; ++k) {
        corner[k] = vshi_mesh_place(mesh, order[k]);
        vertex[k] = order[k];
    }
}

static inline void vshi_mesh_triangle(const vsh_mesh *mesh, size_t i, vshi_vec corner[3]) {
    uint32_t vertex[3];
    vshi_mesh_triangle_of(mesh, i, corner, vertex);
}

/* Normal of triangle i without the transform, twice the area long. */
vshi_vec vshi_mesh_face_normal(const vsh_mesh *mesh, size_t i);

/* Whether triangle i has no area, so that all code skips it. Decides by local positions: products of
 * differences of floats are nearly always exact in double, so collinear corners give 0. After a rotation they
 * would give a rounding's worth of area. */
VSHI_SHARED bool vshi_mesh_degenerate(const vsh_mesh *mesh, size_t i);

/* --- positions and normals of a triangle's points */

/* One triangle. Corners are anticlockwise from outside. */
typedef struct vshi_surface {
    vshi_vec corner[3];
    vshi_vec normal[3]; /* of the corners, unit; the geometric normal if the mesh has no usable one */
    vshi_vec geometric; /* unit */
    bool lifts[3];      /* whether the tangent plane at the corner lifts samples */
    bool smooth;
    bool mirrored; /* corners 1 and 2 are swapped */
} vshi_surface;

/* Returns false for a triangle without area. */
bool vshi_surface_set(const vsh_mesh *mesh, size_t triangle, vshi_surface *surface);

/* Position and normal at barycentric weights, which follow the mesh's order of corners. `lift` is the
 * position's offset from the triangle. */
void vshi_surface_at(const vshi_surface *surface, const double weight[3], vshi_vec *position,
                     vshi_vec *normal, vshi_vec *lift);

/* The unit direction in which a triangle's u grows, and 1 or -1: the side of normal × tangent on which v
 * grows. A zero vector if the UVs have no area. */
vshi_vec vshi_surface_tangent(const vsh_mesh *mesh, size_t triangle, double *handedness);

/* --- terrains */

/* A grid of heights: a surface, or a closed solid. Its vertices are the samples, row by row. A solid adds the
 * bottom below each sample of the edge, around from the first row, then the bottom's middle. */
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

/* The vertices of triangle i. Each cell has two triangles. A solid adds, for each sample of the edge, two of
 * its side and one of the bottom. */
void vshi_terrain_triangle(vshi_terrain terrain, size_t i, uint32_t vertex[3]);

/* Whether a mesh has all triangles of a terrain in order, with x growing along columns and z along rows. */
bool vshi_mesh_is_terrain(const vsh_mesh *mesh, vshi_terrain *terrain);

/* Fills open_edges and flipped_edges, of edges between welded vertices. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_mesh_count_edges(const vsh_mesh *mesh, vsh_mesh_report *report, vsh_error *error);

VSH_END_C
