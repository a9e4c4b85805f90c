/* Triangle meshes: views of the caller's arrays, a check of them, and models read from files. */
#ifndef VDBSHADE_MESH_H
#define VDBSHADE_MESH_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { VSH_MAX_UV_SETS = 8 };

/* A view of a triangle mesh. Nothing is copied or owned; arrays must outlive the call they are given to. */
typedef struct vsh_mesh {
    const char *name;       /* for messages; may be NULL */
    const float *positions; /* [vertex_count][3], local units, finite */
    const float *normals;   /* [vertex_count][3], shading normals of any length, or NULL: flat */
    const float
        *uvs; /* [vertex_count][2], lightmap coordinates with v up, or NULL where no bake needs them */
    const uint32_t *indices; /* [triangle_count][3], each < vertex_count, anticlockwise from outside */
    size_t vertex_count;
    size_t triangle_count;
    const double
        *transform; /* [12], local to world, three rows of four (column 3 translates); NULL: identity */
} vsh_mesh;

/* What vsh_mesh_check() found. Vertices at equal positions count as one, so seams of UVs open nothing. */
typedef struct vsh_mesh_report {
    size_t degenerate_triangles; /* of zero area; they are skipped everywhere */
    size_t open_edges;           /* edges with an odd number of triangles: the mesh bounds no solid */
    size_t flipped_edges;        /* edges whose triangles disagree about the outside */
    double area;                 /* world units², all triangles */
    double bounds_min[3]; /* world units, over vertices in use; min > max for a mesh with no triangle left */
    double bounds_max[3];
} vsh_mesh_report;

/* Looks a mesh over. Errors: VSH_ERROR_INPUT for a vertex that is not finite, an index out of range or a
 * transform that is not finite or flattens; VSH_ERROR_MEMORY. Thread safe. */
VSH_API vsh_result vsh_mesh_check(const vsh_mesh *mesh, vsh_mesh_report *report, vsh_error *error);

/* A file of meshes: OBJ, glTF/GLB, PLY, STL, FBX and what else Assimp reads. Node transforms are applied, a
 * mesh that two nodes use is two meshes. Immutable; may be shared by threads. */
typedef struct vsh_model vsh_model;

/* Reads a model; free it with vsh_model_free(). Errors: VSH_ERROR_READ (no such file, no permission, cut
 * short), VSH_ERROR_INPUT (no triangles, vertices that are not finite, indices out of range),
 * VSH_ERROR_LIMIT. */
VSH_API vsh_result vsh_model_read(const char *path, const vsh_run *run, vsh_model **model, vsh_error *error);
VSH_API void vsh_model_free(vsh_model *model); /* NULL does nothing */

/* Number of meshes, at least 1. */
VSH_API size_t vsh_model_mesh_count(const vsh_model *model);

/* Number of UV sets of mesh `index` (< mesh count), 0 … VSH_MAX_UV_SETS. */
VSH_API int32_t vsh_model_uv_sets(const vsh_model *model, size_t index);

/* A view of mesh `index`, with the UVs of set `uv_set` (from 0); -1 takes the second set where there is one,
 * else the first. Where the set is missing, `uvs` is NULL. The view's arrays belong to the model. */
VSH_API vsh_mesh vsh_model_mesh(const vsh_model *model, size_t index, int32_t uv_set);

#ifdef __cplusplus
}
#endif
#endif
