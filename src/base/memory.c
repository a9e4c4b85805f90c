#define _GNU_SOURCE /* O_TMPFILE */
#include "base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

enum { ALIGNMENT = 64 };

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

vsh_result vshi_copy_text(char **copy, const char *text, const char *what, vsh_error *error) {
    const size_t size = strlen(text) + 1;
    VSHI_TRY(vshi_allocate((void **)copy, size, 1, what, error));
    memcpy(*copy, text, size);
    return VSH_OK;
}

vsh_result vshi_allocate_all(const vshi_array *arrays, size_t count, const char *what, vsh_error *error) {
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY(vshi_allocate(arrays[i].memory, arrays[i].count, arrays[i].size, what, error));
    }
    return VSH_OK;
}

vsh_result vshi_allocate_block(const vshi_array *arrays, size_t count, const char *what, vsh_error *error) {
    size_t bytes = ALIGNMENT; /* never empty, so that the first array is never NULL */
    for (size_t i = 0; i < count; ++i) {
        size_t own;
        *arrays[i].memory = NULL;
        if (__builtin_mul_overflow(arrays[i].count, arrays[i].size, &own) || own > SIZE_MAX / 2 - bytes) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "%s: more bytes than this machine can address", what);
        }
        bytes += (own + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    }
    unsigned char *at;
    VSHI_TRY(vshi_allocate((void **)&at, bytes, 1, what, error));
    for (size_t i = 0; i < count; ++i) {
        *arrays[i].memory = at;
        at += (arrays[i].count * arrays[i].size + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
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

/* --- stores */

/* Creates a file without a name, which ends with this process. Returns -1 with errno if that fails. */
static int create_file(const char *folder) {
    const int file = open(folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (file >= 0 || (errno != EOPNOTSUPP && errno != EISDIR && errno != ENOENT)) {
        return file;
    }
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%s/.vdbshade.XXXXXX", folder);
    const int named = mkostemp(path, O_CLOEXEC);
    if (named >= 0) {
        unlink(path);
    }
    return named;
}

/* Maps memory or a file. The system zeroes pages at the first write, so a part of a bake pays only for pages
 * that it uses. */
static vsh_result map_array(const vshi_store *store, vshi_stored *stored, const char *what,
                            vsh_error *error) {
    const int file = stored->in_memory ? -1 : create_file(store->folder);
    const int flags = stored->in_memory ? MAP_PRIVATE | MAP_ANONYMOUS : MAP_SHARED;
    int why = stored->in_memory ? 0 : file < 0 ? errno : posix_fallocate(file, 0, (off_t)stored->bytes);
    if (why == 0) {
        stored->memory = mmap(NULL, stored->bytes, PROT_READ | PROT_WRITE, flags, file, 0);
        why = stored->memory == MAP_FAILED ? errno : 0;
    }
    if (file >= 0) {
        close(file); /* the mapping keeps it */
    }
    return why == 0 ? VSH_OK
           : stored->in_memory
               ? vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused %zu bytes", what, stored->bytes)
               : vshi_fail(
                     error, VSH_ERROR_WRITE,
                     "%s: %.0f MB, for which --memory-limit has no room, do not fit into a file in %s: %s",
                     what, (double)stored->bytes / 1e6, store->folder, strerror(why));
}

vsh_result vshi_store_take(vshi_store *store, void **memory, size_t count, size_t size, const char *what,
                           vsh_error *error) {
    *memory = NULL;
    if (count == 0) {
        return VSH_OK;
    }
    vshi_stored *list = realloc(store->list, (store->count + 1) * sizeof *list);
    if (list == NULL) {
        return vshi_fail_memory(error, what);
    }
    store->list = list;
    vshi_stored stored = {.bytes = count * size};
    const double bytes = (double)count * (double)size;
    if (bytes >= (double)SIZE_MAX / 2.0) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: %g bytes are more than there can be", what, bytes);
    }
    /* If files are possible, planes leave an eighth of the limit to samples, charts and casters. */
    const double room = (store->folder != NULL ? 8.0 / 7.0 : 1.0) * (bytes + (double)store->held);
    const vsh_result fits = vshi_check_limit(store->run, room, what, error);
    if (fits != VSH_OK && store->folder == NULL) {
        return fits;
    }
    stored.in_memory = fits == VSH_OK;
    VSHI_TRY(map_array(store, &stored, what, error));
    store->held += stored.in_memory ? stored.bytes : 0;
    list[store->count++] = stored;
    *memory = stored.memory;
    return VSH_OK;
}

static void release(vshi_store *store, const vshi_stored *stored) {
    munmap(stored->memory, stored->bytes);
    store->held -= stored->in_memory ? stored->bytes : 0;
}

void vshi_store_give(vshi_store *store, void *memory) {
    for (size_t i = 0; memory != NULL && i < store->count; ++i) {
        if (store->list[i].memory == memory) {
            release(store, &store->list[i]);
            store->list[i] = store->list[--store->count];
            return;
        }
    }
}

void vshi_store_close(vshi_store *store) {
    for (size_t i = 0; i < store->count; ++i) {
        release(store, &store->list[i]);
    }
    free(store->list);
    store->list = NULL;
    store->count = 0;
}
