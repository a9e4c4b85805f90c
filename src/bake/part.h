/* Rows of a lightmap that are baked by themselves, to be put together with the others later: values are those
 * of the samples alone. What is beyond them, padding and invalid texels, is filled once all rows are there,
 * so that no row is shaded for the sake of another. So is AO that is shared with rows of other parts
 * (bake/ao_cut.h), and what is made of it. */
#ifndef VSHI_BAKE_PART_H
#define VSHI_BAKE_PART_H

#include "bake/ao_kept.h"
#include "bake/padding.h"
#include "bake/texels.h"
#include "shade/shade.h"

/* What is known of a texel, in 32 bits; 0 where no chart covers it. */
#define VSHI_PART_MESH UINT32_C(0x3fffffff) /* 1 + index of the mesh of its first sample */
#define VSHI_PART_SHADEABLE                                                                                  \
    UINT32_C(0x40000000) /* a sample is valid, so other texels may be filled from this one */

/* The spacing of texels that share AO, of `spacing` at most and a lightmap of these planes; 1 where none do.
 * Errors: VSH_ERROR_ARGUMENT. */
vsh_result vshi_part_spacing(const vsh_occluders *occluders, const vsh_shade_options *options,
                             const vsh_lightmap *planes, int32_t spacing, int32_t *left, vsh_error *error);

/* What is kept then, VSHI_KEEPS_…. */
uint32_t vshi_part_kinds(const vsh_lightmap *planes);

/* The texels of `rows` rows from `first_row` on, of those of the cut, as vsh_texels_create_band(), for
 * vshi_bake_part(). Errors: the same. */
vsh_result vshi_texels_create_part(const vsh_charts *charts, int32_t first_row, int32_t rows,
                                   const vshi_ao_cut *cut, const vsh_run *run, vsh_texels **texels,
                                   vsh_error *error);

/* vsh_bake_lightmap() of such texels: nothing is padded or filled. `known` [rows][width] takes VSHI_PART_… of
 * each, `kept` [rows that the cut keeps][width] what AO is finished by, of the kinds of these planes; NULL
 * where it leaves none. Values that are left are 0, or what is there of them: irradiance of lights. Errors of
 * what is filled, and of what is left, are not in the statistics. */
vsh_result vshi_bake_part(const vsh_occluders *occluders, const vsh_texels *texels, const vsh_light *lights,
                          size_t light_count, const vsh_shade_options *options, const vsh_run *run,
                          const vsh_lightmap *lightmap, uint32_t *known, void *kept, vsh_bake_stats *stats,
                          vsh_error *error);

/* --- what parts left of AO */

/* Rows out of parts, from one that a square of texels begins with. */
typedef struct vshi_ao_left {
    int32_t width, rows;
    int32_t spacing;
    uint32_t kinds;        /* VSHI_KEEPS_… */
    void *kept;            /* what is, as vshi_ao_kept_row() takes it; zeros where nothing is */
    const uint8_t *wanted; /* [rows of tiles]: 1 where values were left */
    size_t first, last;    /* rows of tiles that are counted in the statistics */
} vshi_ao_left;

/* Sets the values that were left in the planes [rows][width] ao, ao_error, bent and sky, those that are not
 * NULL, to those of one bake, and adds what is known of them, with what holds them against the casters to
 * errors[0] of AO and errors[1] of the sky. What is kept is sound, and of the planes' kinds. Errors:
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_ao_finish(const vshi_ao_left *left, const vsh_shade_options *options, const vsh_run *run,
                          const vsh_lightmap *planes, vsh_shade_stats *shade, vsh_bake_error *errors,
                          vsh_error *error);

/* Bytes that it takes at most, with what is kept and the planes. */
double vshi_ao_finish_bytes(int32_t width, int32_t rows, int32_t threads, uint32_t kinds);

/* --- what is beyond the samples */

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
