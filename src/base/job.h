/* A stage of work under way: its progress, its cancelling, its warnings. */
#ifndef VSHI_JOB_H
#define VSHI_JOB_H

#include "base/error.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vshi_job vshi_job;

/* A job of `total` units under the name `stage` (both outlive it). `run` may be NULL. NULL when memory is
 * short. */
VSHI_SHARED vshi_job *vshi_job_begin(const vsh_run *run, const char *stage, size_t total);
VSHI_SHARED void vshi_job_end(vshi_job *job); /* NULL does nothing */

/* Says that `units` more are done and returns whether to stop. Any thread; the callback is called by one at a
 * time, and never with a smaller fraction than before. */
VSHI_SHARED bool vshi_job_advance(vshi_job *job, size_t units);

VSHI_SHARED bool vshi_job_cancelled(const vshi_job *job);

/* 1 … 1024, or 0 for all cores: the run's, or as many as the system gives, with a warning. */
VSHI_SHARED int32_t vshi_job_threads(const vshi_job *job);

/* VSH_ERROR_CANCELLED, naming the stage. */
VSHI_SHARED vsh_result vshi_job_fail_cancelled(const vshi_job *job, vsh_error *error);

/* Checks run (may be NULL) and copies it over defaults into *full. Errors: VSH_ERROR_ARGUMENT. */
VSHI_SHARED vsh_result vshi_run_resolve(const vsh_run *run, vsh_run *full, vsh_error *error);

/* Sends one line to run->warning, if it is set: what changes the result, and what helps. */
VSHI_SHARED void vshi_warn(const vsh_run *run, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Sends VSHI_NOTE and a line that needs no action, if run->notes is set. */
#define VSHI_NOTE "note: "
VSHI_SHARED void vshi_note(const vsh_run *run, const char *format, ...) __attribute__((format(printf, 2, 3)));
VSHI_SHARED bool vshi_wants_notes(const vsh_run *run);

/* Copies a versioned struct (its first member is its size) over *defaults, whatever version it has. Errors:
 * VSH_ERROR_ARGUMENT where the size is no larger than the first member, larger than `size` or no multiple of
 * size_t's, naming `what`. */
VSHI_SHARED vsh_result vshi_options_resolve(const void *given, void *defaults, size_t size, const char *what,
                                            vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
