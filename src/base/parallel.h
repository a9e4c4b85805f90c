/* Loops over the one thread pool (TBB's). */
#ifndef VSHI_PARALLEL_H
#define VSHI_PARALLEL_H

#include "base/job.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Handles elements begin … end - 1. May run on any thread; must not depend on how the range was cut. */
typedef void vshi_range_fn(void *user, size_t begin, size_t end);

/* Of so many threads (0: all cores) as many as the system gives, and the same number where it gives them all.
 */
VSHI_SHARED int32_t vshi_parallel_threads(int32_t wanted);

/* The most threads that a loop of a job of so many (0: all cores) runs on at a time. */
int32_t vshi_parallel_most(int32_t threads);

/* Calls fn over 0 … count - 1 in pieces of `grain` (the last may be shorter), each piece starting at a
 * multiple of it, on the job's threads; advances the job by `units` × the elements of every piece and stops
 * early where the job is cancelled. Errors: VSH_ERROR_CANCELLED, VSH_ERROR_MEMORY, VSH_ERROR_INTERNAL. */
vsh_result vshi_parallel_for(vshi_job *job, size_t count, size_t grain, size_t units, vshi_range_fn *fn,
                             void *user, vsh_error *error);

/* Handles one element, and may fail. May run on any thread. */
typedef vsh_result vshi_element_fn(void *user, size_t index, vsh_error *error);

/* The same for elements that may fail, `grain` of them at a time: all are handled, and the error is that of
 * the lowest that failed. Errors: of vshi_parallel_for() and of fn. */
vsh_result vshi_parallel_each(vshi_job *job, size_t count, size_t grain, size_t units, vshi_element_fn *fn,
                              void *user, vsh_error *error);

/* Calls fn(user) once, where what a library in it hands to the pool itself runs on no more than the job's
 * threads. Errors: VSH_ERROR_MEMORY, VSH_ERROR_INTERNAL. */
vsh_result vshi_parallel_call(const vshi_job *job, void (*fn)(void *user), void *user, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
