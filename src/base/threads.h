/* How many threads the system gives this process. */
#ifndef VSHI_THREADS_H
#define VSHI_THREADS_H

#include "base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <vdbshade/base.h>

#ifdef __cplusplus
extern "C" {
#endif

/* That liblog4cplus begins when OpenVDB is loaded; where the system refuses one, it ends the process. */
enum { VSHI_OPENVDB_THREADS = 4 };

/* How many threads of `wanted`, with stacks of so many bytes (0: the system's), can live beside this one: 0 …
 * wanted. They and those of OpenVDB and two more are begun, all at a time, and ended; once a process and
 * number, and never again after the first that was refused. Any thread. */
int32_t vshi_threads_given(int32_t wanted, size_t stack);

/* Whether so many can be begun now, beside those that there are. */
bool vshi_threads_left(int32_t wanted);

/* Calls fn(user, error) and returns its result. If this thread has less than VSHI_STACK_ENOUGH left, a new
 * thread with VSHI_STACK makes the call. Hosts call from threads and fibres with small stacks, but TBB,
 * Embree, OpenVDB, our kernels and parsers of nested files need more. Signals go to other threads. Errors:
 * those of fn, VSH_ERROR_MEMORY (the system refuses a thread). */
enum { VSHI_STACK = 4 << 20 /* bytes, as TBB's threads have */, VSHI_STACK_ENOUGH = 2 << 20 };
typedef vsh_result vshi_stack_fn(void *user, vsh_error *error);
VSHI_SHARED vsh_result vshi_on_stack(vshi_stack_fn *fn, void *user, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
