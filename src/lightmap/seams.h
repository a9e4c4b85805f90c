/* Borders between charts on a smooth surface, and the texels that bilinear lookups read along them. */
#pragma once

#include "lightmap/texels.h"

/* The lightmaps that are stitched together. Triangles and texels are numbered through all of them. */
typedef struct vshi_seam_pages {
    const vshi_charts **charts; /* [count] */
    size_t count;
    size_t *first;   /* [count + 1]: each page's first triangle */
    uint64_t *texel; /* [count + 1]: and its first texel */
} vshi_seam_pages;

/* An edge where two triangles join in the world, but not in the lightmap. */
typedef struct vshi_seam {
    double x[2][2], y[2][2]; /* [side][end], texels; an end of both sides is one place in the world */
    uint32_t chart[2];       /* of each side */
    uint32_t page[2];
} vshi_seam;

typedef struct vshi_seams {
    uint32_t *chart; /* [triangles of all pages]: one number for all triangles of a chart */
    vshi_seam *list; /* [count] */
    size_t count;
    double bytes;
} vshi_seams;

/* Finds charts and seams. A chart is a set of triangles that share edges in the world and in the lightmap. A
 * seam is an edge between two charts, or within one, with equal ends in the world. At both ends the sides'
 * normals differ by at most an angle with this cosine. Of edges with many triangles only some pairs count.
 * Errors: VSH_ERROR_LIMIT (run->memory_limit; 2^32 / 3 triangles), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED.
 * Free with vshi_seams_free(), even after an error. */
vsh_result vshi_seams_find(const vshi_seam_pages *pages, double cosine, const vsh_run *run, vshi_job *job,
                           vshi_seams *seams, vsh_error *error);
void vshi_seams_free(vshi_seams *seams);
