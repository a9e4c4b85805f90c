#include "base/floats.h"
#include "base/memory.h"
#include "unwrap/pack.h"

#include <stdlib.h>

static const double LEAST_STRETCH = 1.01; /* of max_stretch: below, rounding and texels decide */

enum { MOST_PADDING = 4096 };

static vsh_result check_whole(const char *name, int32_t value, int32_t least, int32_t most,
                              vsh_error *error) {
    if (value < least || value > most) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "unwrap: %s is %d, expected %d to %d", name, value, least,
                         most);
    }
    return VSH_OK;
}

static vsh_result check_options(const vsh_unwrap_options *o, size_t mesh_count, vsh_error *error) {
    VSHI_TRY(check_whole("width", o->width, 1, VSH_MAX_PAGE_SIZE, error));
    VSHI_TRY(check_whole("height", o->height, 1, VSH_MAX_PAGE_SIZE, error));
    VSHI_TRY(check_whole("max_pages", o->max_pages, 1, VSH_MAX_PAGES, error));
    VSHI_TRY(check_whole("padding", o->padding, 0, MOST_PADDING, error));
    VSHI_TRY(check_whole("keep_uvs", o->keep_uvs, VSH_UNWRAP_ALWAYS, VSH_UNWRAP_KEEP, error));
    VSHI_TRY(check_whole("atlas", o->atlas, VSH_ATLAS_SHARED, VSH_ATLAS_OBJECTS, error));
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
    if (!(o->max_stretch >= LEAST_STRETCH)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "unwrap: max_stretch is %g, expected at least %g",
                         o->max_stretch, LEAST_STRETCH);
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
    for (size_t i = 0; i < shapes->count; ++i) { /* with a shape's part of the atlas */
        const vsh_mesh *mesh = shapes->list[i].mesh;
        bytes += vshi_cut_mesh_bytes(mesh) + 64.0 * (double)mesh->triangle_count;
    }
    for (size_t m = 0; m < mesh_count; ++m) { /* and those of its instances */
        bytes += 28.0 * (double)meshes[m].triangle_count;
    }
    const vshi_packing packing = {.width = options->width, .height = options->height};
    return vshi_check_limit(run, bytes + vshi_pack_bytes(&packing, 0), "unwrapping", error);
}

static vsh_result make_items(const vshi_shapes *shapes, size_t mesh_count, const double *density,
                             vshi_item **items, size_t *count, vsh_error *error) {
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
    vshi_item *item = *items;
    for (size_t m = 0; m < mesh_count; ++m) {
        const vshi_shape *shape = &shapes->list[shapes->instances[m].shape];
        const double factor =
            shape->surface.scale * shapes->instances[m].scale * (density != NULL ? density[m] : 1.0);
        for (size_t c = 0; c < shape->patches.count; ++c) {
            *item++ = (vshi_item){.patch = &shape->patches.list[c],
                                  .boxes = &shape->boxes[c],
                                  .factor = factor,
                                  .mesh = (uint32_t)m};
        }
    }
    return VSH_OK;
}

vsh_result vsh_unwrap(const vsh_mesh *meshes, size_t mesh_count, const vsh_unwrap_options *options,
                      const vsh_run *run, vsh_atlas **atlas, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(atlas);
    *atlas = NULL;
    VSHI_NEEDS_OF(mesh_count, meshes);
    vsh_run full;
    vsh_unwrap_options o = vsh_unwrap_options_default();
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY(vshi_options_resolve(options, &o, sizeof o, "vsh_unwrap_options", error));
    VSHI_TRY(check_options(&o, mesh_count, error));
    VSHI_TRY(check_meshes(meshes, mesh_count, error));
    vshi_shapes shapes = {0};
    vshi_item *items = NULL;
    size_t count = 0;
    vshi_pages pages = {NULL, 0};
    vsh_result result;
    VSHI_TRY_DONE(vshi_shapes_find(meshes, mesh_count, &shapes, error));
    VSHI_TRY_DONE(check_memory(meshes, mesh_count, &shapes, &o, &full, error));
    VSHI_TRY_DONE(vshi_shapes_lay_out(&shapes, &o, &full, error));
    VSHI_TRY_DONE(make_items(&shapes, mesh_count, o.density, &items, &count, error));
    VSHI_TRY_DONE(vshi_pages_pack(&o, &shapes, items, count, &full, &pages, error));
    VSHI_TRY_DONE(vshi_atlas_make(&shapes, &pages, items, count, atlas, error));
done:
    free(pages.list);
    free(items);
    vshi_shapes_free(&shapes);
    return result;
}
