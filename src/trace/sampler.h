/* Where the rays of a point go: points in the unit square, the disc and the hemisphere. */
#ifndef VSHI_SAMPLER_H
#define VSHI_SAMPLER_H

#include "base/vec.h"

#include <vdbshade/method.h>

/* Made once for a call, shared by its threads. Immutable; about 64 KB. */
typedef struct vshi_sampler vshi_sampler;

/* NULL where memory is short. `rays`: the most that any point takes. */
vshi_sampler *vshi_sampler_create(int32_t kind, int32_t rays, int32_t frame);
void vshi_sampler_free(vshi_sampler *sampler); /* NULL does nothing */

/* Points first … first + count - 1 of the sequence of `texel` (vsh_points.texels), uniform in area over the
 * unit disc. `purpose` keeps sequences of one texel apart (one a light, one for AO). Prefixes of 2^k points
 * are the best spread. */
void vshi_sampler_disc(const vshi_sampler *sampler, uint32_t texel, uint32_t purpose, int32_t first,
                       int32_t count, double (*points)[2]);

/* What those of VSH_SAMPLER_SOBOL are made of: the digits of points 0 … rays - 1 in the unit square, the same
 * for all texels (NULL for other kinds), and by what a texel shifts them. net ^ shift, times 2^-32, is turned
 * to the disc (Shirley and Chiu). */
const uint32_t (*vshi_sampler_net(const vshi_sampler *sampler))[2];
void vshi_sampler_shift(const vshi_sampler *sampler, uint32_t texel, uint32_t purpose, uint32_t shift[2]);

/* Points of a net in blocks: the first VSHI_SAMPLER_BLOCK, then as many again as there were. A block of 2^k
 * has one point in each of 2^k cells of the square, and a shift by a texel's digits moves all points of a
 * cell to one other: whose number is the old one's, exclusive or that of the shift's own cell. */
enum { VSHI_SAMPLER_BLOCK = 4 };

/* Cell, of `size`, of a point of these digits. */
static inline uint32_t vshi_sampler_cell(uint32_t size, uint32_t x, uint32_t y) {
    const uint32_t bits = (uint32_t)__builtin_ctz(size), rows = bits / 2, columns = bits - rows;
    return x >> (32 - columns) << rows | (uint32_t)((uint64_t)y >> (32 - rows));
}

/* Digits of the points of the block that begins with point `first`, in the order of their cells. */
const uint32_t (*vshi_sampler_cells(const vshi_sampler *sampler, uint32_t first))[2];

/* Whether points first … last - 1 are whole blocks. */
static inline bool vshi_sampler_is_blocks(int32_t first, int32_t last) {
    return (first & (first - 1)) == 0 && (last & (last - 1)) == 0 && first < last &&
           last >= VSHI_SAMPLER_BLOCK && (first == 0 || first >= VSHI_SAMPLER_BLOCK);
}

/* Blue noise: a number in [0, 1) that neighbouring texels have far apart. Of VSH_SAMPLER_BLUE. */
double vshi_sampler_mask(const vshi_sampler *sampler, uint32_t texel, uint32_t purpose);

#endif
