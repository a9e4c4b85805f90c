/* A binary heap of things to do next, the least first; ties by number, so that no order of pushing shows. */
#ifndef VSHI_UNWRAP_HEAP_H
#define VSHI_UNWRAP_HEAP_H

#include "base/memory.h"

#include <stdint.h>
#include <stdlib.h>

typedef struct vshi_heap_entry {
    double key;
    uint32_t what, by;
} vshi_heap_entry;

typedef struct vshi_heap {
    vshi_heap_entry *entries;
    size_t count, capacity;
} vshi_heap;

static inline bool vshi_heap_before(const vshi_heap_entry *a, const vshi_heap_entry *b) {
    if (a->key != b->key) {
        return a->key < b->key;
    }
    return a->what != b->what ? a->what < b->what : a->by < b->by;
}

/* Errors: VSH_ERROR_MEMORY. */
static inline vsh_result vshi_heap_push(vshi_heap *heap, double key, uint32_t what, uint32_t by,
                                        vsh_error *error) {
    VSHI_TRY(vshi_make_room((void **)&heap->entries, heap->count, &heap->capacity, sizeof *heap->entries,
                            "growing charts", error));
    const vshi_heap_entry entry = {key, what, by};
    size_t at = heap->count++;
    for (size_t above; at > 0 && vshi_heap_before(&entry, &heap->entries[above = (at - 1) / 2]); at = above) {
        heap->entries[at] = heap->entries[above];
    }
    heap->entries[at] = entry;
    return VSH_OK;
}

/* The heap must not be empty. */
static inline vshi_heap_entry vshi_heap_pop(vshi_heap *heap) {
    const vshi_heap_entry least = heap->entries[0], last = heap->entries[--heap->count];
    size_t at = 0;
    for (size_t below; (below = 2 * at + 1) < heap->count; at = below) {
        if (below + 1 < heap->count && vshi_heap_before(&heap->entries[below + 1], &heap->entries[below])) {
            ++below;
        }
        if (!vshi_heap_before(&heap->entries[below], &last)) {
            break;
        }
        heap->entries[at] = heap->entries[below];
    }
    heap->entries[at] = last;
    return least;
}

#endif
