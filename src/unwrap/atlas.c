#include "unwrap/atlas.h"

#include "base/memory.h"
#include "base/try.h"
#include "mesh/weld.h"
#include "unwrap/patch.h"

#include <stdlib.h>

static const char what[] = "an atlas";

double vshi_atlas_shape_bytes(size_t triangle_count) {
    return 64.0 * (double)triangle_count;
}

double vshi_atlas_mesh_bytes(size_t triangle_count) {
    return 28.0 * (double)triangle_count + 256.0;
}

/* --- vertices of a shape */

/* What vertices are made of while they are numbered: those of a patch's vertex, one for each vertex of the
 * mesh that its corners have. */
typedef struct numbering {
    const vshi_shape *shape;
    vshi_atlas_shape *made;
    uint32_t *last;   /* [most vertices of a patch]: the last that was made of each, + 1; 0: none */
    uint32_t *before; /* [3 triangles]: the one that was made before each, + 1 */
} numbering;

static uint32_t vertex_of(numbering *n, uint32_t chart, uint32_t vertex, uint32_t source) {
    vshi_atlas_shape *made = n->made;
    for (uint32_t v = n->last[vertex]; v != 0; v = n->before[v - 1]) {
        if (made->sources[v - 1] == source) {
            return v - 1;
        }
    }
    const uint32_t own = (uint32_t)made->vertex_count++;
    made->sources[own] = source;
    made->vertex_chart[own] = chart;
    made->patch_vertex[own] = vertex;
    n->before[own] = n->last[vertex];
    n->last[vertex] = own + 1;
    return own;
}

static void number_vertices(numbering *n) {
    vshi_atlas_shape *made = n->made;
    const vsh_mesh *mesh = n->shape->mesh;
    for (uint32_t c = 0; c < made->chart_count; ++c) {
        const vshi_patch *p = &n->shape->patches.list[c];
        memset(n->last, 0, p->vertex_count * sizeof *n->last);
        for (uint32_t i = 0; i < p->count; ++i) {
            const size_t triangle = p->triangles[i];
            made->charts[triangle] = c;
            for (size_t k = 0; k < 3; ++k) {
                made->indices[3 * triangle + k] =
                    vertex_of(n, c, p->corner[i][k], mesh->indices[3 * triangle + k]);
            }
        }
    }
    made->chart_vertices = made->vertex_count;
    for (size_t i = 0; i < made->triangle_count; ++i) {
        for (size_t k = 0; k < 3 && made->charts[i] == VSH_NO_CHART; ++k) {
            made->sources[made->vertex_count] = mesh->indices[3 * i + k];
            made->indices[3 * i + k] = (uint32_t)made->vertex_count++;
        }
    }
}

static vsh_result shape_make(const vshi_shape *shape, vshi_atlas_shape *made, vsh_error *error) {
    numbering n = {.shape = shape, .made = made};
    const size_t count = shape->mesh->triangle_count;
    uint32_t most = 0;
    vsh_result result;
    made->triangle_count = count;
    made->chart_count = shape->patches.count;
    for (size_t c = 0; c < made->chart_count; ++c) {
        most = shape->patches.list[c].vertex_count > most ? shape->patches.list[c].vertex_count : most;
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&made->sources, 3 * count, sizeof *made->sources, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&made->indices, 3 * count, sizeof *made->indices, what, error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&made->vertex_chart, 3 * count, sizeof *made->vertex_chart, what, error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&made->patch_vertex, 3 * count, sizeof *made->patch_vertex, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&made->charts, count, sizeof *made->charts, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&n.last, most, sizeof *n.last, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&n.before, 3 * count, sizeof *n.before, what, error));
    if (count > 0) {
        memset(made->charts, 0xff, count * sizeof *made->charts);
    }
    number_vertices(&n);
done:
    free(n.before);
    free(n.last);
    return result;
}

/* --- places in 32-bit UVs */

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

/* Not positive: flipped, or without area. Exact but for the last rounding, which keeps the sign: differences
 * and products of floats of one range are doubles. */
static bool is_bad(const vshi_patch *p, float (*const uvs)[2], uint32_t i) {
    const float *a = uvs[p->corner[i][0]], *b = uvs[p->corner[i][1]], *c = uvs[p->corner[i][2]];
    return !(((double)b[0] - (double)a[0]) * ((double)c[1] - (double)a[1]) -
                 ((double)b[1] - (double)a[1]) * ((double)c[0] - (double)a[0]) >
             0.0);
}

/* Bad triangles around a vertex. */
static uint32_t count_bad(const settling *s, uint32_t v) {
    uint32_t bad = 0;
    for (uint32_t i = s->begin[v]; i < s->begin[v + 1]; ++i) {
        bad += is_bad(s->patch, s->uvs, s->around[i] / 3);
    }
    return bad;
}

/* Moves a vertex to where fewer triangles around it are bad, if it finds such a place. */
static void move(settling *s, uint32_t v) {
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

/* Triangles that rounding has flipped or flattened, slivers all of them, are turned right by moving a corner
 * by some last places: uvs[vertex_count] of the patch, 0 … 1. Some may stay. */
static vsh_result settle(const vshi_patch *p, float (*uvs)[2], vsh_error *error) {
    settling s = {.patch = p, .uvs = uvs};
    const vshi_array arrays[] = {VSHI_ARRAY(s.begin, (size_t)p->vertex_count + 2),
                                 VSHI_ARRAY(s.around, 3 * (size_t)p->count)};
    vsh_result result;
    uint32_t bad = 0;
    for (uint32_t i = 0; i < p->count; ++i) {
        bad += is_bad(p, uvs, i);
    }
    if (bad == 0) {
        return VSH_OK;
    }
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, what, error));
    vshi_list_groups(p->corner[0], 3 * (size_t)p->count, p->vertex_count, s.begin, s.around);
    for (int pass = 0; pass < PASSES && bad > 0; ++pass) {
        bad = 0;
        for (uint32_t i = 0; i < p->count; ++i) {
            for (int k = 0; k < 3 && is_bad(p, uvs, i); ++k) {
                move(&s, p->corner[i][k]);
            }
            bad += is_bad(p, uvs, i);
        }
    }
done:
    free(s.around);
    free(s.begin);
    return result;
}

/* --- meshes */

/* UVs of a mesh's vertices, chart by chart. */
static vsh_result place_vertices(struct vsh_atlas *a, size_t m, const vshi_shape *shape,
                                 const vshi_atlas_shape *made, const vshi_item *items, vsh_error *error) {
    float(*placed)[2] = NULL; /* of a patch */
    uint32_t most = 0;
    vsh_result result;
    for (size_t c = 0; c < made->chart_count; ++c) {
        most = shape->patches.list[c].vertex_count > most ? shape->patches.list[c].vertex_count : most;
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&placed, most, sizeof *placed, what, error));
    size_t vertex = 0;
    for (size_t c = 0; c < made->chart_count; ++c) {
        const vshi_patch *p = &shape->patches.list[c];
        const vsh_atlas_page *page = &a->pages[items[c].at.page];
        for (uint32_t v = 0; v < p->vertex_count; ++v) {
            double at[2];
            vshi_fit_turn(&items[c].at.fit, items[c].at.quarters, p->uv[v], at);
            placed[v][0] = (float)((items[c].at.x + at[0]) / page->width);
            placed[v][1] = (float)((items[c].at.y + at[1]) / page->height);
        }
        VSHI_TRY_DONE(settle(p, placed, error));
        for (; vertex < made->chart_vertices && made->vertex_chart[vertex] == c; ++vertex) {
            memcpy(a->uvs[m] + 2 * vertex, placed[made->patch_vertex[vertex]], sizeof *placed);
        }
    }
done:
    free(placed);
    return result;
}

static vsh_result mesh_make(struct vsh_atlas *a, size_t m, const vshi_shape *shape,
                            const vshi_atlas_shape *made, const vshi_item *items, uint32_t first_chart,
                            vsh_error *error) {
    VSHI_TRY(vshi_allocate((void **)&a->uvs[m], made->vertex_count, 2 * sizeof(float), what, error));
    VSHI_TRY(vshi_allocate((void **)&a->mesh_charts[m], made->triangle_count, sizeof(uint32_t), what, error));
    VSHI_TRY(place_vertices(a, m, shape, made, items, error));
    for (size_t i = 0; i < made->triangle_count; ++i) {
        a->mesh_charts[m][i] = made->charts[i] != VSH_NO_CHART ? first_chart + made->charts[i] : VSH_NO_CHART;
        a->info.flat_triangles += made->charts[i] == VSH_NO_CHART;
    }
    a->meshes[m] = (vsh_atlas_mesh){.uvs = a->uvs[m],
                                    .sources = made->sources,
                                    .indices = made->indices,
                                    .charts = a->mesh_charts[m],
                                    .vertex_count = made->vertex_count,
                                    .triangle_count = made->triangle_count};
    return VSH_OK;
}

/* Stretch of a chart as it was fitted to texels: L2 of the patch, times that of its sides' factors. */
static double fitted_stretch(const vshi_item *item) {
    const double uneven = item->at.fit.uneven;
    return item->patch->stretch * sqrt(0.5 * (uneven + 1.0 / uneven));
}

static void chart_make(struct vsh_atlas *a, const vshi_item *item, double scale, uint32_t chart) {
    const bool sideways = item->at.quarters % 2 != 0;
    const double stretch = fitted_stretch(item);
    a->charts[chart] = (vsh_atlas_chart){
        .page = item->at.page,
        .mesh = item->mesh,
        .stretch = (float)stretch,
        .area = item->patch->area * scale * scale,
        .min = {item->at.x, item->at.y},
        .max = {item->at.x + (sideways ? item->at.fit.height : item->at.fit.width),
                item->at.y + (sideways ? item->at.fit.width : item->at.fit.height)},
    };
    vsh_atlas_page *page = &a->pages[item->at.page];
    page->first_mesh = item->mesh < page->first_mesh ? item->mesh : page->first_mesh;
    page->covered += (double)item->at.touched;
}

/* What pages have in all, and shares of texels that were counted. */
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

vsh_result vshi_atlas_make(size_t mesh_count, const vshi_shapes *shapes, vshi_pages *pages,
                           const vshi_item *items, size_t item_count, vsh_atlas **atlas, vsh_error *error) {
    struct vsh_atlas *a = NULL;
    double area = 0.0, stretch = 0.0;
    vsh_result result;
    VSHI_TRY(vshi_allocate((void **)&a, 1, sizeof *a, what, error));
    a->shape_count = shapes->count;
    a->mesh_count = mesh_count;
    a->info = (vsh_atlas_info){
        .charts = item_count, .pages = (uint32_t)pages->count, .shared = mesh_count - shapes->count};
    a->pages = pages->list;
    *pages = (vshi_pages){NULL, 0};
    VSHI_TRY_DONE(vshi_allocate((void **)&a->shapes, shapes->count, sizeof *a->shapes, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&a->meshes, mesh_count, sizeof *a->meshes, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&a->uvs, mesh_count, sizeof *a->uvs, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&a->mesh_charts, mesh_count, sizeof *a->mesh_charts, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&a->charts, item_count, sizeof *a->charts, what, error));
    for (size_t i = 0; i < shapes->count; ++i) {
        VSHI_TRY_DONE(shape_make(&shapes->list[i], &a->shapes[i], error));
    }
    uint32_t chart = 0;
    for (size_t m = 0; m < mesh_count; ++m) {
        const vshi_instance *instance = &shapes->instances[m];
        const vshi_shape *shape = &shapes->list[instance->shape];
        a->info.kept += shape->kept;
        VSHI_TRY_DONE(mesh_make(a, m, shape, &a->shapes[instance->shape], items + chart, chart, error));
        for (size_t c = 0; c < shape->patches.count; ++c, ++chart) {
            chart_make(a, &items[chart], shape->surface.scale * instance->scale, chart);
            area += a->charts[chart].area;
            stretch += a->charts[chart].area * (double)a->charts[chart].stretch;
            a->info.worst_stretch = fmax(a->info.worst_stretch, (double)a->charts[chart].stretch);
        }
    }
    sum_pages(a);
    a->info.stretch = area > 0.0 ? stretch / area : 1.0;
done:
    if (result != VSH_OK) {
        vsh_atlas_free(a);
        return result;
    }
    *atlas = a;
    return VSH_OK;
}

void vsh_atlas_free(vsh_atlas *a) {
    if (a == NULL) {
        return;
    }
    for (size_t m = 0; m < a->mesh_count; ++m) {
        if (a->uvs != NULL) {
            free(a->uvs[m]);
        }
        if (a->mesh_charts != NULL) {
            free(a->mesh_charts[m]);
        }
    }
    for (size_t i = 0; a->shapes != NULL && i < a->shape_count; ++i) {
        free(a->shapes[i].charts);
        free(a->shapes[i].patch_vertex);
        free(a->shapes[i].vertex_chart);
        free(a->shapes[i].indices);
        free(a->shapes[i].sources);
    }
    free(a->pages);
    free(a->charts);
    free(a->mesh_charts);
    free(a->uvs);
    free(a->meshes);
    free(a->shapes);
    free(a);
}

size_t vsh_atlas_mesh_count(const vsh_atlas *atlas) {
    return atlas->mesh_count;
}

size_t vsh_atlas_chart_count(const vsh_atlas *atlas) {
    return (size_t)atlas->info.charts;
}

size_t vsh_atlas_page_count(const vsh_atlas *atlas) {
    return atlas->info.pages;
}

void vsh_atlas_get_info(const vsh_atlas *atlas, vsh_atlas_info *info) {
    *info = atlas->info;
}

vsh_atlas_mesh vsh_atlas_mesh_view(const vsh_atlas *atlas, size_t mesh) {
    return atlas->meshes[mesh];
}

vsh_atlas_chart vsh_atlas_chart_view(const vsh_atlas *atlas, size_t chart) {
    return atlas->charts[chart];
}

vsh_atlas_page vsh_atlas_page_view(const vsh_atlas *atlas, size_t page) {
    return atlas->pages[page];
}

const vsh_atlas_chart *vsh_atlas_charts(const vsh_atlas *atlas) {
    return atlas->charts;
}
