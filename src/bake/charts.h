/* The triangles of several meshes as one list, sorted into the tiles that they reach. */
#ifndef VSHI_BAKE_CHARTS_H
#define VSHI_BAKE_CHARTS_H

#include "bake/raster.h"
#include "base/job.h"

#include <vdbshade/bake.h>

/* A lightmap is cut into aligned square tiles, which are baked independently. Around each lies a border, of
 * which only the geometry is looked at. */
enum { VSHI_TILE = 64, VSHI_TILE_CELLS = VSHI_TILE / VSHI_CELL }; /* texels and cells along a side */

/* Triangles are numbered through all meshes, in their order. */
typedef struct vshi_charts {
    const vsh_mesh *meshes;
    size_t mesh_count;
    vshi_raster raster;
    size_t *first;           /* [mesh_count + 1]: number of each mesh's first triangle */
    size_t columns, rows;    /* of tiles */
    size_t *tile_start;      /* [columns × rows + 1]: where each tile's triangles begin */
    uint32_t *tile_triangle; /* that reach the tile or a cell around it, in ascending order within a tile */
    uint64_t bytes;
} vshi_charts;

/* Checks the UVs of meshes that passed vshi_mesh_check_data(), sorts the triangles into tiles and counts
 * what is outside or degenerate into reports[mesh_count]. Errors: VSH_ERROR_INPUT, VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. Free with vshi_charts_free() also after an error. */
vsh_result vshi_charts_create(const vsh_mesh *meshes, size_t mesh_count, vshi_raster raster,
                              const vsh_run *run, vshi_job *job, vsh_uv_report *reports, vshi_charts *charts,
                              vsh_error *error);
void vshi_charts_free(vshi_charts *charts);

static inline size_t vshi_charts_tiles(const vshi_charts *charts) {
    return charts->columns * charts->rows;
}

/* Mesh of a triangle, and its number there. */
size_t vshi_charts_mesh(const vshi_charts *charts, size_t triangle, size_t *local);

/* The triangle in the image; false where it has no area there or in the world. */
bool vshi_charts_triangle(const vshi_charts *charts, size_t mesh, size_t local, vshi_uv_triangle *triangle);

#endif
