/* Samplers: points in the unit square and on the disc, for the directions of rays. */
#pragma once

#include "base/vec.h"

#include <vdbshade/light.h>

/* Made once for a call, shared by its threads. Immutable; about 64 KB. */
typedef struct vshi_sampler vshi_sampler;

/* Returns NULL without memory. `rays`: the most rays of a point. */
vshi_sampler *vshi_sampler_create(int32_t kind, int32_t rays, int32_t frame);
void vshi_sampler_free(vshi_sampler *sampler); /* NULL does nothing */

/* Points first … first + count - 1 of the sequence of `texel` (vsh_points.texels), uniform in area over the
 * unit disc. `purpose` separates the sequences of one texel (each light, AO). Prefixes of 2^k points are the
 * most even. */
void vshi_sampler_disc(const vshi_sampler *sampler, uint32_t texel, uint32_t purpose, int32_t first,
                       int32_t count, double (*points)[2]);

/* The shift of a texel's net. VSH_SAMPLER_SOBOL has one net of points for all texels. A texel maps the
 * points' digits ^ shift, times 2^-32, to the disc (Shirley and Chiu). */
void vshi_sampler_shift(const vshi_sampler *sampler, uint32_t texel, uint32_t purpose, uint32_t shift[2]);

/* Blocks of a net: the first VSHI_SAMPLER_BLOCK points, then always as many as before. A block of 2^k points
 * has one in each of 2^k cells of the square. A texel's shift moves the points of cell c to cell c ^ s, with
 * the cell s of the shift itself. */
enum { VSHI_SAMPLER_BLOCK = 4 };

/* The cell, of `size` cells, of a point with these digits. */
static inline uint32_t vshi_sampler_cell(uint32_t size, uint32_t x, uint32_t y) {
    const uint32_t bits = (uint32_t)__builtin_ctz(size), rows = bits / 2, columns = bits - rows;
    return x >> (32 - columns) << rows | (uint32_t)((uint64_t)y >> (32 - rows));
}

/* Digits of the points of the block that begins with point `first`, in the order of the cells. */
const uint32_t (*vshi_sampler_cells(const vshi_sampler *sampler, uint32_t first))[2];

/* Whether points first … last - 1 are whole blocks. */
static inline bool vshi_sampler_is_blocks(int32_t first, int32_t last) {
    return (first & (first - 1)) == 0 && (last & (last - 1)) == 0 && first < last &&
           last >= VSHI_SAMPLER_BLOCK && (first == 0 || first >= VSHI_SAMPLER_BLOCK);
}

/* Blue noise of VSH_SAMPLER_BLUE: a number in [0, 1) that differs much between neighbouring texels. */
double vshi_sampler_mask(const vshi_sampler *sampler, uint32_t texel, uint32_t purpose);
