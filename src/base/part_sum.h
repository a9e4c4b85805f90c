/* What parts' files begin with, and their checksum. */
#ifndef VSHI_PART_SUM_H
#define VSHI_PART_SUM_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* The format's number is in the magic: another one is another version's. */
#define VSHI_PART_MAGIC "vdbshade part 9\n"
#define VSHI_PART_MAGIC_BEGIN "vdbshade part "
#define VSHI_PART_ORDER UINT64_C(0x0102030405060708)
#define VSHI_PART_SUM UINT64_C(0xcbf29ce484222325) /* of no bytes */

/* FNV-1a (Fowler, Noll and Vo, 1991), a word of four bytes at a time. */
static inline uint64_t vshi_part_sum(uint64_t sum, const void *bytes, size_t size) {
    const unsigned char *at = bytes;
    for (size_t i = 0; i + 4 <= size; i += 4) {
        uint32_t word;
        memcpy(&word, at + i, 4);
        sum = (sum ^ word) * UINT64_C(0x100000001b3);
    }
    return sum;
}

#endif
