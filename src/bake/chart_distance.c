/* Charts that lie closer to each other than a texel. Triangles that share an edge, in space and in the UVs,
 * are one chart; the edges that a triangle has to itself are borders. Borders are walked in steps of half a
 * texel and put into the texels they pass, so that near ones are found there. */
#include "base/floats.h"
#include "base/hash.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "mesh/mesh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/bake.h>

static const double STEP = 0.5; /* texels */

enum { NO_EDGE = UINT32_MAX };

/* A place where an edge of triangles is looked up. */
typedef struct slot {
    uint64_t key;
    uint32_t edge;  /* 3 × triangle + corner that it begins with, of the first; NO_EDGE: free */
    uint32_t count; /* triangles that have it */
} slot;

typedef struct border {
    double x[2], y[2]; /* texels */
    uint32_t chart, mesh;
} border;

/* A border in a texel. */
typedef struct passing {
    uint64_t texel;
    uint32_t border, next; /* of the same place in the table; NO_EDGE: none */
} passing;

typedef struct closeness {
    const vsh_mesh *meshes;
    size_t mesh_count, triangles;
    double width, height;
    uint32_t *parent; /* [triangles]: union-find of charts */
    slot *slots;      /* [slot_count], a power of two */
    size_t slot_count;
    border *borders;
    size_t border_count;
    passing *passings;
    uint32_t *heads; /* [head_count], a power of two */
    size_t passing_count, head_count;
} closeness;

static size_t power_above(size_t count) {
    size_t power = 16;
    while (power < count) {
        power *= 2;
    }
    return power;
}

static uint32_t chart_of(closeness *c, uint32_t triangle) {
    while (c->parent[triangle] != triangle) {
        c->parent[triangle] = c->parent[c->parent[triangle]];
        triangle = c->parent[triangle];
    }
    return triangle;
}

static uint64_t bits_of(float value, uint64_t with) {
    uint32_t bits;
    value += 0.0f; /* -0 is 0 */
    memcpy(&bits, &value, sizeof bits);
    return vshi_mix(with ^ bits);
}

static uint64_t end_key(const vsh_mesh *mesh, uint32_t vertex) {
    uint64_t key = 1;
    for (size_t k = 0; k < 2; ++k) {
        key = bits_of(mesh->uvs[2 * (size_t)vertex + k], key);
    }
    for (size_t k = 0; k < 3; ++k) {
        key = bits_of(mesh->positions[3 * (size_t)vertex + k], key);
    }
    return key;
}

static slot *find_slot(closeness *c, uint64_t key) {
    size_t at = (size_t)vshi_mix(key) & (c->slot_count - 1);
    while (c->slots[at].edge != NO_EDGE && c->slots[at].key != key) {
        at = (at + 1) & (c->slot_count - 1);
    }
    return &c->slots[at];
}

static uint64_t edge_key(const vsh_mesh *mesh, size_t m, size_t local, size_t k) {
    const uint32_t *index = mesh->indices + 3 * local;
    return end_key(mesh, index[k]) + end_key(mesh, index[(k + 1) % 3]) +
           vshi_mix(m + 1); /* either way round */
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

static void join_charts(closeness *c) {
    uint32_t triangle = 0;
    for (size_t m = 0; m < c->mesh_count; ++m) {
        const vsh_mesh *mesh = &c->meshes[m];
        for (size_t i = 0; i < mesh->triangle_count; ++i, ++triangle) {
            c->parent[triangle] = triangle;
            for (size_t k = 0; !is_flat(mesh, i) && k < 3; ++k) {
                const uint64_t key = edge_key(mesh, m, i, k);
                slot *s = find_slot(c, key);
                if (s->edge == NO_EDGE) {
                    *s = (slot){key, 3 * triangle + (uint32_t)k, 0};
                } else {
                    c->parent[chart_of(c, triangle)] = chart_of(c, s->edge / 3);
                }
                ++s->count;
            }
        }
    }
}

static void list_borders(closeness *c) {
    uint32_t triangle = 0;
    for (size_t m = 0; m < c->mesh_count; ++m) {
        const vsh_mesh *mesh = &c->meshes[m];
        for (size_t i = 0; i < mesh->triangle_count; ++i, ++triangle) {
            for (size_t k = 0; !is_flat(mesh, i) && k < 3; ++k) {
                const slot *s = find_slot(c, edge_key(mesh, m, i, k));
                if (s->count != 1) {
                    continue;
                }
                border *b = &c->borders[c->border_count++];
                *b = (border){.chart = chart_of(c, triangle), .mesh = (uint32_t)m};
                for (size_t end = 0; end < 2; ++end) {
                    const float *uv = mesh->uvs + 2 * (size_t)mesh->indices[3 * i + (k + end) % 3];
                    b->x[end] = (double)uv[0] * c->width;
                    b->y[end] = (1.0 - (double)uv[1]) * c->height;
                }
            }
        }
    }
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

/* Of a place within the image; false outside. */
static bool texel_at(const closeness *c, double x, double y, uint64_t *texel) {
    if (!(x >= 0.0 && x < c->width && y >= 0.0 && y < c->height)) {
        return false;
    }
    *texel = (uint64_t)y * (uint64_t)c->width + (uint64_t)x;
    return true;
}

static void put_borders(closeness *c) {
    memset(c->heads, 0xff, c->head_count * sizeof *c->heads);
    for (uint32_t b = 0; b < c->border_count; ++b) {
        const size_t steps = steps_of(&c->borders[b]);
        uint64_t last = UINT64_MAX;
        for (size_t s = 0; s <= steps; ++s) {
            double x, y;
            uint64_t texel;
            step_to(&c->borders[b], s, steps, &x, &y);
            if (texel_at(c, x, y, &texel) && texel != last) {
                uint32_t *head = &c->heads[vshi_mix(texel) & (c->head_count - 1)];
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

/* How near another chart's border is to a place; 1 where none is within a texel. */
static double nearest_other(const closeness *c, uint32_t chart, double x, double y) {
    double nearest = 1.0;
    for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
            uint64_t texel;
            if (!texel_at(c, x + dx, y + dy, &texel)) {
                continue;
            }
            uint32_t p = c->heads[vshi_mix(texel) & (c->head_count - 1)];
            for (; p != NO_EDGE; p = c->passings[p].next) {
                const border *b = &c->borders[c->passings[p].border];
                if (c->passings[p].texel == texel && b->chart != chart) {
                    nearest = fmin(nearest, distance_to(b, x, y));
                }
            }
        }
    }
    return nearest;
}

static void measure(const closeness *c, uint64_t *by_mesh, vsh_closeness *found) {
    for (uint32_t b = 0; b < c->border_count; ++b) {
        const border *own = &c->borders[b];
        const size_t steps = steps_of(own);
        uint64_t last = UINT64_MAX;
        for (size_t s = 0; s <= steps; ++s) {
            double x, y;
            uint64_t texel;
            step_to(own, s, steps, &x, &y);
            if (!texel_at(c, x, y, &texel)) {
                continue;
            }
            const double gap = nearest_other(c, own->chart, x, y);
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

static vsh_result find(closeness *c, const vsh_run *run, vsh_closeness *found, vsh_error *error) {
    const char *what = "closeness of charts";
    c->slot_count = power_above(6 * c->triangles);
    const double bytes = (double)c->slot_count * sizeof *c->slots +
                         (double)c->triangles * (sizeof *c->parent + 3.0 * sizeof *c->borders);
    VSHI_TRY(vshi_check_limit(run, bytes, what, error));
    uint64_t *by_mesh = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&by_mesh, c->mesh_count, sizeof *by_mesh, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&c->parent, c->triangles, sizeof *c->parent, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&c->slots, c->slot_count, sizeof *c->slots, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&c->borders, 3 * c->triangles, sizeof *c->borders, what, error));
    for (size_t i = 0; i < c->slot_count; ++i) {
        c->slots[i].edge = NO_EDGE;
    }
    join_charts(c);
    list_borders(c);
    size_t most = 0;
    for (size_t b = 0; b < c->border_count; ++b) {
        most += steps_of(&c->borders[b]) + 1;
    }
    c->head_count = power_above(most);
    const double passings = (double)most * sizeof *c->passings + (double)c->head_count * sizeof *c->heads;
    if (most < NO_EDGE) {
        VSHI_TRY_DONE(vshi_check_limit(run, bytes + passings, what, error));
        VSHI_TRY_DONE(vshi_allocate((void **)&c->passings, most, sizeof *c->passings, what, error));
        VSHI_TRY_DONE(vshi_allocate((void **)&c->heads, c->head_count, sizeof *c->heads, what, error));
        put_borders(c);
        measure(c, by_mesh, found);
    }
done:
    free(c->heads);
    free(c->passings);
    free(c->borders);
    free(c->slots);
    free(c->parent);
    free(by_mesh);
    return result;
}

vsh_result vsh_charts_closeness_sized(const vsh_mesh *meshes, size_t mesh_count, int32_t width,
                                      int32_t height, const vsh_run *run, vsh_closeness *found,
                                      size_t found_size, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_OF(mesh_count, meshes);
    VSHI_NEEDS(found);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    if (width < 1 || height < 1 || width > VSH_MAX_LIGHTMAP_SIZE || height > VSH_MAX_LIGHTMAP_SIZE) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "closeness of charts at %d × %d: expected 1 … %d", width,
                         height, VSH_MAX_LIGHTMAP_SIZE);
    }
    closeness c = {.meshes = meshes, .mesh_count = mesh_count, .width = width, .height = height};
    for (size_t m = 0; m < mesh_count; ++m) {
        VSHI_TRY(vshi_mesh_check_data(&meshes[m], m, error));
        if (meshes[m].uvs == NULL && meshes[m].triangle_count > 0) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s has no lightmap UVs",
                             vshi_mesh_label(&meshes[m], m).text);
        }
        c.triangles += meshes[m].triangle_count;
    }
    if (c.triangles > UINT32_MAX / 3 - 1) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "closeness of charts: %zu triangles, at most %u",
                         c.triangles, UINT32_MAX / 3 - 1);
    }
    vsh_closeness all = {.gap = 1.0};
    const vsh_result result = find(&c, &full, &all, error);
    vshi_give(found, found_size, &all, sizeof all);
    return result;
}
