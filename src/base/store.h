/* Arrays as large as a lightmap. If seven eighths of the memory limit have no room for one, it lies in a file
 * without a name. */
#ifndef VSHI_STORE_H
#define VSHI_STORE_H

#include "base/error.h"

#include <stdbool.h>
#include <stddef.h>

typedef struct vshi_stored {
    void *memory;
    size_t bytes;
    bool in_memory; /* not in a file */
} vshi_stored;

/* Not for several threads at once. */
typedef struct vshi_store {
    const vsh_run *run; /* its limit holds for what is in memory, with run->memory_held; may be NULL */
    char *folder;       /* for the files; NULL: there are none */
    uint64_t held;      /* bytes in memory */
    vshi_stored *list;  /* [count] */
    size_t count;
} vshi_store;

/* Takes count × size bytes, zeroed; NULL where count is 0. Errors: VSH_ERROR_LIMIT (no room and no folder),
 * VSH_ERROR_MEMORY, VSH_ERROR_WRITE (no room in the folder), naming `what`. */
vsh_result vshi_store_take(vshi_store *store, void **memory, size_t count, size_t size, const char *what,
                           vsh_error *error);

/* Gives one back. NULL does nothing. */
void vshi_store_give(vshi_store *store, void *memory);

/* Gives all of them back. */
void vshi_store_close(vshi_store *store);

#endif
