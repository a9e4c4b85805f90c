/* Connections of triangles: vertices at one place, triangles that share an edge, sets of connected triangles,
 * and the components of a mesh. */
#pragma once

#include "geometry/mesh.h"

#include <stdint.h>

/* Writes the key of a vertex. Vertices with equal keys are one. */
enum { VSHI_KEY_WORDS = 3 };
typedef void vshi_key_fn(const void *user, size_t vertex, uint64_t key[VSHI_KEY_WORDS]);

/* Sets weld[v] to the lowest of `count` vertices with the key of v. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_weld(size_t count, vshi_key_fn *key_of, const void *user, uint32_t *weld, vsh_error *error);

/* Lists 0 … count - 1 by groups, each group in ascending order: group g is list[begin[g]] … list[begin[g + 1]
 * - 1]. Skips group UINT32_MAX. All begin[groups + 2] must be 0 before. */
void vshi_list_groups(const uint32_t *group, size_t count, uint32_t groups, uint32_t *begin, uint32_t *list);

/* Side 3 i + k runs from corner k to corner k + 1 of triangle i. */
typedef struct vshi_sorted_sides {
    const uint32_t *corners; /* [triangle_count][3]: vertices, welded */
    size_t triangle_count;
    size_t vertex_count;
    uint32_t *sorted; /* [3 triangle_count]: edge by edge, each edge's sides in ascending order */
} vshi_sorted_sides;

/* Allocates and fills `sorted`, which the caller frees, even after a failure. Errors: VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY. */
vsh_result vshi_sort_sides(vshi_sorted_sides *sides, vsh_error *error);

/* The vertices of a side, the lower one first. */
static inline void vshi_side_ends(const uint32_t *corners, uint32_t side, uint32_t ends[2]) {
    const uint32_t a = corners[side], b = corners[side % 3 == 2 ? side - 2 : side + 1];
    ends[0] = a < b ? a : b;
    ends[1] = a < b ? b : a;
}

/* The end in `sorted` of the edge that begins at `begin`. */
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

/* Joins sets of triangles. A set's number is its lowest triangle, so the order of joins does not matter. At
 * first set[t] = t. */
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

/* --- the edges of a mesh */

#define VSHI_NO_PARTNER UINT32_MAX

/* Side 3 i + k of a mesh runs from corner k to corner k + 1 of triangle i, in the world's order. */
typedef struct vshi_edges {
    uint32_t *weld;    /* [vertex_count]: the lowest vertex at the same position (-0 is 0) */
    uint8_t *skipped;  /* [triangle_count]: no area, or a duplicate */
    uint32_t *first;   /* [triangle_count]: the first duplicate, or the triangle itself */
    uint8_t *doubled;  /* [triangle_count]: see vshi_components */
    uint32_t *partner; /* [3 triangle_count]: the side of the next triangle; VSHI_NO_PARTNER: open */
    size_t open;       /* sides without a partner, of triangles that are not skipped */
} vshi_edges;

/* VSH_ERROR_LIMIT if a mesh has too many triangles to number their sides. */
vsh_result vshi_edges_check(const vsh_mesh *mesh, size_t index, vsh_error *error);

/* Finds partners. With `copies_apart`, triangles with the same corners are in different layers, and partners
 * in one layer: copies, and faces in both directions, do not mix. Errors: of vshi_edges_check(),
 * VSH_ERROR_MEMORY. Free with vshi_edges_free(), even after a failure. */
vsh_result vshi_edges_find(const vsh_mesh *mesh, size_t index, bool copies_apart, vshi_edges *edges,
                           vsh_error *error);
void vshi_edges_free(vshi_edges *edges);

/* --- the components of a mesh: pieces connected by their edges, turned to face one way */

/* An open edge from vertex a to b, in the direction of its triangle once that is turned. */
typedef struct vshi_rim {
    uint32_t component;
    uint32_t a, b;
} vshi_rim;

typedef struct vshi_components {
    size_t count;
    uint8_t *turned;  /* [triangle_count]: runs against the others of its component */
    uint8_t *doubled; /* [triangle_count]: another one has the same corners and faces the other way */
    uint32_t *begin;  /* [count + 2] in `list` */
    uint32_t *list;   /* triangles by component, ascending */
    uint8_t *twisted; /* [at least count]: its faces cannot agree (a Moebius strip); no triangle is turned */
    vshi_rim *rims;   /* sorted by component, then by triangle */
    size_t rim_count;
} vshi_components;

/* Vertices at equal positions count as one. Two triangles at an edge are connected; of more, those with a
 * solid between them. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. Free with vshi_components_free(), even after
 * a failure. */
vsh_result vshi_components_find(const vsh_mesh *mesh, size_t index, vshi_components *found, vsh_error *error);
void vshi_components_free(vshi_components *components);
