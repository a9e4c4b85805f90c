/* Vertices that lie in one place, and triangles that share an edge. */
#ifndef VSHI_WELD_H
#define VSHI_WELD_H

#include "base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Writes the key of a vertex: vertices are one where their keys are equal. */
enum { VSHI_KEY_WORDS = 3 };
typedef void vshi_key_fn(const void *user, size_t vertex, uint64_t key[VSHI_KEY_WORDS]);

/* weld[v] = the lowest vertex with the key of v, of `count`. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_weld(size_t count, vshi_key_fn *key_of, const void *user, uint32_t *weld, vsh_error *error);

/* Lists 0 … count - 1 by their groups, each group in ascending order: group g is list[begin[g]] …
 * list[begin[g + 1] - 1]. Group UINT32_MAX is left out. begin[groups + 2] must be 0 before. */
void vshi_list_groups(const uint32_t *group, size_t count, uint32_t groups, uint32_t *begin, uint32_t *list);

/* Side 3 i + k runs from corner k to corner k + 1 of triangle i. */
typedef struct vshi_sorted_sides {
    const uint32_t *corners; /* [triangle_count][3]: vertices, welded */
    size_t triangle_count;
    size_t vertex_count;
    uint32_t *sorted; /* [3 triangle_count]: sides of one edge follow each other, in ascending order */
} vshi_sorted_sides;

/* Fills `sorted`, which it allocates; the caller frees it, after a failure too. Errors: VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY. */
vsh_result vshi_sort_sides(vshi_sorted_sides *sides, vsh_error *error);

/* The vertices of a side, the lower one first. */
static inline void vshi_side_ends(const uint32_t *corners, uint32_t side, uint32_t ends[2]) {
    const uint32_t a = corners[side], b = corners[side % 3 == 2 ? side - 2 : side + 1];
    ends[0] = a < b ? a : b;
    ends[1] = a < b ? b : a;
}

/* Where in `sorted` the edge after that at `begin` begins. */
static inline size_t vshi_next_edge(const vshi_sorted_sides *sides, size_t begin) {
    uint32_t first[2], other[2];
    vshi_side_ends(sides->corners, sides->sorted[begin], first);
    size_t end = begin + 1;
    for (; end < 3 * sides->triangle_count; ++end) {
        vshi_side_ends(sides->corners, sides->sorted[end], other);
        if (other[0] != first[0] || other[1] != first[1]) {
            break;
        }
    }
    return end;
}

/* Sets of triangles that are joined step by step: a set is known by its lowest triangle, so that no order of
 * joining shows. set[t] = t to begin with. */
static inline uint32_t vshi_set_of(uint32_t *set, uint32_t triangle) {
    while (set[triangle] != triangle) {
        set[triangle] = set[set[triangle]];
        triangle = set[triangle];
    }
    return triangle;
}

static inline void vshi_set_join(uint32_t *set, uint32_t a, uint32_t b) {
    a = vshi_set_of(set, a);
    b = vshi_set_of(set, b);
    set[a > b ? a : b] = a < b ? a : b;
}

#endif
