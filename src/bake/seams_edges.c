/* Compares edges that have equal ends in the world. Two triangles are of one chart if the edge's coordinates
 * in the lightmap are equal, too. Otherwise there is a seam, if the surface is smooth. */
#include "bake/seams_search.h"
#include "base/memory.h"
#include "mesh/weld.h"

#include <stdlib.h>
#include <string.h>

enum {
    MOST_PAIRS = 8,   /* of an edge with those before it: what many triangles meet at is no surface */
    POLL_EDGES = 8192 /* between two looks at the cancel flag */
};

/* Corners of all triangles, welded where they lie in one place in the world. */
typedef struct welded {
    vshi_vec *places;  /* [vertices] */
    uint32_t *weld;    /* [vertices] */
    uint32_t *corners; /* [triangles][3] */
    size_t vertices;
} welded;

static void key_of(const void *user, size_t vertex, uint64_t key[VSHI_KEY_WORDS]) {
    memcpy(key, (const vshi_vec *)user + vertex, VSHI_KEY_WORDS * sizeof *key);
}

/* Triangles that cover nothing get no edges: their corners are one. */
static void place_mesh(vshi_seam_search *s, const vshi_charts *charts, size_t m, uint32_t triangle,
                       uint32_t vertex, welded *w) {
    const vsh_mesh *mesh = &charts->meshes[m];
    for (uint32_t v = 0; v < mesh->vertex_count; ++v) {
        const vshi_vec at = vshi_edge_place(mesh, v);
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

static vsh_result weld(vshi_seam_search *s, welded *w, vsh_error *error) {
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
static vsh_result compare_sides(vshi_seam_search *s, const uint32_t *sides, size_t count, vsh_error *error) {
    for (size_t k = 1; k < count; ++k) {
        for (size_t i = k; i-- > 0 && k - i <= MOST_PAIRS;) {
            const uint32_t pair[2] = {sides[i], sides[k]};
            vshi_edge_end a[2], b[2];
            bool goes_on;
            vshi_edge_look_at(s->pages, pair[0], a);
            vshi_edge_look_at(s->pages, pair[1], b);
            VSHI_TRY(vshi_seam_compare(s, pair, a, b, &goes_on, error));
            if (goes_on) {
                s->goes_on[pair[0]] = s->goes_on[pair[1]] = 1;
            }
        }
    }
    return VSH_OK;
}

static vsh_result compare_edges(vshi_seam_search *s, const vshi_sorted_sides *sides, vsh_error *error) {
    size_t polled = 0;
    for (size_t i = 0, end; i < 3 * sides->triangle_count; i = end) {
        uint32_t ends[2];
        end = vshi_next_edge(sides, i);
        vshi_side_ends(sides->corners, sides->sorted[i], ends);
        if (polled++ % POLL_EDGES == 0 && vshi_job_advance(s->job, 0)) {
            return vshi_job_fail_cancelled(s->job, error);
        }
        if (ends[0] != ends[1]) {
            VSHI_TRY(compare_sides(s, sides->sorted + i, end - i, error));
        }
    }
    return VSH_OK;
}

static vsh_result weld_and_compare(vshi_seam_search *s, vsh_error *error) {
    const char *what = "seams";
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
    VSHI_TRY_DONE(vshi_allocate((void **)&w.places, w.vertices, sizeof *w.places, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&w.weld, w.vertices, sizeof *w.weld, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&w.corners, triangles, 3 * sizeof *w.corners, what, error));
    VSHI_TRY_DONE(weld(s, &w, error));
    sides.corners = w.corners;
    VSHI_TRY_DONE(vshi_sort_sides(&sides, error));
    result = compare_edges(s, &sides, error);
done:
    free(sides.sorted);
    free(w.corners);
    free(w.weld);
    free(w.places);
    return result;
}

static vsh_result find(vshi_seam_search *s, vsh_error *error) {
    const char *what = "seams";
    const size_t triangles = s->pages->first[s->pages->count];
    vshi_seams *seams = s->seams;
    s->held = (double)triangles * (sizeof *seams->chart + 3.0 * sizeof *s->goes_on);
    VSHI_TRY(vshi_check_limit(s->run, s->held, what, error));
    VSHI_TRY(vshi_allocate((void **)&seams->chart, triangles, sizeof *seams->chart, what, error));
    VSHI_TRY(vshi_allocate((void **)&s->goes_on, 3 * triangles, sizeof *s->goes_on, what, error));
    VSHI_TRY(weld_and_compare(s, error));
    VSHI_TRY(vshi_seam_parts_find(s, error));
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
    vshi_seam_search search = {.pages = pages, .cosine = cosine, .run = run, .job = job, .seams = seams};
    const vsh_result result = find(&search, error);
    free(search.goes_on);
    return result;
}

void vshi_seams_free(vshi_seams *seams) {
    free(seams->list);
    free(seams->chart);
    *seams = (vshi_seams){NULL, NULL, 0, 0.0};
}
