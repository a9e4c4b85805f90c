/* One tile of a lightmap: its triangles, what covers its texels, and their samples. */
#ifndef VSHI_BAKE_TILE_H
#define VSHI_BAKE_TILE_H

#include "bake/charts.h"
#include "mesh/mesh.h"

#include <stdatomic.h>

enum { VSHI_TILE_ACROSS = VSHI_TILE_CELLS + 2 }; /* cells along a tile and its border */

/* A tile's triangles, set up and sorted into its cells and those around it. */
typedef struct vshi_tile {
    size_t column, row;
    size_t count;
    vshi_uv_triangle *triangle; /* [count] */
    uint32_t *mesh;             /* of each */
    uint32_t *local;            /* number of each within its mesh */
    uint64_t *object;           /* of each: different numbers for different objects */
    size_t cell_start[VSHI_TILE_ACROSS * VSHI_TILE_ACROSS + 2];
    uint32_t *cell_triangle; /* in ascending order within a cell; indices into `triangle` */
    vshi_cell cell;          /* the last one rasterised; owner and nearest: index into `triangle`, + 1 */
} vshi_tile;

/* Counts texels that are covered twice; all tiles share it. */
typedef struct vshi_overlaps {
    _Atomic size_t *texels;     /* [mesh_count] */
    _Atomic size_t *others;     /* [mesh_count]: those that another object covers already */
    _Atomic uint8_t *triangles; /* [all triangles]: 1 where it covers a texel again */
    size_t watched;             /* a mesh */
    _Atomic size_t *owners;     /* [mesh_count]: texels of each that the watched mesh covers again; NULL: not
                                   asked for */
} vshi_overlaps;

/* The most bytes that the tiles at work on `threads` threads (0: all cores) hold. */
double vshi_tile_bytes(const vshi_charts *charts, int32_t threads);

/* Errors: VSH_ERROR_MEMORY. Close the tile also after an error. */
vsh_result vshi_tile_open(const vshi_charts *charts, size_t number, vshi_tile *tile, vsh_error *error);
void vshi_tile_close(vshi_tile *tile);

/* Rasterises the cell `x` cells right of and `y` below the tile's first one, -1 … VSHI_TILE_CELLS each, into
 * tile->cell. False where no triangle reaches it, or it lies outside the image. `overlaps` may be NULL. */
bool vshi_tile_rasterize(const vshi_charts *charts, vshi_tile *tile, int32_t x, int32_t y,
                         const vshi_overlaps *overlaps);

/* The first triangle that covers texel `bit` of the tile's cell, index + 1; 0: none. */
uint32_t vshi_tile_owner(const vshi_charts *charts, const vshi_tile *tile, size_t bit);

/* --- samples */

/* In a sample's mesh: its triangle is a sheet. */
#define VSHI_SAMPLE_SHEET UINT32_C(0x80000000)
/* In a sample's mesh: its texel's centre lies outside the chart, so the sample stands near the chart's
 * border, which may lie in other surfaces. */
#define VSHI_SAMPLE_BORDER UINT32_C(0x40000000)
enum { VSHI_MOST_MESHES = 0x3fffffff };

/* Where texels lie in the world. The samples of a texel follow each other; texels come cell by cell. */
typedef struct vshi_samples {
    size_t count, room;
    double *position; /* [room][3] */
    float *normal;    /* [room][3] */
    float *geometric; /* [room][3] */
    float *lift;      /* [room][3]: of the position off its triangle, world units */
    uint32_t *texel;  /* [room]: vsh_texel() in the lightmap */
    uint32_t *mesh;   /* [room]: its number, and VSHI_SAMPLE_… */
    float *tangent;   /* [room][4]: of the triangle, unit, and its handedness; NULL: not asked for */
} vshi_samples;

/* Bytes of one sample. */
static inline size_t vshi_sample_bytes(bool tangents) {
    return 3 * sizeof(double) + (tangents ? 13 : 9) * sizeof(float) + 2 * sizeof(uint32_t);
}

/* Memory for so many. Free them also after an error. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_samples_allocate(vshi_samples *samples, size_t room, bool tangents, vsh_error *error);
void vshi_samples_free(vshi_samples *samples);

static inline uint32_t vshi_sample_mesh(const vshi_samples *samples, size_t i) {
    return samples->mesh[i] & ~(VSHI_SAMPLE_SHEET | VSHI_SAMPLE_BORDER);
}

static inline bool vshi_sample_is_sheet(const vshi_samples *samples, size_t i) {
    return (samples->mesh[i] & VSHI_SAMPLE_SHEET) != 0;
}

static inline bool vshi_sample_is_border(const vshi_samples *samples, size_t i) {
    return (samples->mesh[i] & VSHI_SAMPLE_BORDER) != 0;
}

/* Writes samples one after the other. Neighbours are nearly always of one triangle, which stays set up. */
typedef struct vshi_sample_writer {
    const vsh_charts *charts;
    const vshi_tile *tile;
    vshi_samples *samples;
    uint32_t number; /* triangle + 1 that is set up; 0: none */
    vshi_surface surface;
    float tangent[4]; /* of it, where they are asked for */
} vshi_sample_writer;

/* Appends the samples of the cell that was rasterised last: those of the texels in `mask`, along Morton's
 * curve (1966), so that 4, 16 or all 64 texels that follow each other are a square. */
void vshi_samples_write_cell(vshi_sample_writer *writer, uint64_t mask);

/* Appends all samples of rows of cells begin … end - 1 of the tile. */
void vshi_samples_write_rows(vshi_sample_writer *writer, vshi_tile *tile, int32_t begin, int32_t end);

/* Appends those of the texels that touch the tile from outside. */
void vshi_samples_write_frame(vshi_sample_writer *writer, vshi_tile *tile);

/* Rasterises tile `number` and calls visit() with its samples, one row of cells after the other. Errors:
 * VSH_ERROR_MEMORY. */
typedef void vshi_samples_fn(void *user, const vshi_samples *samples);
vsh_result vshi_tile_visit(const vsh_charts *charts, size_t number, bool tangents, vshi_samples_fn *visit,
                           void *user, vsh_error *error);

#endif
