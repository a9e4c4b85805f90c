/* malloc() and the like for the two programs, not for the library. Foreign libraries do not survive refused
 * memory: OpenVDB, GLib and log4cplus end the process, Blosc writes through NULL, C++ streams drop text. So
 * the program ends when a block is refused to anybody but this library, whose code returns VSH_ERROR_MEMORY.
 */
#define _GNU_SOURCE /* RTLD_NEXT, dladdr */
#include "base/memory.h"

#include <dlfcn.h>
#include <malloc.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* The next definition: that of libc, a sanitizer, or an allocator that was preloaded. */
static void *find_next(_Atomic(void *) *found, const char *name) {
    void *next = atomic_load(found);
    if (next == NULL) {
        next = dlsym(RTLD_NEXT, name);
        atomic_store(found, next);
    }
    return next;
}

#define NEXT(name, to)                                                                                       \
    static _Atomic(void *) found;                                                                            \
    void *symbol = find_next(&found, #name);                                                                 \
    memcpy(&(to), &symbol, sizeof(to))

static bool is_library(const void *caller) {
    Dl_info info;
    const char *slash = dladdr(caller, &info) != 0 ? strrchr(info.dli_fname, '/') : NULL;
    return slash != NULL && strncmp(slash, "/libvdbshade", strlen("/libvdbshade")) == 0;
}

static void *check(void *block, size_t size, const void *caller) {
    if (block == NULL && size > 0 && !is_library(caller)) {
        vshi_memory_refused(size);
    }
    return block;
}

VSHI_SHARED void *malloc(size_t size) {
    void *(*next)(size_t);
    NEXT(malloc, next);
    return check(next(size), size, __builtin_return_address(0));
}

VSHI_SHARED void *calloc(size_t count, size_t size) {
    void *(*next)(size_t, size_t);
    NEXT(calloc, next);
    return check(next(count, size), count * size, __builtin_return_address(0));
}

VSHI_SHARED void *realloc(void *block, size_t size) {
    void *(*next)(void *, size_t);
    NEXT(realloc, next);
    return check(next(block, size), size, __builtin_return_address(0));
}

VSHI_SHARED void *memalign(size_t alignment, size_t size) {
    void *(*next)(size_t, size_t);
    NEXT(memalign, next);
    return check(next(alignment, size), size, __builtin_return_address(0));
}

VSHI_SHARED void *aligned_alloc(size_t alignment, size_t size) {
    void *(*next)(size_t, size_t);
    NEXT(aligned_alloc, next);
    return check(next(alignment, size), size, __builtin_return_address(0));
}

VSHI_SHARED int posix_memalign(void **block, size_t alignment, size_t size) {
    int (*next)(void **, size_t, size_t);
    NEXT(posix_memalign, next);
    const int code = next(block, alignment, size);
    check(code == 0 ? *block : NULL, size, __builtin_return_address(0));
    return code;
}
