/* TBB's threads begin each other, and where the system refuses one of them that, nobody is there to catch
 * what is thrown: std::terminate() ends the host. So as many are begun here first, and no more asked of TBB
 * than there were. What is known of it belongs to the process, as its threads do. */
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
    SPARE = VSHI_OPENVDB_THREADS + 2, /* left to others: the host's, another process of the user */
    YIELDS = 100,                     /* for the end of a thread; then */
    NAPS = 10000                      /* of a tenth of a millisecond */
};

static pthread_mutex_t looking = PTHREAD_MUTEX_INITIALIZER;
static _Atomic int32_t known; /* that were given */
static bool refused;          /* one was; guarded by `looking` */

typedef struct gate {
    pthread_mutex_t lock;
    pthread_cond_t opens;
    bool open;
    pid_t *tasks; /* [count]: those that came */
    int32_t count;
} gate;

static void *wait_at(void *user) {
    gate *at = user;
    pthread_mutex_lock(&at->lock);
    at->tasks[at->count++] = gettid();
    while (!at->open) {
        pthread_cond_wait(&at->opens, &at->lock);
    }
    pthread_mutex_unlock(&at->lock);
    return NULL;
}

static void open_gate(gate *at) {
    pthread_mutex_lock(&at->lock);
    at->open = true;
    pthread_cond_broadcast(&at->opens);
    pthread_mutex_unlock(&at->lock);
}

/* Not where there is no /proc. */
static bool is_there(pid_t task) {
    char path[48];
    struct stat status;
    snprintf(path, sizeof path, "/proc/self/task/%d", (int)task);
    return stat(path, &status) == 0;
}

/* A thread that was joined counts against limits until the system has ended its task: on a busy machine, for
 * milliseconds. */
static void await_ends(const gate *at) {
    int looks = 0;
    for (int32_t i = 0; i < at->count; ++i) {
        for (; looks < YIELDS + NAPS && is_there(at->tasks[i]); ++looks) {
            if (looks < YIELDS) {
                sched_yield();
            } else {
                nanosleep(&(struct timespec){.tv_nsec = 100000}, NULL);
            }
        }
    }
}

static int32_t begin(int32_t wanted, const pthread_attr_t *attributes, pthread_t *threads, pid_t *tasks) {
    gate at = {PTHREAD_MUTEX_INITIALIZER, PTHREAD_COND_INITIALIZER, false, tasks, 0};
    int32_t begun = 0;
    while (begun < wanted && pthread_create(&threads[begun], attributes, wait_at, &at) == 0) {
        ++begun;
    }
    open_gate(&at);
    for (int32_t i = 0; i < begun; ++i) {
        pthread_join(threads[i], NULL);
    }
    await_ends(&at);
    return begun;
}

/* The threads take no signals: a host's handlers may rely on who runs them. */
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
    const int32_t begun = begin(wanted, &attributes, threads, (pid_t *)(threads + wanted));
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    pthread_attr_destroy(&attributes);
    free(threads);
    return begun;
}

int32_t vshi_threads_given(int32_t wanted, size_t stack) {
    if (wanted <= atomic_load(&known)) {
        return wanted;
    }
    pthread_mutex_lock(&looking);
    const int32_t before = atomic_load(&known);
    if (wanted > before && !refused) {
        const int32_t free = try(wanted + SPARE, stack) - SPARE;
        refused = free < wanted;
        atomic_store(&known, free > before ? free : before);
    }
    pthread_mutex_unlock(&looking);
    const int32_t now = atomic_load(&known);
    return wanted < now ? wanted : now;
}

bool vshi_threads_left(int32_t wanted) {
    pthread_mutex_lock(&looking);
    const bool left = try(wanted, 0) == wanted;
    pthread_mutex_unlock(&looking);
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
