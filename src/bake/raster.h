/* Conservative rasterisation of UV triangles over cells of 8 × 8 texels, exact and watertight. */
#ifndef VSHI_BAKE_RASTER_H
#define VSHI_BAKE_RASTER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    VSHI_CELL = 8, /* texels along a cell: its 64 texels are the bits of a mask, row by row */
    VSHI_MAX_SUPERSAMPLE = 16
};

/* Size of the image, and samples along a texel. */
typedef struct vshi_raster {
    int32_t width, height; /* texels */
    int32_t supersample;
} vshi_raster;

/* A triangle in the image: x = u × width, y = (1 - v) × height, texels. */
typedef struct vshi_uv_triangle {
    double x[3], y[3];
    int64_t grid_x[3], grid_y[3]; /* the same on the integer grid, turned so that the area is positive */
} vshi_uv_triangle;

/* Sets a triangle up. False where it has no area (to the grid, some 2^-21 texels). UVs must be finite. */
bool vshi_uv_triangle_set(const vshi_raster *raster, const float *uv[3], vshi_uv_triangle *triangle);

/* Tile rows begin … end - 1 that the triangle's inside reaches within the image; false: none. */
bool vshi_uv_cell_rows(const vshi_raster *raster, const vshi_uv_triangle *triangle, size_t *begin,
                       size_t *end);

/* Cells begin … end - 1 of a cell row that the triangle may reach: never fewer than it does. */
void vshi_uv_cells(const vshi_raster *raster, const vshi_uv_triangle *triangle, size_t row, size_t *begin,
                   size_t *end);

/* Triangles that cover one cell. `owner` has (8 N)² entries, row by row. */
typedef struct vshi_cell {
    size_t column, row;                      /* of the cell */
    uint64_t inside;                         /* texels of the cell that lie in the image */
    uint64_t covered;                        /* texels with a covered sample */
    uint64_t border;                         /* texels that triangles only touch */
    uint32_t *owner;                         /* triangle + 1 of each sample, 0: none */
    uint32_t nearest[VSHI_CELL * VSHI_CELL]; /* of border texels: the nearest triangle + 1 */
    double distance[VSHI_CELL * VSHI_CELL];  /* its squared distance to the centre, texels² */
} vshi_cell;

/* Empties a cell. */
void vshi_cell_begin(const vshi_raster *raster, size_t column, size_t row, vshi_cell *cell);

/* Texels of a cell where a triangle finds samples taken already; shared edges are none. */
typedef struct vshi_cell_overlap {
    uint64_t texels;
    uint64_t others; /* of them, those with a sample that a triangle of another object took */
} vshi_cell_overlap;

/* Gives the free samples inside the triangle (top-left rule, so that shared edges are of one) to `number`
 * (triangle + 1). `object` [triangles] tells objects apart; NULL: not asked for. */
vshi_cell_overlap vshi_cell_cover(const vshi_raster *raster, const vshi_uv_triangle *triangle,
                                  uint32_t number, const uint64_t *object, vshi_cell *cell);

/* Texels without any covered sample that the triangle's inside reaches become border texels; called in the
 * order of the triangles once all have covered, so that the first of equally near ones stays. */
void vshi_cell_touch(const vshi_raster *raster, const vshi_uv_triangle *triangle, uint32_t number,
                     vshi_cell *cell);

/* Barycentric coordinates of a point of the image, clamped into the triangle. */
void vshi_uv_barycentric(const vshi_uv_triangle *triangle, double x, double y, double weight[3]);

/* Centroid of the part of the triangle that lies within half a texel, along both axes, of its point nearest
 * to (x, y), which is outside it. */
void vshi_uv_centroid_near(const vshi_uv_triangle *triangle, double x, double y, double weight[3]);

/* Point of the triangle's outline that is nearest to a point outside it; returns the squared distance. */
double vshi_uv_nearest(const vshi_uv_triangle *triangle, double x, double y, double weight[3]);

#endif
