/* The charts of a receiver's UVs: triangles that share an edge, in space and in the UVs. */
#ifndef VSHI_CHART_BORDERS_H
#define VSHI_CHART_BORDERS_H

#include "base/error.h"

#include <vdbshade/mesh.h>

typedef struct vshi_chart_borders {
    uint32_t *charts; /* [triangles of all meshes]: one number for all triangles of a chart */
    uint32_t *edges; /* [edge_count]: 3 × triangle + the corner that it begins with, of those that a triangle
                        of some area in the UVs has to itself; ascending */
    size_t edge_count;
} vshi_chart_borders;

/* Finds the charts of checked meshes that have UVs, and together at most UINT32_MAX / 3 - 1 triangles; the
 * charts of two meshes are two. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY; `what` is what memory is for. Free
 * them also after a failure. */
vsh_result vshi_chart_borders_find(const vsh_mesh *meshes, size_t mesh_count, const vsh_run *run,
                                   const char *what, vshi_chart_borders *borders, vsh_error *error);
void vshi_chart_borders_free(vshi_chart_borders *borders);

#endif
