/* Which edges of a mesh hold together: vertices are welded where their positions are equal, then every edge's
 * triangles are counted by direction. An edge met by an odd number of triangles is a border; one whose
 * triangles run along it more often one way than the other joins triangles that disagree about the outside.
 */
#include "base/hash.h"
#include "base/memory.h"
#include "base/try.h"
#include "mesh/mesh.h"

#include <stdlib.h>
#include <string.h>

static uint64_t hash_position(const float *p) {
    uint32_t bits[3];
    for (int k = 0; k < 3; ++k) {
        const float value = p[k] == 0.0F ? 0.0F : p[k]; /* -0 equals 0 */
        memcpy(&bits[k], &value, sizeof value);
    }
    return vshi_mix(vshi_mix((uint64_t)bits[0] << 32 | bits[1]) + bits[2] + UINT64_C(0x9e3779b97f4a7c15));
}

vsh_result vshi_mesh_weld(const vsh_mesh *mesh, uint32_t *weld, vsh_error *error) {
    size_t capacity = 16;
    while (capacity < 2 * mesh->vertex_count) {
        capacity *= 2;
    }
    uint32_t *slots = NULL; /* vertex + 1, or 0 where empty; a power of two, at most half full */
    VSHI_TRY(vshi_allocate((void **)&slots, capacity, sizeof *slots, "welding vertices", error));
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        const float *p = mesh->positions + 3 * v;
        size_t slot = (size_t)hash_position(p) & (capacity - 1);
        weld[v] = (uint32_t)v;
        for (; slots[slot] != 0; slot = (slot + 1) & (capacity - 1)) {
            const uint32_t other = slots[slot] - 1;
            const float *q = mesh->positions + 3 * (size_t)other;
            if (p[0] == q[0] && p[1] == q[1] && p[2] == q[2]) {
                weld[v] = other;
                break;
            }
        }
        if (slots[slot] == 0) {
            slots[slot] = (uint32_t)v + 1;
        }
    }
    free(slots);
    return VSH_OK;
}

/* One triangle's use of an edge, filed under the edge's lower vertex. Sorted by the upper vertex. */
typedef struct edge_use {
    uint32_t upper;
    uint8_t downwards; /* the triangle runs from the upper to the lower vertex */
    uint8_t flat;      /* the triangle is degenerate, though its vertices are distinct */
} edge_use;

static int compare_uses(const void *a, const void *b) {
    const uint32_t x = ((const edge_use *)a)->upper;
    const uint32_t y = ((const edge_use *)b)->upper;
    return (x > y) - (x < y);
}

static void sort_uses(edge_use *uses, size_t count) {
    enum { FEW = 24 };
    if (count > FEW) {
        qsort(uses, count, sizeof *uses, compare_uses);
        return;
    }
    for (size_t i = 1; i < count; ++i) {
        const edge_use use = uses[i];
        size_t k = i;
        for (; k > 0 && uses[k - 1].upper > use.upper; --k) {
            uses[k] = uses[k - 1];
        }
        uses[k] = use;
    }
}

typedef struct edge_count {
    size_t open;
    size_t flipped;
} edge_count;

static void count_edge(edge_count *count, size_t upwards, size_t downwards) {
    if ((upwards + downwards) % 2 != 0) {
        ++count->open;
    } else if (upwards != downwards) {
        ++count->flipped;
    }
}

/* Counts the edges of one lower vertex, without and with the flat triangles. */
static void count_uses(const edge_use *uses, size_t count, edge_count *solid, edge_count *all) {
    for (size_t i = 0; i < count;) {
        size_t runs[2][2] = {{0, 0}, {0, 0}}; /* [flat][downwards] */
        const uint32_t upper = uses[i].upper;
        for (; i < count && uses[i].upper == upper; ++i) {
            ++runs[uses[i].flat][uses[i].downwards];
        }
        count_edge(solid, runs[0][0], runs[0][1]);
        count_edge(all, runs[0][0] + runs[1][0], runs[0][1] + runs[1][1]);
    }
}

/* The three welded vertices of a triangle; false where two are one, so that its edges cancel out. */
static bool welded_triangle(const vsh_mesh *mesh, const uint32_t *weld, size_t i, uint32_t vertex[3]) {
    for (int k = 0; k < 3; ++k) {
        vertex[k] = weld[mesh->indices[3 * i + (size_t)k]];
    }
    return vertex[0] != vertex[1] && vertex[1] != vertex[2] && vertex[2] != vertex[0];
}

vsh_result vshi_mesh_count_edges(const vsh_mesh *mesh, vsh_mesh_report *report, vsh_error *error) {
    report->open_edges = 0;
    report->flipped_edges = 0;
    if (mesh->triangle_count == 0) {
        return VSH_OK;
    }
    uint32_t *weld = NULL;
    size_t *ends = NULL; /* ends[v]: past the last use filed under v, once filled */
    edge_use *uses = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&weld, mesh->vertex_count, sizeof *weld, "welded vertices", error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&ends, mesh->vertex_count + 1, sizeof *ends, "edges of vertices", error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&uses, 3 * mesh->triangle_count, sizeof *uses, "edges of triangles", error));
    VSHI_TRY_DONE(vshi_mesh_weld(mesh, weld, error));

    uint32_t vertex[3];
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        if (welded_triangle(mesh, weld, i, vertex)) {
            for (int k = 0; k < 3; ++k) {
                const uint32_t a = vertex[k], b = vertex[(k + 1) % 3];
                ++ends[(a < b ? a : b) + (size_t)1];
            }
        }
    }
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        ends[v + 1] += ends[v];
    }
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        if (welded_triangle(mesh, weld, i, vertex)) {
            const uint8_t flat = vshi_mesh_degenerate(mesh, i);
            for (int k = 0; k < 3; ++k) {
                const uint32_t a = vertex[k], b = vertex[(k + 1) % 3];
                uses[ends[a < b ? a : b]++] = (edge_use){a < b ? b : a, a > b, flat};
            }
        }
    }

    edge_count solid = {0, 0}, all = {0, 0};
    for (size_t v = 0, begin = 0; v < mesh->vertex_count; begin = ends[v], ++v) {
        sort_uses(uses + begin, ends[v] - begin);
        count_uses(uses + begin, ends[v] - begin, &solid, &all);
    }
    /* A triangle whose corners lie on a line casts nothing, but it may be what joins two long edges to one: a
     * mesh that is closed with such triangles or without them is closed. */
    const bool with_flat = all.open < solid.open;
    report->open_edges = with_flat ? all.open : solid.open;
    report->flipped_edges = with_flat ? all.flipped : solid.flipped;

done:
    free(uses);
    free(ends);
    free(weld);
    return result;
}
