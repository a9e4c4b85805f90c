#pragma once

#include "base/error.h"

/* Stores the defaults of a struct by its name ("vsh_run"), for languages that cannot call the inline
 * …_default() and …_zero() functions. `size` is the struct's size as the caller knows it. Returns 0 if there
 * is no such struct or an argument is NULL, else 1. */
VSHI_SHARED int32_t vshi_struct_init(const char *name, void *made, size_t size);

/* Passes progress on from time to time, for languages whose callbacks are slow or run in one thread only. Set
 * vsh_run.progress to vshi_progress_seldom(), and vsh_run.user to one of these for each call. */
typedef struct vshi_progress_filter {
    size_t struct_size;
    vsh_progress_fn *progress; /* called with `user` at 0 and 1 of a stage, and between them at most every
                                * `seconds`. Its first answer other than 0 is repeated. May be NULL */
    void *user;
    double seconds;   /* ≥ 0 */
    uint64_t thread;  /* (uint64_t)pthread_self() of the only thread to call `progress`; 0: any thread. The
                       * thread that makes a call of the library takes part if its stack has 4 MiB */
    double last;      /* time of the last call; 0: none yet. Set by vshi_progress_seldom(), as the next */
    int32_t answered; /* the answer of `progress` */
} vshi_progress_filter;

/* A vsh_progress_fn: `filter` points to a vshi_progress_filter. */
VSHI_SHARED int32_t vshi_progress_seldom(void *filter, const char *stage, double fraction);
