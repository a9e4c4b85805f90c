/* Edges with equal ends in the world, found by a hash table of edges: where the lightmap's coordinates are
 * equal too, two triangles are of one chart; where they are not, and the surface is smooth, there is a seam.
 */
#include "bake/seams_parts.h"
#include "base/hash.h"
#include "base/memory.h"
#include "base/try.h"
#include "mesh/mesh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    NO_EDGE = UINT32_MAX,
    MOST_PAIRS = 8, /* of an edge with those before it: what many triangles meet at is no surface */
    BATCH = 96,
    POLL_TRIANGLES = 4096 /* between two looks at the cancel flag */
};

typedef struct slot {
    uint32_t edge; /* 3 × triangle + corner that it begins with, of the last; NO_EDGE: free */
    uint32_t hash;
} slot;

typedef struct edges {
    const vshi_seam_pages *pages;
    double cosine;
    vshi_job *job;
    uint32_t *chart;    /* union-find, while charts are joined */
    slot *slots;        /* [slot_count], a power of two */
    uint32_t *previous; /* [3 triangles]: edge of the same ends before it; NO_EDGE: none */
    uint8_t *goes_on;   /* [3 triangles]: its surface does beyond it, on another edge; or it has no area */
    size_t slot_count;
    vshi_seam_parts parts;
} edges;

static uint64_t hash_place(vshi_vec p) {
    const double at[3] = {p.x + 0.0, p.y + 0.0, p.z + 0.0}; /* -0 is 0 */
    uint64_t key = 1, bits;
    for (int k = 0; k < 3; ++k) {
        memcpy(&bits, &at[k], sizeof bits);
        key = vshi_mix(key ^ bits);
    }
    return key;
}

static void places_of(const vsh_mesh *mesh, size_t local, size_t k, vshi_vec at[2]) {
    at[0] = vshi_edge_place(mesh, mesh->indices[3 * local + k]);
    at[1] = vshi_edge_place(mesh, mesh->indices[3 * local + (k + 1) % 3]);
}

static bool same_ends(const vshi_vec a[2], const vshi_vec b[2]) {
    return (vshi_same_place(a[0], b[0]) && vshi_same_place(a[1], b[1])) ||
           (vshi_same_place(a[0], b[1]) && vshi_same_place(a[1], b[0]));
}

/* Edges that are put into the table together: their slots are fetched from memory meanwhile. */
typedef struct batch {
    uint32_t edge[BATCH];
    uint64_t key[BATCH];
    vshi_vec at[BATCH][2];
    size_t count;
} batch;

static void add(const edges *e, batch *b, uint32_t edge, const vsh_mesh *mesh, size_t local) {
    vshi_vec *at = b->at[b->count];
    places_of(mesh, local, edge % 3, at);
    const uint64_t key = vshi_mix(hash_place(at[0]) + hash_place(at[1])); /* either way round */
    b->edge[b->count] = edge;
    b->key[b->count++] = key;
    __builtin_prefetch(&e->slots[(size_t)key & (e->slot_count - 1)], 1);
}

/* Puts an edge behind those of equal ends. */
static void put(edges *e, uint32_t edge, uint64_t key, const vshi_vec at[2]) {
    const uint32_t hash = (uint32_t)(key >> 32);
    size_t i = (size_t)key & (e->slot_count - 1);
    for (; e->slots[i].edge != NO_EDGE; i = (i + 1) & (e->slot_count - 1)) {
        vshi_vec other[2];
        size_t local;
        if (e->slots[i].hash != hash) {
            continue;
        }
        const vsh_mesh *mesh = vshi_edge_mesh(e->pages, e->slots[i].edge, &local);
        places_of(mesh, local, e->slots[i].edge % 3, other);
        if (same_ends(at, other)) {
            break;
        }
    }
    e->previous[edge] = e->slots[i].edge;
    e->slots[i] = (slot){edge, hash};
}

static void put_all(edges *e, batch *b) {
    for (size_t i = 0; i < b->count; ++i) {
        put(e, b->edge[i], b->key[i], b->at[i]);
    }
    b->count = 0;
}

/* --- pairs of edges */

/* Both edges, the second turned so that it begins where the first does. */
static void look_at_pair(const edges *e, uint32_t a, uint32_t b, vshi_edge_end first[2],
                         vshi_edge_end second[2]) {
    vshi_edge_look_at(e->pages, a, first);
    vshi_edge_look_at(e->pages, b, second);
    vshi_ends_turn(first, second);
}

/* --- all edges */

static bool cancelled(const edges *e, size_t triangle) {
    return triangle % POLL_TRIANGLES == 0 && vshi_job_advance(e->job, 0);
}

static vsh_result sort_page(edges *e, const vshi_charts *charts, batch *b, uint32_t *triangle,
                            vsh_error *error) {
    for (size_t m = 0; m < charts->mesh_count; ++m) {
        for (size_t i = 0; i < charts->meshes[m].triangle_count; ++i, ++*triangle) {
            if (cancelled(e, *triangle)) {
                return vshi_job_fail_cancelled(e->job, error);
            }
            vshi_uv_triangle unused;
            const bool used = vshi_charts_triangle(charts, m, i, &unused);
            e->chart[*triangle] = *triangle;
            for (uint32_t k = 0; k < 3; ++k) {
                e->previous[3 * *triangle + k] = NO_EDGE;
                e->goes_on[3 * *triangle + k] = !used;
                if (used) {
                    add(e, b, 3 * *triangle + k, &charts->meshes[m], i);
                }
            }
            if (b->count > BATCH - 3) {
                put_all(e, b);
            }
        }
    }
    return VSH_OK;
}

static vsh_result sort_edges(edges *e, vsh_error *error) {
    memset(e->slots, 0xff, e->slot_count * sizeof *e->slots);
    uint32_t triangle = 0;
    batch b;
    b.count = 0;
    for (size_t page = 0; page < e->pages->count; ++page) {
        VSHI_TRY(sort_page(e, e->pages->charts[page], &b, &triangle, error));
    }
    put_all(e, &b);
    return VSH_OK;
}
/* Joins charts and counts seams, or (`list`) fills them in. */
static vsh_result go_through_pairs(edges *e, vshi_seam *list, size_t *count, vsh_error *error) {
    const size_t all = 3 * e->pages->first[e->pages->count];
    *count = 0;
    for (size_t edge = 0; edge < all; ++edge) {
        if (edge % 3 == 0 && cancelled(e, edge / 3)) {
            return vshi_job_fail_cancelled(e->job, error);
        }
        uint32_t other = e->previous[edge];
        for (int pair = 0; pair < MOST_PAIRS && other != NO_EDGE; ++pair, other = e->previous[other]) {
            vshi_edge_end a[2], b[2];
            look_at_pair(e, other, (uint32_t)edge, a, b);
            const bool one_chart = vshi_ends_same_in_lightmap(a, b);
            if (!one_chart && !vshi_ends_smooth(a, b, e->cosine)) {
                continue;
            }
            e->goes_on[edge] = e->goes_on[other] = 1;
            if (one_chart) {
                vshi_chart_join(e->chart, other / 3, (uint32_t)edge / 3);
            } else if (vshi_ends_inside(a) && vshi_ends_inside(b)) {
                if (list != NULL) {
                    list[*count] = vshi_seam_between(a, b, e->chart, other / 3, (uint32_t)edge / 3);
                }
                ++*count;
            }
        }
    }
    return VSH_OK;
}

static vsh_result find(edges *e, const vsh_run *run, vshi_seams *seams, vsh_error *error) {
    const char *what = "seams";
    const size_t triangles = e->pages->first[e->pages->count];
    e->slot_count = 16;
    while (e->slot_count < 4 * triangles) {
        e->slot_count *= 2;
    }
    const double held = (double)triangles * sizeof *e->chart;
    const double bytes =
        held + 3.0 * (double)triangles * (sizeof *e->previous + 1) + (double)e->slot_count * sizeof *e->slots;
    VSHI_TRY(vshi_check_limit(run, bytes, what, error));
    VSHI_TRY(vshi_allocate((void **)&seams->chart, triangles, sizeof *seams->chart, what, error));
    VSHI_TRY(vshi_allocate((void **)&e->previous, 3 * triangles, sizeof *e->previous, what, error));
    VSHI_TRY(vshi_allocate((void **)&e->goes_on, 3 * triangles, 1, what, error));
    VSHI_TRY(vshi_allocate((void **)&e->slots, e->slot_count, sizeof *e->slots, what, error));
    e->chart = seams->chart;
    VSHI_TRY(sort_edges(e, error));
    free(e->slots);
    e->slots = NULL;
    VSHI_TRY(go_through_pairs(e, NULL, &seams->count, error));
    const double rest = bytes - (double)e->slot_count * sizeof *e->slots;
    vsh_run beside = *run;
    beside.memory_held += (uint64_t)rest;
    VSHI_TRY(vshi_seam_parts_find(e->pages, e->goes_on, e->cosine, &beside, e->job, seams->chart, &e->parts,
                                  error));
    const size_t count = seams->count + e->parts.count;
    const double listed = (double)count * sizeof *seams->list;
    seams->bytes = held + listed;
    VSHI_TRY(vshi_check_limit(run, rest + listed + e->parts.bytes, what, error));
    VSHI_TRY(vshi_allocate((void **)&seams->list, count, sizeof *seams->list, what, error));
    VSHI_TRY(go_through_pairs(e, seams->list, &seams->count, error));
    if (e->parts.count > 0) {
        vshi_seam_parts_list(&e->parts, seams->chart, seams->list + seams->count);
    }
    seams->count = count;
    for (size_t i = 0; i < triangles; ++i) {
        seams->chart[i] = vshi_chart_of(seams->chart, (uint32_t)i);
    }
    return VSH_OK;
}

vsh_result vshi_seams_find(const vshi_seam_pages *pages, double cosine, const vsh_run *run, vshi_job *job,
                           vshi_seams *seams, vsh_error *error) {
    const size_t triangles = pages->first[pages->count];
    *seams = (vshi_seams){NULL, NULL, 0, 0.0};
    if (triangles > UINT32_MAX / 3 - 1) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "seams: %zu triangles, at most %u", triangles,
                         UINT32_MAX / 3 - 1);
    }
    edges e = {.pages = pages, .cosine = cosine, .job = job};
    const vsh_result result = find(&e, run, seams, error);
    vshi_seam_parts_free(&e.parts);
    free(e.slots);
    free(e.goes_on);
    free(e.previous);
    return result;
}

void vshi_seams_free(vshi_seams *seams) {
    free(seams->list);
    free(seams->chart);
    *seams = (vshi_seams){NULL, NULL, 0, 0.0};
}
