/* Checks of a mesh's triangles and edges. An edge that an odd number of triangles meets at is a border;
 * one whose triangles run along it more often one way than the other joins triangles that disagree about the
 * outside. */
#include "base/memory.h"
#include "mesh/mesh.h"
#include "mesh/weld.h"

#include <float.h>
#include <stdlib.h>

static void grow(vsh_mesh_report *report, vshi_vec p) {
    const double at[3] = {p.x, p.y, p.z};
    for (int k = 0; k < 3; ++k) {
        report->bounds_min[k] = at[k] < report->bounds_min[k] ? at[k] : report->bounds_min[k];
        report->bounds_max[k] = at[k] > report->bounds_max[k] ? at[k] : report->bounds_max[k];
    }
}

vsh_result vshi_mesh_look_over(const vsh_mesh *mesh, size_t index, vsh_mesh_report *report,
                               vsh_error *error) {
    VSHI_TRY(vshi_mesh_validate(mesh, index, error));
    *report = (vsh_mesh_report){.bounds_min = {DBL_MAX, DBL_MAX, DBL_MAX},
                                .bounds_max = {-DBL_MAX, -DBL_MAX, -DBL_MAX}};
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        if (vshi_mesh_degenerate(mesh, i)) {
            ++report->degenerate_triangles;
            continue;
        }
        vshi_vec corner[3];
        vshi_mesh_triangle(mesh, i, corner);
        report->area +=
            0.5 * vshi_length(vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0])));
        for (int k = 0; k < 3; ++k) {
            grow(report, corner[k]);
        }
    }
    return VSH_OK;
}

/* --- edges */

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
    const vshi_array arrays[] = {VSHI_ARRAY(weld, mesh->vertex_count), VSHI_ARRAY(corners, 3 * count),
                                 VSHI_ARRAY(shape, count)};
    vsh_result result;
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, "edges of triangles", error));
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
