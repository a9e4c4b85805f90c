/* SHA-256 (NIST, FIPS 180-4) of many blocks, by the processor's own instructions. */
#ifndef VSHI_SHA256_H
#define VSHI_SHA256_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Whether this processor has them. */
bool vshi_sha256_fast(void);

/* Takes `count` blocks of 64 bytes into a state. Only where it has them. */
void vshi_sha256_blocks(uint32_t state[8], const unsigned char *bytes, size_t count);

#endif
