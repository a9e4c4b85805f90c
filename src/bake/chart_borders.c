/* Vertices of one place, in space and in the UVs, are one; edges are sorted by the lesser of their vertices,
 * so that the few that begin there are held against each other. */
#include "bake/chart_borders.h"

#include "base/hash.h"
#include "base/memory.h"
#include "base/try.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { NO_VERTEX = UINT32_MAX, VALUES = 5 };

/* An edge of a triangle, with its lesser vertex known by its place. */
typedef struct listed_edge {
    uint32_t other; /* vertex */
    uint32_t edge;  /* 3 × triangle + corner, of all meshes */
} listed_edge;

/* What one mesh needs, for the largest. */
typedef struct finding {
    const vsh_mesh *mesh;
    uint32_t first;  /* triangle of the mesh */
    uint32_t *same;  /* [vertices]: the first vertex in the same place */
    uint32_t *slots; /* [slot_count], a power of two */
    size_t slot_count;
    size_t *begins;      /* [vertices + 2]: where a vertex's edges are listed */
    listed_edge *listed; /* [3 × triangles] */
    uint8_t *open;       /* [3 × triangles of all meshes] */
    uint32_t *charts;
} finding;

static void values_of(const vsh_mesh *mesh, uint32_t vertex, uint32_t values[VALUES]) {
    float v[VALUES];
    memcpy(v, mesh->uvs + 2 * (size_t)vertex, 2 * sizeof *v);
    memcpy(v + 2, mesh->positions + 3 * (size_t)vertex, 3 * sizeof *v);
    for (size_t k = 0; k < VALUES; ++k) {
        v[k] += 0.0f; /* -0 is 0 */
    }
    memcpy(values, v, sizeof v);
}

static void find_same(finding *f) {
    const size_t mask = f->slot_count - 1;
    memset(f->slots, 0xff, f->slot_count * sizeof *f->slots);
    for (uint32_t v = 0; v < f->mesh->vertex_count; ++v) {
        uint32_t own[VALUES], other[VALUES];
        values_of(f->mesh, v, own);
        uint64_t key = 1;
        for (size_t k = 0; k < VALUES; ++k) {
            key = vshi_mix(key ^ own[k]);
        }
        size_t at = (size_t)key & mask;
        for (; f->slots[at] != NO_VERTEX; at = (at + 1) & mask) {
            values_of(f->mesh, f->slots[at], other);
            if (memcmp(own, other, sizeof own) == 0) {
                break;
            }
        }
        if (f->slots[at] == NO_VERTEX) {
            f->slots[at] = v;
        }
        f->same[v] = f->slots[at];
    }
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

/* The vertices of an edge, the lesser first. */
static void ends_of(const finding *f, size_t local, size_t k, uint32_t ends[2]) {
    const uint32_t *index = f->mesh->indices + 3 * local;
    const uint32_t a = f->same[index[k]], b = f->same[index[(k + 1) % 3]];
    ends[0] = a < b ? a : b;
    ends[1] = a < b ? b : a;
}

/* Sorts the edges by their lesser vertex: those of vertex v begin at begins[v]. */
static void list_edges(finding *f) {
    const size_t vertices = f->mesh->vertex_count, triangles = f->mesh->triangle_count;
    uint32_t ends[2];
    memset(f->begins, 0, (vertices + 2) * sizeof *f->begins);
    for (size_t i = 0; i < triangles; ++i) {
        for (size_t k = 0; !is_flat(f->mesh, i) && k < 3; ++k) {
            ends_of(f, i, k, ends);
            ++f->begins[ends[0] + 2];
        }
    }
    for (size_t v = 0; v < vertices; ++v) {
        f->begins[v + 2] += f->begins[v + 1];
    }
    for (size_t i = 0; i < triangles; ++i) {
        for (size_t k = 0; !is_flat(f->mesh, i) && k < 3; ++k) {
            ends_of(f, i, k, ends);
            const uint32_t edge = 3 * (f->first + (uint32_t)i) + (uint32_t)k;
            f->listed[f->begins[ends[0] + 1]++] = (listed_edge){ends[1], edge};
        }
    }
}

static int by_other(const void *a, const void *b) {
    const listed_edge *x = a, *y = b;
    const int order = (x->other > y->other) - (x->other < y->other);
    return order != 0 ? order : (x->edge > y->edge) - (x->edge < y->edge);
}

static uint32_t chart_of(uint32_t *charts, uint32_t triangle) {
    while (charts[triangle] != triangle) {
        charts[triangle] = charts[charts[triangle]];
        triangle = charts[triangle];
    }
    return triangle;
}

static void join(uint32_t *charts, uint32_t triangle, uint32_t with) {
    const uint32_t a = chart_of(charts, triangle), b = chart_of(charts, with);
    charts[a > b ? a : b] = a < b ? a : b;
}

/* Joins the charts on all sides of an edge, and marks edges that have one. */
static void join_charts(finding *f) {
    for (size_t v = 0; v < f->mesh->vertex_count; ++v) {
        listed_edge *own = f->listed + f->begins[v];
        const size_t count = f->begins[v + 1] - f->begins[v];
        qsort(own, count, sizeof *own, by_other); /* some few */
        for (size_t i = 0, end; i < count; i = end) {
            for (end = i + 1; end < count && own[end].other == own[i].other; ++end) {
                join(f->charts, own[end].edge / 3, own[i].edge / 3);
            }
            f->open[own[i].edge] = end == i + 1;
        }
    }
}

static vsh_result take(finding *f, size_t vertices, size_t triangles, size_t all, const char *what,
                       vsh_error *error) {
    VSHI_TRY(vshi_allocate((void **)&f->same, vertices, sizeof *f->same, what, error));
    VSHI_TRY(vshi_allocate((void **)&f->slots, f->slot_count, sizeof *f->slots, what, error));
    VSHI_TRY(vshi_allocate((void **)&f->begins, vertices + 2, sizeof *f->begins, what, error));
    VSHI_TRY(vshi_allocate((void **)&f->listed, 3 * triangles, sizeof *f->listed, what, error));
    return vshi_allocate((void **)&f->open, 3 * all, sizeof *f->open, what, error);
}

/* Lists the open edges. */
static vsh_result list_open(const finding *f, size_t all, const char *what, vshi_chart_borders *borders,
                            vsh_error *error) {
    size_t count = 0;
    for (size_t edge = 0; edge < 3 * all; ++edge) {
        count += f->open[edge];
    }
    VSHI_TRY(vshi_allocate((void **)&borders->edges, count, sizeof *borders->edges, what, error));
    for (size_t edge = 0; edge < 3 * all; ++edge) {
        if (f->open[edge]) {
            borders->edges[borders->edge_count++] = (uint32_t)edge;
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
    finding f = {.slot_count = 16};
    while (f.slot_count < 2 * vertices) {
        f.slot_count *= 2;
    }
    const double bytes = (double)vertices * (sizeof *f.same + sizeof *f.begins) +
                         (double)f.slot_count * sizeof *f.slots + 3.0 * (double)triangles * sizeof *f.listed +
                         (double)all * (sizeof *borders->charts + 3.0 * (1.0 + sizeof *borders->edges));
    VSHI_TRY(vshi_check_limit(run, bytes, what, error));
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&borders->charts, all, sizeof *borders->charts, what, error));
    VSHI_TRY_DONE(take(&f, vertices, triangles, all, what, error));
    f.charts = borders->charts;
    for (uint32_t t = 0; t < all; ++t) {
        f.charts[t] = t;
    }
    for (size_t m = 0; m < mesh_count; ++m) {
        f.mesh = &meshes[m];
        find_same(&f);
        list_edges(&f);
        join_charts(&f);
        f.first += (uint32_t)f.mesh->triangle_count;
    }
    for (uint32_t t = 0; t < all; ++t) {
        f.charts[t] = chart_of(f.charts, t);
    }
    result = list_open(&f, all, what, borders, error);
done:
    free(f.open);
    free(f.listed);
    free(f.begins);
    free(f.slots);
    free(f.same);
    return result;
}

void vshi_chart_borders_free(vshi_chart_borders *borders) {
    free(borders->edges);
    free(borders->charts);
    *borders = (vshi_chart_borders){NULL, NULL, 0};
}
