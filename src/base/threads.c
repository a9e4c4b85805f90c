/* TBB's threads begin each other. If the system refuses one, the exception is caught nowhere, and
 * std::terminate() ends the host. So this file begins as many threads first, and TBB gets no more than the
 * system allowed. The limit is kept for the whole process. */
#define _GNU_SOURCE
#include "base/threads.h"

#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <time.h>

enum {
    SPARE = VSHI_OPENVDB_THREADS + 2, /* for the host and other processes of the user */
    NAPS = 10000                      /* each takes a tenth of a millisecond */
};

static pthread_mutex_t trying = PTHREAD_MUTEX_INITIALIZER;
static _Atomic int32_t known; /* threads that the system gave */
static bool refused;          /* the system refused one; guarded by `trying` */

/* Held while try() creates threads. They wait for it, so that all of them live at once. */
static pthread_mutex_t gate = PTHREAD_MUTEX_INITIALIZER;

static void *wait_at_gate(void *unused) {
    pthread_mutex_lock(&gate);
    pthread_mutex_unlock(&gate);
    return unused;
}

/* Returns the number of this process's threads, plus the two links of every folder; 0 without /proc. */
static size_t count_threads(void) {
    struct stat folder;
    return stat("/proc/self/task", &folder) == 0 ? folder.st_nlink : 0;
}

/* Returns how many of `wanted` threads the system begins. They block all signals, because a host's handlers
 * may rely on the thread. */
static int32_t try(int32_t wanted, size_t stack) {
    const size_t before = count_threads();
    sigset_t all, signals;
    pthread_attr_t attributes;
    pthread_t *threads = malloc((size_t)wanted * sizeof *threads);
    if (threads == NULL || pthread_attr_init(&attributes) != 0) {
        free(threads);
        return 0;
    }
    if (stack > 0) {
        pthread_attr_setstacksize(&attributes, stack);
    }
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &signals);
    int32_t begun = 0;
    pthread_mutex_lock(&gate);
    while (begun < wanted && pthread_create(&threads[begun], &attributes, wait_at_gate, NULL) == 0) {
        ++begun;
    }
    pthread_mutex_unlock(&gate);
    for (int32_t i = 0; i < begun; ++i) {
        pthread_join(threads[i], NULL);
    }
    pthread_sigmask(SIG_SETMASK, &signals, NULL);
    pthread_attr_destroy(&attributes);
    free(threads);
    /* joined threads count against limits until the system has ended them, some milliseconds later */
    for (int nap = 0; nap < NAPS && count_threads() > before; ++nap) {
        nanosleep(&(struct timespec){.tv_nsec = 100000}, NULL);
    }
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
