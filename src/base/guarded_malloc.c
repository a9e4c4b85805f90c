/* malloc() and the like for the two programs, not for the library. Other libraries do not survive refused
 * memory: OpenVDB, GLib and log4cplus end the process, Blosc writes through NULL, C++ streams drop text. So
 * the program ends if another library is refused a block. Our library returns VSH_ERROR_MEMORY itself. */
#define _GNU_SOURCE /* RTLD_NEXT, dladdr */
#include "base/memory.h"

#include <dlfcn.h>
#include <malloc.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

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

/* Finds the next definition, of libc, a sanitizer or a preloaded allocator, and stores it in the function
 * pointer. */
static void find_next(_Atomic(void *) *found, const char *name, void *function) {
    void *next = atomic_load(found);
    if (next == NULL) {
        next = dlsym(RTLD_NEXT, name);
        atomic_store(found, next);
    }
    memcpy(function, &next, sizeof next);
}

/* Defines a function that calls the next definition and checks the block. */
#define GUARD(name, parameters, arguments, size)                                                             \
    VSHI_SHARED void *name parameters {                                                                      \
        static _Atomic(void *) found;                                                                        \
        void *(*next)parameters;                                                                             \
        find_next(&found, #name, &next);                                                                     \
        return check(next arguments, size, __builtin_return_address(0));                                     \
    }

GUARD(malloc, (size_t size), (size), size)
GUARD(calloc, (size_t count, size_t size), (count, size), count *size)
GUARD(realloc, (void *block, size_t size), (block, size), size)
GUARD(memalign, (size_t alignment, size_t size), (alignment, size), size)
GUARD(aligned_alloc, (size_t alignment, size_t size), (alignment, size), size)

VSHI_SHARED int posix_memalign(void **block, size_t alignment, size_t size) {
    static _Atomic(void *) found;
    int (*next)(void **, size_t, size_t);
    find_next(&found, "posix_memalign", &next);
    const int code = next(block, alignment, size);
    check(code == 0 ? *block : NULL, size, __builtin_return_address(0));
    return code;
}
