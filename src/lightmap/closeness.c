/* Charts that lie closer to each other than a texel. Their borders are walked in steps of half a texel and
 * put into the texels they pass, so that near ones are found there. */
#include "base/bytes.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "geometry/edges.h"
#include "geometry/mesh.h"
#include "lightmap/texels.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/lightmap.h>

static const double STEP = 0.5; /* texels */

enum { NONE = UINT32_MAX };

static const char what[] = "closeness of charts";

/* --- borders of charts */

/* An edge with a single triangle of some area in the UVs. */
typedef struct border {
    double x[2], y[2]; /* texels */
    uint32_t chart;    /* a triangle of it, until charts are found */
    uint32_t mesh;
} border;

/* A border that passes a texel. */
typedef struct passing {
    uint64_t texel;
    uint32_t border, next; /* next in the same list of the table; NONE: none */
} passing;

typedef struct closeness {
    const vsh_mesh *meshes;
    size_t mesh_count, triangles; /* of all meshes */
    double width, height;
    const vsh_run *run;
    uint32_t *charts; /* [triangles]: sets of triangles */
    border *borders;
    size_t border_count, border_room;
    passing *passings;
    uint32_t *heads; /* [head_count], a power of two */
    size_t passing_count, head_count;
} closeness;

/* Checks that memory allows `bytes` more than the charts and borders. */
static vsh_result check_bytes(const closeness *c, double bytes, vsh_error *error) {
    const double held =
        (double)c->triangles * sizeof *c->charts + (double)c->border_room * sizeof *c->borders;
    return vshi_check_limit(c->run, held + bytes, what, error);
}

/* Vertices with equal places in space and in the UVs are one. */
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

/* Whether a triangle covers nothing in the UVs. */
static bool is_flat(const vsh_mesh *mesh, size_t local) {
    const uint32_t *index = mesh->indices + 3 * local;
    const float *a = mesh->uvs + 2 * (size_t)index[0], *b = mesh->uvs + 2 * (size_t)index[1];
    const float *d = mesh->uvs + 2 * (size_t)index[2];
    const double ux = (double)b[0] - (double)a[0], uy = (double)b[1] - (double)a[1];
    const double vx = (double)d[0] - (double)a[0], vy = (double)d[1] - (double)a[1];
    return ux * vy - uy * vx == 0.0;
}

static vsh_result add_border(closeness *c, size_t m, uint32_t side, uint32_t triangle, vsh_error *error) {
    const vsh_mesh *mesh = &c->meshes[m];
    if (c->border_count == c->border_room) {
        VSHI_TRY(check_bytes(c, 2.0 * (double)c->border_room * sizeof *c->borders, error));
    }
    VSHI_TRY(vshi_make_room((void **)&c->borders, c->border_count, &c->border_room, sizeof *c->borders, what,
                            error));
    border *b = &c->borders[c->border_count++];
    *b = (border){.chart = triangle, .mesh = (uint32_t)m};
    for (uint32_t end = 0; end < 2; ++end) {
        const uint32_t corner = side / 3 * 3 + (side + end) % 3;
        const float *uv = mesh->uvs + 2 * (size_t)mesh->indices[corner];
        b->x[end] = (double)uv[0] * c->width;
        b->y[end] = (1.0 - (double)uv[1]) * c->height;
    }
    return VSH_OK;
}

/* Joins the charts on all sides of an edge, and lists edges with one side. `first`: triangle of the mesh. */
static vsh_result join_charts(closeness *c, size_t m, uint32_t first, vsh_error *error) {
    const vsh_mesh *mesh = &c->meshes[m];
    const size_t triangles = mesh->triangle_count, vertices = mesh->vertex_count;
    uint32_t *weld = NULL, *corners = NULL;
    vshi_sorted_sides sides = {NULL, triangles, vertices, NULL};
    vsh_result result;
    /* welding takes four slots a vertex at most, sorting one count a vertex and two numbers a side */
    VSHI_TRY_DONE(check_bytes(
        c, (double)vertices * 6.0 * sizeof *weld + 9.0 * (double)triangles * sizeof *corners, error));
    const vshi_array arrays[] = {VSHI_ARRAY(weld, vertices), VSHI_ARRAY(corners, 3 * triangles)};
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, what, error));
    VSHI_TRY_DONE(vshi_weld(vertices, key_of, mesh, weld, error));
    for (size_t side = 0; side < 3 * triangles; ++side) {
        corners[side] = weld[mesh->indices[side]];
    }
    sides.corners = corners;
    VSHI_TRY_DONE(vshi_sort_sides(&sides, error));
    for (size_t i = 0, end; i < 3 * triangles; i = end) {
        uint32_t own = 0, count = 0;
        end = vshi_next_edge(&sides, i);
        for (size_t k = i; k < end; ++k) {
            const uint32_t side = sides.sorted[k];
            if (!is_flat(mesh, side / 3)) {
                own = count++ == 0 ? side : own;
                vshi_set_join(c->charts, first + side / 3, first + own / 3);
            }
        }
        if (count == 1) {
            VSHI_TRY_DONE(add_border(c, m, own, first + own / 3, error));
        }
    }
done:
    free(sides.sorted);
    free(corners);
    free(weld);
    return result;
}

static vsh_result find_borders(closeness *c, vsh_error *error) {
    VSHI_TRY(check_bytes(c, 0.0, error));
    VSHI_TRY(vshi_allocate((void **)&c->charts, c->triangles, sizeof *c->charts, what, error));
    for (uint32_t t = 0; t < c->triangles; ++t) {
        c->charts[t] = t;
    }
    uint32_t first = 0;
    for (size_t m = 0; m < c->mesh_count; first += (uint32_t)c->meshes[m++].triangle_count) {
        VSHI_TRY(join_charts(c, m, first, error));
    }
    for (size_t b = 0; b < c->border_count; ++b) {
        c->borders[b].chart = vshi_set_of(c->charts, c->borders[b].chart);
    }
    return VSH_OK;
}

/* Steps along a border. */
static size_t steps_of(const border *b) {
    const double length =
        sqrt((b->x[1] - b->x[0]) * (b->x[1] - b->x[0]) + (b->y[1] - b->y[0]) * (b->y[1] - b->y[0]));
    return 1 + (size_t)fmin(ceil(length / STEP), 1e6);
}

static void step_to(const border *b, size_t step, size_t steps, double *x, double *y) {
    const double t = (double)step / (double)steps;
    *x = b->x[0] + t * (b->x[1] - b->x[0]);
    *y = b->y[0] + t * (b->y[1] - b->y[0]);
}

/* Finds the texel of a place. False outside the image. */
static bool texel_at(const closeness *c, double x, double y, uint64_t *texel) {
    if (!(x >= 0.0 && x < c->width && y >= 0.0 && y < c->height)) {
        return false;
    }
    *texel = (uint64_t)y * (uint64_t)c->width + (uint64_t)x;
    return true;
}

/* The head of a texel's list. Neighbours along a row are mostly close in memory. */
static uint32_t *head_of(const closeness *c, uint64_t texel) {
    return &c->heads[(vshi_mix(texel / 16) * 16 + texel % 16) & (c->head_count - 1)];
}

static void list_passings(closeness *c) {
    memset(c->heads, 0xff, c->head_count * sizeof *c->heads);
    for (uint32_t b = 0; b < c->border_count; ++b) {
        const size_t steps = steps_of(&c->borders[b]);
        uint64_t last = UINT64_MAX;
        for (size_t s = 0; s <= steps; ++s) {
            double x, y;
            uint64_t texel;
            step_to(&c->borders[b], s, steps, &x, &y);
            if (texel_at(c, x, y, &texel) && texel != last) {
                uint32_t *head = head_of(c, texel);
                c->passings[c->passing_count] = (passing){texel, b, *head};
                *head = (uint32_t)c->passing_count++;
                last = texel;
            }
        }
    }
}

static double distance_to(const border *b, double x, double y) {
    const double dx = b->x[1] - b->x[0], dy = b->y[1] - b->y[0], square = dx * dx + dy * dy;
    double t = square > 0.0 ? ((x - b->x[0]) * dx + (y - b->y[0]) * dy) / square : 0.0;
    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    const double px = x - b->x[0] - t * dx, py = y - b->y[0] - t * dy;
    return sqrt(px * px + py * py);
}

/* Distance to the nearest border of another chart, at most 1 texel. */
static double nearest_other(const closeness *c, uint32_t chart, double x, double y) {
    double nearest = 1.0;
    for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
            uint64_t texel;
            if (!texel_at(c, floor(x) + dx, floor(y) + dy, &texel)) {
                continue;
            }
            for (uint32_t p = *head_of(c, texel); p != NONE; p = c->passings[p].next) {
                const border *b = &c->borders[c->passings[p].border];
                if (c->passings[p].texel == texel && b->chart != chart) {
                    nearest = fmin(nearest, distance_to(b, x, y));
                }
            }
        }
    }
    return nearest;
}

static void measure(const closeness *c, uint64_t *by_mesh, vshi_closeness *found) {
    for (uint32_t b = 0; b < c->border_count; ++b) {
        const border *own = &c->borders[b];
        const size_t steps = steps_of(own);
        uint64_t last = UINT64_MAX;
        for (size_t s = 0; s <= steps; ++s) {
            double x, y;
            uint64_t texel;
            step_to(own, s, steps, &x, &y);
            const double gap = texel_at(c, x, y, &texel) ? nearest_other(c, own->chart, x, y) : 1.0;
            if (gap < 1.0) {
                found->gap = fmin(found->gap, gap);
                found->texels += texel != last;
                by_mesh[own->mesh] += texel != last;
                last = texel;
            }
        }
    }
    for (size_t m = 0; m < c->mesh_count; ++m) {
        if (by_mesh[m] > found->mesh_texels) {
            found->mesh = m;
            found->mesh_texels = by_mesh[m];
        }
    }
}

static vsh_result find(closeness *c, vshi_closeness *found, vsh_error *error) {
    uint64_t *by_mesh = NULL;
    size_t most = 0;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&by_mesh, c->mesh_count, sizeof *by_mesh, what, error));
    VSHI_TRY_DONE(find_borders(c, error));
    for (size_t b = 0; b < c->border_count; ++b) {
        most += steps_of(&c->borders[b]) + 1;
    }
    for (c->head_count = 16; c->head_count < most; c->head_count *= 2) {
    }
    if (most < NONE) {
        VSHI_TRY_DONE(check_bytes(
            c, (double)most * sizeof *c->passings + (double)c->head_count * sizeof *c->heads, error));
        const vshi_array arrays[] = {VSHI_ARRAY(c->passings, most), VSHI_ARRAY(c->heads, c->head_count)};
        VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, what, error));
        list_passings(c);
        measure(c, by_mesh, found);
    }
done:
    free(c->heads);
    free(c->passings);
    free(c->borders);
    free(c->charts);
    free(by_mesh);
    return result;
}

vsh_result vshi_charts_closeness(const vsh_mesh *meshes, size_t mesh_count, int32_t width, int32_t height,
                                 const vsh_run *run, vshi_closeness *found, vsh_error *error) {
    VSHI_FLOATS;
    closeness c = {.meshes = meshes, .mesh_count = mesh_count, .width = width, .height = height, .run = run};
    for (size_t m = 0; m < mesh_count; ++m) {
        c.triangles += meshes[m].triangle_count;
    }
    if (c.triangles > UINT32_MAX / 3 - 1) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "closeness of charts: %zu triangles, at most %u",
                         c.triangles, UINT32_MAX / 3 - 1);
    }
    *found = (vshi_closeness){.gap = 1.0};
    return find(&c, found, error);
}
