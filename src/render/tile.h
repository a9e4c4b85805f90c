/* The samples of a tile: where their rays end, and in what light. */
#ifndef VSHI_TILE_H
#define VSHI_TILE_H

#include "render/lit.h"
#include "render/shafts.h"

/* What holds for a whole picture. */
typedef struct vshi_scenery {
    const vsh_render_options *options;
    const vshi_sample_grid *grid;
    const vsh_surface *surfaces;
    size_t surface_count;
    const vsh_light *lights;
    size_t light_count;
    const vsh_query *query;
    const vsh_occluders *occluders; /* that the query asks */
    vsh_run run;
    bool traces_shadow, traces_ao; /* rays against triangles, not marches through the field */
    double lift;                   /* of points on surfaces, voxels */
    const vshi_lit *lit;           /* NULL: none */
    vshi_shafts shafts;
} vshi_scenery;

/* Rows of samples under way. */
typedef struct vshi_rows {
    int32_t first, count;
    vshi_seen *seen;   /* [count × columns] */
    vshi_lit_band lit; /* of the same rows, where there are lit meshes */
} vshi_rows;

/* Tile of VSHI_TILE columns and rows at most, beginning at `column` and row `row` of the grid. Errors: as
 * vsh_query_points(). */
vsh_result vshi_tile_render(const vshi_scenery *scenery, const vshi_rows *rows, int32_t column, int32_t row,
                            vsh_shade_stats *stats, vsh_error *error);

#endif
