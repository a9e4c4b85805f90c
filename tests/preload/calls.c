/* Preloaded by tests/cli/refusals.bats: refuses system calls, or lists them.
 * - REFUSE_THREADS=N refuses more than N threads at a time. With LINGER=MS a thread counts for so long after
 * it was joined.
 * - REFUSE_MEMFD refuses every memfd_create().
 * - VSH_TEST_MALLOC=N refuses the N-th allocation of the program VSH_TEST_PROGRAM.
 * - TELL_SYNCS=FILE writes a line for each fsync(), fdatasync() and rename(), with the names. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <limits.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

static void *next(const char *name) {
    void *found = dlsym(RTLD_NEXT, name);
    if (found == NULL) {
        abort();
    }
    return found;
}

static atomic_int living;

/* A thread and its function. It stays in the list after it has ended. */
typedef struct call {
    void *(*fn)(void *);
    void *user, *result;
    pthread_t thread;
    atomic_int ended;
    struct call *next;
} call;

static _Atomic(call *) calls;

static void *live(void *user) {
    call *made = user;
    made->result = made->fn(made->user);
    atomic_store(&made->ended, 1);
    const char *linger = getenv("LINGER");
    if (linger != NULL) {
        usleep((useconds_t)(1000 * atoi(linger)));
    }
    atomic_fetch_sub(&living, 1);
    return made->result;
}

int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*fn)(void *), void *user) {
    int (*real)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);
    void *found = next("pthread_create");
    memcpy(&real, &found, sizeof real);
    const char *most = getenv("REFUSE_THREADS");
    if (most == NULL) {
        return real(thread, attributes, fn, user);
    }
    call *made = calloc(1, sizeof *made);
    if (made == NULL || atomic_fetch_add(&living, 1) >= atoi(most)) {
        atomic_fetch_sub(&living, 1);
        free(made);
        return EAGAIN;
    }
    made->fn = fn;
    made->user = user;
    const int result = real(&made->thread, attributes, live, made);
    *thread = made->thread;
    made->next = atomic_load(&calls);
    while (!atomic_compare_exchange_weak(&calls, &made->next, made)) {
    }
    return result;
}

/* Like the system's own, this may return while the thread still counts. */
int pthread_join(pthread_t thread, void **result) {
    int (*real)(pthread_t, void **);
    void *found = next("pthread_join");
    memcpy(&real, &found, sizeof real);
    call *made = getenv("LINGER") != NULL ? atomic_load(&calls) : NULL;
    while (made != NULL && !pthread_equal(made->thread, thread)) {
        made = made->next;
    }
    if (made == NULL) {
        return real(thread, result);
    }
    while (atomic_load(&made->ended) == 0) {
        usleep(100);
    }
    if (result != NULL) {
        *result = made->result;
    }
    return pthread_detach(thread);
}

int memfd_create(const char *name, unsigned flags) {
    int (*real)(const char *, unsigned);
    void *found = next("memfd_create");
    memcpy(&real, &found, sizeof real);
    if (getenv("REFUSE_MEMFD") != NULL) {
        errno = ENOSYS;
        return -1;
    }
    return real(name, flags);
}

/* glibc's own functions, because dlsym() would allocate. */
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *old, size_t size);
void *__libc_memalign(size_t alignment, size_t size);

static atomic_long allocations;
static long refused_allocation; /* 0: none */

static __attribute__((constructor)) void begin(void) {
    const char *text = getenv("VSH_TEST_MALLOC"), *program = getenv("VSH_TEST_PROGRAM");
    const int meant = text != NULL && program != NULL && strcmp(program, program_invocation_short_name) == 0;
    refused_allocation = meant ? atol(text) : 0;
    atomic_store(&allocations, 0);
}

static int refuses(void) {
    if (refused_allocation == 0 || atomic_fetch_add(&allocations, 1) + 1 != refused_allocation) {
        return 0;
    }
    errno = ENOMEM;
    return 1;
}

void *malloc(size_t size) {
    return refuses() ? NULL : __libc_malloc(size);
}

void *calloc(size_t count, size_t size) {
    return refuses() ? NULL : __libc_calloc(count, size);
}

void *realloc(void *old, size_t size) {
    return refuses() ? NULL : __libc_realloc(old, size);
}

void *aligned_alloc(size_t alignment, size_t size) {
    return refuses() ? NULL : __libc_memalign(alignment, size);
}

int posix_memalign(void **block, size_t alignment, size_t size) {
    void *made = aligned_alloc(alignment, size);
    *block = made != NULL ? made : *block;
    return made != NULL ? 0 : ENOMEM;
}

static void tell(const char *call, const char *name) {
    const char *path = getenv("TELL_SYNCS");
    FILE *file = path != NULL ? fopen(path, "a") : NULL;
    if (file != NULL) {
        fprintf(file, "%s %s\n", call, name);
        fclose(file);
    }
}

static int sync_with(const char *call, int file) {
    char link[64], name[PATH_MAX] = "";
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    if (readlink(link, name, sizeof name - 1) > 0) {
        tell(call, name);
    }
    int (*real)(int);
    void *found = next(call);
    memcpy(&real, &found, sizeof real);
    return real(file);
}

int fsync(int file) {
    return sync_with("fsync", file);
}

int fdatasync(int file) {
    return sync_with("fdatasync", file);
}

int rename(const char *from, const char *to) {
    tell("rename", to);
    int (*real)(const char *, const char *);
    void *found = next("rename");
    memcpy(&real, &found, sizeof real);
    return real(from, to);
}
