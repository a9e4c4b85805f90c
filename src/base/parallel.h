/* Loops over the one thread pool (TBB's). */
#pragma once

#include "base/job.h"

VSH_BEGIN_C

/* Handles elements begin … end - 1. May run on any thread; must not depend on how the range was cut. */
typedef void vshi_range_fn(void *user, size_t begin, size_t end);

/* Returns `wanted` threads (0: all cores), or fewer if the system refuses some. */
VSHI_SHARED int32_t vshi_parallel_threads(int32_t wanted);

/* The most threads that a loop runs on at a time, in a job with `threads` (0: all cores). */
int32_t vshi_parallel_most(int32_t threads);

/* Calls fn over 0 … count - 1 on the job's threads, in pieces of `grain`; the last may be shorter. Advances
 * the job by `units` for each element, and stops early if it is cancelled. Errors: VSH_ERROR_CANCELLED,
 * VSH_ERROR_MEMORY, VSH_ERROR_INTERNAL. */
vsh_result vshi_parallel_for(vshi_job *job, size_t count, size_t grain, size_t units, vshi_range_fn *fn,
                             void *user, vsh_error *error);

/* Handles one element, and may fail. May run on any thread. */
typedef vsh_result vshi_element_fn(void *user, size_t index, vsh_error *error);

/* Calls fn for each element, like vshi_parallel_for(). Handles all of them even if some fail, and then
 * reports the error of the lowest. Errors: as vshi_parallel_for() and fn. */
vsh_result vshi_parallel_each(vshi_job *job, size_t count, size_t grain, size_t units, vshi_element_fn *fn,
                              void *user, vsh_error *error);

/* Calls fn(user) once, for a library that uses the pool itself: it gets no more than the job's threads.
 * Errors: VSH_ERROR_MEMORY, VSH_ERROR_INTERNAL. */
vsh_result vshi_parallel_call(const vshi_job *job, void (*fn)(void *user), void *user, vsh_error *error);

VSH_END_C
