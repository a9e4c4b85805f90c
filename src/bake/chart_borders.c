/* Vertices of one place, in space and in the UVs, are one; triangles that share an edge between them are of
 * one chart. */
#include "bake/chart_borders.h"

#include "base/memory.h"
#include "base/try.h"
#include "mesh/weld.h"

#include <stdlib.h>
#include <string.h>

/* What one mesh needs, for the largest. */
typedef struct finding {
    uint32_t *weld;    /* [vertices] */
    uint32_t *corners; /* [triangles][3] */
    uint8_t *open;     /* [3 × triangles of all meshes] */
    uint32_t *charts;
} finding;

static void key_of(const void *user, size_t vertex, uint64_t key[VSHI_KEY_WORDS]) {
    const vsh_mesh *mesh = user;
    float values[2 * VSHI_KEY_WORDS] = {0.0f};
    memcpy(values, mesh->positions + 3 * vertex, 3 * sizeof *values);
    memcpy(values + 3, mesh->uvs + 2 * vertex, 2 * sizeof *values);
    for (size_t k = 0; k < 2 * VSHI_KEY_WORDS; ++k) {
        values[k] += 0.0f; /* -0 is 0 */
    }
    memcpy(key, values, sizeof values);
}

/* Whether a triangle covers anything in the UVs. */
static bool is_flat(const vsh_mesh *mesh, size_t local) {
    const uint32_t *index = mesh->indices + 3 * local;
    const float *a = mesh->uvs + 2 * (size_t)index[0], *b = mesh->uvs + 2 * (size_t)index[1];
    const float *d = mesh->uvs + 2 * (size_t)index[2];
    const double ux = (double)b[0] - (double)a[0], uy = (double)b[1] - (double)a[1];
    const double vx = (double)d[0] - (double)a[0], vy = (double)d[1] - (double)a[1];
    return ux * vy - uy * vx == 0.0;
}

/* Joins the charts on all sides of an edge, and marks edges that have one. `first`: triangle of the mesh. */
static vsh_result join_charts(const finding *f, const vsh_mesh *mesh, uint32_t first, vsh_error *error) {
    vshi_sorted_sides sides = {f->corners, mesh->triangle_count, mesh->vertex_count, NULL};
    vsh_result result;
    VSHI_TRY_DONE(vshi_weld(mesh->vertex_count, key_of, mesh, f->weld, error));
    for (size_t side = 0; side < 3 * mesh->triangle_count; ++side) {
        f->corners[side] = f->weld[mesh->indices[side]];
    }
    VSHI_TRY_DONE(vshi_sort_sides(&sides, error));
    for (size_t i = 0, end; i < 3 * mesh->triangle_count; i = end) {
        uint32_t own = 0, count = 0;
        end = vshi_next_edge(&sides, i);
        for (size_t k = i; k < end; ++k) {
            const uint32_t side = sides.sorted[k];
            if (!is_flat(mesh, side / 3)) {
                own = count++ == 0 ? side : own;
                vshi_set_join(f->charts, first + side / 3, first + own / 3);
            }
        }
        f->open[3 * (size_t)first + own] |= count == 1;
    }
done:
    free(sides.sorted);
    return result;
}

static vsh_result find(finding *f, const vsh_mesh *meshes, size_t mesh_count, size_t all, const char *what,
                       vshi_chart_borders *borders, vsh_error *error) {
    for (uint32_t t = 0; t < all; ++t) {
        f->charts[t] = t;
    }
    uint32_t first = 0;
    for (size_t m = 0; m < mesh_count; first += (uint32_t)meshes[m++].triangle_count) {
        VSHI_TRY(join_charts(f, &meshes[m], first, error));
    }
    size_t count = 0;
    for (size_t side = 0; side < 3 * all; ++side) {
        f->charts[side / 3] = vshi_set_of(f->charts, (uint32_t)(side / 3));
        count += f->open[side];
    }
    VSHI_TRY(vshi_allocate((void **)&borders->edges, count, sizeof *borders->edges, what, error));
    for (size_t side = 0; side < 3 * all; ++side) {
        if (f->open[side]) {
            borders->edges[borders->edge_count++] = (uint32_t)side;
        }
    }
    return VSH_OK;
}

vsh_result vshi_chart_borders_find(const vsh_mesh *meshes, size_t mesh_count, const vsh_run *run,
                                   const char *what, vshi_chart_borders *borders, vsh_error *error) {
    *borders = (vshi_chart_borders){NULL, NULL, 0};
    size_t vertices = 0, triangles = 0, all = 0;
    for (size_t m = 0; m < mesh_count; ++m) {
        vertices = meshes[m].vertex_count > vertices ? meshes[m].vertex_count : vertices;
        triangles = meshes[m].triangle_count > triangles ? meshes[m].triangle_count : triangles;
        all += meshes[m].triangle_count;
    }
    finding f = {NULL, NULL, NULL, NULL};
    /* welding takes four slots a vertex at most, sorting one count a vertex and two numbers a side */
    const double bytes = (double)vertices * 6.0 * sizeof *f.weld +
                         3.0 * (double)triangles * 3.0 * sizeof *f.corners +
                         (double)all * (sizeof *borders->charts + 3.0 * (1.0 + sizeof *borders->edges));
    VSHI_TRY(vshi_check_limit(run, bytes, what, error));
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&borders->charts, all, sizeof *borders->charts, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&f.weld, vertices, sizeof *f.weld, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&f.corners, triangles, 3 * sizeof *f.corners, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&f.open, 3 * all, sizeof *f.open, what, error));
    f.charts = borders->charts;
    result = find(&f, meshes, mesh_count, all, what, borders, error);
done:
    free(f.open);
    free(f.corners);
    free(f.weld);
    return result;
}

void vshi_chart_borders_free(vshi_chart_borders *borders) {
    free(borders->edges);
    free(borders->charts);
    *borders = (vshi_chart_borders){NULL, NULL, 0};
}
