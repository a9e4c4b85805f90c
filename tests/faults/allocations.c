/* Allocations that fail, and blocks that are counted (scenarios.h). */
#include "scenarios.h"

#include <errno.h>
#include <pthread.h>

enum { ROOM = 1 << 20 }; /* live blocks at a time, twice */

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static struct {
    bool on, all;
    uint64_t first, count, failed;
    uint64_t live;
    void *blocks[ROOM]; /* open addressing; a freed place holds `gone` */
} state;
static char gone;

/* The linker names the library's function __real_…, and the one of this file __wrap_…. */
#define WRAPPED(type, function, ...)                                                                         \
    type __real_##function(__VA_ARGS__);                                                                     \
    type __wrap_##function(__VA_ARGS__);
WRAPPED(void *, malloc, size_t size)
WRAPPED(void *, calloc, size_t count, size_t size)
WRAPPED(void *, realloc, void *old, size_t size)
WRAPPED(void *, aligned_alloc, size_t alignment, size_t size)
WRAPPED(int, posix_memalign, void **block, size_t alignment, size_t size)
WRAPPED(char *, strdup, const char *text)
WRAPPED(char *, strndup, const char *text, size_t size)
WRAPPED(void, free, void *block)

void faults_begin(uint64_t first, int all) {
    pthread_mutex_lock(&lock);
    state.on = true;
    state.all = all != 0;
    state.first = first;
    state.count = state.failed = 0;
    pthread_mutex_unlock(&lock);
}

uint64_t faults_end(uint64_t *failed) {
    pthread_mutex_lock(&lock);
    state.on = false;
    *failed = state.failed;
    const uint64_t count = state.count;
    pthread_mutex_unlock(&lock);
    return count;
}

uint64_t faults_live(void) {
    pthread_mutex_lock(&lock);
    const uint64_t live = state.live;
    pthread_mutex_unlock(&lock);
    return live;
}

static bool refused(void) {
    pthread_mutex_lock(&lock);
    bool refuse = false;
    if (state.on) {
        ++state.count;
        refuse = state.first > 0 && (state.all ? state.count >= state.first : state.count == state.first);
        state.failed += refuse;
    }
    pthread_mutex_unlock(&lock);
    if (refuse) {
        errno = ENOMEM;
    }
    return refuse;
}

static size_t place_of(const void *block) {
    return (size_t)(((uintptr_t)block >> 4) * 0x9e3779b97f4a7c15u >> 44);
}

static void *note(void *block) {
    if (block != NULL) {
        pthread_mutex_lock(&lock);
        size_t place = place_of(block);
        while (state.blocks[place] != NULL && state.blocks[place] != &gone) {
            place = (place + 1) % ROOM;
        }
        state.blocks[place] = block;
        ++state.live;
        pthread_mutex_unlock(&lock);
    }
    return block;
}

/* Forgets a block. Blocks that a library allocated and we free are not in the table. */
static void forget(const void *block) {
    if (block != NULL) {
        pthread_mutex_lock(&lock);
        size_t place = place_of(block);
        while (state.blocks[place] != NULL && state.blocks[place] != block) {
            place = (place + 1) % ROOM;
        }
        if (state.blocks[place] == block) {
            const bool last = state.blocks[(place + 1) % ROOM] == NULL;
            state.blocks[place] = last ? NULL : (void *)&gone;
            --state.live;
        }
        pthread_mutex_unlock(&lock);
    }
}

void *__wrap_malloc(size_t size) {
    return refused() ? NULL : note(__real_malloc(size));
}

void *__wrap_calloc(size_t count, size_t size) {
    return refused() ? NULL : note(__real_calloc(count, size));
}

void *__wrap_realloc(void *old, size_t size) {
    if (refused()) {
        return NULL;
    }
    forget(old);
    void *block = __real_realloc(old, size);
    return note(block != NULL || size == 0 ? block : old);
}

void *__wrap_aligned_alloc(size_t alignment, size_t size) {
    return refused() ? NULL : note(__real_aligned_alloc(alignment, size));
}

int __wrap_posix_memalign(void **block, size_t alignment, size_t size) {
    if (refused()) {
        return ENOMEM;
    }
    const int code = __real_posix_memalign(block, alignment, size);
    if (code == 0) {
        note(*block);
    }
    return code;
}

char *__wrap_strdup(const char *text) {
    return refused() ? NULL : note(__real_strdup(text));
}

char *__wrap_strndup(const char *text, size_t size) {
    return refused() ? NULL : note(__real_strndup(text, size));
}

void __wrap_free(void *block) {
    forget(block);
    __real_free(block);
}
