/* One row of tiles at work: its triangles set up, sorted into tiles, and rasterised tile by tile. */
#ifndef VSHI_BAKE_ROWS_H
#define VSHI_BAKE_ROWS_H

#include "bake/charts.h"

#include <stdatomic.h>

typedef struct vshi_row {
    size_t row;
    size_t tiles;
    vshi_uv_triangle *triangle; /* [triangles of the row] */
    uint32_t *mesh;             /* of each */
    uint32_t *local;            /* number of each within its mesh */
    uint64_t *object;           /* of each: different numbers for different objects */
    size_t *tile_start;         /* [tiles + 2] */
    uint32_t *tile_triangle;    /* in ascending order within a tile; indices into `triangle` */
    vshi_tile tile;             /* owner and nearest: index into `triangle`, + 1 */
} vshi_row;

/* Where texels are counted that are covered twice; shared by all rows. */
typedef struct vshi_overlaps {
    _Atomic size_t *texels;     /* [mesh_count] */
    _Atomic size_t *others;     /* [mesh_count]: those that another object covers already */
    _Atomic uint8_t *triangles; /* [all triangles]: 1 where it covers a texel again */
    size_t watched;             /* a mesh */
    _Atomic size_t *owners; /* [mesh_count]: where the watched mesh finds another object, whose it is; NULL:
                               not asked for */
} vshi_overlaps;

/* Bytes that rows at work on `threads` threads hold at most. */
double vshi_row_bytes(const vshi_charts *charts, int32_t threads);

/* Errors: VSH_ERROR_MEMORY. Close the row also after an error. */
vsh_result vshi_row_open(const vshi_charts *charts, size_t row, vshi_row *work, vsh_error *error);
void vshi_row_close(vshi_row *work);

/* Rasterises tile `column` into work->tile. `overlaps` may be NULL. */
void vshi_row_tile(const vshi_charts *charts, vshi_row *work, size_t column, const vshi_overlaps *overlaps);

#endif
