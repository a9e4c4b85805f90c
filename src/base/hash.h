/* Bits well mixed, for hash tables. */
#ifndef VSHI_HASH_H
#define VSHI_HASH_H

#include <stdint.h>

/* The finaliser of SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number generators",
 * 2014): neighbouring numbers land far apart. */
static inline uint64_t vshi_mix(uint64_t x) {
    x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
    return x ^ (x >> 31);
}

#endif
