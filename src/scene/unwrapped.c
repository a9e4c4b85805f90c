/* Lightmap UVs that are made for receivers, and the pages of those that have some. */
#include "scene/assets.h"

#include "base/job.h"
#include "base/memory.h"
#include "mesh/mesh.h"
#include "model/model.h"

#include <vdbshade/lit.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Of a mesh's triangles, those without area in the UVs: what an exporter leaves of slivers. */
static const double LARGEST_DEGENERATE = 0.01;

int32_t vshi_receiver_unwrap(const vsh_receiver *receiver) {
    if (receiver->type != VSH_RECEIVER_MESH) {
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

/* --- parts */

typedef struct cutting {
    const vsh_mesh *meshes;
    size_t count;
    const vsh_atlas_chart *charts;
    size_t *on_page;  /* [page_count]: triangles of one mesh */
    uint32_t objects; /* numbers of objects that are taken */
    vshi_unwrapped *made;
} cutting;

/* The next `count` elements of four bytes in the memory for positions, normals and indices. */
static void *take(vshi_unwrapped *made, size_t count) {
    made->used += count;
    return made->memory + made->used - count;
}

static uint32_t page_of(const cutting *c, const vsh_atlas_mesh *view, size_t triangle) {
    const uint32_t chart = view->charts[triangle];
    return chart == VSH_NO_CHART ? UINT32_MAX : c->charts[chart].page;
}

/* Counts a mesh's triangles by pages; those without a chart go with the first that has any. Returns how many
 * pages there are. */
static size_t count_by_page(const cutting *c, const vsh_atlas_mesh *view, size_t *first) {
    size_t pages = 0, none = 0;
    memset(c->on_page, 0, c->made->page_count * sizeof *c->on_page);
    for (size_t t = 0; t < view->triangle_count; ++t) {
        const uint32_t page = page_of(c, view, t);
        if (page == UINT32_MAX) {
            ++none;
        } else {
            pages += c->on_page[page]++ == 0;
        }
    }
    for (*first = 0; pages > 0 && c->on_page[*first] == 0;) {
        ++*first;
    }
    c->on_page[*first] += none;
    return pages > 0 ? pages : 1;
}

/* Copies three floats a vertex to where the atlas wants them; NULL where there are none. */
static const float *gather(vshi_unwrapped *made, const float *from, const vsh_atlas_mesh *view) {
    if (from == NULL || view->vertex_count == 0) {
        return NULL;
    }
    float *to = take(made, 3 * (size_t)view->vertex_count);
    for (size_t v = 0; v < view->vertex_count; ++v) {
        memcpy(to + 3 * v, from + 3 * (size_t)view->sources[v], 3 * sizeof *to);
    }
    return to;
}

/* Copies the triangles of a mesh that lie on one page. */
static void select_page(const cutting *c, const vsh_atlas_mesh *view, uint32_t page, bool first,
                        vsh_mesh *part) {
    uint32_t *indices = take(c->made, 3 * c->on_page[page]);
    part->indices = indices;
    part->triangle_count = 0;
    for (size_t t = 0; t < view->triangle_count; ++t) {
        const uint32_t own = page_of(c, view, t);
        if (own == page || (own == UINT32_MAX && first)) {
            memcpy(indices + 3 * part->triangle_count++, view->indices + 3 * t, 3 * sizeof *indices);
        }
    }
}

/* Adds a mesh's parts to the pages' lists, of which `page_begins` says where each goes on. */
static void add_parts(cutting *c, size_t m) {
    vshi_unwrapped *made = c->made;
    const vsh_atlas_mesh view = vsh_atlas_mesh_view(made->atlas, m);
    size_t first;
    const size_t pages = count_by_page(c, &view, &first);
    vsh_mesh part = c->meshes[m];
    part.checked = NULL;
    part.uvs = view.uvs;
    part.indices = view.indices;
    part.vertex_count = view.vertex_count;
    part.object = pages > 1 && part.object == 0 ? ++c->objects : part.object;
    part.positions = gather(made, c->meshes[m].positions, &view);
    part.normals = gather(made, c->meshes[m].normals, &view);
    for (size_t page = 0; page < made->page_count; ++page) {
        if (c->on_page[page] == 0 && !(page == first && pages == 1)) {
            continue;
        }
        vsh_mesh *placed = &made->parts[made->page_begins[page]];
        *placed = part;
        made->numbers[made->page_begins[page]++] = m;
        if (pages > 1) {
            select_page(c, &view, (uint32_t)page, page == first, placed);
        }
    }
}

/* Finds where each page's parts begin, and how many there are. Returns the elements that they take. */
static size_t count_parts(cutting *c) {
    vshi_unwrapped *made = c->made;
    size_t elements = 0;
    for (size_t m = 0; m < c->count; ++m) {
        const vsh_atlas_mesh view = vsh_atlas_mesh_view(made->atlas, m);
        size_t first;
        const size_t pages = count_by_page(c, &view, &first);
        const bool empty = pages == 1 && c->on_page[first] == 0;
        elements += (c->meshes[m].normals != NULL ? 6 : 3) * (size_t)view.vertex_count;
        elements += pages > 1 ? 3 * (size_t)view.triangle_count : 0;
        for (size_t page = 0; page < made->page_count; ++page) {
            made->page_begins[page + 1] += c->on_page[page] > 0 || (empty && page == first);
        }
    }
    for (size_t page = 0; page < made->page_count; ++page) {
        made->page_begins[page + 1] += made->page_begins[page];
    }
    made->part_count = made->page_begins[made->page_count];
    return elements;
}

static vsh_result cut(cutting *c, const vsh_run *run, vsh_error *error) {
    vshi_unwrapped *made = c->made;
    double bytes = 0.0;
    for (size_t m = 0; m < c->count; ++m) {
        const vsh_atlas_mesh view = vsh_atlas_mesh_view(made->atlas, m);
        const size_t width = c->meshes[m].normals != NULL ? 6 : 3;
        bytes += (double)view.vertex_count * (double)(width * sizeof(float)) +
                 (double)view.triangle_count * 3.0 * sizeof(uint32_t);
        c->objects = c->meshes[m].object > c->objects ? c->meshes[m].object : c->objects;
    }
    VSHI_TRY(vshi_check_limit(run, bytes, "unwrapped meshes", error));
    made->page_count = vsh_atlas_page_count(made->atlas);
    VSHI_TRY(vshi_allocate((void **)&c->on_page, made->page_count, sizeof *c->on_page, "pages", error));
    VSHI_TRY(vshi_allocate((void **)&made->page_begins, made->page_count + 2, sizeof *made->page_begins,
                           "pages", error));
    const size_t elements = count_parts(c);
    VSHI_TRY(vshi_allocate((void **)&made->parts, made->part_count, sizeof *made->parts, "meshes", error));
    VSHI_TRY(
        vshi_allocate((void **)&made->numbers, made->part_count, sizeof *made->numbers, "meshes", error));
    VSHI_TRY(
        vshi_allocate((void **)&made->memory, elements, sizeof *made->memory, "unwrapped meshes", error));
    /* each page's beginning moves to its end, which is where the next one's is */
    for (size_t m = 0; m < c->count; ++m) {
        add_parts(c, m);
    }
    memmove(made->page_begins + 1, made->page_begins, made->page_count * sizeof *made->page_begins);
    made->page_begins[0] = 0;
    return VSH_OK;
}

/* Lists the pages of a receiver that is not unwrapped. */
static vsh_result keep_pages(const vsh_receiver *receiver, const vsh_mesh *meshes, size_t count,
                             vshi_unwrapped *unwrapped, vsh_error *error) {
    unwrapped->whole = (vsh_receiver_page){receiver->width, receiver->height, NULL};
    if (receiver->atlas != VSH_ATLAS_OBJECTS) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_allocate((void **)&unwrapped->page_begins, count + 1, sizeof *unwrapped->page_begins,
                           "pages", error));
    VSHI_TRY(vshi_allocate((void **)&unwrapped->pages, count, sizeof *unwrapped->pages, "pages", error));
    for (size_t first = 0; first < count; first += vshi_mesh_object_size(meshes, first, count)) {
        unwrapped->pages[unwrapped->page_count] = unwrapped->whole;
        unwrapped->pages[unwrapped->page_count].object = vshi_object_name(&meshes[first]);
        unwrapped->page_begins[unwrapped->page_count++] = first;
    }
    unwrapped->page_begins[unwrapped->page_count] = count;
    return VSH_OK;
}

static vsh_result list_pages(const vsh_receiver *receiver, const vsh_mesh *meshes, vshi_unwrapped *made,
                             vsh_error *error) {
    VSHI_TRY(vshi_allocate((void **)&made->pages, made->page_count, sizeof *made->pages, "pages", error));
    for (size_t i = 0; i < made->page_count; ++i) {
        const vsh_atlas_page page = vsh_atlas_page_view(made->atlas, i);
        const bool own = receiver->atlas == VSH_ATLAS_OBJECTS;
        made->pages[i] = (vsh_receiver_page){page.width, page.height,
                                             own ? vshi_object_name(&meshes[page.first_mesh]) : NULL};
    }
    return VSH_OK;
}

vsh_result vsh_model_densities(const vsh_model *model, const char *path, const vsh_density_rule *rules,
                               size_t count, double *density, vsh_error *error) {
    VSHI_NEEDS(model);
    VSHI_NEEDS(path);
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

/* Lists the factors of the density of a receiver's meshes, to be freed also after an error; NULL: all are 1.
 */
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

/* Puts the parts, and what their meshes are numbered, in the place of the meshes. */
static vsh_result take_parts(vshi_asset_place *place, vsh_error *error) {
    vshi_unwrapped *made = &place->unwrapped;
    size_t *numbers = NULL;
    VSHI_TRY(vshi_allocate((void **)&numbers, made->part_count, sizeof *numbers, "meshes", error));
    for (size_t i = 0; i < made->part_count; ++i) {
        numbers[i] = place->numbers[made->numbers[i]];
    }
    free(place->numbers);
    free(place->meshes);
    place->numbers = numbers;
    place->meshes = made->parts;
    place->count = made->part_count;
    made->parts = NULL;
    return VSH_OK;
}

static vsh_result unwrap(vshi_asset_place *place, const vsh_receiver *receiver, const vsh_run *run,
                         vsh_error *error) {
    vshi_unwrapped *made = &place->unwrapped;
    vsh_unwrap_options options = vsh_unwrap_options_default();
    options.width = receiver->max_size > 0 ? receiver->max_size : receiver->width;
    options.height = receiver->max_size > 0 ? receiver->max_size : receiver->height;
    options.fit_pages = receiver->max_size > 0;
    options.atlas = receiver->atlas;
    options.padding =
        receiver->padding == VSH_PADDING_AUTO ? vsh_unwrap_options_default().padding : receiver->padding;
    options.texels_per_unit = receiver->texels_per_unit;
    options.max_pages = receiver->pages > 0 ? receiver->pages
                        : receiver->texels_per_unit > 0.0 && receiver->atlas == VSH_ATLAS_SHARED
                            ? VSH_MAX_PAGES
                            : 1;
    options.keep_uvs =
        vshi_receiver_unwrap(receiver) == VSH_RECEIVER_UNWRAP_ALWAYS ? VSH_UNWRAP_ALWAYS : VSH_UNWRAP_KEEP;
    if (receiver->max_size > 0 && receiver->texels_per_unit == 0.0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "%s: a largest size (max_size) is for a density (texels_per_unit): without one, any "
                         "size is filled",
                         receiver->path);
    }
    if (receiver->pages > 1 && receiver->atlas == VSH_ATLAS_OBJECTS) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %d pages: of an atlas of objects each has one",
                         receiver->path, receiver->pages);
    }
    cutting c = {.meshes = place->meshes, .count = place->count, .made = made};
    vsh_error why;
    double *density = NULL;
    vsh_result result = list_densities(receiver, place, &density, error);
    if (result == VSH_OK) {
        options.density = density;
        result = vsh_unwrap(place->meshes, place->count, &options, run, &made->atlas, &why);
        result = result == VSH_OK ? VSH_OK : vshi_fail(error, result, "%s: %s", receiver->path, why.message);
    }
    free(density);
    VSHI_TRY(result);
    c.charts = vsh_atlas_charts(made->atlas);
    result = cut(&c, run, error);
    free(c.on_page);
    VSHI_TRY(result);
    VSHI_TRY(list_pages(receiver, place->meshes, made, error));
    return take_parts(place, error);
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
    return needs != 0 || is_packed(place, receiver)
               ? unwrap(place, receiver, run, error)
               : keep_pages(receiver, place->meshes, place->count, &place->unwrapped, error);
}

void vshi_unwrapped_free(vshi_unwrapped *unwrapped) {
    free(unwrapped->memory);
    free(unwrapped->pages);
    free(unwrapped->page_begins);
    free(unwrapped->numbers);
    free(unwrapped->parts);
    vsh_atlas_free(unwrapped->atlas);
    *unwrapped = (vshi_unwrapped){0};
}
