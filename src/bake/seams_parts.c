/* T-junctions: where an edge ends in the middle of a longer one. Ends of edges that the surface does not go
 * on beyond are put into a tree, which each of these edges is led through; those that lie on it cut it in
 * parts, whose ends are then the very places of others. */
#include "bake/seams_search.h"

#include "bake/places.h"
#include "base/hash.h"
#include "base/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char what[] = "seams";

/* How far from an edge an end may be to lie on it, of the largest coordinate: places are rounded to 6e-8 of
 * it, at the edge's ends too. */
static const double ON_EDGE = 5e-7;

enum {
    MOST_CUTS = 1024,    /* of an edge: what is cut more often is no edge of a wall */
    MOST_LOOKED = 65536, /* ends near an edge */
    MOST_PAIRS = 8,      /* of a part with those before it */
    POLL_EDGES = 256
};

typedef struct part {
    uint64_t key; /* of its ends */
    uint32_t edge;
    bool cut; /* it is not a whole edge */
    double t[2];
    vshi_vec at[2];
} part;

/* An end of another edge that lies on one. */
typedef struct on_edge {
    double t;
    uint32_t number;
} on_edge;

typedef struct finding {
    vshi_seam_search *search;
    uint32_t *edges; /* [count]: that end somewhere */
    size_t count;
    vshi_vec centre;
    double within;
    vshi_places ends; /* number: 2 × place in `edges` + end */
    part *parts;      /* [part_count] */
    size_t part_count, part_room;
    bool any_cut;
    /* of the edge that is looked at */
    vshi_vec at[2];
    on_edge cuts[MOST_CUTS];
    size_t cut_count, looked;
} finding;

static void places_of(const finding *f, uint32_t edge, vshi_vec at[2]) {
    size_t local;
    const vsh_mesh *mesh = vshi_edge_mesh(f->search->pages, edge, &local);
    for (uint32_t k = 0; k < 2; ++k) {
        at[k] = vshi_edge_place(mesh, mesh->indices[3 * local + (edge % 3 + k) % 3]);
    }
}

static void to_floats(const finding *f, vshi_vec place, float at[3]) {
    const vshi_vec from = vshi_sub(place, f->centre);
    at[0] = (float)from.x;
    at[1] = (float)from.y;
    at[2] = (float)from.z;
}

/* Whether memory allows for `bytes` more than the search holds. */
static vsh_result check_bytes(const finding *f, double bytes, vsh_error *error) {
    const vshi_seam_search *s = f->search;
    return vshi_check_limit(s->run, s->held + (double)s->room * sizeof *s->seams->list + bytes, what, error);
}

static vsh_result list_edges(finding *f, vsh_error *error) {
    const uint8_t *goes_on = f->search->goes_on;
    const size_t all = 3 * f->search->pages->first[f->search->pages->count];
    for (size_t edge = 0; edge < all; ++edge) {
        f->count += goes_on[edge] == 0;
    }
    const double each = sizeof *f->edges + 2.0 * VSHI_PLACE_BYTES + 2.0 * sizeof *f->parts;
    VSHI_TRY(check_bytes(f, (double)f->count * each, error));
    VSHI_TRY(vshi_allocate((void **)&f->edges, f->count, sizeof *f->edges, what, error));
    for (size_t edge = 0, at = 0; edge < all; ++edge) {
        if (goes_on[edge] == 0) {
            f->edges[at++] = (uint32_t)edge;
        }
    }
    return VSH_OK;
}

static vsh_result list_ends(finding *f, vsh_error *error) {
    vshi_vec low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < f->count; ++i) {
        vshi_vec at[2];
        places_of(f, f->edges[i], at);
        for (int k = 0; k < 2; ++k) {
            low = (vshi_vec){fmin(low.x, at[k].x), fmin(low.y, at[k].y), fmin(low.z, at[k].z)};
            high = (vshi_vec){fmax(high.x, at[k].x), fmax(high.y, at[k].y), fmax(high.z, at[k].z)};
        }
    }
    f->centre = vshi_scale(vshi_add(low, high), 0.5);
    const double largest = fmax(fmax(fmax(-low.x, high.x), fmax(-low.y, high.y)), fmax(-low.z, high.z));
    f->within = ON_EDGE * fmax(largest, 0.0);
    f->ends.count = 2 * f->count;
    VSHI_TRY(vshi_allocate((void **)&f->ends.list, f->ends.count, sizeof *f->ends.list, what, error));
    for (size_t i = 0; i < f->count; ++i) {
        vshi_vec at[2];
        places_of(f, f->edges[i], at);
        for (size_t k = 0; k < 2; ++k) {
            to_floats(f, at[k], f->ends.list[2 * i + k].at);
            f->ends.list[2 * i + k].number = (uint32_t)(2 * i + k);
        }
    }
    return vshi_places_sort(&f->ends, error);
}

/* --- parts */

static vshi_vec end_of(const finding *f, uint32_t number) {
    vshi_vec at[2];
    places_of(f, f->edges[number / 2], at);
    return at[number % 2];
}

/* Notes an end that lies on the edge, and not at its ends. */
static bool note(void *user, uint32_t number) {
    finding *f = user;
    const vshi_vec along = vshi_sub(f->at[1], f->at[0]), from = vshi_sub(end_of(f, number), f->at[0]);
    const double square = vshi_dot(along, along), t = vshi_dot(from, along) / square;
    const vshi_vec off = vshi_sub(from, vshi_scale(along, t));
    const double margin = f->within / sqrt(square);
    if (t > margin && t < 1.0 - margin && vshi_dot(off, off) <= f->within * f->within) {
        f->cuts[f->cut_count++] = (on_edge){t, number};
    }
    return f->cut_count < MOST_CUTS && ++f->looked < MOST_LOOKED;
}

static int compare_cuts(const void *a, const void *b) {
    const on_edge *x = a, *y = b;
    return x->t != y->t ? (x->t > y->t) - (x->t < y->t) : (x->number > y->number) - (x->number < y->number);
}

static uint64_t hash_place(vshi_vec p) {
    const double at[3] = {p.x + 0.0, p.y + 0.0, p.z + 0.0}; /* -0 is 0 */
    uint64_t key = 1, bits;
    for (int k = 0; k < 3; ++k) {
        memcpy(&bits, &at[k], sizeof bits);
        key = vshi_mix(key ^ bits);
    }
    return key;
}

static vsh_result add_part(finding *f, part added, vsh_error *error) {
    if (vshi_same_place(added.at[0], added.at[1])) {
        return VSH_OK;
    }
    if (f->part_count == f->part_room) {
        f->part_room = 2 * f->part_room + 64;
        VSHI_TRY(check_bytes(f, (double)f->part_room * sizeof *f->parts, error));
        part *grown = realloc(f->parts, f->part_room * sizeof *grown);
        if (grown == NULL) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", what);
        }
        f->parts = grown;
    }
    added.key = vshi_mix(hash_place(added.at[0]) + hash_place(added.at[1])); /* either way round */
    f->parts[f->part_count++] = added;
    return VSH_OK;
}

/* The parts of an edge, which is one where nothing lies on it. */
static vsh_result cut_edge(finding *f, uint32_t edge, vsh_error *error) {
    float a[3], b[3];
    f->cut_count = f->looked = 0;
    places_of(f, edge, f->at);
    to_floats(f, f->at[0], a);
    to_floats(f, f->at[1], b);
    vshi_places_along(&f->ends, a, b, (float)(4.0 * f->within), note, f); /* 32 bits know less */
    if (f->cut_count == MOST_CUTS || f->looked == MOST_LOOKED) {
        f->cut_count = 0;
    }
    qsort(f->cuts, f->cut_count, sizeof *f->cuts, compare_cuts);
    f->any_cut = f->any_cut || f->cut_count > 0;
    part next = {.edge = edge, .cut = f->cut_count > 0, .t = {0.0, 1.0}, .at = {f->at[0], f->at[1]}};
    for (size_t i = 0; i < f->cut_count; ++i) {
        next.t[1] = f->cuts[i].t;
        next.at[1] = end_of(f, f->cuts[i].number);
        VSHI_TRY(add_part(f, next, error));
        next.t[0] = next.t[1];
        next.at[0] = next.at[1];
    }
    next.t[1] = 1.0;
    next.at[1] = f->at[1];
    return add_part(f, next, error);
}

static int order_parts(const void *a, const void *b) {
    const part *x = a, *y = b;
    if (x->key != y->key) {
        return x->key < y->key ? -1 : 1;
    }
    return x->edge != y->edge ? (x->edge > y->edge) - (x->edge < y->edge)
                              : (x->t[0] > y->t[0]) - (x->t[0] < y->t[0]);
}

/* --- pairs */

static void look_at_part(const finding *f, const part *p, vshi_edge_end ends[2]) {
    vshi_edge_end whole[2];
    vshi_edge_look_at(f->search->pages, p->edge, whole);
    for (int k = 0; k < 2; ++k) {
        ends[k] = whole[0];
        ends[k].t = p->t[k];
        ends[k].at = p->at[k];
        ends[k].x += p->t[k] * (whole[1].x - whole[0].x);
        ends[k].y += p->t[k] * (whole[1].y - whole[0].y);
    }
}

static bool same_ends(const part *p, const part *q) {
    return (vshi_same_place(p->at[0], q->at[0]) && vshi_same_place(p->at[1], q->at[1])) ||
           (vshi_same_place(p->at[0], q->at[1]) && vshi_same_place(p->at[1], q->at[0]));
}

/* Compares parts with those before them. Whole edges have been compared. */
static vsh_result compare_parts(const finding *f, vsh_error *error) {
    for (size_t i = 0; i < f->part_count; ++i) {
        const part *p = &f->parts[i];
        for (size_t k = i; k > 0 && i - k < MOST_PAIRS && f->parts[k - 1].key == p->key; --k) {
            const part *q = &f->parts[k - 1];
            const uint32_t pair[2] = {q->edge, p->edge};
            vshi_edge_end a[2], b[2];
            bool goes_on;
            if ((p->cut || q->cut) && same_ends(p, q)) {
                look_at_part(f, q, a);
                look_at_part(f, p, b);
                VSHI_TRY(vshi_seam_compare(f->search, pair, a, b, &goes_on, error));
            }
        }
    }
    return VSH_OK;
}

static vsh_result find(finding *f, vsh_error *error) {
    VSHI_TRY(list_edges(f, error));
    if (f->count == 0 || f->count > UINT32_MAX / 2) {
        return VSH_OK; /* more are not numbered */
    }
    VSHI_TRY(list_ends(f, error));
    for (size_t i = 0; i < f->count; ++i) {
        if (i % POLL_EDGES == 0 && vshi_job_advance(f->search->job, 0)) {
            return vshi_job_fail_cancelled(f->search->job, error);
        }
        VSHI_TRY(cut_edge(f, f->edges[i], error));
    }
    if (!f->any_cut) {
        return VSH_OK;
    }
    qsort(f->parts, f->part_count, sizeof *f->parts, order_parts);
    return compare_parts(f, error);
}

vsh_result vshi_seam_parts_find(vshi_seam_search *search, vsh_error *error) {
    finding *f = NULL;
    VSHI_TRY(vshi_allocate((void **)&f, 1, sizeof *f, what, error));
    f->search = search;
    const vsh_result result = find(f, error);
    free(f->parts);
    vshi_places_free(&f->ends);
    free(f->edges);
    free(f);
    return result;
}
