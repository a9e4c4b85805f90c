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
    uint32_t depth;        /* how often it was cut out of another */
} vshi_patch;

/* Takes over `triangles`, also where it fails; uv is 0. Errors: VSH_ERROR_MEMORY. Free with
 * vshi_patch_free(), after a failure too. */
vsh_result vshi_patch_make(const vshi_cut_mesh *surface, uint32_t *triangles, uint32_t count,
                           vshi_patch *patch, vsh_error *error);
void vshi_patch_free(vshi_patch *patch);

/* The box around its uv. */
void vshi_patch_box(const vshi_patch *patch, double low[2], double high[2]);

/* Twice the area of a patch's triangle in UVs, positive where it runs anticlockwise. */
static inline double vshi_patch_doubled_area(const vshi_patch *p, uint32_t i) {
    const double *a = p->uv[p->corner[i][0]], *b = p->uv[p->corner[i][1]], *c = p->uv[p->corner[i][2]];
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* --- laying a chart out flat */

/* Fills the patch's uv and stretch. Parts of a plane are projected; else least squares conformal maps (Lévy
 * and others, 2002), made as rigid as possible (Liu and others, "A local/global approach to mesh
 * parameterization", 2008) where that stretches less. *flat: no triangle flips, none lies over
 * another, and the stretch is within the limit. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_flatten(vshi_patch *patch, double max_stretch, bool *flat, vsh_error *error);

/* Scales uv to the patch's area and measures its stretch; false where a triangle flips or has no area. */
bool vshi_flatten_measure(vshi_patch *patch);

/* Whether the patch lies over itself. None of its triangles flips. Borders that touch are none that cross.
 * Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_patch_overlaps(const vshi_patch *patch, bool *overlaps, vsh_error *error);

/* --- charts in parts that can be laid out */

/* Some charts of one surface. */
typedef struct vshi_patches {
    vshi_patch *list; /* [count] */
    size_t count, capacity;
} vshi_patches;

/* Takes over the patch, also where it fails, and leaves it empty. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_patches_add(vshi_patches *patches, vshi_patch *patch, vsh_error *error);
void vshi_patches_free(vshi_patches *patches);

/* Adds a patch for each part of a patch, the last part first, which has triangles and a depth and nothing
 * else: part[count] is the number of each triangle's part. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_patches_split(const vshi_patch *patch, const uint32_t *part, uint32_t parts, vshi_patches *to,
                              vsh_error *error);

/* Lays triangles (ascending, taken over) out as one chart, or as many as it takes so that none folds or
 * stretches beyond the limit; adds them to `patches`. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_lay_out(const vshi_cut_mesh *surface, uint32_t *triangles, uint32_t count, double max_stretch,
                        vshi_patches *patches, vsh_error *error);

/* --- charts of the UVs that a mesh has */

/* Whether the UVs of a surface that was cut along them are of use (vsh_uvs_usable()), and if so, and
 * `patches` is not NULL, a patch for each part of it that hangs together. All are scaled alike, so that they
 * have the surface's area together. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_keep_charts(const vshi_cut_mesh *surface, vshi_patches *patches, bool *usable,
                            vsh_error *error);

#endif
