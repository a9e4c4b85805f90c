/* A stage of work under way: progress, cancelling, warnings, and the options of a run. */
#pragma once

#include "base/error.h"

#include <stdbool.h>

VSH_BEGIN_C

typedef struct vshi_job vshi_job;

/* Begins a job of `total` units under the name `stage`, which outlives it. `run` may be NULL. Returns NULL if
 * memory is short. */
VSHI_SHARED vshi_job *vshi_job_begin(const vsh_run *run, const char *stage, size_t total);

/* Begins a job in the same way, but fails with VSH_ERROR_MEMORY, naming `what`. */
VSHI_SHARED vsh_result vshi_job_open(vshi_job **job, const vsh_run *run, const char *stage, size_t total,
                                     const char *what, vsh_error *error);
VSHI_SHARED void vshi_job_end(vshi_job *job); /* NULL does nothing */

/* Reports `units` more as done and returns whether to stop. Any thread may call this. One thread at a time
 * calls the callback, and the fraction never falls. */
VSHI_SHARED bool vshi_job_advance(vshi_job *job, size_t units);

VSHI_SHARED bool vshi_job_cancelled(const vshi_job *job);

/* The run's threads, 1 … 1024, or 0 for all cores; fewer, with a note, if the system refuses some. */
VSHI_SHARED int32_t vshi_job_threads(const vshi_job *job);

/* These fail with VSH_ERROR_CANCELLED, naming the stage, if the job is cancelled. The second advances it
 * first. */
VSHI_SHARED vsh_result vshi_job_check(const vshi_job *job, vsh_error *error);
VSHI_SHARED vsh_result vshi_job_step(vshi_job *job, size_t units, vsh_error *error);

/* Checks run (may be NULL) and copies it over defaults into *full. Errors: VSH_ERROR_ARGUMENT. */
VSHI_SHARED vsh_result vshi_run_resolve(const vsh_run *run, vsh_run *full, vsh_error *error);

/* Sends one line to run->warning, if it is set. A warning says how the result suffers, and what to do. */
VSHI_SHARED void vshi_warn(const vsh_run *run, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Sends VSHI_NOTE and a line that needs no action, if run->notes is set. */
#define VSHI_NOTE "note: "
VSHI_SHARED void vshi_note(const vsh_run *run, const char *format, ...) __attribute__((format(printf, 2, 3)));
VSHI_SHARED bool vshi_wants_notes(const vsh_run *run);

/* Copies a versioned struct, whose first member is its size, over *defaults. Errors: VSH_ERROR_ARGUMENT,
 * naming `what`, if no version of the struct has that size: sizes are multiples of size_t's, larger than it,
 * and at most `size`. */
VSHI_SHARED vsh_result vshi_options_resolve(const void *given, void *defaults, size_t size, const char *what,
                                            vsh_error *error);

/* --- instruction sets */

enum { VSHI_ISA_COUNT = VSH_ISA_AVX512 + 1 };

/* Whether this machine has an instruction set: 1 or 0. */
int32_t vshi_isa_available(int32_t isa);

/* Replaces VSH_ISA_BEST by this machine's best set. */
VSHI_SHARED int32_t vshi_isa_resolve(int32_t isa);

/* The kernel `name`_base, `name`_avx2 or `name`_avx512 of a VSH_ISA_…. */
#if defined(__x86_64__)
#define VSHI_KERNEL_OF(name, isa)                                                                            \
    (vshi_isa_resolve(isa) == VSH_ISA_AVX512 ? &name##_avx512                                                \
     : vshi_isa_resolve(isa) == VSH_ISA_AVX2 ? &name##_avx2                                                  \
                                             : &name##_base)
#else
#define VSHI_KERNEL_OF(name, isa) ((void)(isa), &name##_base)
#endif

VSH_END_C
