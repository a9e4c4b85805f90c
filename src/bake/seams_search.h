/* Edges in the world and in the lightmap, and parts of them that meet others. */
#ifndef VSHI_BAKE_SEAMS_PARTS_H
#define VSHI_BAKE_SEAMS_PARTS_H

#include "bake/seams.h"
#include "mesh/mesh.h"

/* An end of a triangle's edge, or of a part of it, as it is in the world and in the lightmap. */
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

/* Has the second begin where the first does. */
void vshi_ends_turn(const vshi_edge_end first[2], vshi_edge_end second[2]);

/* Whether two edges of equal ends in the world are one in the lightmap; whether the sides' normals are no
 * further apart, at both ends, than an angle of this cosine; whether an edge lies in the image. */
bool vshi_ends_same_in_lightmap(const vshi_edge_end a[2], const vshi_edge_end b[2]);
bool vshi_ends_smooth(const vshi_edge_end a[2], const vshi_edge_end b[2], double cosine);
bool vshi_ends_inside(const vshi_edge_end a[2]);

/* Charts by union-find over triangles: the lower number stays, so that no order shows. */
static inline uint32_t vshi_chart_of(uint32_t *chart, uint32_t triangle) {
    while (chart[triangle] != triangle) {
        chart[triangle] = chart[chart[triangle]];
        triangle = chart[triangle];
    }
    return triangle;
}

static inline void vshi_chart_join(uint32_t *chart, uint32_t a, uint32_t b) {
    a = vshi_chart_of(chart, a);
    b = vshi_chart_of(chart, b);
    chart[a > b ? a : b] = a < b ? a : b;
}

/* The seam between two edges of triangles. */
vshi_seam vshi_seam_between(const vshi_edge_end a[2], const vshi_edge_end b[2], uint32_t *chart,
                            uint32_t first_triangle, uint32_t second_triangle);

/* Two parts of edges that are a seam. */
typedef struct vshi_part_pair {
    vshi_edge_end a[2], b[2];
    uint32_t triangle[2];
} vshi_part_pair;

typedef struct vshi_seam_parts {
    vshi_part_pair *pairs; /* [count] */
    size_t count;
    double bytes;
} vshi_seam_parts;

/* Finds pairs of parts, of edges that the surface does not go on beyond (goes_on [3 triangles] is 0): the
 * ends of others that lie on an edge cut it, and parts of equal ends are held against each other as whole
 * edges are. Joins charts. Errors: VSH_ERROR_LIMIT (run->memory_limit), VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED. Free with vshi_seam_parts_free(), after a failure too. */
vsh_result vshi_seam_parts_find(const vshi_seam_pages *pages, const uint8_t *goes_on, double cosine,
                                const vsh_run *run, vshi_job *job, uint32_t *chart, vshi_seam_parts *parts,
                                vsh_error *error);

/* Their seams, once all charts are joined. */
void vshi_seam_parts_list(const vshi_seam_parts *parts, uint32_t *chart, vshi_seam *list);
void vshi_seam_parts_free(vshi_seam_parts *parts);

#endif
