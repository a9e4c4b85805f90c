/* Pages of receivers, and lightmap UVs that are made for them. */
#include "scene/assets.h"

#include "base/job.h"
#include "base/memory.h"
#include "geometry/mesh.h"
#include "io/model/model.h"

#include <vdbshade/scene.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Largest share of a mesh's triangles that may lack area in the UVs: exporters make such triangles of
 * slivers. */
static const double LARGEST_DEGENERATE = 0.01;

int32_t vshi_receiver_unwrap(const vsh_receiver *receiver) {
    if (receiver->type != VSH_RECEIVER_MESH || receiver->vertex_colors != NULL) {
        return VSH_RECEIVER_UNWRAP_NEVER;
    }
    if (receiver->unwrap != VSH_RECEIVER_UNWRAP_DEFAULT) {
        return receiver->unwrap;
    }
    return vsh_lit_is_output(receiver->output) ? VSH_RECEIVER_UNWRAP_AUTO : VSH_RECEIVER_UNWRAP_NEVER;
}

/* Whether a lightmap of the meshes' own UVs can be baked. */
static vsh_result are_usable(const vsh_receiver *receiver, const vsh_mesh *meshes, size_t count,
                             const vsh_run *run, bool *usable, vsh_error *error) {
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = receiver->width;
    options.height = receiver->height;
    vsh_run quiet = *run;
    quiet.warning = NULL;
    vsh_uv_report *reports = NULL;
    vsh_charts *charts = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&reports, count, sizeof *reports, "UV reports", error));
    VSHI_TRY_DONE(vsh_charts_create(meshes, count, &options, &quiet, reports, &charts, error));
    vsh_charts_info info;
    vsh_charts_get_info(charts, &info);
    size_t overlap = 0;
    *usable = info.covered > 0;
    for (size_t i = 0; i < count; ++i) {
        overlap += reports[i].overlap_texels;
        *usable =
            *usable && reports[i].outside_triangles == 0 &&
            (double)reports[i].degenerate_triangles <= LARGEST_DEGENERATE * (double)meshes[i].triangle_count;
    }
    *usable = *usable && (double)overlap <= VSH_LARGEST_OVERLAP * (double)info.covered;
done:
    vsh_charts_free(charts);
    free(reports);
    return result;
}

vsh_result vsh_receiver_needs_unwrap(const vsh_receiver *receiver, const vsh_mesh *meshes, size_t count,
                                     const vsh_run *run, int32_t *needs, vsh_error *error) {
    VSHI_NEEDS(receiver);
    VSHI_NEEDS_OF(count, meshes);
    VSHI_NEEDS(needs);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    const int32_t mode = vshi_receiver_unwrap(receiver);
    *needs = mode == VSH_RECEIVER_UNWRAP_ALWAYS;
    if (mode != VSH_RECEIVER_UNWRAP_AUTO) {
        return VSH_OK;
    }
    *needs = receiver->texels_per_unit > 0.0 || receiver->pages > 0 || receiver->max_size > 0 ||
             receiver->density_count > 0;
    for (size_t i = 0; i < count; ++i) {
        *needs = *needs || meshes[i].uvs == NULL;
    }
    if (*needs) {
        return VSH_OK;
    }
    for (size_t first = 0, size; first < count && *needs == 0; first += size) {
        bool usable = false;
        size = receiver->atlas == VSH_ATLAS_OBJECTS ? vshi_mesh_object_size(meshes, first, count) : count;
        VSHI_TRY(are_usable(receiver, meshes + first, size, &full, &usable, error));
        *needs = !usable;
    }
    return VSH_OK;
}

/* --- meshes cut along their charts */

typedef struct mesh_cut {
    const vshi_asset_place *place; /* of the whole meshes */
    const vsh_atlas *atlas;
    size_t page_count;
    size_t *on_page;       /* [page_count]: triangles of one mesh */
    size_t *next;          /* [page_count]: next part of each page */
    uint32_t objects;      /* highest number of an object */
    vsh_mesh *parts;       /* these three: [parts] */
    size_t *numbers;       /* of the model's meshes */
    size_t *atlas_numbers; /* of the atlas' meshes, which are the place's */
    uint32_t *memory;      /* unused elements for positions, normals and indices */
} mesh_cut;

static void *allocate_elements(mesh_cut *c, size_t count) {
    c->memory += count;
    return c->memory - count;
}

static uint32_t find_page(const mesh_cut *c, const vsh_atlas_mesh *view, size_t triangle) {
    const uint32_t chart = view->charts[triangle];
    return chart == VSH_NO_CHART ? UINT32_MAX : vsh_atlas_charts(c->atlas)[chart].page;
}

/* Counts a mesh's triangles by pages. Triangles without a chart count on the first page with charts. Returns
 * the number of pages. */
static size_t count_by_page(const mesh_cut *c, const vsh_atlas_mesh *view, size_t *first) {
    size_t pages = 0, without = 0;
    memset(c->on_page, 0, c->page_count * sizeof *c->on_page);
    for (size_t t = 0; t < view->triangle_count; ++t) {
        const uint32_t page = find_page(c, view, t);
        if (page == UINT32_MAX) {
            ++without;
        } else {
            pages += c->on_page[page]++ == 0;
        }
    }
    for (*first = 0; pages > 0 && c->on_page[*first] == 0;) {
        ++*first;
    }
    c->on_page[*first] += without;
    return pages > 0 ? pages : 1;
}

/* Whether a mesh counted by pages has a part on the page. */
static bool has_part(const mesh_cut *c, size_t pages, size_t first, size_t page) {
    return c->on_page[page] > 0 || (page == first && pages == 1);
}

/* Copies three floats a vertex in the atlas' order; NULL if there are none. */
static const float *copy_vertices(mesh_cut *c, const float *from, const vsh_atlas_mesh *view) {
    if (from == NULL || view->vertex_count == 0) {
        return NULL;
    }
    float *to = allocate_elements(c, 3 * (size_t)view->vertex_count);
    for (size_t v = 0; v < view->vertex_count; ++v) {
        memcpy(to + 3 * v, from + 3 * (size_t)view->sources[v], 3 * sizeof *to);
    }
    return to;
}

/* Copies the triangles of a mesh that lie on one page. */
static void copy_triangles(mesh_cut *c, const vsh_atlas_mesh *view, size_t page, bool first, vsh_mesh *part) {
    uint32_t *indices = allocate_elements(c, 3 * c->on_page[page]);
    part->indices = indices;
    part->triangle_count = 0;
    for (size_t t = 0; t < view->triangle_count; ++t) {
        const uint32_t own = find_page(c, view, t);
        if (own == page || (own == UINT32_MAX && first)) {
            memcpy(indices + 3 * part->triangle_count++, view->indices + 3 * t, 3 * sizeof *indices);
        }
    }
}

/* Adds a mesh's parts to the pages. */
static void add_parts(mesh_cut *c, size_t m) {
    const vsh_mesh *mesh = &c->place->meshes[m];
    const vsh_atlas_mesh view = vsh_atlas_mesh_view(c->atlas, m);
    size_t first;
    const size_t pages = count_by_page(c, &view, &first);
    vsh_mesh part = *mesh;
    part.checked = NULL;
    part.uvs = view.uvs;
    part.indices = view.indices;
    part.vertex_count = view.vertex_count;
    part.object = pages > 1 && part.object == 0 ? ++c->objects : part.object;
    part.positions = copy_vertices(c, mesh->positions, &view);
    part.normals = copy_vertices(c, mesh->normals, &view);
    for (size_t page = 0; page < c->page_count; ++page) {
        if (has_part(c, pages, first, page)) {
            const size_t at = c->next[page]++;
            c->parts[at] = part;
            c->atlas_numbers[at] = m;
            c->numbers[at] = c->place->numbers[m];
            if (pages > 1) {
                copy_triangles(c, &view, page, page == first, &c->parts[at]);
            }
        }
    }
}

/* Finds where each page's parts begin. Returns the elements of memory that all parts take. */
static size_t count_parts(mesh_cut *c, size_t *begins) {
    size_t elements = 0;
    for (size_t m = 0; m < c->place->count; ++m) {
        const vsh_mesh *mesh = &c->place->meshes[m];
        const vsh_atlas_mesh view = vsh_atlas_mesh_view(c->atlas, m);
        size_t first;
        const size_t pages = count_by_page(c, &view, &first);
        elements += (mesh->normals != NULL ? 6 : 3) * (size_t)view.vertex_count;
        elements += pages > 1 ? 3 * (size_t)view.triangle_count : 0;
        c->objects = mesh->object > c->objects ? mesh->object : c->objects;
        for (size_t page = 0; page < c->page_count; ++page) {
            begins[page + 1] += has_part(c, pages, first, page);
        }
    }
    for (size_t page = 0; page < c->page_count; ++page) {
        begins[page + 1] += begins[page];
        c->next[page] = begins[page];
    }
    return elements;
}

/* Replaces the place's meshes by their parts. */
static vsh_result cut_meshes(vshi_asset_place *place, const vsh_run *run, vsh_error *error) {
    vshi_receiver_pages *pages = &place->pages;
    const size_t count = pages->count;
    mesh_cut c = {.place = place, .atlas = pages->atlas, .page_count = count};
    const vshi_array lists[] = {VSHI_ARRAY(c.on_page, count), VSHI_ARRAY(c.next, count),
                                VSHI_ARRAY(pages->begins, count + 1)};
    vsh_result result;
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(lists, "pages", error));
    const size_t elements = count_parts(&c, pages->begins), parts = pages->begins[count];
    VSHI_TRY_DONE(vshi_check_limit(run, (double)elements * sizeof *c.memory, "unwrapped meshes", error));
    const vshi_array arrays[] = {VSHI_ARRAY(c.parts, parts), VSHI_ARRAY(c.numbers, parts),
                                 VSHI_ARRAY(pages->atlas_numbers, parts),
                                 VSHI_ARRAY(pages->memory, elements)};
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, "unwrapped meshes", error));
    c.atlas_numbers = pages->atlas_numbers;
    c.memory = pages->memory;
    for (size_t m = 0; m < place->count; ++m) {
        add_parts(&c, m);
    }
    free(place->numbers);
    free(place->meshes);
    place->numbers = c.numbers;
    place->meshes = c.parts;
    place->count = parts;
    c.numbers = NULL;
    c.parts = NULL;
done:
    free(c.numbers);
    free(c.parts);
    free(c.next);
    free(c.on_page);
    return result;
}

/* --- pages */

/* Lists the pages of a receiver that is not unwrapped. */
static vsh_result keep_pages(vshi_asset_place *place, const vsh_receiver *receiver, vsh_error *error) {
    vshi_receiver_pages *pages = &place->pages;
    const bool objects = receiver->atlas == VSH_ATLAS_OBJECTS && receiver->vertex_colors == NULL;
    const vshi_array arrays[] = {VSHI_ARRAY(pages->begins, place->count + 1),
                                 VSHI_ARRAY(pages->list, place->count)};
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, "pages", error));
    for (size_t first = 0, size; first < place->count; first += size) {
        size = objects ? vshi_mesh_object_size(place->meshes, first, place->count) : place->count;
        pages->list[pages->count] = (vshi_receiver_page){
            receiver->width, receiver->height, objects ? vshi_object_name(&place->meshes[first]) : NULL};
        pages->begins[++pages->count] = first + size;
    }
    return VSH_OK;
}

/* Lists the pages of an atlas of the place's meshes. */
static vsh_result list_pages(vshi_asset_place *place, const vsh_receiver *receiver, vsh_error *error) {
    vshi_receiver_pages *pages = &place->pages;
    const bool objects = receiver->atlas == VSH_ATLAS_OBJECTS;
    vsh_atlas_info info;
    vsh_atlas_get_info(pages->atlas, &info);
    pages->count = info.pages;
    VSHI_TRY(vshi_allocate((void **)&pages->list, pages->count, sizeof *pages->list, "pages", error));
    for (size_t i = 0; i < pages->count; ++i) {
        const vsh_atlas_page page = vsh_atlas_page_view(pages->atlas, i);
        pages->list[i] = (vshi_receiver_page){
            page.width, page.height, objects ? vshi_object_name(&place->meshes[page.first_mesh]) : NULL};
    }
    return VSH_OK;
}

vsh_result vsh_model_densities(const vsh_model *model, const char *path, const vsh_density_rule *rules,
                               size_t count, double *density, vsh_error *error) {
    VSHI_NEEDS_BOTH(model, path);
    VSHI_NEEDS(density);
    VSHI_NEEDS_OF(count, rules);
    const size_t meshes = vsh_model_mesh_count(model);
    for (size_t m = 0; m < meshes; ++m) {
        density[m] = 1.0;
    }
    for (size_t r = 0; r < count; ++r) {
        const vsh_density_rule *rule = &rules[r];
        if (rule->pattern == NULL || !(rule->factor > 0.0) || !isfinite(rule->factor)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "%s: density '%.100s' is %g, expected a pattern and a finite number above 0",
                             path, rule->pattern != NULL ? rule->pattern : "", rule->factor);
        }
        unsigned char *chosen = NULL;
        const vsh_result result = vshi_select_some(model, path, &rule->pattern, 1, &chosen, error);
        for (size_t m = 0; m < meshes && result == VSH_OK; ++m) {
            density[m] = chosen[m] != 0 ? rule->factor : density[m];
        }
        free(chosen);
        VSHI_TRY(result);
    }
    return VSH_OK;
}

/* Lists the density factors of a receiver's meshes, to be freed even after an error; NULL: all are 1. */
static vsh_result list_densities(const vsh_receiver *receiver, const vshi_asset_place *place,
                                 double **density, vsh_error *error) {
    if (receiver->density_count == 0) {
        return VSH_OK;
    }
    const size_t all = vsh_model_mesh_count(place->model);
    VSHI_TRY(vshi_allocate((void **)density, all, sizeof **density, "densities", error));
    VSHI_TRY(vsh_model_densities(place->model, receiver->path, receiver->density, receiver->density_count,
                                 *density, error));
    for (size_t m = 0; m < place->count; ++m) {
        (*density)[m] = (*density)[place->numbers[m]]; /* numbers rise, so none was overwritten */
    }
    return VSH_OK;
}

static vsh_unwrap_options choose_unwrap_options(const vsh_receiver *receiver) {
    vsh_unwrap_options options = vsh_unwrap_options_default();
    const bool fit = receiver->max_size > 0, dense = receiver->texels_per_unit > 0.0;
    options.width = fit ? receiver->max_size : receiver->width;
    options.height = fit ? receiver->max_size : receiver->height;
    options.fit_pages = fit;
    options.atlas = receiver->atlas;
    options.padding = receiver->padding == VSH_PADDING_AUTO ? options.padding : receiver->padding;
    options.texels_per_unit = receiver->texels_per_unit;
    options.max_pages = receiver->pages > 0                            ? receiver->pages
                        : dense && receiver->atlas == VSH_ATLAS_SHARED ? VSH_MAX_PAGES
                                                                       : 1;
    options.keep_uvs =
        vshi_receiver_unwrap(receiver) == VSH_RECEIVER_UNWRAP_ALWAYS ? VSH_UNWRAP_ALWAYS : VSH_UNWRAP_KEEP;
    return options;
}

static vsh_result unwrap(vshi_asset_place *place, const vsh_receiver *receiver, const vsh_run *run,
                         vsh_error *error) {
    vsh_unwrap_options options = choose_unwrap_options(receiver);
    if (receiver->max_size > 0 && receiver->texels_per_unit == 0.0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "%s: a largest size (max_size) needs a density (texels_per_unit): without one, any "
                         "size is filled",
                         receiver->path);
    }
    if (receiver->pages > 1 && receiver->atlas == VSH_ATLAS_OBJECTS) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %d pages: in an atlas of objects each has one",
                         receiver->path, receiver->pages);
    }
    vsh_error why;
    double *density = NULL;
    vsh_result result = list_densities(receiver, place, &density, error);
    if (result == VSH_OK) {
        options.density = density;
        result = vsh_unwrap(place->meshes, place->count, &options, run, &place->pages.atlas, &why);
        result = result == VSH_OK ? VSH_OK : vshi_fail(error, result, "%s: %s", receiver->path, why.message);
    }
    free(density);
    VSHI_TRY(result);
    VSHI_TRY(list_pages(place, receiver, error));
    return cut_meshes(place, run, error);
}

/* Whether a lit asset's own UVs are a packer's integers. Few engines read a lightmap with those. */
static bool is_packed(const vshi_asset_place *place, const vsh_receiver *receiver) {
    bool packed = false;
    if (vshi_receiver_unwrap(receiver) != VSH_RECEIVER_UNWRAP_AUTO || !vsh_lit_is_output(receiver->output)) {
        return false;
    }
    for (size_t i = 0; i < place->count; ++i) {
        const vshi_model_shape *shape = &place->model->shapes[place->model->entries[place->numbers[i]].shape];
        const int32_t set = receiver->uv_set < 0 ? shape->uv_sets > 1 : receiver->uv_set;
        packed = packed || (shape->packed >> set & 1) != 0;
    }
    return packed;
}

vsh_result vshi_place_pages(vshi_asset_place *place, const vsh_receiver *receiver, const vsh_run *run,
                            vsh_error *error) {
    int32_t needs = 0;
    VSHI_TRY(vsh_receiver_needs_unwrap(receiver, place->meshes, place->count, run, &needs, error));
    return needs != 0 || is_packed(place, receiver) ? unwrap(place, receiver, run, error)
                                                    : keep_pages(place, receiver, error);
}

void vshi_receiver_pages_free(vshi_receiver_pages *pages) {
    free(pages->memory);
    free(pages->list);
    free(pages->begins);
    free(pages->atlas_numbers);
    vsh_atlas_free(pages->atlas);
}
