/* Finds charts and the seams between them, by edges with equal ends in the world. Two triangles are of one
 * chart if the edge's coordinates in the lightmap are equal too. Otherwise there is a seam if the surface is
 * smooth.
 *
 * At a T-junction an edge ends in the middle of a longer one. A tree holds the ends of open edges. Each open
 * edge is cut at the ends that lie on it, so that its parts have the same ends as their neighbours. */
#include "base/bytes.h"
#include "base/memory.h"
#include "geometry/edges.h"
#include "geometry/mesh.h"
#include "lightmap/places.h"
#include "lightmap/seams.h"
#include "shade/shade.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char what[] = "seams";

/* Each triangle at an edge is compared with this many before it. Many triangles at one edge are no surface.
 */
enum { MOST_PAIRS = 8 };

typedef struct seam_search {
    const vshi_seam_pages *pages;
    double cosine; /* of the largest angle between smooth normals */
    const vsh_run *run;
    vshi_job *job;
    uint8_t *goes_on;  /* [3 triangles]: the surface continues beyond the edge, or its triangle has no area */
    vshi_seams *seams; /* until the end, `chart` holds sets of triangles, and a seam's charts are triangles */
    size_t room;       /* of the list */
    double held;       /* bytes, beside the list */
} seam_search;

/* An end of a triangle's edge, or of a part of it, in the world and in the lightmap. */
typedef struct edge_end {
    const vsh_mesh *mesh;
    const vshi_raster *raster;
    size_t triangle; /* of the mesh */
    uint32_t page;
    uint32_t vertex[2]; /* ends of the whole edge */
    double t;           /* place from the first vertex to the second, 0 … 1 */
    vshi_vec at;
    double x, y; /* texels */
} edge_end;

static bool is_same_place(vshi_vec a, vshi_vec b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

/* The mesh of edge 3 × triangle + corner, and the triangle's number there. */
static const vsh_mesh *mesh_of_edge(const vshi_seam_pages *pages, uint32_t edge, size_t *local) {
    const size_t page = vshi_find_group(pages->first, pages->count, edge / 3);
    const vshi_charts *charts = pages->charts[page];
    return &charts->meshes[vshi_charts_mesh(charts, edge / 3 - pages->first[page], local)];
}

/* --- two edges */

/* Texels between the ends of an edge in two triangles of one chart, at most: files round coordinates. A
 * bilinear lookup reads the same place on both sides of so narrow a seam. */
static const double SAME_PLACE = 1.0 / 1024.0;

static void find_ends(const vshi_seam_pages *pages, uint32_t edge, edge_end ends[2]) {
    size_t local;
    const vsh_mesh *mesh = mesh_of_edge(pages, edge, &local);
    const size_t page = vshi_find_group(pages->first, pages->count, edge / 3);
    const vshi_raster *raster = &pages->charts[page]->raster;
    const uint32_t *corner = mesh->indices + 3 * local;
    for (uint32_t k = 0; k < 2; ++k) {
        const uint32_t vertex = corner[(edge % 3 + k) % 3];
        const float *uv = mesh->uvs + 2 * (size_t)vertex;
        ends[k] = (edge_end){.mesh = mesh,
                             .raster = raster,
                             .triangle = local,
                             .page = (uint32_t)page,
                             .vertex = {corner[edge % 3], corner[(edge % 3 + 1) % 3]},
                             .t = k,
                             .at = vshi_mesh_place(mesh, vertex),
                             .x = (double)uv[0] * raster->width,
                             .y = (1.0 - (double)uv[1]) * raster->height};
    }
}

static bool is_same_in_lightmap(const edge_end *a, const edge_end *b) {
    return a->page == b->page && fabs(a->x - b->x) <= SAME_PLACE && fabs(a->y - b->y) <= SAME_PLACE;
}

static vshi_vec normal_of(const vsh_mesh *mesh, uint32_t vertex) {
    const vshi_vec given = vshi_vec_off(mesh->normals + 3 * (size_t)vertex);
    return vshi_unit(vshi_transform_normal(mesh->transform, given));
}

static vshi_vec normal_at(const edge_end *end) {
    const vsh_mesh *mesh = end->mesh;
    vshi_vec normal = {0.0, 0.0, 0.0}, corner[3];
    if (mesh->normals != NULL && (end->t == 0.0 || end->t == 1.0)) {
        normal = normal_of(mesh, end->vertex[end->t == 1.0]);
    } else if (mesh->normals != NULL) {
        normal = vshi_unit(vshi_add(vshi_scale(normal_of(mesh, end->vertex[0]), 1.0 - end->t),
                                    vshi_scale(normal_of(mesh, end->vertex[1]), end->t)));
    }
    if (!(vshi_dot(normal, normal) > 0.0)) {
        vshi_mesh_triangle(mesh, end->triangle, corner);
        normal = vshi_unit(vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0])));
    }
    return normal;
}

static bool is_smooth(const edge_end *a, const edge_end *b, double cosine) {
    return vshi_dot(normal_at(a), normal_at(b)) >= cosine;
}

/* Texels outside the image are not baked. */
static bool are_inside(const edge_end a[2]) {
    const double width = a[0].raster->width + SAME_PLACE, height = a[0].raster->height + SAME_PLACE;
    return fmin(a[0].x, a[1].x) >= -SAME_PLACE && fmax(a[0].x, a[1].x) <= width &&
           fmin(a[0].y, a[1].y) >= -SAME_PLACE && fmax(a[0].y, a[1].y) <= height;
}

static vsh_result add_seam(seam_search *search, const vshi_seam *seam, vsh_error *error) {
    vshi_seams *seams = search->seams;
    if (seams->count == search->room) {
        const double bytes = 2.0 * (double)search->room * sizeof *seams->list;
        VSHI_TRY(vshi_check_limit(search->run, search->held + bytes, what, error));
    }
    VSHI_TRY(
        vshi_make_room((void **)&seams->list, seams->count, &search->room, sizeof *seams->list, what, error));
    seams->list[seams->count++] = *seam;
    return VSH_OK;
}

static vsh_result compare_pair(seam_search *search, const uint32_t edge[2], const edge_end a[2],
                               const edge_end b[2], bool *goes_on, vsh_error *error) {
    const bool turned = !is_same_place(a[0].at, b[0].at);
    const edge_end second[2] = {b[turned], b[!turned]};
    const bool one_chart = is_same_in_lightmap(&a[0], &second[0]) && is_same_in_lightmap(&a[1], &second[1]);
    *goes_on = one_chart ||
               (is_smooth(&a[0], &second[0], search->cosine) && is_smooth(&a[1], &second[1], search->cosine));
    if (one_chart) {
        vshi_set_join(search->seams->chart, edge[0] / 3, edge[1] / 3);
    } else if (*goes_on && are_inside(a) && are_inside(second)) {
        const vshi_seam seam = {{{a[0].x, a[1].x}, {second[0].x, second[1].x}},
                                {{a[0].y, a[1].y}, {second[0].y, second[1].y}},
                                {edge[0] / 3, edge[1] / 3},
                                {a[0].page, second[0].page}};
        return add_seam(search, &seam, error);
    }
    return VSH_OK;
}

/* --- T-junctions */

/* The largest distance from an end to the edge that it lies on, as a share of the largest coordinate.
 * Rounding moves ends by 6e-8 of it. */
static const double ON_EDGE = 5e-7;

enum {
    MOST_CUTS = 1024,    /* of an edge; no edge of a wall has more */
    MOST_LOOKED = 65536, /* ends near an edge that are tested */
    POLL_PARTS = 256
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
    seam_search *search;
    uint32_t *edges; /* [count]: open edges */
    size_t count;
    vshi_vec centre;
    double within;
    vshi_places ends; /* number: 2 × place in `edges` + end */
    part *parts;      /* [part_count] */
    size_t part_count, part_room;
    bool any_cut;
    /* of the current edge */
    vshi_vec at[2];
    on_edge cuts[MOST_CUTS];
    size_t cut_count, looked;
} finding;

static void places_of(const finding *f, uint32_t edge, vshi_vec at[2]) {
    size_t local;
    const vsh_mesh *mesh = mesh_of_edge(f->search->pages, edge, &local);
    for (uint32_t k = 0; k < 2; ++k) {
        at[k] = vshi_mesh_place(mesh, mesh->indices[3 * local + (edge % 3 + k) % 3]);
    }
}

static void to_floats(const finding *f, vshi_vec place, float at[3]) {
    vshi_vec_to_floats(vshi_sub(place, f->centre), at);
}

/* Checks that memory allows `bytes` more than the search holds. */
static vsh_result check_bytes(const finding *f, double bytes, vsh_error *error) {
    const seam_search *s = f->search;
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
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    double largest = 0.0;
    for (size_t i = 0; i < f->count; ++i) {
        vshi_vec at[2];
        places_of(f, f->edges[i], at);
        vshi_grow_box(low, high, at[0]);
        vshi_grow_box(low, high, at[1]);
    }
    for (int k = 0; k < 3; ++k) {
        largest = fmax(largest, fmax(-low[k], high[k]));
    }
    f->centre = vshi_scale(vshi_add(vshi_vec_of(low), vshi_vec_of(high)), 0.5);
    f->within = ON_EDGE * largest;
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

/* Notes an end that lies on the edge, but not at its ends. */
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
    if (is_same_place(added.at[0], added.at[1])) {
        return VSH_OK;
    }
    if (f->part_count == f->part_room) {
        VSHI_TRY(check_bytes(f, 2.0 * (double)f->part_room * sizeof *f->parts, error));
    }
    VSHI_TRY(vshi_make_room((void **)&f->parts, f->part_count, &f->part_room, sizeof *f->parts, what, error));
    added.key = vshi_mix(hash_place(added.at[0]) + hash_place(added.at[1])); /* either way round */
    f->parts[f->part_count++] = added;
    return VSH_OK;
}

/* Adds the parts of an edge: one if nothing lies on it. */
static vsh_result cut_edge(finding *f, uint32_t edge, vsh_error *error) {
    float a[3], b[3];
    f->cut_count = f->looked = 0;
    places_of(f, edge, f->at);
    to_floats(f, f->at[0], a);
    to_floats(f, f->at[1], b);
    vshi_places_along(&f->ends, a, b, (float)(4.0 * f->within), note, f); /* wider, for 32 bits */
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

static void find_part_ends(const finding *f, const part *p, edge_end ends[2]) {
    edge_end whole[2];
    find_ends(f->search->pages, p->edge, whole);
    for (int k = 0; k < 2; ++k) {
        ends[k] = whole[0];
        ends[k].t = p->t[k];
        ends[k].at = p->at[k];
        ends[k].x += p->t[k] * (whole[1].x - whole[0].x);
        ends[k].y += p->t[k] * (whole[1].y - whole[0].y);
    }
}

/* Compares parts with those before them. Whole edges have been compared. */
static vsh_result compare_parts(const finding *f, vsh_error *error) {
    for (size_t i = 0; i < f->part_count; ++i) {
        const part *p = &f->parts[i];
        for (size_t k = i; k > 0 && i - k < MOST_PAIRS && f->parts[k - 1].key == p->key; --k) {
            const part *q = &f->parts[k - 1];
            const uint32_t pair[2] = {q->edge, p->edge};
            edge_end a[2], b[2];
            bool goes_on;
            const bool turned = !is_same_place(p->at[0], q->at[0]);
            if ((p->cut || q->cut) && is_same_place(p->at[0], q->at[turned]) &&
                is_same_place(p->at[1], q->at[!turned])) {
                find_part_ends(f, q, a);
                find_part_ends(f, p, b);
                VSHI_TRY(compare_pair(f->search, pair, a, b, &goes_on, error));
            }
        }
    }
    return VSH_OK;
}

static vsh_result find_parts(finding *f, vsh_error *error) {
    VSHI_TRY(list_edges(f, error));
    if (f->count == 0 || f->count > UINT32_MAX / 2) {
        return VSH_OK; /* 32 bits number no more ends */
    }
    VSHI_TRY(list_ends(f, error));
    for (size_t i = 0; i < f->count; ++i) {
        VSHI_TRY(i % POLL_PARTS == 0 ? vshi_job_step(f->search->job, 0, error) : VSH_OK);
        VSHI_TRY(cut_edge(f, f->edges[i], error));
    }
    if (!f->any_cut) {
        return VSH_OK;
    }
    qsort(f->parts, f->part_count, sizeof *f->parts, order_parts);
    return compare_parts(f, error);
}

static vsh_result compare_parts_of_edges(seam_search *search, vsh_error *error) {
    finding *f = NULL;
    VSHI_TRY(vshi_allocate((void **)&f, 1, sizeof *f, what, error));
    f->search = search;
    const vsh_result result = find_parts(f, error);
    free(f->parts);
    vshi_places_free(&f->ends);
    free(f->edges);
    free(f);
    return result;
}

/* --- whole edges */

enum { POLL_EDGES = 8192 /* between two looks at the cancel flag */ };

/* Corners of all triangles, welded if they lie in one place in the world. */
typedef struct welded {
    vshi_vec *places;  /* [vertices] */
    uint32_t *weld;    /* [vertices] */
    uint32_t *corners; /* [triangles][3] */
    size_t vertices;
} welded;

static void key_of(const void *user, size_t vertex, uint64_t key[VSHI_KEY_WORDS]) {
    memcpy(key, (const vshi_vec *)user + vertex, VSHI_KEY_WORDS * sizeof *key);
}

/* Triangles that cover nothing get no edges: all their corners are one. */
static void place_mesh(seam_search *s, const vshi_charts *charts, size_t m, uint32_t triangle,
                       uint32_t vertex, welded *w) {
    const vsh_mesh *mesh = &charts->meshes[m];
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) {
        const vshi_vec at = vshi_mesh_place(mesh, v);
        w->places[vertex + v] = (vshi_vec){at.x + 0.0, at.y + 0.0, at.z + 0.0}; /* -0 is 0 */
    }
    for (size_t i = 0; i < mesh->triangle_count; ++i, ++triangle) {
        vshi_uv_triangle unused;
        const bool used = vshi_charts_triangle(charts, m, i, &unused);
        s->seams->chart[triangle] = triangle;
        for (size_t k = 0; k < 3; ++k) {
            s->goes_on[3 * (size_t)triangle + k] = !used;
            w->corners[3 * (size_t)triangle + k] = vertex + mesh->indices[3 * i + (used ? k : 0)];
        }
    }
}

static vsh_result weld(seam_search *s, welded *w, vsh_error *error) {
    uint32_t vertex = 0;
    for (size_t page = 0; page < s->pages->count; ++page) {
        const vshi_charts *charts = s->pages->charts[page];
        for (size_t m = 0; m < charts->mesh_count; ++m) {
            place_mesh(s, charts, m, (uint32_t)(s->pages->first[page] + charts->first[m]), vertex, w);
            vertex += (uint32_t)charts->meshes[m].vertex_count;
        }
    }
    VSHI_TRY(vshi_weld(w->vertices, key_of, w->places, w->weld, error));
    for (size_t i = 0; i < 3 * s->pages->first[s->pages->count]; ++i) {
        w->corners[i] = w->weld[w->corners[i]];
    }
    return VSH_OK;
}

/* Compares the sides of an edge with those before them. */
static vsh_result compare_sides(seam_search *s, const uint32_t *sides, size_t count, vsh_error *error) {
    for (size_t k = 1; k < count; ++k) {
        for (size_t i = k; i-- > 0 && k - i <= MOST_PAIRS;) {
            const uint32_t pair[2] = {sides[i], sides[k]};
            edge_end a[2], b[2];
            bool goes_on;
            find_ends(s->pages, pair[0], a);
            find_ends(s->pages, pair[1], b);
            VSHI_TRY(compare_pair(s, pair, a, b, &goes_on, error));
            if (goes_on) {
                s->goes_on[pair[0]] = s->goes_on[pair[1]] = 1;
            }
        }
    }
    return VSH_OK;
}

static vsh_result compare_edges(seam_search *s, const vshi_sorted_sides *sides, vsh_error *error) {
    size_t polled = 0;
    for (size_t i = 0, end; i < 3 * sides->triangle_count; i = end) {
        uint32_t ends[2];
        end = vshi_next_edge(sides, i);
        vshi_side_ends(sides->corners, sides->sorted[i], ends);
        VSHI_TRY(polled++ % POLL_EDGES == 0 ? vshi_job_step(s->job, 0, error) : VSH_OK);
        if (ends[0] != ends[1]) {
            VSHI_TRY(compare_sides(s, sides->sorted + i, end - i, error));
        }
    }
    return VSH_OK;
}

static vsh_result weld_and_compare(seam_search *s, vsh_error *error) {
    const size_t triangles = s->pages->first[s->pages->count];
    welded w = {.vertices = 0};
    for (size_t page = 0; page < s->pages->count; ++page) {
        for (size_t m = 0; m < s->pages->charts[page]->mesh_count; ++m) {
            w.vertices += s->pages->charts[page]->meshes[m].vertex_count;
        }
    }
    if (w.vertices > UINT32_MAX - 1) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "seams: %zu vertices, at most %u", w.vertices,
                         UINT32_MAX - 1);
    }
    /* welding takes four slots a vertex at most, sorting one count a vertex and two numbers a side */
    const double bytes = s->held + (double)w.vertices * (sizeof *w.places + 6.0 * sizeof *w.weld) +
                         3.0 * (double)triangles * 3.0 * sizeof *w.corners;
    vshi_sorted_sides sides = {NULL, triangles, w.vertices, NULL};
    vsh_result result;
    VSHI_TRY_DONE(vshi_check_limit(s->run, bytes, what, error));
    const vshi_array arrays[] = {VSHI_ARRAY(w.places, w.vertices), VSHI_ARRAY(w.corners, 3 * triangles),
                                 VSHI_ARRAY(w.weld, w.vertices)};
    VSHI_TRY_DONE(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    VSHI_TRY_DONE(weld(s, &w, error));
    sides.corners = w.corners;
    VSHI_TRY_DONE(vshi_sort_sides(&sides, error));
    result = compare_edges(s, &sides, error);
done:
    free(sides.sorted);
    free(w.places);
    return result;
}

static vsh_result find_seams(seam_search *s, vsh_error *error) {
    const size_t triangles = s->pages->first[s->pages->count];
    vshi_seams *seams = s->seams;
    s->held = (double)triangles * (sizeof *seams->chart + 3.0 * sizeof *s->goes_on);
    VSHI_TRY(vshi_check_limit(s->run, s->held, what, error));
    const vshi_array arrays[] = {VSHI_ARRAY(seams->chart, triangles), VSHI_ARRAY(s->goes_on, 3 * triangles)};
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, what, error));
    VSHI_TRY(weld_and_compare(s, error));
    VSHI_TRY(compare_parts_of_edges(s, error));
    for (size_t i = 0; i < triangles; ++i) {
        seams->chart[i] = vshi_set_of(seams->chart, (uint32_t)i);
    }
    for (size_t i = 0; i < 2 * seams->count; ++i) {
        uint32_t *chart = &seams->list[i / 2].chart[i % 2];
        *chart = seams->chart[*chart];
    }
    seams->bytes = (double)triangles * sizeof *seams->chart + (double)s->room * sizeof *seams->list;
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
    seam_search search = {.pages = pages, .cosine = cosine, .run = run, .job = job, .seams = seams};
    const vsh_result result = find_seams(&search, error);
    free(search.goes_on);
    return result;
}

void vshi_seams_free(vshi_seams *seams) {
    free(seams->list);
    free(seams->chart);
    *seams = (vshi_seams){NULL, NULL, 0, 0.0};
}
