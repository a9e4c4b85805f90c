/* Vertices and UVs of meshes, once their charts have places. */
#include "unwrap/charts.h"

#include "base/memory.h"
#include "geometry/edges.h"

#include <stdlib.h>

static const char what[] = "an atlas";

struct vsh_atlas {
    uint32_t *sources, *indices; /* [3 triangles of all shapes], one block: instances share them */
    float (*uvs)[2];             /* of the vertices of all meshes; with mesh_charts one block */
    uint32_t *mesh_charts;       /* [triangles of all meshes] */
    vsh_atlas_mesh *meshes;      /* [mesh_count]: parts of these arrays; with charts one block */
    vsh_atlas_chart *charts;     /* [info.charts] */
    size_t mesh_count;
    vsh_atlas_page *pages; /* [info.pages] */
    vsh_atlas_info info;
};

/* --- vertices of a shape */

/* Vertices of charts come first, chart by chart; then vertices of triangles without area. */
typedef struct vertices {
    uint32_t *sources, *indices; /* the atlas's */
    uint32_t *chart;             /* [chart_vertices]: of the shape, from 0 */
    uint32_t *patch_vertex;      /* [chart_vertices] */
    size_t count, chart_vertices;
} vertices;

typedef struct making {
    struct vsh_atlas *atlas;
    const vshi_shapes *shapes;
    vertices *vertices;             /* [shapes]; one block with the arrays below */
    uint32_t *chart, *patch_vertex; /* [3 triangles of all shapes] */
    uint32_t *last;     /* [most vertices of a patch]: 1 + the last vertex made of each; 0: none */
    uint32_t *before;   /* [3 triangles]: 1 + the vertex made before each */
    float (*placed)[2]; /* [most vertices of a patch] */
} making;

/* The atlas's vertex for a vertex of a patch and one of the mesh, which is made if needed. */
static uint32_t find_vertex(const making *m, vertices *made, uint32_t chart, uint32_t vertex,
                            uint32_t source) {
    for (uint32_t v = m->last[vertex]; v != 0; v = m->before[v - 1]) {
        if (made->sources[v - 1] == source) {
            return v - 1;
        }
    }
    const uint32_t own = (uint32_t)made->count++;
    made->sources[own] = source;
    made->chart[own] = chart;
    made->patch_vertex[own] = vertex;
    m->before[own] = m->last[vertex];
    m->last[vertex] = own + 1;
    return own;
}

static void number_vertices(const making *m, const vshi_shape *shape, vertices *made) {
    const uint32_t *given = shape->mesh->indices;
    const size_t corners = 3 * shape->mesh->triangle_count;
    for (size_t i = 0; i < corners; ++i) {
        made->indices[i] = UINT32_MAX;
    }
    for (uint32_t c = 0; c < shape->patches.count; ++c) {
        const vshi_patch *p = &shape->patches.list[c];
        memset(m->last, 0, p->vertex_count * sizeof *m->last);
        for (uint32_t i = 0; i < 3 * p->count; ++i) {
            const size_t corner = 3 * (size_t)p->triangles[i / 3] + i % 3;
            made->indices[corner] = find_vertex(m, made, c, p->corner[i / 3][i % 3], given[corner]);
        }
    }
    made->chart_vertices = made->count;
    for (size_t i = 0; i < corners; ++i) {
        if (made->indices[i] == UINT32_MAX) {
            made->sources[made->count] = given[i];
            made->indices[i] = (uint32_t)made->count++;
        }
    }
}

static vsh_result number_all(making *m, vsh_error *error) {
    size_t triangles = 0;
    uint32_t most = 0;
    for (size_t i = 0; i < m->shapes->count; ++i) {
        const vshi_shape *shape = &m->shapes->list[i];
        triangles += shape->mesh->triangle_count;
        for (size_t c = 0; c < shape->patches.count; ++c) {
            most = shape->patches.list[c].vertex_count > most ? shape->patches.list[c].vertex_count : most;
        }
    }
    const vshi_array own[] = {VSHI_ARRAY(m->vertices, m->shapes->count),
                              VSHI_ARRAY(m->last, most),
                              VSHI_ARRAY(m->placed, most),
                              VSHI_ARRAY(m->chart, 3 * triangles),
                              VSHI_ARRAY(m->patch_vertex, 3 * triangles),
                              VSHI_ARRAY(m->before, 3 * triangles)};
    const vshi_array made[] = {VSHI_ARRAY(m->atlas->sources, 3 * triangles),
                               VSHI_ARRAY(m->atlas->indices, 3 * triangles)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(own, what, error));
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(made, what, error));
    for (size_t i = 0, at = 0; i < m->shapes->count; ++i) {
        const vshi_shape *shape = &m->shapes->list[i];
        m->vertices[i] = (vertices){.sources = m->atlas->sources + at,
                                    .indices = m->atlas->indices + at,
                                    .chart = m->chart + at,
                                    .patch_vertex = m->patch_vertex + at};
        number_vertices(m, shape, &m->vertices[i]);
        at += 3 * shape->mesh->triangle_count;
    }
    return VSH_OK;
}

/* --- rounding to 32-bit UVs */

static const double LEAST_STEP = 0x1p-24; /* half of a last place just below 1 */

enum {
    PASSES = 6,
    STEPS = 7,        /* each twice as long as the one before */
    MOST_AROUND = 256 /* triangles of a corner that is moved */
};

typedef struct settling {
    const vshi_patch *patch;
    float (*uvs)[2];
    uint32_t *begin, *around; /* around[begin[v] …]: corners at vertex v */
} settling;

/* Whether a triangle is flipped, or without area. The sign is exact: differences and products of floats of
 * one range are doubles. */
static bool is_bad(const vshi_patch *p, float (*const uvs)[2], uint32_t i) {
    const float *a = uvs[p->corner[i][0]], *b = uvs[p->corner[i][1]], *c = uvs[p->corner[i][2]];
    return !(((double)b[0] - (double)a[0]) * ((double)c[1] - (double)a[1]) -
                 ((double)b[1] - (double)a[1]) * ((double)c[0] - (double)a[0]) >
             0.0);
}

static uint32_t count_bad(const settling *s, uint32_t v) {
    uint32_t bad = 0;
    for (uint32_t i = s->begin[v]; i < s->begin[v + 1]; ++i) {
        bad += is_bad(s->patch, s->uvs, s->around[i] / 3);
    }
    return bad;
}

/* Moves a vertex by a few last places so that fewer triangles around it are bad, if possible. */
static void move_vertex(settling *s, uint32_t v) {
    static const int ways[8][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}};
    if (s->begin[v + 1] - s->begin[v] > MOST_AROUND) {
        return;
    }
    float *uv = s->uvs[v], best[2] = {uv[0], uv[1]};
    const float from[2] = {uv[0], uv[1]};
    uint32_t least = count_bad(s, v);
    double step = LEAST_STEP;
    for (int length = 0; length < STEPS && least > 0; ++length, step *= 2.0) {
        for (int way = 0; way < 8 && least > 0; ++way) {
            for (int d = 0; d < 2; ++d) {
                const float to = (float)((double)from[d] + step * ways[way][d]);
                uv[d] = to < 0.0F ? 0.0F : to > 1.0F ? 1.0F : to;
            }
            const uint32_t bad = count_bad(s, v);
            if (bad < least) {
                least = bad;
                best[0] = uv[0];
                best[1] = uv[1];
            }
        }
    }
    uv[0] = best[0];
    uv[1] = best[1];
}

/* Repairs slivers that rounding to uvs[vertex_count] has flipped or flattened. Some may stay. */
static vsh_result settle(const vshi_patch *p, float (*uvs)[2], vsh_error *error) {
    settling s = {.patch = p, .uvs = uvs};
    const vshi_array arrays[] = {VSHI_ARRAY(s.begin, (size_t)p->vertex_count + 2),
                                 VSHI_ARRAY(s.around, 3 * (size_t)p->count)};
    uint32_t bad = 0;
    for (uint32_t i = 0; i < p->count; ++i) {
        bad += is_bad(p, uvs, i);
    }
    if (bad == 0) {
        return VSH_OK;
    }
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    vshi_list_groups(p->corner[0], 3 * (size_t)p->count, p->vertex_count, s.begin, s.around);
    for (int pass = 0; pass < PASSES && bad > 0; ++pass) {
        bad = 0;
        for (uint32_t i = 0; i < p->count; ++i) {
            for (int k = 0; k < 3 && is_bad(p, uvs, i); ++k) {
                move_vertex(&s, p->corner[i][k]);
            }
            bad += is_bad(p, uvs, i);
        }
    }
    free(s.begin);
    return VSH_OK;
}

/* --- meshes */

/* UVs of a mesh's vertices, chart by chart, and the charts of its triangles. */
static vsh_result place_mesh(const making *m, size_t mesh, const vshi_pack_item *items, uint32_t first_chart,
                             float (*uvs)[2], uint32_t *mesh_charts, vsh_error *error) {
    const uint32_t number = m->shapes->instances[mesh].shape;
    const vshi_shape *shape = &m->shapes->list[number];
    const vertices *made = &m->vertices[number];
    size_t vertex = 0;
    for (uint32_t c = 0; c < shape->patches.count; ++c) {
        const vshi_patch *p = &shape->patches.list[c];
        const vshi_place *place = &items[c].at;
        const vsh_atlas_page *page = &m->atlas->pages[place->page];
        for (uint32_t v = 0; v < p->vertex_count; ++v) {
            double at[2];
            vshi_fit_turn(&place->fit, place->quarters, p->uv[v], at);
            m->placed[v][0] = (float)((place->x + at[0]) / page->width);
            m->placed[v][1] = (float)((place->y + at[1]) / page->height);
        }
        VSHI_TRY(settle(p, m->placed, error));
        for (; vertex < made->chart_vertices && made->chart[vertex] == c; ++vertex) {
            memcpy(uvs[vertex], m->placed[made->patch_vertex[vertex]], sizeof *uvs);
        }
        for (uint32_t i = 0; i < p->count; ++i) {
            mesh_charts[p->triangles[i]] = first_chart + c;
        }
    }
    return VSH_OK;
}

static vsh_result place_all(const making *m, const vshi_pack_item *items, vsh_error *error) {
    struct vsh_atlas *a = m->atlas;
    const vshi_shapes *shapes = m->shapes;
    size_t vertex_count = 0, triangle_count = 0;
    for (size_t i = 0; i < a->mesh_count; ++i) {
        vertex_count += m->vertices[shapes->instances[i].shape].count;
        triangle_count += shapes->meshes[i].triangle_count;
    }
    const vshi_array arrays[] = {VSHI_ARRAY(a->uvs, vertex_count),
                                 VSHI_ARRAY(a->mesh_charts, triangle_count)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    for (size_t i = 0; i < triangle_count; ++i) {
        a->mesh_charts[i] = VSH_NO_CHART;
    }
    float(*uvs)[2] = a->uvs;
    uint32_t *charts = a->mesh_charts, chart = 0;
    for (size_t i = 0; i < a->mesh_count; ++i) {
        const vshi_shape *shape = &shapes->list[shapes->instances[i].shape];
        const vertices *made = &m->vertices[shapes->instances[i].shape];
        const size_t triangles = shape->mesh->triangle_count;
        VSHI_TRY(place_mesh(m, i, items + chart, chart, uvs, charts, error));
        a->meshes[i] = (vsh_atlas_mesh){uvs[0], made->sources, made->indices, charts, made->count, triangles};
        a->info.flat_triangles += (made->count - made->chart_vertices) / 3;
        a->info.kept += shape->kept;
        uvs += made->count;
        charts += triangles;
        chart += (uint32_t)shape->patches.count;
    }
    return VSH_OK;
}

static void describe_chart(struct vsh_atlas *a, const vshi_pack_item *item, double scale, uint32_t chart) {
    const bool sideways = item->at.quarters % 2 != 0;
    const double uneven = item->at.fit.uneven; /* fitting to texels stretches, too */
    a->charts[chart] = (vsh_atlas_chart){
        .page = item->at.page,
        .mesh = item->mesh,
        .stretch = (float)(item->patch->stretch * sqrt(0.5 * (uneven + 1.0 / uneven))),
        .area = item->patch->area * scale * scale,
        .min = {item->at.x, item->at.y},
        .max = {item->at.x + (sideways ? item->at.fit.height : item->at.fit.width),
                item->at.y + (sideways ? item->at.fit.width : item->at.fit.height)},
    };
    vsh_atlas_page *page = &a->pages[item->at.page];
    page->first_mesh = item->mesh < page->first_mesh ? item->mesh : page->first_mesh;
    page->covered += (double)item->at.touched;
}

/* Sums up the pages, and turns each page's count of texels into a share. */
static void sum_pages(struct vsh_atlas *a) {
    double texels = 0.0, touched = 0.0;
    a->info.texels_per_unit = INFINITY;
    for (uint32_t i = 0; i < a->info.pages; ++i) {
        vsh_atlas_page *page = &a->pages[i];
        const double own = (double)page->width * page->height;
        touched += page->covered;
        texels += own;
        page->covered /= own;
        a->info.width = page->width > a->info.width ? page->width : a->info.width;
        a->info.height = page->height > a->info.height ? page->height : a->info.height;
        a->info.texels_per_unit = fmin(a->info.texels_per_unit, page->texels_per_unit);
    }
    a->info.covered = touched / texels;
}

vsh_result vshi_atlas_make(const vshi_shapes *shapes, vshi_pages *pages, const vshi_pack_item *items,
                           size_t item_count, vsh_atlas **atlas, vsh_error *error) {
    making m = {.shapes = shapes};
    double area = 0.0, stretch = 0.0;
    vsh_result result;
    VSHI_TRY(vshi_allocate((void **)&m.atlas, 1, sizeof *m.atlas, what, error));
    struct vsh_atlas *a = m.atlas;
    a->mesh_count = shapes->mesh_count;
    a->info = (vsh_atlas_info){.meshes = shapes->mesh_count,
                               .charts = item_count,
                               .pages = (uint32_t)pages->count,
                               .shared = shapes->mesh_count - shapes->count};
    a->pages = pages->list;
    *pages = (vshi_pages){NULL, 0};
    const vshi_array arrays[] = {VSHI_ARRAY(a->meshes, a->mesh_count), VSHI_ARRAY(a->charts, item_count)};
    VSHI_TRY_DONE(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    VSHI_TRY_DONE(number_all(&m, error));
    VSHI_TRY_DONE(place_all(&m, items, error));
    for (uint32_t i = 0; i < item_count; ++i) {
        const vshi_instance *instance = &shapes->instances[items[i].mesh];
        describe_chart(a, &items[i], shapes->list[instance->shape].surface.scale * instance->scale, i);
        area += a->charts[i].area;
        stretch += a->charts[i].area * (double)a->charts[i].stretch;
        a->info.worst_stretch = fmax(a->info.worst_stretch, (double)a->charts[i].stretch);
    }
    sum_pages(a);
    a->info.stretch = area > 0.0 ? stretch / area : 1.0;
done:
    free(m.vertices);
    *atlas = result == VSH_OK ? a : NULL;
    if (result != VSH_OK) {
        vsh_atlas_free(a);
    }
    return result;
}

void vsh_atlas_free(vsh_atlas *a) {
    if (a == NULL) {
        return;
    }
    free(a->pages);
    free(a->meshes);
    free(a->uvs);
    free(a->sources);
    free(a);
}

void vsh_atlas_get_info(const vsh_atlas *atlas, vsh_atlas_info *info) {
    *info = atlas->info;
}

vsh_atlas_mesh vsh_atlas_mesh_view(const vsh_atlas *atlas, size_t mesh) {
    return atlas->meshes[mesh];
}

vsh_atlas_page vsh_atlas_page_view(const vsh_atlas *atlas, size_t page) {
    return atlas->pages[page];
}

const vsh_atlas_chart *vsh_atlas_charts(const vsh_atlas *atlas) {
    return atlas->charts;
}
