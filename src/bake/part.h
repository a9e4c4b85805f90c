/* Rows of a lightmap that are baked by themselves, to be put together with the others later: values are those
 * of the samples alone. What is beyond them, padding and invalid texels, is filled once all rows are there,
 * so that no row is shaded for the sake of another but those that AO is shared with. */
#ifndef VSHI_BAKE_PART_H
#define VSHI_BAKE_PART_H

#include "bake/padding.h"
#include "bake/texels.h"

/* What is known of a texel, in 32 bits; 0 where no chart covers it. */
#define VSHI_PART_MESH UINT32_C(0x3fffffff) /* 1 + index of the mesh of its first sample */
#define VSHI_PART_SHADEABLE                                                                                  \
    UINT32_C(0x40000000)                    /* one of its samples is valid: others may be filled from it */
#define VSHI_PART_SEEN UINT32_C(0x80000000) /* none is, but it is in plain sight */

/* The texels of `rows` rows from `first_row` on, as vsh_texels_create_band(), for vshi_bake_part(). Errors:
 * the same. */
vsh_result vshi_texels_create_part(const vsh_charts *charts, int32_t first_row, int32_t rows,
                                   const vsh_run *run, vsh_texels **texels, vsh_error *error);

/* vsh_bake_lightmap() of such texels: nothing is padded or filled. `known` [rows][width] takes VSHI_PART_… of
 * each. Errors of what is filled are not in the statistics. */
vsh_result vshi_bake_part(const vsh_occluders *occluders, const vsh_texels *texels, const vsh_light *lights,
                          size_t light_count, const vsh_shade_options *options, const vsh_run *run,
                          const vsh_lightmap *lightmap, uint32_t *known, vsh_bake_stats *stats,
                          vsh_error *error);

/* Rows of parts, put together. */
typedef struct vshi_rows_given {
    int32_t width, rows;
    int32_t padding; /* texels */
    bool fills;      /* what is beyond it too: of a whole lightmap */
    const uint32_t *known;
    const float *coverage; /* 1: the texel has a value */
    const vshi_plane *planes;
    size_t plane_count;
} vshi_rows_given;

/* Rows above and below some that what they are filled with is taken from. */
int32_t vshi_part_reach(const vsh_charts *charts);

/* Padding of a lightmap's charts, and whether all that is empty is filled once it is whole. */
int32_t vshi_part_padding(const vsh_charts *charts, bool *fills);

/* Fills invalid texels and pads, as vsh_bake_lightmap() does a whole lightmap: where these are some of its
 * rows, all but those within vshi_part_reach() of an end that is not the lightmap's. Errors:
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_rows_complete(const vshi_rows_given *given, const vsh_run *run, vsh_error *error);

/* Bytes that it takes beside what it is given. */
double vshi_rows_complete_bytes(int32_t width, int32_t rows, bool fills);

#endif
