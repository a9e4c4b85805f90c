/* Several allocations in a row, one check at the end. */
#ifndef VSHI_BAKE_TAKE_H
#define VSHI_BAKE_TAKE_H

#include "base/memory.h"

/* As vshi_allocate(), but returns the memory and does nothing where *result is a failure already. */
static inline void *vshi_take(size_t count, size_t size, const char *what, vsh_result *result,
                              vsh_error *error) {
    void *memory = NULL;
    if (*result == VSH_OK) {
        *result = vshi_allocate(&memory, count, size, what, error);
    }
    return memory;
}

#endif
