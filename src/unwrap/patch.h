/* Triangles of a surface as a chart: a mesh of their own, laid out flat. */
#ifndef VSHI_UNWRAP_PATCH_H
#define VSHI_UNWRAP_PATCH_H

#include "unwrap/cut_mesh.h"

typedef struct vshi_patch {
    const vshi_cut_mesh *surface;
    uint32_t *triangles; /* [count] of the surface, ascending */
    uint32_t count;
    uint32_t vertex_count; /* corners that hang together by the patch's edges are one; where parts of it touch
                              at a point they are two */
    uint32_t (*corner)[3]; /* [count]: vertices */
    uint32_t *beyond;      /* [3 count]: the patch's side beyond each, or VSHI_NONE: its border */
    vshi_vec *place;       /* [vertex_count], surface units */
    double (*uv)[2];       /* [vertex_count], surface units: as much area as the triangles have */
    double area;           /* surface units² */
    double stretch;        /* L2, see vsh_atlas_chart */
    bool kept;             /* uv are the mesh's own, and of any area */
} vshi_patch;

/* Takes over `triangles`, also where it fails; uv is 0. Errors: VSH_ERROR_MEMORY. Free with
 * vshi_patch_free(), after a failure too. */
vsh_result vshi_patch_make(const vshi_cut_mesh *surface, uint32_t *triangles, uint32_t count,
                           vshi_patch *patch, vsh_error *error);
void vshi_patch_free(vshi_patch *patch);

/* Twice the area of a patch's triangle in UVs, positive where it runs anticlockwise. */
static inline double vshi_patch_doubled_area(const vshi_patch *p, uint32_t i) {
    const double *a = p->uv[p->corner[i][0]], *b = p->uv[p->corner[i][1]], *c = p->uv[p->corner[i][2]];
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

#endif
