#include "base/floats.h"
#include "base/memory.h"
#include "geometry/mesh.h"
#include "unwrap/charts.h"

#include <stdlib.h>

static const double LEAST_STRETCH = 1.01; /* for max_stretch: below, rounding and texels decide */

enum { MOST_PADDING = 4096 };

static vsh_result check_options(const vsh_unwrap_options *o, size_t mesh_count, vsh_error *error) {
    const vshi_range ranges[] = {
        {"unwrap: width", o->width, 1, VSH_MAX_PAGE_SIZE},
        {"unwrap: height", o->height, 1, VSH_MAX_PAGE_SIZE},
        {"unwrap: max_pages", o->max_pages, 1, VSH_MAX_PAGES},
        {"unwrap: padding", o->padding, 0, MOST_PADDING},
        {"unwrap: keep_uvs", (int32_t)o->keep_uvs, VSH_UNWRAP_ALWAYS, VSH_UNWRAP_KEEP},
        {"unwrap: atlas", (int32_t)o->atlas, VSH_ATLAS_SHARED, VSH_ATLAS_OBJECTS},
        {"unwrap: max_stretch", o->max_stretch, LEAST_STRETCH, INFINITY},
    };
    VSHI_TRY(vshi_check_ranges(ranges, sizeof ranges / sizeof ranges[0], error));
    if (o->atlas == VSH_ATLAS_OBJECTS && o->max_pages > 1) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "unwrap: max_pages is %d: each object has one page",
                         o->max_pages);
    }
    if (o->fit_pages != 0 && o->texels_per_unit == 0.0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "unwrap: fit_pages: without texels_per_unit any page is filled");
    }
    if (!(o->texels_per_unit >= 0.0) || !isfinite(o->texels_per_unit)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "unwrap: texels_per_unit is %g, expected a finite number from 0 on",
                         o->texels_per_unit);
    }
    for (size_t m = 0; o->density != NULL && m < mesh_count; ++m) {
        if (!(o->density[m] > 0.0) || !isfinite(o->density[m])) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "unwrap: density %zu is %g, expected a finite number above 0", m, o->density[m]);
        }
    }
    return VSH_OK;
}

static vsh_result check_meshes(const vsh_mesh *meshes, size_t mesh_count, vsh_error *error) {
    if (mesh_count == 0 || mesh_count > UINT32_MAX) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "unwrap: %zu meshes, expected 1 to %u", mesh_count,
                         UINT32_MAX);
    }
    for (size_t m = 0; m < mesh_count; ++m) {
        VSHI_TRY(vshi_mesh_check_data(&meshes[m], m, error));
    }
    return VSH_OK;
}

static vsh_result check_memory(const vsh_mesh *meshes, size_t mesh_count, const vshi_shapes *shapes,
                               const vsh_unwrap_options *options, const vsh_run *run, vsh_error *error) {
    double bytes = (double)mesh_count * 384.0;
    for (size_t i = 0; i < shapes->count; ++i) { /* including a shape's part of the atlas */
        const vsh_mesh *mesh = shapes->list[i].mesh;
        bytes += vshi_cut_mesh_bytes(mesh) + 64.0 * (double)mesh->triangle_count;
    }
    for (size_t m = 0; m < mesh_count; ++m) { /* and the parts of its instances */
        bytes += 28.0 * (double)meshes[m].triangle_count;
    }
    const vshi_packing packing = {.width = options->width, .height = options->height};
    return vshi_check_limit(run, bytes + vshi_pack_bytes(&packing, 0), "unwrapping", error);
}

static vsh_result make_items(const vshi_shapes *shapes, size_t mesh_count, const double *density,
                             vshi_pack_item **items, size_t *count, vsh_error *error) {
    *count = 0;
    for (size_t m = 0; m < mesh_count; ++m) {
        *count += shapes->list[shapes->instances[m].shape].patches.count;
    }
    if (*count == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "unwrap: no triangle of %zu mesh%s has area", mesh_count,
                         mesh_count == 1 ? "" : "es");
    }
    if (*count >= VSH_NO_CHART) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "unwrap: %zu charts, at most %u", *count, VSH_NO_CHART - 1);
    }
    VSHI_TRY(vshi_allocate((void **)items, *count, sizeof **items, "packing charts", error));
    vshi_pack_item *item = *items;
    for (size_t m = 0; m < mesh_count; ++m) {
        const vshi_shape *shape = &shapes->list[shapes->instances[m].shape];
        const double factor =
            shape->surface.scale * shapes->instances[m].scale * (density != NULL ? density[m] : 1.0);
        for (size_t c = 0; c < shape->patches.count; ++c) {
            *item++ =
                (vshi_pack_item){.patch = &shape->patches.list[c], .factor = factor, .mesh = (uint32_t)m};
        }
    }
    return VSH_OK;
}

/* --- pages: all charts are packed together, or those of each object onto a page of its own. Then pages
 * shrink as far as their charts allow. */

/* Charts whose factors differ by less than this share are packed alike: the scales of instances are roots of
 * sums, and round. */
static const double SAME_FACTOR = 1e-9;

/* Largest share of a page's texels that charts may touch, because the rest is padding. With more, a page is
 * not even tried. */
static const double MOST_TOUCHED = 0.98;

enum {
    UNITS = 1024,  /* of the job, for each group */
    LEAST_SIDE = 4 /* texels of a shrunk page: as large as blocks of compressed textures */
};

/* Items that are packed together. */
typedef struct group {
    size_t first, count; /* items */
    size_t mesh;         /* the first of its object */
    size_t before;       /* 1 + the last earlier group whose first mesh is of the same shape; 0: none */
    size_t alike;        /* 1 + an earlier group with the same packing; 0: none */
    size_t page, pages;  /* its first page, and how many */
} group;

typedef struct work {
    const vsh_unwrap_options *options;
    const vshi_shapes *shapes;
    vshi_pack_item *items;
    size_t item_count;
    group *groups; /* [group_count]; one block with `own` and `latest` */
    size_t group_count;
    vshi_pack_item *own; /* [item_count]: items of a page that shrinks */
    size_t *latest;      /* [shape count]: 1 + the last group whose first mesh is of the shape; 0: none */
    vshi_job *job;
    vshi_pages *pages;
    size_t room; /* of the pages' list */
} work;

static vshi_packing make_packing(const vsh_unwrap_options *o) {
    return (vshi_packing){.width = o->width,
                          .height = o->height,
                          .padding = o->padding,
                          .max_pages = (uint32_t)o->max_pages,
                          .max_stretch = o->max_stretch,
                          .density = o->texels_per_unit};
}

/* --- groups */

static bool same_factor(double a, double b) {
    return fabs(a - b) <= SAME_FACTOR * b;
}

/* Whether two groups have the same charts up to one scale factor, which must be 1 with a given density. */
static bool are_alike(const work *w, const group *a, const group *b) {
    const vshi_pack_item *x = w->items + a->first, *y = w->items + b->first;
    const double by = w->options->texels_per_unit > 0.0 ? 1.0 : x[0].factor / y[0].factor;
    bool alike = a->count == b->count;
    for (size_t i = 0; i < a->count && alike; ++i) {
        alike = x[i].patch == y[i].patch && same_factor(x[i].factor, by * y[i].factor);
    }
    return alike;
}

static void add_object(work *w, size_t mesh, size_t first, size_t count) {
    group *made = &w->groups[w->group_count];
    size_t *latest = &w->latest[w->shapes->instances[w->items[first].mesh].shape];
    *made = (group){.first = first, .count = count, .mesh = mesh, .before = *latest};
    for (size_t g = *latest; g > 0 && made->alike == 0; g = w->groups[g - 1].before) {
        const group *other = &w->groups[g - 1];
        made->alike = other->alike == 0 && are_alike(w, made, other) ? g : 0;
    }
    *latest = ++w->group_count;
}

static void find_objects(work *w) {
    const vshi_shapes *s = w->shapes;
    for (size_t m = 0, item = 0; m < s->mesh_count;) {
        const size_t end = m + vshi_mesh_object_size(s->meshes, m, s->mesh_count), first = item;
        while (item < w->item_count && w->items[item].mesh < end) {
            ++item;
        }
        if (item > first) {
            add_object(w, m, first, item - first);
        }
        m = end;
    }
}

/* --- pages */

static vsh_result add_pages(work *w, group *g, const vshi_packing *packing, vsh_error *error) {
    g->page = w->pages->count;
    g->pages = packing->pages;
    for (size_t i = 0; i < g->pages; ++i) {
        VSHI_TRY(vshi_make_room((void **)&w->pages->list, w->pages->count, &w->room, sizeof *w->pages->list,
                                "pages of an atlas", error));
        w->pages->list[w->pages->count++] = (vsh_atlas_page){.width = packing->width,
                                                             .height = packing->height,
                                                             .texels_per_unit = packing->density,
                                                             .first_mesh = UINT32_MAX};
    }
    for (size_t i = 0; i < g->count; ++i) {
        w->items[g->first + i].at.page += (uint32_t)g->page;
    }
    return VSH_OK;
}

static vsh_result pack_group(work *w, group *g, vsh_error *error) {
    vshi_packing packing = make_packing(w->options);
    vsh_error why;
    const vsh_result result = vshi_pack(&packing, w->items + g->first, g->count, w->job, UNITS, &why);
    if (result == VSH_OK) {
        return add_pages(w, g, &packing, error);
    }
    vsh_mesh named = w->shapes->meshes[g->mesh];
    named.name = named.object_name != NULL ? named.object_name : named.name;
    const bool own = result == VSH_ERROR_LIMIT && w->options->atlas == VSH_ATLAS_OBJECTS;
    return vshi_fail(error, result, "%s%s%s", own ? vshi_mesh_label(&named, g->mesh).text : "",
                     own ? ": " : "", why.message);
}

static vsh_result pack_alike(work *w, group *g, vsh_error *error) {
    const group *as = &w->groups[g->alike - 1];
    const vsh_atlas_page *page = &w->pages->list[as->page];
    const vshi_packing packing = {.width = page->width,
                                  .height = page->height,
                                  .pages = (uint32_t)as->pages,
                                  .density = page->texels_per_unit * w->items[as->first].factor /
                                             w->items[g->first].factor};
    for (size_t i = 0; i < g->count; ++i) {
        w->items[g->first + i].at = w->items[as->first + i].at;
        w->items[g->first + i].at.page -= (uint32_t)as->page;
    }
    VSHI_TRY(vshi_job_step(w->job, UNITS, error));
    return add_pages(w, g, &packing, error);
}

/* --- pages that shrink */

typedef struct page_size {
    int32_t width, height;
} page_size;

static int compare_sizes(const void *a, const void *b) {
    const page_size *x = a, *y = b;
    const int64_t s = (int64_t)x->width * x->height, t = (int64_t)y->width * y->height;
    return s != t ? (s > t) - (s < t) : (x->height > y->height) - (x->height < y->height);
}

/* Powers of two below a side, then the side itself. */
static int list_sides(int32_t most, int32_t sides[32]) {
    int count = 0;
    for (int32_t side = LEAST_SIDE; side < most; side *= 2) {
        sides[count++] = side;
    }
    sides[count++] = most;
    return count;
}

enum { MOST_SIZES = 256 };

/* Sizes of pages below the largest, by their texels. One side is at most twice the other, or that of the
 * largest page. */
static int list_sizes(const vsh_unwrap_options *o, page_size sizes[MOST_SIZES]) {
    int32_t widths[32], heights[32];
    const int columns = list_sides(o->width, widths), rows = list_sides(o->height, heights);
    int count = 0;
    for (int x = 0; x < columns; ++x) {
        for (int y = 0; y < rows; ++y) {
            const int32_t w = widths[x], h = heights[y];
            const bool even = (w <= 2 * h || h == o->height) && (h <= 2 * w || w == o->width);
            if (even && (w < o->width || h < o->height) && count < MOST_SIZES) {
                sizes[count++] = (page_size){w, h};
            }
        }
    }
    qsort(sizes, (size_t)count, sizeof *sizes, compare_sizes);
    return count;
}

/* Packs the items of a page into the smallest page with room for them. */
static vsh_result shrink_page(work *w, const group *g, size_t number, vsh_error *error) {
    vshi_pack_item *own = w->own;
    vsh_atlas_page *page = &w->pages->list[number];
    page_size sizes[MOST_SIZES];
    const int size_count = list_sizes(w->options, sizes);
    size_t count = 0;
    uint64_t touched = 0;
    for (size_t i = g->first; i < g->first + g->count; ++i) {
        if (w->items[i].at.page == number) {
            own[count++] = w->items[i];
            touched += w->items[i].at.touched;
        }
    }
    bool fits = false;
    for (int s = 0; s < size_count && !fits; ++s) {
        vshi_packing packing = make_packing(w->options);
        packing.width = sizes[s].width;
        packing.height = sizes[s].height;
        packing.max_pages = 1;
        if ((double)touched > MOST_TOUCHED * packing.width * packing.height) {
            continue;
        }
        VSHI_TRY(vshi_pack_one(&packing, own, count, w->job, &fits, error));
        page->width = fits ? packing.width : page->width;
        page->height = fits ? packing.height : page->height;
    }
    for (size_t i = g->first, k = 0; i < g->first + g->count && fits; ++i) {
        if (w->items[i].at.page == number) {
            w->items[i] = own[k++];
            w->items[i].at.page = (uint32_t)number;
        }
    }
    return VSH_OK;
}

/* --- all */

static vsh_result pack_groups(work *w, vsh_error *error) {
    for (size_t i = 0; i < w->group_count; ++i) {
        group *g = &w->groups[i];
        if (g->alike > 0) {
            VSHI_TRY(pack_alike(w, g, error));
            continue;
        }
        VSHI_TRY(pack_group(w, g, error));
        for (size_t page = g->page; page < g->page + g->pages && w->options->fit_pages != 0; ++page) {
            VSHI_TRY(shrink_page(w, g, page, error));
        }
    }
    return VSH_OK;
}

/* Gives each item its place, by the options. Items are in the order of their meshes. The stage is "pack". */
static vsh_result pack_pages(const vsh_unwrap_options *options, const vshi_shapes *shapes,
                             vshi_pack_item *items, size_t item_count, const vsh_run *run, vshi_pages *pages,
                             vsh_error *error) {
    const size_t mesh_count = shapes->mesh_count;
    work w = {.options = options, .shapes = shapes, .items = items, .item_count = item_count, .pages = pages};
    const vshi_packing packing = make_packing(options);
    const vshi_array arrays[] = {VSHI_ARRAY(w.groups, mesh_count),
                                 VSHI_ARRAY(w.own, options->fit_pages != 0 ? item_count : 0),
                                 VSHI_ARRAY(w.latest, shapes->count)};
    vsh_result result;
    *pages = (vshi_pages){NULL, 0};
    VSHI_TRY_DONE(vshi_check_limit(run, vshi_pack_bytes(&packing, item_count), "packing charts", error));
    VSHI_TRY_DONE(VSHI_ALLOCATE_BLOCK(arrays, "pages of an atlas", error));
    if (options->atlas == VSH_ATLAS_OBJECTS) {
        find_objects(&w);
    } else {
        w.groups[w.group_count++] = (group){.count = item_count};
    }
    VSHI_TRY_DONE(vshi_job_open(&w.job, run, "pack", UNITS * w.group_count, "pages of an atlas", error));
    result = pack_groups(&w, error);
done:
    vshi_job_end(w.job);
    free(w.groups);
    return result;
}

/* --- all */

vsh_result vsh_unwrap(const vsh_mesh *meshes, size_t mesh_count, const vsh_unwrap_options *options,
                      const vsh_run *run, vsh_atlas **atlas, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(atlas);
    VSHI_NEEDS_OF(mesh_count, meshes);
    vsh_run full;
    vsh_unwrap_options o = vsh_unwrap_options_default();
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY(vshi_options_resolve(options, &o, sizeof o, "vsh_unwrap_options", error));
    VSHI_TRY(check_options(&o, mesh_count, error));
    vshi_tight_meshes tight;
    vshi_shapes shapes = {0};
    vshi_pack_item *items = NULL;
    size_t count = 0;
    vshi_pages pages = {NULL, 0};
    vsh_result result;
    VSHI_TRY_DONE(vshi_meshes_tighten(meshes, mesh_count, &tight, error));
    meshes = tight.meshes;
    VSHI_TRY_DONE(check_meshes(meshes, mesh_count, error));
    VSHI_TRY_DONE(vshi_shapes_find(meshes, mesh_count, &shapes, error));
    VSHI_TRY_DONE(check_memory(meshes, mesh_count, &shapes, &o, &full, error));
    VSHI_TRY_DONE(vshi_shapes_lay_out(&shapes, &o, &full, error));
    VSHI_TRY_DONE(make_items(&shapes, mesh_count, o.density, &items, &count, error));
    VSHI_TRY_DONE(pack_pages(&o, &shapes, items, count, &full, &pages, error));
    VSHI_TRY_DONE(vshi_atlas_make(&shapes, &pages, items, count, atlas, error));
done:
    free(pages.list);
    free(items);
    vshi_shapes_free(&shapes);
    free(tight.memory);
    return result;
}
