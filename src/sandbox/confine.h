/* What a reader may no longer do. */
#ifndef VSHI_READ_CONFINE_H
#define VSHI_READ_CONFINE_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Limits this process for good: `memory` bytes (0: as much as the machine has) of data, `beside` more and a
 * stack for each core; address space of `memory` and 2 GiB; `seconds` of processor time, no core dump, no
 * file larger than what may be handed over, no new privileges, death with its parent. False where the host
 * allows not all of it, or in a sanitized build. */
bool vshi_confine_resources(uint64_t memory, uint64_t beside, double seconds);

/* What became of a filter of system calls. */
enum {
    VSHI_CALLS_FREE = 0, /* the host allows none, or does not let it be seen (no /proc); sanitized builds */
    VSHI_CALLS_CONFINED = 1, /* it holds in every thread, as the kernel tells of each */
    VSHI_CALLS_IN_PART = 2   /* some thread is not seen to have it: nothing may be parsed here */
};

/* Leaves the system calls that parsing needs, in every thread of this process and those to come; the others
 * fail with EPERM, and calls of another kind of machine (32 bit, x32) end the process. */
int vshi_confine_calls(void);

/* From now on memory that operator new is refused ends the process with VSHI_READER_OUT_OF_MEMORY, before a
 * library can do worse. */
void vshi_confine_memory(void);

#ifdef __cplusplus
}
#endif
#endif
