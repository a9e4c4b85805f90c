/* Which edges of a mesh hold together: vertices are welded where their positions are equal, then every edge's
 * triangles are counted by direction. An edge met by an odd number of triangles is a border; one whose
 * triangles run along it more often one way than the other joins triangles that disagree about the outside.
 */
#include "base/memory.h"
#include "base/try.h"
#include "mesh/mesh.h"
#include "mesh/weld.h"

#include <stdlib.h>
#include <string.h>

static void key_of(const void *user, size_t vertex, uint64_t key[VSHI_KEY_WORDS]) {
    const float *p = (const float *)user + 3 * vertex;
    const float place[2 * VSHI_KEY_WORDS] = {p[0] + 0.0f, p[1] + 0.0f, p[2] + 0.0f}; /* -0 is 0 */
    memcpy(key, place, sizeof place);
}

vsh_result vshi_mesh_weld(const vsh_mesh *mesh, uint32_t *weld, vsh_error *error) {
    return vshi_weld(mesh->vertex_count, key_of, mesh->positions, weld, error);
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

/* Shapes of triangles: corners on a line make it flat. Two corners in one place make its edges cancel out. */
enum { SOLID, FLAT, COLLAPSED };

/* Counts edges, without and with the flat triangles. */
static void count_edges(const vshi_sorted_sides *sides, const uint8_t *shape, edge_count *solid,
                        edge_count *all) {
    for (size_t i = 0; i < 3 * sides->triangle_count;) {
        size_t runs[3][2] = {{0, 0}, {0, 0}, {0, 0}}; /* [shape][downwards] */
        uint32_t ends[2];
        for (const size_t end = vshi_next_edge(sides, i); i < end; ++i) {
            const uint32_t side = sides->sorted[i];
            vshi_side_ends(sides->corners, side, ends);
            ++runs[shape[side / 3]][sides->corners[side] != ends[0]];
        }
        count_edge(solid, runs[SOLID][0], runs[SOLID][1]);
        count_edge(all, runs[SOLID][0] + runs[FLAT][0], runs[SOLID][1] + runs[FLAT][1]);
    }
}

vsh_result vshi_mesh_count_edges(const vsh_mesh *mesh, vsh_mesh_report *report, vsh_error *error) {
    const size_t count = mesh->triangle_count;
    uint32_t *weld = NULL, *corners = NULL;
    uint8_t *shape = NULL; /* of each triangle */
    vshi_sorted_sides sides = {NULL, count, mesh->vertex_count, NULL};
    edge_count solid = {0, 0}, all = {0, 0};
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&weld, mesh->vertex_count, sizeof *weld, "welded vertices", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&corners, count, 3 * sizeof *corners, "edges of triangles", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&shape, count, sizeof *shape, "edges of triangles", error));
    VSHI_TRY_DONE(vshi_mesh_weld(mesh, weld, error));
    for (size_t i = 0; i < count; ++i) {
        uint32_t *v = corners + 3 * i;
        for (size_t k = 0; k < 3; ++k) {
            v[k] = weld[mesh->indices[3 * i + k]];
        }
        shape[i] = v[0] == v[1] || v[1] == v[2] || v[2] == v[0] ? COLLAPSED
                   : vshi_mesh_degenerate(mesh, i)              ? FLAT
                                                                : SOLID;
    }
    sides.corners = corners;
    VSHI_TRY_DONE(vshi_sort_sides(&sides, error));
    count_edges(&sides, shape, &solid, &all);
    /* A flat triangle casts nothing, but it may be what joins two long edges to one: a mesh that is closed
     * with such triangles or without them is closed. */
    const bool with_flat = all.open < solid.open;
    report->open_edges = with_flat ? all.open : solid.open;
    report->flipped_edges = with_flat ? all.flipped : solid.flipped;
done:
    free(sides.sorted);
    free(shape);
    free(corners);
    free(weld);
    return result;
}
