/* Vectors of MARCH_WIDTH lanes, by the vector extensions of gcc and clang. */
#ifndef VSHI_VECTORS_H
#define VSHI_VECTORS_H

#include <math.h>
#include <stdint.h>
#include <string.h>

typedef float floats __attribute__((vector_size(4 * MARCH_WIDTH)));
typedef int32_t ints __attribute__((vector_size(4 * MARCH_WIDTH)));
typedef uint32_t words __attribute__((vector_size(4 * MARCH_WIDTH)));

static inline floats pick(ints mask, floats yes, floats no) {
    return (floats)((mask & (ints)yes) | (~mask & (ints)no));
}

static inline floats larger(floats a, floats b) {
    return pick(a > b, a, b);
}

static inline floats root(floats x) {
    for (int i = 0; i < MARCH_WIDTH; ++i) {
        x[i] = sqrtf(x[i]);
    }
    return x;
}

/* values[base] and values[base + 1] of each lane, neighbours along z, times 65536: loaded together as a word,
 * whose halves become floats where each is the upper half of an integer. */
static inline uint32_t word(const int16_t *values, int32_t base) {
    uint32_t both;
    memcpy(&both, values + base, sizeof both);
    return both;
}

static inline void load_pairs(const int16_t *values, const int32_t *base, floats *near, floats *far) {
#define WORDS(i)                                                                                             \
    word(values, base[i]), word(values, base[(i) + 1]), word(values, base[(i) + 2]),                         \
        word(values, base[(i) + 3])
#if MARCH_WIDTH == 4
    const words both = {WORDS(0)};
#elif MARCH_WIDTH == 8
    const words both = {WORDS(0), WORDS(4)};
#else
    const words both = {WORDS(0), WORDS(4), WORDS(8), WORDS(12)};
#endif
#undef WORDS
    const floats low = __builtin_convertvector((ints)(both << 16), floats);
    const floats high = __builtin_convertvector((ints)(both & 0xffff0000u), floats);
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
    *near = low;
    *far = high;
#else
    *near = high;
    *far = low;
#endif
}

#endif
