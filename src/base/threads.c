/* TBB's threads begin each other. If the system refuses one, the exception is caught nowhere, and
 * std::terminate() ends the host. So this file begins as many threads first, and TBB gets no more than the
 * system allowed. The limit is kept for the whole process. */
#define _GNU_SOURCE /* gettid */
#include "base/threads.h"

#include "base/error.h"
#include "base/floats.h"

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum {
    SPARE = VSHI_OPENVDB_THREADS + 2, /* for the host and other processes of the user */
    YIELDS = 100,                     /* before the first nap, while a thread ends */
    NAPS = 10000                      /* each takes a tenth of a millisecond */
};

static pthread_mutex_t trying = PTHREAD_MUTEX_INITIALIZER;
static _Atomic int32_t known; /* threads that the system gave */
static bool refused;          /* the system refused one; guarded by `trying` */

/* Threads that are tried wait for this, so that all of them live at once. */
static pthread_mutex_t gate = PTHREAD_MUTEX_INITIALIZER;

static void *wait_at_gate(void *task) {
    *(pid_t *)task = gettid();
    pthread_mutex_lock(&gate);
    pthread_mutex_unlock(&gate);
    return NULL;
}

/* Returns whether a task of this process lives; false without /proc. */
static bool is_alive(pid_t task) {
    char path[48];
    struct stat status;
    snprintf(path, sizeof path, "/proc/self/task/%d", (int)task);
    return stat(path, &status) == 0;
}

/* Joined threads count against limits until the system has ended their tasks. On a busy machine that takes
 * milliseconds. */
static void await_ends(const pid_t *tasks, int32_t count) {
    int looks = 0;
    for (int32_t i = 0; i < count; ++i) {
        for (; looks < YIELDS + NAPS && is_alive(tasks[i]); ++looks) {
            if (looks < YIELDS) {
                sched_yield();
            } else {
                nanosleep(&(struct timespec){.tv_nsec = 100000}, NULL);
            }
        }
    }
}

static int32_t begin_all(int32_t wanted, const pthread_attr_t *attributes, pthread_t *threads, pid_t *tasks) {
    int32_t begun = 0;
    pthread_mutex_lock(&gate);
    while (begun < wanted && pthread_create(&threads[begun], attributes, wait_at_gate, &tasks[begun]) == 0) {
        ++begun;
    }
    pthread_mutex_unlock(&gate);
    for (int32_t i = 0; i < begun; ++i) {
        pthread_join(threads[i], NULL);
    }
    await_ends(tasks, begun);
    return begun;
}

/* Returns how many of `wanted` threads the system begins. They block all signals, because a host's handlers
 * may rely on the thread. */
static int32_t try(int32_t wanted, size_t stack) {
    sigset_t all, before;
    pthread_attr_t attributes;
    pthread_t *threads = malloc((size_t)wanted * (sizeof *threads + sizeof(pid_t)));
    if (threads == NULL || pthread_attr_init(&attributes) != 0) {
        free(threads);
        return 0;
    }
    if (stack > 0) {
        pthread_attr_setstacksize(&attributes, stack);
    }
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    const int32_t begun = begin_all(wanted, &attributes, threads, (pid_t *)(threads + wanted));
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    pthread_attr_destroy(&attributes);
    free(threads);
    return begun;
}

int32_t vshi_threads_given(int32_t wanted, size_t stack) {
    if (wanted <= atomic_load(&known)) {
        return wanted;
    }
    pthread_mutex_lock(&trying);
    const int32_t before = atomic_load(&known);
    if (wanted > before && !refused) {
        const int32_t free = try(wanted + SPARE, stack) - SPARE;
        refused = free < wanted;
        atomic_store(&known, free > before ? free : before);
    }
    pthread_mutex_unlock(&trying);
    const int32_t now = atomic_load(&known);
    return wanted < now ? wanted : now;
}

bool vshi_threads_left(int32_t wanted) {
    pthread_mutex_lock(&trying);
    const bool left = try(wanted, 0) == wanted;
    pthread_mutex_unlock(&trying);
    return left;
}

/* The range of addresses of a thread's stack. A fibre has its stack elsewhere. */
typedef struct stack_range {
    uintptr_t low, high; /* both 0: not looked up yet */
} stack_range;

static bool has_stack(void) {
    static _Thread_local stack_range range;
    if (range.high == 0) {
        pthread_attr_t attributes;
        void *low = NULL;
        size_t size = 0;
        range = (stack_range){0, UINTPTR_MAX}; /* if the system does not say */
        if (pthread_getattr_np(pthread_self(), &attributes) == 0) {
            if (pthread_attr_getstack(&attributes, &low, &size) == 0) {
                range = (stack_range){(uintptr_t)low, (uintptr_t)low + size};
            }
            pthread_attr_destroy(&attributes);
        }
    }
    const uintptr_t here = (uintptr_t)__builtin_frame_address(0);
    return here >= range.low && here < range.high && here - range.low >= VSHI_STACK_ENOUGH;
}

typedef struct stack_call {
    vshi_stack_fn *fn;
    void *user;
    vsh_error *error;
    vsh_result result;
} stack_call;

static void *run_call(void *user) {
    VSHI_FLOATS;
    stack_call *call = user;
    call->result = call->fn(call->user, call->error);
    return NULL;
}

vsh_result vshi_on_stack(vshi_stack_fn *fn, void *user, vsh_error *error) {
    if (has_stack()) {
        return fn(user, error);
    }
    stack_call call = {fn, user, error, VSH_OK};
    sigset_t all, before;
    pthread_attr_t attributes;
    pthread_t thread;
    bool begun = false;
    if (pthread_attr_init(&attributes) == 0) {
        sigfillset(&all);
        pthread_sigmask(SIG_SETMASK, &all, &before);
        begun = pthread_attr_setstacksize(&attributes, VSHI_STACK) == 0 &&
                pthread_create(&thread, &attributes, run_call, &call) == 0;
        pthread_sigmask(SIG_SETMASK, &before, NULL);
        pthread_attr_destroy(&attributes);
    }
    if (!begun) {
        return vshi_fail(
            error, VSH_ERROR_MEMORY,
            "threads: the system refuses a thread with a stack of %d MB; call from a thread with "
            "%d MB",
            VSHI_STACK >> 20, 2 * VSHI_STACK_ENOUGH >> 20);
    }
    pthread_join(thread, NULL);
    return call.result;
}
