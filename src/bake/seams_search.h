/* Seams while they are searched for. */
#ifndef VSHI_BAKE_SEAMS_SEARCH_H
#define VSHI_BAKE_SEAMS_SEARCH_H

#include "bake/seams.h"
#include "mesh/mesh.h"

typedef struct vshi_seam_search {
    const vshi_seam_pages *pages;
    double cosine; /* of the largest angle between normals that are smooth */
    const vsh_run *run;
    vshi_job *job;
    uint8_t *goes_on;  /* [3 triangles]: the surface does beyond the edge; or its triangle has no area */
    vshi_seams *seams; /* `chart` holds sets of triangles, and a seam's charts are triangles, until the end */
    size_t room;       /* of the list */
    double held;       /* bytes, beside the list */
} vshi_seam_search;

/* An end of a triangle's edge, or of a part of it, in the world and in the lightmap. */
typedef struct vshi_edge_end {
    const vsh_mesh *mesh;
    const vshi_raster *raster;
    size_t triangle; /* of the mesh */
    uint32_t page;
    uint32_t vertex[2]; /* that it is between, */
    double t;           /* and how far from the first to the second */
    vshi_vec at;
    double x, y; /* texels */
} vshi_edge_end;

static inline vshi_vec vshi_edge_place(const vsh_mesh *mesh, uint32_t vertex) {
    return vshi_transform_point(mesh->transform, vshi_vec_off(mesh->positions + 3 * (size_t)vertex));
}

static inline bool vshi_same_place(vshi_vec a, vshi_vec b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

/* The mesh of edge 3 × triangle + corner, and the triangle's number there. */
static inline const vsh_mesh *vshi_edge_mesh(const vshi_seam_pages *pages, uint32_t edge, size_t *local) {
    const size_t page = vshi_seam_page(pages, edge / 3);
    const vshi_charts *charts = pages->charts[page];
    return &charts->meshes[vshi_charts_mesh(charts, edge / 3 - pages->first[page], local)];
}

void vshi_edge_look_at(const vshi_seam_pages *pages, uint32_t edge, vshi_edge_end ends[2]);

/* Compares two edges, or parts of edges, of equal ends in the world: joins their charts if they are one in
 * the lightmap, lists a seam if the surface is smooth there. `goes_on`: whether it is one of both. Errors:
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_seam_compare(vshi_seam_search *search, const uint32_t edge[2], const vshi_edge_end a[2],
                             const vshi_edge_end b[2], bool *goes_on, vsh_error *error);

/* Compares parts of edges that the surface does not go on beyond: the ends of others that lie on an edge cut
 * it. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_seam_parts_find(vshi_seam_search *search, vsh_error *error);

#endif
