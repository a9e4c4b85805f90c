/* Meshes cut out by a texture: their opaque places, and triangles of their opaque parts. */
#pragma once

#include "base/error.h"
#include "base/vec.h"

#include <stdbool.h>
#include <stdint.h>
#include <vdbshade/mesh.h>

VSH_BEGIN_C

/* Checks a mesh's mask. Errors: VSH_ERROR_ARGUMENT (its size, its UVs, …). */
vsh_result vshi_alpha_mask_check(const vsh_mesh *mesh, size_t index, vsh_error *error);

/* A place in the image: columns and rows from the middle of the upper left texel. Not finite if the texture
 * coordinates are not. */
typedef struct vshi_mask_place {
    double x, y;
} vshi_mask_place;
vshi_mask_place vshi_alpha_mask_place(const vsh_alpha_mask *mask, const float uv[2]);

/* Whether a mask is opaque at a place. */
bool vshi_alpha_mask_opaque(const vsh_alpha_mask *mask, vshi_mask_place at);

/* Counts of opaque texels above and left of each corner of the image. Four of them give the count of any
 * rectangle (Crow, "Summed-area tables for texture mapping", 1984). */
typedef struct vshi_mask_table {
    const vsh_alpha_mask *mask;
    uint32_t *sums; /* [height + 1][width + 1] */
} vshi_mask_table;

/* Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. Free with vshi_mask_table_free(). */
vsh_result vshi_mask_table_create(const vsh_alpha_mask *mask, const vsh_run *run, vshi_mask_table *table,
                                  vsh_error *error);
void vshi_mask_table_free(vshi_mask_table *table);

/* Cover of a mask over the rectangle around a triangle's corners. It is exact for a rectangle of few texels.
 * For larger ones MIXED may also mean unknown. */
typedef enum vshi_mask_cover {
    VSHI_MASK_CLEAR,  /* nowhere opaque */
    VSHI_MASK_OPAQUE, /* everywhere */
    VSHI_MASK_MIXED
} vshi_mask_cover;
vshi_mask_cover vshi_mask_table_cover(const vshi_mask_table *table, const vshi_mask_place corners[3]);

/* The opaque parts of a masked mesh. Each triangle is cut until a piece is opaque, or clear and dropped, or
 * at most `size` (world units) long. Corners are in the mesh's own space. Neighbours may meet in the middle
 * of an edge. */
typedef struct vshi_mask_pieces {
    float *positions;  /* [3 × count][3] */
    uint32_t *indices; /* [count][3] */
    size_t count;
} vshi_mask_pieces;

/* Errors: VSH_ERROR_LIMIT (run->memory_limit, more than 2^31 - 1 pieces), VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED. Free with vshi_mask_pieces_free(), even after an error. */
VSHI_SHARED vsh_result vshi_mask_pieces_cut(const vsh_mesh *mesh, double size, const vsh_run *run,
                                            vshi_mask_pieces *pieces, vsh_error *error);
VSHI_SHARED void vshi_mask_pieces_free(vshi_mask_pieces *pieces);

VSH_END_C
