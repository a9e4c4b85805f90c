#include "mesh/solidity_parts.h"

#include "base/memory.h"
#include "mesh/edges.h"
#include "mesh/weld.h"

#include <stdlib.h>

#define NO_COMPONENT UINT32_MAX

static const char what[] = "components";

typedef struct walking {
    const vsh_mesh *mesh;
    vshi_edges edges;
    bool mirrored;
    uint32_t *of;    /* [triangle_count]: its component; NO_COMPONENT for those without area */
    uint32_t *queue; /* [triangle_count] */
    vshi_components *found;
} walking;

/* Whether a triangle's side runs from its edge's lower vertex to the upper one. */
static bool upwards(const walking *w, uint32_t side) {
    uint32_t v[3];
    vshi_edges_corners(w->mesh, w->edges.weld, w->mirrored, side / 3, v);
    return v[side % 3] < v[(side % 3 + 1) % 3];
}

/* Numbers and turns all that hangs together with triangle `seed`. */
static void walk(walking *w, uint32_t seed) {
    vshi_components *c = w->found;
    const uint32_t number = (uint32_t)c->count++;
    uint8_t *twisted = &c->twisted[number];
    size_t waiting = 1;
    w->queue[0] = seed;
    w->of[seed] = number;
    for (size_t at = 0; at < waiting; ++at) {
        const uint32_t i = w->queue[at];
        for (uint32_t side = 3 * i; side < 3 * i + 3; ++side) {
            const uint32_t partner = w->edges.partner[side];
            if (partner == VSHI_NO_PARTNER) {
                continue;
            }
            const uint32_t other = partner / 3;
            const uint8_t turned = c->turned[i] ^ (uint8_t)(upwards(w, side) == upwards(w, partner));
            if (w->of[other] == NO_COMPONENT) {
                w->of[other] = number;
                c->turned[other] = turned;
                w->queue[waiting++] = other;
            } else if (c->turned[other] != turned) {
                *twisted = 1;
            }
        }
    }
    for (size_t at = 0; *twisted && at < waiting; ++at) {
        c->turned[w->queue[at]] = 0;
    }
}

static void walk_all(walking *w) {
    vshi_components *c = w->found;
    const size_t count = w->mesh->triangle_count;
    for (size_t i = 0; i < count; ++i) {
        w->of[i] = NO_COMPONENT;
    }
    for (size_t i = 0; i < count; ++i) {
        if (w->of[i] == NO_COMPONENT && !w->edges.skipped[i]) {
            walk(w, (uint32_t)i);
        }
    }
    for (size_t i = 0; i < count; ++i) {
        const uint32_t first = w->edges.first[i];
        if (first != i) {
            w->of[i] = w->of[first];
            c->turned[i] = c->turned[first];
            c->doubled[i] = c->doubled[first];
        }
    }
}

static vsh_result list_rims(walking *w, vsh_error *error) {
    vshi_components *c = w->found;
    VSHI_TRY(vshi_allocate((void **)&c->rims, w->edges.open, sizeof *c->rims, "open edges", error));
    for (size_t at = 0; at < c->begin[c->count]; ++at) {
        const uint32_t i = c->list[at];
        for (uint32_t k = 0; k < 3 && !w->edges.skipped[i]; ++k) {
            if (w->edges.partner[3 * i + k] == VSHI_NO_PARTNER) {
                uint32_t v[3];
                vshi_edges_corners(w->mesh, w->edges.weld, w->mirrored, i, v);
                const uint32_t a = v[k], b = v[(k + 1) % 3];
                c->rims[c->rim_count++] = (vshi_rim){w->of[i], c->turned[i] ? b : a, c->turned[i] ? a : b};
            }
        }
    }
    return VSH_OK;
}

/* The edge of an open terrain, by its triangles. */
static vsh_result list_terrain_rims(const vsh_mesh *mesh, vshi_terrain t, vshi_components *c,
                                    vsh_error *error) {
    const bool mirrored = vshi_transform_determinant(mesh->transform) < 0.0;
    const size_t across = t.columns - 1, down = t.rows - 1;
    VSHI_TRY(
        vshi_allocate((void **)&c->rims, vshi_terrain_edge_length(t), sizeof *c->rims, "open edges", error));
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        const size_t column = i / 2 % across, row = i / 2 / across;
        if (column > 0 && column + 1 < across && row > 0 && row + 1 < down) {
            continue;
        }
        uint32_t given[3], v[3];
        vshi_terrain_triangle(t, i, given);
        v[0] = given[0];
        v[1] = given[mirrored ? 2 : 1];
        v[2] = given[mirrored ? 1 : 2];
        for (int k = 0; k < 3; ++k) {
            const uint32_t a = v[k], b = v[(k + 1) % 3];
            const size_t ax = a % t.columns, bx = b % t.columns, az = a / t.columns, bz = b / t.columns;
            if ((ax == bx && (ax == 0 || ax == across)) || (az == bz && (az == 0 || az == down))) {
                c->rims[c->rim_count++] = (vshi_rim){0, a, b};
            }
        }
    }
    return VSH_OK;
}

/* The one component of a terrain: the order of its triangles says how they hang together. */
static vsh_result list_terrain(const vsh_mesh *mesh, vshi_terrain t, vshi_components *c, vsh_error *error) {
    const size_t count = mesh->triangle_count;
    const vshi_array arrays[] = {VSHI_ARRAY(c->turned, count), VSHI_ARRAY(c->doubled, count),
                                 VSHI_ARRAY(c->twisted, 1), VSHI_ARRAY(c->begin, 3),
                                 VSHI_ARRAY(c->list, count)};
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, what, error));
    for (size_t i = 0; i < count; ++i) {
        if (!vshi_mesh_degenerate(mesh, i)) {
            c->list[c->begin[1]++] = (uint32_t)i;
        }
    }
    c->count = 1;
    return t.solid ? VSH_OK : list_terrain_rims(mesh, t, c, error);
}

vsh_result vshi_components_find(const vsh_mesh *mesh, size_t index, vshi_components *found,
                                vsh_error *error) {
    *found = (vshi_components){0};
    VSHI_TRY(vshi_edges_check(mesh, index, error));
    vshi_terrain terrain;
    if (vshi_mesh_is_terrain(mesh, &terrain)) {
        return list_terrain(mesh, terrain, found, error);
    }
    walking w = {.mesh = mesh, .mirrored = vshi_transform_determinant(mesh->transform) < 0.0, .found = found};
    const size_t count = mesh->triangle_count;
    const vshi_array arrays[] = {VSHI_ARRAY(found->turned, count), VSHI_ARRAY(found->twisted, count),
                                 VSHI_ARRAY(found->list, count), VSHI_ARRAY(w.of, count),
                                 VSHI_ARRAY(w.queue, count)};
    vsh_result result;
    VSHI_TRY_DONE(vshi_edges_find(mesh, index, false, &w.edges, error));
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, what, error));
    found->doubled = w.edges.doubled;
    w.edges.doubled = NULL;
    walk_all(&w);
    VSHI_TRY_DONE(vshi_allocate((void **)&found->begin, found->count + 2, sizeof *found->begin, what, error));
    vshi_list_groups(w.of, count, (uint32_t)found->count, found->begin, found->list);
    VSHI_TRY_DONE(list_rims(&w, error));
done:
    free(w.queue);
    free(w.of);
    vshi_edges_free(&w.edges);
    return result;
}

void vshi_components_free(vshi_components *components) {
    free(components->rims);
    free(components->twisted);
    free(components->list);
    free(components->begin);
    free(components->doubled);
    free(components->turned);
    *components = (vshi_components){0};
}
