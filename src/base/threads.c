/* TBB's threads begin each other, and where the system refuses one of them that, nobody is there to catch
 * what is thrown: std::terminate() ends the host. So as many are begun here first, and no more asked of TBB
 * than there were. What is known of it belongs to the process, as its threads do. */
#include "base/threads.h"

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <sys/stat.h>

enum {
    SPARE = VSHI_OPENVDB_THREADS + 2, /* left to others: the host's, another process of the user */
    LOOKS = 1000                      /* for the end of a thread, a yield each */
};

static pthread_mutex_t looking = PTHREAD_MUTEX_INITIALIZER;
static _Atomic int32_t known; /* that were given */
static bool refused;          /* one was; guarded by `looking` */

typedef struct gate {
    pthread_mutex_t lock;
    pthread_cond_t opens;
    bool open;
} gate;

static void *wait_at(void *user) {
    gate *at = user;
    pthread_mutex_lock(&at->lock);
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

/* Links of the folder that has one a thread; 0 where there is no /proc. */
static nlink_t count_tasks(void) {
    struct stat status;
    return stat("/proc/self/task", &status) == 0 ? status.st_nlink : 0;
}

/* A thread that was joined counts against limits for a moment yet. */
static void await_ends(nlink_t before) {
    for (int i = 0; i < LOOKS && count_tasks() > before; ++i) {
        sched_yield();
    }
}

static int32_t begin(int32_t wanted, const pthread_attr_t *attributes, pthread_t *threads) {
    gate at = {PTHREAD_MUTEX_INITIALIZER, PTHREAD_COND_INITIALIZER, false};
    const nlink_t before = count_tasks();
    int32_t begun = 0;
    while (begun < wanted && pthread_create(&threads[begun], attributes, wait_at, &at) == 0) {
        ++begun;
    }
    open_gate(&at);
    for (int32_t i = 0; i < begun; ++i) {
        pthread_join(threads[i], NULL);
    }
    await_ends(before);
    return begun;
}

/* The threads take no signals: a host's handlers may rely on who runs them. */
static int32_t try(int32_t wanted, size_t stack) {
    sigset_t all, before;
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
    pthread_sigmask(SIG_SETMASK, &all, &before);
    const int32_t begun = begin(wanted, &attributes, threads);
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
