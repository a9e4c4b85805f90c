/* Connections of triangles by their vertices and edges. */
#include "geometry/edges.h"

#include "base/bytes.h"
#include "base/elementary.h"
#include "base/memory.h"

#include <stdlib.h>
#include <string.h>

vsh_result vshi_weld(size_t count, vshi_key_fn *key_of, const void *user, uint32_t *weld, vsh_error *error) {
    size_t capacity = 16;
    while (capacity < 2 * count) {
        capacity *= 2;
    }
    uint32_t *slots = NULL; /* vertex + 1, or 0 where empty */
    VSHI_TRY(vshi_allocate((void **)&slots, capacity, sizeof *slots, "welding vertices", error));
    for (size_t v = 0; v < count; ++v) {
        uint64_t key[VSHI_KEY_WORDS], other[VSHI_KEY_WORDS], hash = 1;
        key_of(user, v, key);
        for (int k = 0; k < VSHI_KEY_WORDS; ++k) {
            hash = vshi_mix(hash ^ key[k]);
        }
        size_t slot = (size_t)hash & (capacity - 1);
        for (; slots[slot] != 0; slot = (slot + 1) & (capacity - 1)) {
            key_of(user, slots[slot] - 1, other);
            if (memcmp(key, other, sizeof key) == 0) {
                break;
            }
        }
        if (slots[slot] == 0) {
            slots[slot] = (uint32_t)v + 1;
        }
        weld[v] = slots[slot] - 1;
    }
    free(slots);
    return VSH_OK;
}

void vshi_list_groups(const uint32_t *group, size_t count, uint32_t groups, uint32_t *begin, uint32_t *list) {
    for (size_t i = 0; i < count; ++i) {
        if (group[i] != UINT32_MAX) {
            ++begin[group[i] + (size_t)2];
        }
    }
    for (size_t g = 0; g < groups; ++g) {
        begin[g + 2] += begin[g + 1];
    }
    for (size_t i = 0; i < count; ++i) {
        if (group[i] != UINT32_MAX) {
            list[begin[group[i] + (size_t)1]++] = (uint32_t)i;
        }
    }
}

/* Sorts the sides `from` (NULL: all) stably by one of their ends. Near vertices of a mesh mostly have near
 * numbers, so memory is accessed in order, unlike a hash table's. */
static void sort_by_end(const vshi_sorted_sides *sides, int end, const uint32_t *from, uint32_t *first,
                        uint32_t *sorted) {
    const uint32_t count = (uint32_t)(3 * sides->triangle_count);
    uint32_t ends[2];
    memset(first, 0, (sides->vertex_count + 1) * sizeof *first);
    for (uint32_t side = 0; side < count; ++side) {
        vshi_side_ends(sides->corners, side, ends);
        ++first[ends[end] + (size_t)1];
    }
    for (size_t v = 0; v < sides->vertex_count; ++v) {
        first[v + 1] += first[v];
    }
    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t side = from != NULL ? from[i] : i;
        vshi_side_ends(sides->corners, side, ends);
        sorted[first[ends[end]]++] = side;
    }
}

vsh_result vshi_sort_sides(vshi_sorted_sides *sides, vsh_error *error) {
    const char *what = "edges of triangles";
    const size_t count = 3 * sides->triangle_count;
    uint32_t *first = NULL, *by_higher = NULL;
    if (sides->triangle_count > UINT32_MAX / 3) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %zu triangles, at most %u", what, sides->triangle_count,
                         UINT32_MAX / 3);
    }
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&first, sides->vertex_count + 1, sizeof *first, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&by_higher, count, sizeof *by_higher, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&sides->sorted, count, sizeof *sides->sorted, what, error));
    sort_by_end(sides, 1, NULL, first, by_higher);
    sort_by_end(sides, 0, by_higher, first, sides->sorted);
done:
    free(by_higher);
    free(first);
    return result;
}

/* --- partners. Two sides at an edge are partners. More are sorted by their triangles' angles around the
 * edge: a triangle whose back faces the next one begins a wedge of solid, which that one ends. So boxes that
 * share an edge or a face in one mesh stay boxes. */

enum { MOST_LAYERS = 16 }; /* of copies; further triangles have no partners */

/* A side at the current edge. */
typedef struct use {
    uint32_t side;
    uint32_t third;     /* vertex of the triangle, beside the edge's */
    uint32_t downwards; /* it runs from the higher to the lower vertex */
} use;

/* A use by its angle around the edge. */
typedef struct spoke {
    double angle;
    uint32_t side;
    uint32_t downwards;
    bool frayed; /* its triangle is connected to one with an open edge */
    bool joined;
} spoke;

typedef struct finding {
    const vsh_mesh *mesh;
    bool mirrored;
    vshi_edges *edges;
    uint8_t *flat;  /* [triangle_count]: no area */
    uint8_t *layer; /* [triangle_count] */
    int layers;
    uint32_t *corners; /* [triangle_count][3]: welded, in the world's order */
    vshi_sorted_sides sides;
    use *uses;       /* [most sides of an edge] */
    spoke *spokes;   /* [most sides of an edge] */
    size_t odd;      /* edges of three, five, … triangles */
    uint8_t *frayed; /* [triangle_count]; set by find_frayed() */
    uint32_t *queue; /* [triangle_count] */
} finding;

static int compare_uses(const void *a, const void *b) {
    const use *x = a, *y = b;
    if (x->third != y->third) {
        return x->third < y->third ? -1 : 1;
    }
    if (x->downwards != y->downwards) {
        return x->downwards < y->downwards ? -1 : 1;
    }
    return (x->side > y->side) - (x->side < y->side);
}

static void join_pair(vshi_edges *edges, uint32_t a, uint32_t b) {
    edges->partner[a] = b;
    edges->partner[b] = a;
}

static int compare_spokes(const void *a, const void *b) {
    const spoke *x = a, *y = b;
    if (x->angle != y->angle) {
        return x->angle < y->angle ? -1 : 1;
    }
    if (x->downwards != y->downwards) { /* coinciding faces: one wedge ends before the next begins */
        return x->downwards < y->downwards ? -1 : 1;
    }
    return (x->side > y->side) - (x->side < y->side);
}

/* Chooses the spoke of three that ends at the edge, while the two others continue each other. A frayed spoke
 * is a card stuck to a solid, and ends. Else the two that come nearest to a plane continue, preferably one
 * that begins a wedge and one that ends it. */
static size_t ending_of_three(const spoke *s) {
    static const double PI = 3.14159265358979323846;
    size_t best = 0;
    double least = INFINITY;
    for (size_t left_out = 0; left_out < 3; ++left_out) {
        const spoke *a = &s[left_out == 0 ? 1 : 0], *b = &s[left_out == 2 ? 1 : 2];
        const double bend = fabs(fabs(b->angle - a->angle) - PI) +
                            (a->downwards == b->downwards ? 10.0 : 0.0) + (s[left_out].frayed ? 0.0 : 100.0);
        if (bend < least) {
            least = bend;
            best = left_out;
        }
    }
    return best;
}

static void join_spokes(vshi_edges *edges, spoke *s, size_t count) {
    qsort(s, count, sizeof *s, compare_spokes);
    if (count == 3) {
        s[ending_of_three(s)].joined = true;
    }
    for (size_t i = 0; i < count; ++i) {
        const size_t next = (i + 1) % count;
        if (s[i].downwards && !s[next].downwards && !s[i].joined && !s[next].joined) {
            join_pair(edges, s[i].side, s[next].side);
            s[i].joined = s[next].joined = true;
        }
    }
    /* faces that disagree: join neighbours */
    size_t waiting = count;
    for (size_t i = 0; i < count; ++i) {
        if (s[i].joined) {
            continue;
        }
        if (waiting == count) {
            waiting = i;
        } else {
            join_pair(edges, s[waiting].side, s[i].side);
            waiting = count;
        }
    }
}

/* Joins more than two sides of an edge. */
static void join_many(finding *f, size_t count) {
    const use *uses = f->uses;
    uint32_t ends[2];
    vshi_side_ends(f->corners, uses[0].side, ends);
    const vshi_vec origin = vshi_mesh_place(f->mesh, ends[0]);
    const vshi_vec axis = vshi_unit(vshi_sub(vshi_mesh_place(f->mesh, ends[1]), origin));
    vshi_vec u, v;
    vshi_frame(axis, &u, &v);
    for (size_t i = 0; i < count; ++i) {
        const vshi_vec to = vshi_sub(vshi_mesh_place(f->mesh, uses[i].third), origin);
        f->spokes[i] = (spoke){vshi_atan2(vshi_dot(to, v), vshi_dot(to, u)), uses[i].side, uses[i].downwards,
                               f->frayed[uses[i].side / 3], false};
    }
    join_spokes(f->edges, f->spokes, count);
}

/* Lists the sides of an edge, in a layer, except for triangles that are skipped or duplicates. */
static size_t list_uses(finding *f, size_t begin, size_t end, int layer) {
    vshi_edges *edges = f->edges;
    size_t count = 0, kept = 0;
    for (size_t i = begin; i < end; ++i) {
        const uint32_t side = f->sides.sorted[i], *v = f->corners + side / 3 * (size_t)3;
        if (!edges->skipped[side / 3] && f->layer[side / 3] == layer) {
            f->uses[count++] = (use){side, v[(side + 2) % 3], v[side % 3] > v[(side + 1) % 3]};
        }
    }
    if (count > 1) {
        qsort(f->uses, count, sizeof *f->uses, compare_uses);
    }
    for (size_t i = 0; i < count; ++i) {
        const use one = f->uses[i], *before = kept > 0 ? &f->uses[kept - 1] : NULL;
        if (before != NULL && before->third == one.third) {
            if (before->downwards == one.downwards) {
                edges->first[one.side / 3] = before->side / 3;
                edges->skipped[one.side / 3] = 1;
                continue;
            }
            edges->doubled[one.side / 3] = 1;
            edges->doubled[before->side / 3] = 1;
        }
        f->uses[kept++] = one;
    }
    return kept;
}

/* An edge of a layer. */
typedef struct cursor {
    size_t begin, end; /* of its sides */
    int layer;
} cursor;

/* Lists the uses of the edge after `at`, which begins as {0, 0, 0}; false after the last. */
static bool next_uses(finding *f, cursor *at, size_t *count) {
    if (at->begin == at->end || ++at->layer == f->layers) {
        at->layer = 0;
        at->begin = at->end;
        if (at->begin == 3 * f->mesh->triangle_count) {
            return false;
        }
        at->end = vshi_next_edge(&f->sides, at->begin);
    }
    *count = list_uses(f, at->begin, at->end, at->layer);
    return true;
}

/* Joins the sides of each edge with two, four, … (`parity` 0) or three, five, … (1) sides, and counts other
 * edges of more than two. */
static void join_sides(finding *f, size_t parity) {
    size_t count;
    f->odd = 0;
    for (cursor at = {0, 0, 0}; next_uses(f, &at, &count);) {
        if (count == 2 && parity == 0) {
            join_pair(f->edges, f->uses[0].side, f->uses[1].side);
        } else if (count > 2 && count % 2 == parity) {
            join_many(f, count);
        } else {
            f->odd += count > 2;
        }
    }
}

/* Marks the triangles that are connected to one with an open edge. */
static void find_frayed(finding *f) {
    const vshi_edges *edges = f->edges;
    size_t waiting = 0, count;
    for (cursor c = {0, 0, 0}; next_uses(f, &c, &count);) {
        if (count == 1 && !f->frayed[f->uses[0].side / 3]) {
            f->frayed[f->uses[0].side / 3] = 1;
            f->queue[waiting++] = f->uses[0].side / 3;
        }
    }
    for (size_t at = 0; at < waiting; ++at) {
        for (uint32_t side = 3 * f->queue[at]; side < 3 * f->queue[at] + 3; ++side) {
            const uint32_t other = edges->partner[side] / 3;
            if (edges->partner[side] != VSHI_NO_PARTNER && !f->frayed[other]) {
                f->frayed[other] = 1;
                f->queue[waiting++] = other;
            }
        }
    }
}

/* Fills partner, skipped, first, doubled and open. Flat triangles may join two long edges to one. */
static void join_edges(finding *f, bool with_flat) {
    const size_t count = f->mesh->triangle_count;
    vshi_edges *edges = f->edges;
    memset(edges->partner, 0xff, 3 * count * sizeof *edges->partner);
    memset(edges->doubled, 0, count);
    memset(f->frayed, 0, count);
    for (size_t i = 0; i < count; ++i) {
        const uint32_t *v = f->corners + 3 * i;
        edges->first[i] = (uint32_t)i;
        edges->skipped[i] = v[0] == v[1] || v[1] == v[2] || v[2] == v[0] || (!with_flat && f->flat[i]);
    }
    join_sides(f, 0);
    if (f->odd > 0) { /* these need to know the frayed triangles */
        find_frayed(f);
        join_sides(f, 1);
    }
    edges->open = 0;
    for (size_t side = 0; side < 3 * count; ++side) {
        edges->open += !edges->skipped[side / 3] && edges->partner[side] == VSHI_NO_PARTNER;
    }
}

/* A vshi_key_fn: a triangle's corners in any order. */
static void key_of_corners(const void *user, size_t triangle, uint64_t key[VSHI_KEY_WORDS]) {
    const uint32_t *v = (const uint32_t *)user + 3 * triangle;
    const uint32_t low = v[0] < v[1] ? v[0] : v[1], high = v[0] < v[1] ? v[1] : v[0];
    key[0] = v[2] < low ? v[2] : low;
    key[1] = v[2] < low ? low : v[2] > high ? high : v[2];
    key[2] = v[2] > high ? v[2] : high;
}

/* A triangle's layer is the number of triangles before it with the same corners. */
static vsh_result find_layers(finding *f, vsh_error *error) {
    const size_t count = f->mesh->triangle_count;
    uint32_t *original, *copies;
    const vshi_array arrays[] = {VSHI_ARRAY(original, count), VSHI_ARRAY(copies, count)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, "copies of triangles", error));
    const vsh_result result = vshi_weld(count, key_of_corners, f->corners, original, error);
    for (size_t i = 0; result == VSH_OK && i < count; ++i) {
        uint32_t *layer = &copies[original[i]];
        f->layer[i] = (uint8_t)*layer;
        *layer += *layer < MOST_LAYERS;
        f->layers = (int)*layer > f->layers ? (int)*layer : f->layers;
    }
    free(original);
    return result;
}

static void key_of_place(const void *user, size_t vertex, uint64_t key[VSHI_KEY_WORDS]) {
    const float *p = (const float *)user + 3 * vertex;
    const float place[2 * VSHI_KEY_WORDS] = {p[0] + 0.0f, p[1] + 0.0f, p[2] + 0.0f}; /* -0 is 0 */
    memcpy(key, place, sizeof place);
}

/* The welded vertices of triangle i in the world's order. */
static void find_corners(const vsh_mesh *mesh, const uint32_t *weld, bool mirrored, size_t i, uint32_t v[3]) {
    const uint32_t *given = mesh->indices + 3 * i;
    v[0] = weld[given[0]];
    v[1] = weld[given[mirrored ? 2 : 1]];
    v[2] = weld[given[mirrored ? 1 : 2]];
}

/* Sets weld[v] to the lowest vertex at the position of v. */
static vsh_result weld_positions(const vsh_mesh *mesh, uint32_t *weld, vsh_error *error) {
    return vshi_weld(mesh->vertex_count, key_of_place, mesh->positions, weld, error);
}

static vsh_result sort_sides(finding *f, vsh_error *error) {
    const vsh_mesh *mesh = f->mesh;
    size_t most = 0;
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        find_corners(mesh, f->edges->weld, f->mirrored, i, f->corners + 3 * i);
    }
    f->sides = (vshi_sorted_sides){f->corners, mesh->triangle_count, mesh->vertex_count, NULL};
    VSHI_TRY(vshi_sort_sides(&f->sides, error));
    for (size_t i = 0, end; i < 3 * mesh->triangle_count; i = end) {
        end = vshi_next_edge(&f->sides, i);
        most = end - i > most ? end - i : most;
    }
    VSHI_TRY(vshi_allocate((void **)&f->spokes, most, sizeof *f->spokes, "edges of triangles", error));
    return vshi_allocate((void **)&f->uses, most, sizeof *f->uses, "edges of triangles", error);
}

vsh_result vshi_edges_check(const vsh_mesh *mesh, size_t index, vsh_error *error) {
    return mesh->triangle_count <= UINT32_MAX / 3
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_LIMIT, "%s: %zu triangles, %u at most",
                           vshi_mesh_label(mesh, index).text, mesh->triangle_count, UINT32_MAX / 3);
}

vsh_result vshi_edges_find(const vsh_mesh *mesh, size_t index, bool copies_apart, vshi_edges *edges,
                           vsh_error *error) {
    *edges = (vshi_edges){0};
    VSHI_TRY(vshi_edges_check(mesh, index, error));
    const size_t count = mesh->triangle_count;
    if (count == 0) {
        return VSH_OK;
    }
    finding f = {.mesh = mesh,
                 .mirrored = vshi_transform_determinant(mesh->transform) < 0.0,
                 .edges = edges,
                 .layers = 1};
    const vshi_array arrays[] = {VSHI_ARRAY(edges->weld, mesh->vertex_count),
                                 VSHI_ARRAY(edges->skipped, count), VSHI_ARRAY(edges->first, count),
                                 VSHI_ARRAY(edges->doubled, count), VSHI_ARRAY(edges->partner, 3 * count)};
    const vshi_array own[] = {VSHI_ARRAY(f.flat, count), VSHI_ARRAY(f.layer, count),
                              VSHI_ARRAY(f.corners, 3 * count), VSHI_ARRAY(f.frayed, count),
                              VSHI_ARRAY(f.queue, count)};
    size_t flats = 0;
    vsh_result result;
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, "edges of triangles", error));
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(own, "edges of triangles", error));
    VSHI_TRY_DONE(weld_positions(mesh, edges->weld, error));
    VSHI_TRY_DONE(sort_sides(&f, error));
    if (copies_apart) {
        VSHI_TRY_DONE(find_layers(&f, error));
    }
    for (size_t i = 0; i < count; ++i) {
        f.flat[i] = vshi_mesh_degenerate(mesh, i);
        flats += f.flat[i];
    }
    join_edges(&f, false);
    const size_t open = edges->open;
    if (flats > 0 && open > 0) { /* a mesh that is closed with or without them is closed */
        join_edges(&f, true);
        if (edges->open >= open) {
            join_edges(&f, false);
        }
    }
done:
    free(f.uses);
    free(f.spokes);
    free(f.sides.sorted);
    free(f.flat); /* the block's first array */
    return result;
}

void vshi_edges_free(vshi_edges *edges) {
    free(edges->partner);
    free(edges->doubled);
    free(edges->first);
    free(edges->skipped);
    free(edges->weld);
    *edges = (vshi_edges){0};
}

/* --- components */

#define NO_COMPONENT UINT32_MAX

typedef struct walking {
    const vsh_mesh *mesh;
    vshi_edges edges;
    bool mirrored;
    uint32_t *of;    /* [triangle_count]: its component; NO_COMPONENT without area */
    uint32_t *queue; /* [triangle_count] */
    vshi_components *found;
} walking;

/* Whether a triangle's side runs from its edge's lower vertex to the upper one. */
static bool upwards(const walking *w, uint32_t side) {
    uint32_t v[3];
    find_corners(w->mesh, w->edges.weld, w->mirrored, side / 3, v);
    return v[side % 3] < v[(side % 3 + 1) % 3];
}

/* Numbers and turns all triangles connected to `seed`. */
static void number_component(walking *w, uint32_t seed) {
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

static void number_components(walking *w) {
    vshi_components *c = w->found;
    const size_t count = w->mesh->triangle_count;
    for (size_t i = 0; i < count; ++i) {
        w->of[i] = NO_COMPONENT;
    }
    for (size_t i = 0; i < count; ++i) {
        if (w->of[i] == NO_COMPONENT && !w->edges.skipped[i]) {
            number_component(w, (uint32_t)i);
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
                find_corners(w->mesh, w->edges.weld, w->mirrored, i, v);
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

/* Makes the one component of a terrain, whose triangles' order defines their connections. */
static vsh_result list_terrain(const vsh_mesh *mesh, vshi_terrain t, vshi_components *c, vsh_error *error) {
    const size_t count = mesh->triangle_count;
    const vshi_array arrays[] = {VSHI_ARRAY(c->turned, count), VSHI_ARRAY(c->doubled, count),
                                 VSHI_ARRAY(c->twisted, 1), VSHI_ARRAY(c->begin, 3),
                                 VSHI_ARRAY(c->list, count)};
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, "components", error));
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
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, "components", error));
    found->doubled = w.edges.doubled;
    w.edges.doubled = NULL;
    number_components(&w);
    VSHI_TRY_DONE(
        vshi_allocate((void **)&found->begin, found->count + 2, sizeof *found->begin, "components", error));
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

/* --- checks of a mesh's edges. An edge of an odd number of triangles is a border. An edge whose triangles
 * run along it more often one way than the other joins triangles that disagree about the outside. */

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

/* Shapes of triangles: FLAT has corners on a line. The edges of COLLAPSED, with two corners at one place,
 * cancel. */
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
    uint32_t *weld, *corners;
    uint8_t *shape; /* of each triangle */
    vshi_sorted_sides sides = {NULL, count, mesh->vertex_count, NULL};
    edge_count solid = {0, 0}, all = {0, 0};
    const vshi_array arrays[] = {VSHI_ARRAY(corners, 3 * count), VSHI_ARRAY(shape, count),
                                 VSHI_ARRAY(weld, mesh->vertex_count)};
    vsh_result result;
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, "edges of triangles", error));
    VSHI_TRY_DONE(weld_positions(mesh, weld, error));
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
    /* A flat triangle casts nothing, but may join two long edges to one. A mesh that is closed with or
     * without such triangles is closed. */
    const bool with_flat = all.open < solid.open;
    report->open_edges = with_flat ? all.open : solid.open;
    report->flipped_edges = with_flat ? all.flipped : solid.flipped;
done:
    free(sides.sorted);
    free(corners);
    return result;
}
