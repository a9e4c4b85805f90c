/* What a reader may no longer do. */
#ifndef VSHI_READ_CONFINE_H
#define VSHI_READ_CONFINE_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Limits this process for good: `memory` bytes (0: as much as the machine has) and 2 GiB of address space,
 * `seconds` of processor time, no core dump, no file larger than what may be handed over, no new privileges,
 * death with its parent. */
void vshi_confine_resources(uint64_t memory, double seconds);

/* Leaves the system calls that parsing needs; the others fail with EPERM. False where the host allows no such
 * filter, or in a sanitized build. To be called by a process with one thread. */
bool vshi_confine_calls(void);

/* From now on memory that operator new is refused ends the process with VSHI_READER_HUNGRY, before a library
 * can do worse. */
void vshi_confine_hunger(void);

#ifdef __cplusplus
}
#endif
#endif
