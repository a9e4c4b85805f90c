#define _DEFAULT_SOURCE
#include "base/memory.h"

#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>

enum { ALIGNMENT = 64, LARGE_PAGE = 2 << 20 /* x86-64 */ };

vsh_result vshi_allocate(void **memory, size_t count, size_t size, const char *what, vsh_error *error) {
    *memory = NULL;
    if (count == 0) {
        return VSH_OK;
    }
    size_t bytes;
    if (__builtin_mul_overflow(count, size, &bytes) || bytes > SIZE_MAX - ALIGNMENT) {
        return vshi_fail(error, VSH_ERROR_MEMORY,
                         "%s: %zu × %zu bytes are more than this machine can address", what, count, size);
    }
    bytes = (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    *memory = aligned_alloc(ALIGNMENT, bytes);
    if (*memory == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused %zu bytes", what, bytes);
    }
    memset(*memory, 0, bytes);
    return VSH_OK;
}

vsh_result vshi_allocate_all(const vshi_array *arrays, size_t count, const char *what, vsh_error *error) {
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY(vshi_allocate(arrays[i].memory, arrays[i].count, arrays[i].size, what, error));
    }
    return VSH_OK;
}

vsh_result vshi_make_room(void **array, size_t count, size_t *capacity, size_t size, const char *what,
                          vsh_error *error) {
    if (count < *capacity) {
        return VSH_OK;
    }
    const size_t more = *capacity > 0 ? 2 * *capacity : 4;
    void *grown;
    VSHI_TRY(vshi_allocate(&grown, more, size, what, error));
    if (count > 0) {
        memcpy(grown, *array, count * size);
    }
    free(*array);
    *array = grown;
    *capacity = more;
    return VSH_OK;
}

vsh_result vshi_take_pages(void **memory, size_t bytes, const char *what, vsh_error *error) {
    const bool large = bytes >= 2 * (size_t)LARGE_PAGE && bytes <= SIZE_MAX / 2;
    const size_t pages = large ? (bytes + LARGE_PAGE - 1) / LARGE_PAGE * LARGE_PAGE : 0;
    *memory = large ? aligned_alloc(LARGE_PAGE, pages) : malloc(bytes > 0 ? bytes : 1);
    if (*memory == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused %zu bytes", what, bytes);
    }
    if (large) {
        madvise(*memory, pages, MADV_HUGEPAGE); /* where that is refused, small ones do */
    }
    return VSH_OK;
}

uint64_t vshi_memory_left(const vsh_run *run) {
    return run->memory_held < run->memory_limit ? run->memory_limit - run->memory_held
                                                : (uint64_t)(run->memory_limit > 0);
}

vsh_result vshi_check_limit(const vsh_run *run, double bytes, const char *what, vsh_error *error) {
    if (run == NULL || run->memory_limit == 0) {
        return VSH_OK;
    }
    bytes += (double)run->memory_held;
    if (bytes <= (double)run->memory_limit) {
        return VSH_OK;
    }
    const int decimals = run->memory_limit < 1000000 ? 3 : 0;
    return vshi_fail(error, VSH_ERROR_LIMIT, "%s: about %.*f MB are needed, over the memory limit of %.*f MB",
                     what, decimals, bytes / 1e6, decimals, (double)run->memory_limit / 1e6);
}

uint64_t vshi_peak_bytes(void) {
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) == 0 ? (uint64_t)usage.ru_maxrss * 1024 : 0;
}
