#include "mesh/weld.h"

#include "base/hash.h"
#include "base/memory.h"
#include "mesh/mesh.h"

#include <stdlib.h>
#include <string.h>

vsh_result vshi_weld(size_t count, vshi_key_fn *key_of, const void *user, uint32_t *weld, vsh_error *error) {
    size_t capacity = 16;
    while (capacity < 2 * count) {
        capacity *= 2;
    }
    uint32_t *slots = NULL; /* vertex + 1, or 0 where empty */
    VSHI_TRY(vshi_allocate((void **)&slots, capacity, sizeof *slots, "welding vertices", error));
    for (size_t v = 0; v < count; ++v) {
        uint64_t key[VSHI_KEY_WORDS], other[VSHI_KEY_WORDS], hash = 1;
        key_of(user, v, key);
        for (int k = 0; k < VSHI_KEY_WORDS; ++k) {
            hash = vshi_mix(hash ^ key[k]);
        }
        size_t slot = (size_t)hash & (capacity - 1);
        for (; slots[slot] != 0; slot = (slot + 1) & (capacity - 1)) {
            key_of(user, slots[slot] - 1, other);
            if (memcmp(key, other, sizeof key) == 0) {
                break;
            }
        }
        if (slots[slot] == 0) {
            slots[slot] = (uint32_t)v + 1;
        }
        weld[v] = slots[slot] - 1;
    }
    free(slots);
    return VSH_OK;
}

static void key_of_place(const void *user, size_t vertex, uint64_t key[VSHI_KEY_WORDS]) {
    const float *p = (const float *)user + 3 * vertex;
    const float place[2 * VSHI_KEY_WORDS] = {p[0] + 0.0f, p[1] + 0.0f, p[2] + 0.0f}; /* -0 is 0 */
    memcpy(key, place, sizeof place);
}

vsh_result vshi_mesh_weld(const vsh_mesh *mesh, uint32_t *weld, vsh_error *error) {
    return vshi_weld(mesh->vertex_count, key_of_place, mesh->positions, weld, error);
}

void vshi_list_groups(const uint32_t *group, size_t count, uint32_t groups, uint32_t *begin, uint32_t *list) {
    for (size_t i = 0; i < count; ++i) {
        if (group[i] != UINT32_MAX) {
            ++begin[group[i] + (size_t)2];
        }
    }
    for (size_t g = 0; g < groups; ++g) {
        begin[g + 2] += begin[g + 1];
    }
    for (size_t i = 0; i < count; ++i) {
        if (group[i] != UINT32_MAX) {
            list[begin[group[i] + (size_t)1]++] = (uint32_t)i;
        }
    }
}

/* Sorts sides by one of their ends, and leaves those alike in order; `from` NULL: as they are numbered.
 * Vertices near each other in a mesh mostly have numbers near each other, so that memory is gone through in
 * order, which a hash table's is not. */
static void sort_by_end(const vshi_sorted_sides *sides, int end, const uint32_t *from, uint32_t *first,
                        uint32_t *sorted) {
    const uint32_t count = (uint32_t)(3 * sides->triangle_count);
    uint32_t ends[2];
    memset(first, 0, (sides->vertex_count + 1) * sizeof *first);
    for (uint32_t side = 0; side < count; ++side) {
        vshi_side_ends(sides->corners, side, ends);
        ++first[ends[end] + (size_t)1];
    }
    for (size_t v = 0; v < sides->vertex_count; ++v) {
        first[v + 1] += first[v];
    }
    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t side = from != NULL ? from[i] : i;
        vshi_side_ends(sides->corners, side, ends);
        sorted[first[ends[end]]++] = side;
    }
}

vsh_result vshi_sort_sides(vshi_sorted_sides *sides, vsh_error *error) {
    const char *what = "edges of triangles";
    const size_t count = 3 * sides->triangle_count;
    uint32_t *first = NULL, *by_higher = NULL;
    if (sides->triangle_count > UINT32_MAX / 3) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %zu triangles, at most %u", what, sides->triangle_count,
                         UINT32_MAX / 3);
    }
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&first, sides->vertex_count + 1, sizeof *first, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&by_higher, count, sizeof *by_higher, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&sides->sorted, count, sizeof *sides->sorted, what, error));
    sort_by_end(sides, 1, NULL, first, by_higher);
    sort_by_end(sides, 0, by_higher, first, sides->sorted);
done:
    free(by_higher);
    free(first);
    return result;
}
