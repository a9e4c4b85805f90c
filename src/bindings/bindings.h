#pragma once

#include "base/error.h"

/* For bindings of other languages, which cannot call inline functions: what the …_default() or …_zero() of a
 * struct gives, by its name ("vsh_run"), into `size` bytes, as many as they know of it. 1; or 0 where there
 * is no such struct, or an argument is NULL. */
VSHI_SHARED int32_t vshi_struct_init(const char *name, void *made, size_t size);

/* A progress callback that hands on to another from time to time: for languages whose callbacks take long, or
 * may be called by one thread alone. As vsh_run.progress goes vshi_progress_seldom(), as vsh_run.user the
 * address of this, which is one call's. */
typedef struct vshi_progress_filter {
    size_t struct_size;
    vsh_progress_fn *progress; /* handed on to with `user`: 0 and 1 of a stage, and in between at most every
                                  `seconds`; else work goes on. What it answers other than 0 stays. May be
                                  NULL */
    void *user;                /* of `progress` */
    double seconds;            /* by the clock, ≥ 0 */
    uint64_t thread;  /* nonzero: that thread alone hands on, (uint64_t)pthread_self(); the one that makes a
                         call takes part in its work, if it has a stack of 4 MiB */
    double last;      /* these two are kept by vshi_progress_seldom(): when it handed on last, 0: not yet; */
    int32_t answered; /* and what the callback answered */
} vshi_progress_filter;

static inline vshi_progress_filter vshi_progress_filter_default(void) {
    vshi_progress_filter filter = {sizeof(vshi_progress_filter), NULL, NULL, 0.02, 0, 0.0, 0};
    return filter;
}

/* A vsh_progress_fn: `filter` points to a vshi_progress_filter. */
VSHI_SHARED int32_t vshi_progress_seldom(void *filter, const char *stage, double fraction);
