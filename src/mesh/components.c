#include "mesh/components.h"

#include "base/memory.h"
#include "mesh/edges.h"

#include <stdlib.h>

typedef struct walking {
    const vsh_mesh *mesh;
    vshi_edges edges;
    bool mirrored;
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
static void walk(walking *w, uint32_t seed, uint8_t *twisted) {
    vshi_components *c = w->found;
    const uint32_t number = (uint32_t)c->count++;
    size_t waiting = 1;
    w->queue[0] = seed;
    c->of[seed] = number;
    for (size_t at = 0; at < waiting; ++at) {
        const uint32_t i = w->queue[at];
        for (uint32_t side = 3 * i; side < 3 * i + 3; ++side) {
            const uint32_t partner = w->edges.partner[side];
            if (partner == VSHI_NO_PARTNER) {
                continue;
            }
            const uint32_t other = partner / 3;
            const uint8_t turned = c->turned[i] ^ (uint8_t)(upwards(w, side) == upwards(w, partner));
            if (c->of[other] == VSHI_NO_COMPONENT) {
                c->of[other] = number;
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

static vsh_result walk_all(walking *w, vsh_error *error) {
    vshi_components *c = w->found;
    const size_t count = w->mesh->triangle_count;
    uint8_t *twisted = NULL; /* as many as there may be */
    vsh_result result = vshi_allocate((void **)&twisted, count, 1, "components", error);
    for (size_t i = 0; i < count; ++i) {
        c->of[i] = VSHI_NO_COMPONENT;
    }
    for (size_t i = 0; i < count && result == VSH_OK; ++i) {
        if (c->of[i] == VSHI_NO_COMPONENT && !w->edges.skipped[i]) {
            walk(w, (uint32_t)i, &twisted[c->count]);
        }
    }
    for (size_t i = 0; i < count && result == VSH_OK; ++i) {
        const uint32_t first = w->edges.first[i];
        if (first != i) {
            c->of[i] = c->of[first];
            c->turned[i] = c->turned[first];
            c->doubled[i] = c->doubled[first];
        }
    }
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&c->twisted, c->count, 1, "components", error);
    }
    for (size_t i = 0; i < c->count && result == VSH_OK; ++i) {
        c->twisted[i] = twisted[i];
    }
    free(twisted);
    return result;
}

/* Lists triangles by component. */
static vsh_result list(walking *w, vsh_error *error) {
    vshi_components *c = w->found;
    vsh_result result =
        vshi_allocate((void **)&c->begin, c->count + 2, sizeof *c->begin, "components", error);
    if (result == VSH_OK) {
        result =
            vshi_allocate((void **)&c->list, w->mesh->triangle_count, sizeof *c->list, "components", error);
    }
    if (result != VSH_OK) {
        return result;
    }
    for (size_t i = 0; i < w->mesh->triangle_count; ++i) {
        if (c->of[i] != VSHI_NO_COMPONENT) {
            ++c->begin[c->of[i] + (size_t)2];
        }
    }
    for (size_t i = 2; i < c->count + 2; ++i) {
        c->begin[i] += c->begin[i - 1];
    }
    for (size_t i = 0; i < w->mesh->triangle_count; ++i) {
        if (c->of[i] != VSHI_NO_COMPONENT) {
            c->list[c->begin[c->of[i] + (size_t)1]++] = (uint32_t)i;
        }
    }
    return VSH_OK;
}

static vsh_result list_rims(walking *w, vsh_error *error) {
    vshi_components *c = w->found;
    const vsh_result result =
        vshi_allocate((void **)&c->rims, w->edges.open, sizeof *c->rims, "open edges", error);
    for (size_t at = 0; at < c->begin[c->count] && result == VSH_OK; ++at) {
        const uint32_t i = c->list[at];
        for (uint32_t k = 0; k < 3 && !w->edges.skipped[i]; ++k) {
            if (w->edges.partner[3 * i + k] == VSHI_NO_PARTNER) {
                uint32_t v[3];
                vshi_edges_corners(w->mesh, w->edges.weld, w->mirrored, i, v);
                const uint32_t a = v[k], b = v[(k + 1) % 3];
                c->rims[c->rim_count++] = (vshi_rim){c->of[i], c->turned[i] ? b : a, c->turned[i] ? a : b};
            }
        }
    }
    return result;
}

vsh_result vshi_components_find(const vsh_mesh *mesh, size_t index, vshi_components *found,
                                vsh_error *error) {
    *found = (vshi_components){0};
    walking w = {.mesh = mesh, .mirrored = vshi_transform_determinant(mesh->transform) < 0.0, .found = found};
    const size_t count = mesh->triangle_count;
    vsh_result result = vshi_edges_find(mesh, index, &w.edges, error);
    if (result == VSH_OK) {
        found->doubled = w.edges.doubled;
        w.edges.doubled = NULL;
        result = vshi_allocate((void **)&found->of, count, sizeof *found->of, "components", error);
    }
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&found->turned, count, 1, "components", error);
    }
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&w.queue, count, sizeof *w.queue, "components", error);
    }
    if (result == VSH_OK) {
        result = walk_all(&w, error);
    }
    if (result == VSH_OK) {
        result = list(&w, error);
    }
    if (result == VSH_OK) {
        result = list_rims(&w, error);
    }
    free(w.queue);
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
    free(components->of);
    *components = (vshi_components){0};
}
