/* Cells of the lattice that ambient occlusion is shaded on, and whether a value may be interpolated in one.
 */
#ifndef VSHI_BAKE_LATTICE_CELLS_H
#define VSHI_BAKE_LATTICE_CELLS_H

#include "bake/origins.h"

enum { LATTICE_FAR = 31 };

/* Known: shaded; between: interpolated. */
enum { LATTICE_UNKNOWN, LATTICE_CHOSEN, LATTICE_KNOWN, LATTICE_BETWEEN };

typedef struct vshi_lattice {
    const vsh_occluders *occluders;
    const vsh_field *field; /* of these */
    const vsh_texels *texels;
    const vshi_origins *origins;
    const vsh_points *points;
    double distance; /* of AO, finest voxels */
    int32_t spacing; /* of this pass */
    uint32_t *at;    /* [rows held][width]: number of the texel's origin + 1; 0: none */
    uint8_t *state;  /* [origins.count] */
    size_t *before;  /* [blocks + 1]: chosen origins before each block */
    size_t blocks;
    float *values, *deviation;
    float *bent; /* [origins.count][3], or NULL */
    /* of the chosen */
    uint32_t *number;
    double *position;
    float *normal, *face;
    uint32_t *texel;
    float *chosen_values, *chosen_deviation, *chosen_bent;
    size_t *row_start; /* [rows of the origins + 1] */
    uint8_t *behind;   /* [rows of the origins]: rows of tiles that each lies behind the last that is wanted
                          before it; LATTICE_FAR: as many or more, or none is */
} vshi_lattice;

/* Between lattice lines, both included; at the edge of a chart clipped to the texels that are there. */
typedef struct vshi_cell {
    uint32_t column, row; /* of its first lattice lines */
    uint32_t left, right, top, bottom;
    bool good;
    size_t corner[4]; /* origins: left and right of the upper row, of the lower */
} vshi_cell;

/* The origin of a texel; false where there is none. */
bool vshi_lattice_lookup(const vshi_lattice *l, uint32_t column, uint32_t row, size_t *i);

/* Whether a texel is the corner of a cell, its own or one that ends at it. */
bool vshi_lattice_is_corner(const vshi_lattice *l, uint32_t column, uint32_t row);

/* The cell from (column, row) on; `good` where its values may be interpolated from its corners'. */
vshi_cell vshi_lattice_look_at(const vshi_lattice *l, uint32_t column, uint32_t row);

/* How far x lies between two lines, 0 … 1. */
double vshi_lattice_part(uint32_t x, uint32_t from, uint32_t to);

/* One of so many channels of the corners' values, at a place of the cell. */
float vshi_lattice_between(const float *values, size_t channels, size_t channel, const vshi_cell *c, double x,
                           double y);

#endif
