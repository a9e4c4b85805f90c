/* Hashing a file that may be large. */
#ifndef VSHI_DIGEST_H
#define VSHI_DIGEST_H

#include "base/job.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <vdbshade/digest.h>

/* vsh_file_digest(), within a job that is under way. */
vsh_result vshi_file_digest(const char *path, char digest[VSH_DIGEST_TEXT], vshi_job *job, vsh_error *error);

/* --- sHA-256 (NIST, FIPS 180-4) of many blocks, by the processor's own instructions */

/* Whether this processor has them. */
bool vshi_sha256_fast(void);

/* Takes `count` blocks of 64 bytes into a state. Only where it has them. */
void vshi_sha256_blocks(uint32_t state[8], const unsigned char *bytes, size_t count);

#endif
