#define _GNU_SOURCE /* O_TMPFILE */
#include "base/store.h"

#include "base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

/* A file that nobody else sees and that is gone with this process; -1: errno says why there is none. */
static int create_file(const char *folder) {
    const int file = open(folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (file >= 0 || (errno != EOPNOTSUPP && errno != EISDIR && errno != ENOENT)) {
        return file;
    }
    char *path = NULL;
    if (asprintf(&path, "%s/.vdbshade.XXXXXX", folder) < 0) {
        errno = ENOMEM;
        return -1;
    }
    const int named = mkostemp(path, O_CLOEXEC);
    if (named >= 0) {
        unlink(path);
    }
    free(path);
    return named;
}

/* The system zeroes pages as they are first written, so a part of a bake pays only for pages that it uses. */
static vsh_result map_memory(vshi_store *store, vshi_stored *stored, const char *what, vsh_error *error) {
    stored->memory = mmap(NULL, stored->bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (stored->memory == MAP_FAILED) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused %zu bytes", what, stored->bytes);
    }
    stored->in_memory = true;
    store->held += stored->bytes;
    return VSH_OK;
}

static vsh_result map_file(const vshi_store *store, vshi_stored *stored, const char *what, vsh_error *error) {
    const int file = create_file(store->folder);
    int why = file < 0 ? errno : posix_fallocate(file, 0, (off_t)stored->bytes);
    void *memory = MAP_FAILED;
    if (why == 0) {
        memory = mmap(NULL, stored->bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
        why = memory == MAP_FAILED ? errno : 0;
    }
    if (file >= 0) {
        close(file); /* the mapping keeps it */
    }
    if (why != 0) {
        return vshi_fail(
            error, VSH_ERROR_WRITE,
            "%s: %.0f MB, for which --memory-limit has no room, cannot be held in a file in %s: %s", what,
            (double)stored->bytes / 1e6, store->folder, strerror(why));
    }
    stored->memory = memory;
    return VSH_OK;
}

vsh_result vshi_store_take(vshi_store *store, void **memory, size_t count, size_t size, const char *what,
                           vsh_error *error) {
    *memory = NULL;
    if (count == 0) {
        return VSH_OK;
    }
    vshi_stored *list = realloc(store->list, (store->count + 1) * sizeof *list);
    if (list == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", what);
    }
    store->list = list;
    vshi_stored stored = {.bytes = count * size};
    const double bytes = (double)count * (double)size;
    if (bytes >= (double)SIZE_MAX / 2.0) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: %g bytes are more than there can be", what, bytes);
    }
    /* With a file to turn to, planes leave an eighth of the limit to samples, charts and casters. */
    const double room = (store->folder != NULL ? 8.0 / 7.0 : 1.0) * (bytes + (double)store->held);
    const vsh_result fits = vshi_check_limit(store->run, room, what, error);
    if (fits == VSH_OK) {
        VSHI_TRY(map_memory(store, &stored, what, error));
    } else if (store->folder == NULL) {
        return fits;
    } else {
        VSHI_TRY(map_file(store, &stored, what, error));
    }
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
