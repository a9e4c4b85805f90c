/* Charts and texels: triangles in cells of 8 × 8 texels, in tiles of 64 × 64, and the samples of texels. */
#pragma once

#include "base/job.h"
#include "geometry/mesh.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <vdbshade/lightmap.h>

/* --- conservative rasterisation of UV triangles over cells, exact and watertight (tile.c) */

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
    int64_t grid_x[3], grid_y[3]; /* the corners on the integer grid, turned so that the area is positive */
    uint32_t mesh, local;         /* of a tile's triangle: its mesh, and its number there */
    uint64_t object;              /* of a tile's triangle: different numbers for different objects */
} vshi_uv_triangle;

/* Sets up a triangle. False if it has no area (to the grid, some 2^-21 texels). UVs must be finite. */
bool vshi_uv_triangle_set(const vshi_raster *raster, const float *uv[3], vshi_uv_triangle *triangle);

/* Finds the cell rows begin … end - 1 that the triangle's inside reaches within the image. False: none. */
bool vshi_uv_cell_rows(const vshi_raster *raster, const vshi_uv_triangle *triangle, size_t *begin,
                       size_t *end);

/* Finds the cells begin … end - 1 of a cell row that the triangle may reach: never too few. */
void vshi_uv_cells(const vshi_raster *raster, const vshi_uv_triangle *triangle, size_t row, size_t *begin,
                   size_t *end);

/* Triangles that cover one cell. They are numbered by their index + 1, and 0 is none. */
typedef struct vshi_cell {
    size_t column, row;                      /* of the cell */
    uint64_t inside;                         /* texels of the cell in the image */
    uint64_t covered;                        /* texels with a covered sample */
    uint64_t border;                         /* texels that triangles only touch */
    uint32_t *owner;                         /* [(8 N)²], row by row: triangle of each sample */
    uint32_t nearest[VSHI_CELL * VSHI_CELL]; /* of border texels: the nearest triangle */
    double distance[VSHI_CELL * VSHI_CELL];  /* its squared distance to the centre, texels² */
} vshi_cell;

/* --- charts: the triangles of several meshes as one list, sorted into the tiles that they reach (charts.c)
 */

/* A lightmap is cut into aligned square tiles, which are baked independently. Around each lies a border whose
 * geometry alone counts. Texels and cells along a side: */
enum { VSHI_TILE = 64, VSHI_TILE_CELLS = VSHI_TILE / VSHI_CELL };

/* Triangles are numbered through all meshes, in their order. */
typedef struct vshi_charts {
    const vsh_mesh *meshes;
    size_t mesh_count;
    vshi_raster raster;
    size_t *first;           /* [mesh_count + 1]: number of each mesh's first triangle */
    size_t columns, rows;    /* of tiles */
    size_t *tile_start;      /* [columns × rows + 1]: where each tile's triangles begin */
    uint32_t *tile_triangle; /* reaching the tile or a cell around it, in ascending order within a tile */
    uint64_t bytes;
} vshi_charts;

static inline size_t vshi_charts_tiles(const vshi_charts *charts) {
    return charts->columns * charts->rows;
}

/* Finds the mesh of a triangle, and its number there. */
size_t vshi_charts_mesh(const vshi_charts *charts, size_t triangle, size_t *local);

/* Sets up the triangle in the image. False if it has no area there or in the world. */
bool vshi_charts_triangle(const vshi_charts *charts, size_t mesh, size_t local, vshi_uv_triangle *triangle);

struct vsh_charts {
    vsh_charts_info info;
    vshi_charts sorted;
    vshi_tight_meshes tight; /* the caller's meshes, or copies */
    int32_t padding;
    bool fills;         /* texels beyond the padding too */
    int32_t ao_spacing; /* 1 if texels have several samples */
    bool tangents;
    bool smooth;      /* a mesh has normals, which may differ from those of its triangles */
    double centre[3]; /* of the meshes' box, world units: 32 bits hold places relative to it */
    vsh_shade_options shade;
    uint64_t *samples;    /* [tiles] */
    unsigned char *sheet; /* [triangles of all meshes]: 1: air on both sides, so the field holds its shell */
    size_t *points;       /* [triangles + 1]: first point of each; NULL: texels lie in UVs (points.c) */
};

/* Warns of faults in a mesh's UVs, one line for each kind. `file` is the mesh's, or "". */
void vshi_warn_mesh_uvs(const char *file, const vsh_mesh *mesh, size_t index, const vsh_uv_report *uv,
                        const vsh_run *run);

/* Returns every second bit of a number of six bits: texels of a cell along Morton's curve (1966). */
static inline size_t vshi_even_bits(size_t number) {
    return (number & 1) | (number >> 1 & 2) | (number >> 2 & 4);
}

/* --- points in place of texels (points.c): cells and tiles of a page take them in their order */

/* Spreads points over the triangles, whose numbers are known, and sets the page's size. Errors:
 * VSH_ERROR_MEMORY. */
vsh_result vshi_points_spread(vsh_charts *charts, vsh_error *error);
uint64_t vshi_points_in_tile(const vsh_charts *charts, size_t tile);

/* vsh_charts_create() with resolved options and run. A width of 0 gives points; then supersample and
 * ao_spacing are 1, and padding 0. */
vsh_result vshi_charts_create(const vsh_mesh *meshes, size_t mesh_count, const vsh_lightmap_options *options,
                              const vsh_run *run, vsh_uv_report *uv_reports, vsh_charts **charts,
                              vsh_error *error);

/* The part of a triangle's world area that each of its points has. */
double vshi_point_area(const vsh_charts *charts, size_t triangle);

uint32_t vshi_point_texel(const vsh_charts *charts, size_t point);

/* Finds the barycentric weights of a triangle's point. */
void vshi_point_weights(const vsh_charts *charts, size_t triangle, size_t point, double weight[3]);

/* --- one tile (tile.c) */

enum { VSHI_TILE_ACROSS = VSHI_TILE_CELLS + 2 }; /* cells along a tile and its border */

/* A tile's triangles, set up and sorted into its cells and those around it. */
typedef struct vshi_tile {
    size_t column, row;
    vshi_uv_triangle *triangle;
    size_t cell_start[VSHI_TILE_ACROSS * VSHI_TILE_ACROSS + 2];
    uint32_t *cell_triangle; /* indices into `triangle`, in ascending order within a cell */
    vshi_cell cell;          /* the last rasterised cell */
} vshi_tile;

/* Counts of texels that are covered twice; all tiles share them. */
typedef struct vshi_overlaps {
    _Atomic size_t *texels;     /* [mesh_count] */
    _Atomic size_t *others;     /* [mesh_count]: texels that another object covers already */
    _Atomic size_t *owners;     /* [mesh_count]: texels of each that the watched mesh covers again */
    _Atomic uint8_t *triangles; /* [all triangles]: 1: covers a texel again */
    size_t watched;             /* a mesh, or SIZE_MAX */
} vshi_overlaps;

/* The most bytes of tiles at work on `threads` threads (0: all cores). */
double vshi_tile_bytes(const vshi_charts *charts, int32_t threads);

/* Errors: VSH_ERROR_MEMORY. Close the tile even after an error. */
vsh_result vshi_tile_open(const vshi_charts *charts, size_t number, vshi_tile *tile, vsh_error *error);
void vshi_tile_close(vshi_tile *tile);

/* Rasterises the cell `x` cells right of and `y` below the tile's first one, -1 … VSHI_TILE_CELLS each, into
 * tile->cell. False if no triangle reaches it, or it lies outside the image. `overlaps` may be NULL. */
bool vshi_tile_rasterize(const vshi_charts *charts, vshi_tile *tile, int32_t x, int32_t y,
                         const vshi_overlaps *overlaps);

/* The first triangle that covers texel `bit` of the tile's cell, index + 1; 0: none. */
uint32_t vshi_tile_owner(const vshi_charts *charts, const vshi_tile *tile, size_t bit);

/* --- samples */

/* In a sample's mesh: its triangle is a sheet. */
#define VSHI_SAMPLE_SHEET UINT32_C(0x80000000)
/* In a sample's mesh: its texel's centre lies outside the chart. The sample stands near the chart's border,
 * which may lie in other surfaces. */
#define VSHI_SAMPLE_BORDER UINT32_C(0x40000000)
enum { VSHI_MOST_MESHES = 0x3fffffff };

/* Places of texels in the world. The samples of a texel follow each other, and texels come cell by cell. */
typedef struct vshi_samples {
    size_t count, room;
    double *position; /* [room][3] */
    float *normal;    /* [room][3] */
    float *geometric; /* [room][3] */
    float *lift;      /* [room][3]: of the position off its triangle, world units */
    uint32_t *texel;  /* [room]: vsh_texel() in the lightmap */
    uint32_t *mesh;   /* [room]: its number, and VSHI_SAMPLE_… */
    float *tangent;   /* [room][4]: of the triangle, unit, and its handedness; NULL: not wanted */
} vshi_samples;

/* Bytes of one sample. */
static inline size_t vshi_sample_bytes(bool tangents) {
    return 3 * sizeof(double) + (tangents ? 13 : 9) * sizeof(float) + 2 * sizeof(uint32_t);
}

/* Allocates samples. Free them even after an error. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_samples_allocate(vshi_samples *samples, size_t room, bool tangents, vsh_error *error);
void vshi_samples_free(vshi_samples *samples);

static inline uint32_t vshi_sample_mesh(const vshi_samples *samples, size_t i) {
    return samples->mesh[i] & ~(VSHI_SAMPLE_SHEET | VSHI_SAMPLE_BORDER);
}

/* Writes samples in sequence. Neighbours mostly share a triangle, which stays set up. */
typedef struct vshi_sample_writer {
    const vsh_charts *charts;
    const vshi_tile *tile;
    vshi_samples *samples;
    size_t number; /* triangle + 1 that is set up; 0: none */
    vshi_surface surface;
    float tangent[4]; /* of the triangle, if wanted */
} vshi_sample_writer;

/* Appends all samples of rows of cells begin … end - 1 of the tile. */
void vshi_samples_write_rows(vshi_sample_writer *writer, vshi_tile *tile, int32_t begin, int32_t end);

/* Appends the samples of the texels that touch the tile from outside. */
void vshi_samples_write_frame(vshi_sample_writer *writer, vshi_tile *tile);

/* Rasterizes tile `number` and calls visit() with its samples, one row of cells at a time. Errors:
 * VSH_ERROR_MEMORY. */
typedef void vshi_samples_fn(void *user, const vshi_samples *samples);
vsh_result vshi_tile_visit(const vsh_charts *charts, size_t number, bool tangents, vshi_samples_fn *visit,
                           void *user, vsh_error *error);

/* Charts that lie closer to each other than a texel, so that bilinear lookups mix both. */
typedef struct vshi_closeness {
    uint64_t texels;      /* passed by borders that are so close to another chart */
    uint64_t mesh_texels; /* such texels of the worst mesh */
    size_t mesh;          /* the worst mesh */
    double gap;           /* the least between two charts, texels; 1: none is less */
} vshi_closeness;

/* Measures a receiver's charts at a size. A chart is a set of triangles connected by edges in space and in
 * the UVs. The meshes are those of charts that were created. Errors: VSH_ERROR_LIMIT (run->memory_limit; 2^32
 * / 3 triangles), VSH_ERROR_MEMORY. */
vsh_result vshi_charts_closeness(const vsh_mesh *meshes, size_t mesh_count, int32_t width, int32_t height,
                                 const vsh_run *run, vshi_closeness *found, vsh_error *error);
