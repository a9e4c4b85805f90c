/* The threads that the system gives this process, and stacks that are large enough. */
#pragma once

#include "base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <vdbshade/base.h>

VSH_BEGIN_C

/* Threads that liblog4cplus begins when OpenVDB is loaded. It ends the process if the system refuses one. */
enum { VSHI_OPENVDB_THREADS = 4 };

/* Returns how many of `wanted` more threads this process can have, with stacks of `stack` bytes (0: the
 * system's): 0 … wanted. Tries it by beginning that many threads at once, with OpenVDB's and two more, and
 * ending them. Tries each number once, and none after a refusal. Thread safe. */
int32_t vshi_threads_given(int32_t wanted, size_t stack);

/* Returns whether the system lets this process begin that many more threads now. */
bool vshi_threads_left(int32_t wanted);

/* Calls fn(user, error) and returns its result. If this thread has less than VSHI_STACK_ENOUGH left, a new
 * thread with VSHI_STACK makes the call. Hosts call from threads and fibres with small stacks, but TBB,
 * Embree, OpenVDB, our kernels and parsers of nested files need more. Signals go to other threads. Errors: as
 * fn, VSH_ERROR_MEMORY (the system refuses a thread). */
enum { VSHI_STACK = 4 << 20 /* bytes, as TBB's threads have */, VSHI_STACK_ENOUGH = 2 << 20 };
typedef vsh_result vshi_stack_fn(void *user, vsh_error *error);
VSHI_SHARED vsh_result vshi_on_stack(vshi_stack_fn *fn, void *user, vsh_error *error);

VSH_END_C
