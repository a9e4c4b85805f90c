/* Sizes computed with overflow checks, allocation behind them, and the memory limit. */
#ifndef VSHI_MEMORY_H
#define VSHI_MEMORY_H

#include "base/error.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* count × size bytes, zeroed and aligned to 64, into *memory; NULL where count is 0. Free with free().
 * Errors: VSH_ERROR_MEMORY, naming `what`. */
vsh_result vshi_allocate(void **memory, size_t count, size_t size, const char *what, vsh_error *error);

/* VSH_ERROR_LIMIT, naming `what`, where `bytes` (a double, so that estimates cannot overflow) pass
 * run->memory_limit together with run->memory_held. `run` may be NULL. */
vsh_result vshi_check_limit(const vsh_run *run, double bytes, const char *what, vsh_error *error);

/* What run->memory_held leaves of its limit, at least a byte; 0: there is no limit. */
uint64_t vshi_memory_left(const vsh_run *run);

#ifdef __cplusplus
}
#endif
#endif
