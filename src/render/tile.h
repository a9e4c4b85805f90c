/* The samples of a tile: where their rays end, and in what light. */
#ifndef VSHI_TILE_H
#define VSHI_TILE_H

#include "field/field.h"
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

/* --- where a ray meets the zero surface of a field */

/* In world space; `direction` is unit. */
typedef struct vshi_eye_ray {
    vshi_vec origin, direction;
} vshi_eye_ray;

/* Adds to *samples what it takes. Returns the distance, world units, or `end` where the ray meets nothing
 * before it, *finished telling whether that is certain. */
double vshi_field_hit(const vsh_field *field, const vshi_eye_ray *ray, double end, uint64_t *samples,
                      bool *finished);

/* Unit normal next to the surface, world space; `otherwise` where the field has none. */
vshi_vec vshi_field_normal(const vsh_field *field, vshi_vec position, vshi_vec otherwise);

#endif
