#include "unwrap/cut_mesh.h"

#include "base/hash.h"
#include "base/memory.h"
#include "base/try.h"
#include "mesh/edges.h"

#include <stdlib.h>

enum { MOST_LAYERS = 16 }; /* triangles that lie on more copies hang together with none */

/* Corners of a triangle as places, the least first in each order. */
typedef struct corners {
    uint32_t v[3];
} corners;

static corners sorted(uint32_t a, uint32_t b, uint32_t c) {
    uint32_t low = a < b ? a : b, high = a < b ? b : a;
    const uint32_t middle = c < low ? low : c > high ? high : c;
    low = c < low ? c : low;
    high = c > high ? c : high;
    return (corners){{low, middle, high}};
}

static uint64_t hash(corners c) {
    return vshi_mix(vshi_mix((uint64_t)c.v[0] << 32 | c.v[1]) + c.v[2] + UINT64_C(0x9e3779b97f4a7c15));
}

/* layer[i]: how many triangles before have the same corners, whichever way they look. Returns the number of
 * layers. */
static vsh_result find_layers(const vsh_mesh *mesh, const uint32_t *weld, uint8_t *layer, int *layers,
                              vsh_error *error) {
    size_t capacity = 16;
    while (capacity < 2 * mesh->triangle_count) {
        capacity *= 2;
    }
    uint32_t *slots = NULL; /* the last triangle with these corners + 1, or 0 */
    VSHI_TRY(vshi_allocate((void **)&slots, capacity, sizeof *slots, "copies of triangles", error));
    *layers = 1;
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        const uint32_t *v = mesh->indices + 3 * i;
        const corners own = sorted(weld[v[0]], weld[v[1]], weld[v[2]]);
        size_t slot = (size_t)hash(own) & (capacity - 1);
        for (; slots[slot] != 0; slot = (slot + 1) & (capacity - 1)) {
            const uint32_t *w = mesh->indices + 3 * (size_t)(slots[slot] - 1);
            const corners other = sorted(weld[w[0]], weld[w[1]], weld[w[2]]);
            if (own.v[0] == other.v[0] && own.v[1] == other.v[1] && own.v[2] == other.v[2]) {
                const uint8_t before = layer[slots[slot] - 1];
                layer[i] = before < MOST_LAYERS ? (uint8_t)(before + 1) : before;
                *layers = layer[i] >= *layers ? layer[i] + 1 : *layers;
                break;
            }
        }
        slots[slot] = (uint32_t)i + 1;
    }
    free(slots);
    return VSH_OK;
}

/* Whether the two sides run between the same places, the other way. */
static bool opposite(const vsh_mesh *mesh, const uint32_t *weld, uint32_t a, uint32_t b) {
    const uint32_t *v = mesh->indices + 3 * (size_t)(a / 3), *w = mesh->indices + 3 * (size_t)(b / 3);
    return weld[v[a % 3]] == weld[w[(b + 1) % 3]] && weld[v[(a + 1) % 3]] == weld[w[b % 3]];
}

vsh_result vshi_sides_find(const vsh_mesh *mesh, size_t index, uint32_t *partner, vsh_error *error) {
    vsh_mesh local = *mesh; /* sides are of the mesh's own order, also where it is mirrored */
    local.transform = NULL;
    vshi_edges edges = {0};
    uint8_t *layer = NULL;
    uint32_t *weld = NULL;
    int layers = 1;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&layer, mesh->triangle_count, 1, "copies of triangles", error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&weld, mesh->vertex_count, sizeof *weld, "copies of triangles", error));
    VSHI_TRY_DONE(vshi_mesh_weld(&local, weld, error));
    VSHI_TRY_DONE(find_layers(&local, weld, layer, &layers, error));
    VSHI_TRY_DONE(
        vshi_edges_find(&local, index, layer, layers < MOST_LAYERS ? layers : MOST_LAYERS, &edges, error));
    for (uint32_t side = 0; side < 3 * (uint32_t)mesh->triangle_count; ++side) {
        const uint32_t other = edges.partner[side];
        const bool joined = other != VSHI_NO_PARTNER && opposite(&local, weld, side, other) &&
                            !vshi_mesh_degenerate(&local, side / 3) &&
                            !vshi_mesh_degenerate(&local, other / 3);
        partner[side] = joined ? other : UINT32_MAX;
    }
done:
    vshi_edges_free(&edges);
    free(weld);
    free(layer);
    return result;
}
