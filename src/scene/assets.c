/* What stands behind a scene: the meshes of its files put where casters and receivers stand. */
#include "scene/assets.h"

#include "base/error.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/similarity.h"
#include "base/try.h"
#include "base/vec.h"
#include "heightfield/heights.h"
#include "model/model.h"
#include "scene/asset_files.h"
#include "scene/asset_place.h"
#include "scene/select.h"
#include "scene/solidity.h"
#include "scene/unwrapped.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/lit.h>

struct vsh_assets {
    vshi_asset_files files;
    vshi_asset_place *casters;
    size_t caster_count;
    vshi_asset_place *receivers;
    size_t receiver_count;
    vshi_mesh_set set; /* of the casters' meshes */
};

static vsh_result place_model(vshi_asset_place *place, const vsh_model *model, int32_t uv_set,
                              const double transform[12], vsh_error *error) {
    return vshi_place_chosen(place, model, NULL, uv_set, 0.0, transform, error);
}

/* A second side of 0 follows from the first, which is the longer one, by the cells. */
static void settle_size(vsh_heights_source *source) {
    const double across = source->columns - 1, down = source->rows - 1, longer = source->size[0];
    if (source->size[1] == 0.0) {
        source->size[0] = longer * fmin(1.0, across / down);
        source->size[1] = longer * fmin(1.0, down / across);
    }
}

/* `source` is filled but for what the image holds, and whether it is direct but for its transform. */
static vsh_result place_heights(vsh_assets *assets, vshi_asset_place *place, vsh_heights_source *source,
                                int32_t what, const size_t *texels, const double transform[12],
                                const vsh_run *run, vsh_error *error) {
    const vshi_height_image *map = NULL;
    VSHI_TRY(vshi_asset_map(&assets->files, source->name, run, &map, error));
    source->columns = map->columns;
    source->rows = map->rows;
    source->values = map->values;
    settle_size(source);
    if (place->direct) {
        vsh_heights_source placed = *source;
        placed.transform = transform;
        VSHI_TRY(vsh_heights_create(&placed, run, &place->heights, error));
    }
    VSHI_TRY(vshi_model_of_heights(source, what, texels, run, &place->made, error));
    return place_model(place, place->made, 0, transform, error);
}

static vsh_result place_spheres(vshi_asset_place *place, const vsh_caster *caster, size_t index,
                                const vsh_run *run, vsh_error *error) {
    const double *spheres = caster->spheres;
    size_t count = caster->sphere_count;
    double *read = NULL;
    vsh_error why;
    if (caster->path != NULL) {
        VSHI_TRY(vsh_spheres_read(caster->path, run, &read, &count, error));
        spheres = read;
    }
    const vsh_result result =
        vsh_spheres_create(spheres, count, caster->transform, run, &place->spheres, &why);
    vsh_spheres_list_free(read);
    return result == VSH_OK ? VSH_OK
                            : vshi_fail(error, result, "caster %zu: %s%s%s", index,
                                        caster->path != NULL ? caster->path : "",
                                        caster->path != NULL ? ": " : "", why.message);
}

/* The first receiver that unwraps meshes of a model; NULL: none. */
static const vshi_asset_place *find_unwrapped(const vsh_assets *assets, const vsh_model *model) {
    for (size_t i = 0; i < assets->receiver_count; ++i) {
        if (assets->receivers[i].model == model && assets->receivers[i].unwrapped.atlas != NULL) {
            return &assets->receivers[i];
        }
    }
    return NULL;
}

static vsh_result place_caster(vsh_assets *assets, const vsh_scene *scene, size_t index, const vsh_run *run,
                               vsh_error *error) {
    const vsh_caster *caster = &scene->casters[index];
    vshi_asset_place *place = &assets->casters[index];
    if (caster->type == VSH_CASTER_SDF) {
        return VSH_OK;
    }
    if (caster->type < VSH_CASTER_MESH || caster->type > VSH_CASTER_TEXT) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "caster %zu: type %d: expected 0 … %d", index,
                         caster->type, VSH_CASTER_TEXT);
    }
    place->direct = vshi_caster_is_direct(scene, caster);
    if (caster->type == VSH_CASTER_SPHERES) {
        return place_spheres(place, caster, index, run, error);
    }
    if (caster->path == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "caster %zu: no path", index);
    }
    if (caster->type == VSH_CASTER_VDB) {
        return vshi_asset_grid(&assets->files, caster->path, caster->grid, run, &place->grid, error);
    }
    if (caster->type == VSH_CASTER_MASK) {
        return vsh_outline_from_image(caster->path, &caster->mask, run, &place->outline, error);
    }
    if (caster->type == VSH_CASTER_TEXT) {
        return vsh_outline_from_text(caster->text, caster->path, &caster->letters, run, &place->outline,
                                     error);
    }
    if (caster->type == VSH_CASTER_HEIGHTFIELD) {
        vsh_heights_source source = {.name = caster->path,
                                     .size = {caster->size[0], caster->size[1]},
                                     .height = caster->height,
                                     .base = caster->base};
        return place_heights(assets, place, &source, VSH_HEIGHTS_SOLID, NULL, caster->transform, run, error);
    }
    VSHI_TRY(vshi_asset_model(&assets->files, caster->path, run, &place->model, error));
    return vshi_place_casting(place, scene, caster, vshi_asset_masks(&assets->files, place->model),
                              find_unwrapped(assets, place->model), run, error);
}

static vsh_result settle_solidity(vsh_assets *assets, const vsh_scene *scene, const vsh_run *run,
                                  vsh_error *error) {
    vshi_mesh_list *lists = NULL;
    const size_t casters = assets->caster_count, count = casters + assets->receiver_count;
    vsh_result result = vshi_allocate((void **)&lists, count, sizeof *lists, "meshes", error);
    if (result != VSH_OK || count == 0) {
        return result;
    }
    for (size_t i = 0; i < count; ++i) {
        const vshi_asset_place *place = i < casters ? &assets->casters[i] : &assets->receivers[i - casters];
        lists[i] = (vshi_mesh_list){place->meshes, place->count, place->model,
                                    i < casters ? scene->casters[i].path : NULL};
    }
    result = vshi_solidity_settle(scene, lists, lists + casters, run, &assets->set, error);
    free(lists);
    return result;
}

/* Those that do not cast, too. */
static vsh_result check_receivers(vsh_assets *assets, const vsh_scene *scene, const vsh_run *run,
                                  vsh_error *error) {
    for (size_t i = 0; i < assets->receiver_count; ++i) {
        vshi_asset_place *place = &assets->receivers[i];
        vsh_error why;
        const vsh_result result = vshi_mesh_set_create(place->meshes, place->count, &place->set, &why);
        if (result != VSH_OK) {
            return vshi_fail(error, result, "%s: %s", scene->receivers[i].path, why.message);
        }
        for (size_t m = 0; m < place->count; ++m) {
            place->meshes[m].checked = place->set.meshes[m].checked;
        }
        const bool shared = scene->receivers[i].atlas == VSH_ATLAS_SHARED;
        if (shared && place->unwrapped.page_count > 1) { /* what hangs together may be on several */
            VSHI_TRY(vshi_mesh_set_solve(&place->set, run, error));
        }
    }
    return VSH_OK;
}

/* Whether a lit asset's own UVs are a packer's integers. Few engines read a lightmap with those. */
static bool is_packed(const vshi_asset_place *place, const vsh_receiver *receiver) {
    bool packed = false;
    for (size_t i = 0; i < place->count; ++i) {
        const vshi_model_shape *shape = &place->model->shapes[place->model->entries[place->numbers[i]].shape];
        const int32_t set = receiver->uv_set < 0 ? shape->uv_sets > 1 : receiver->uv_set;
        packed = packed || (shape->packed >> set & 1) != 0;
    }
    return packed && vshi_receiver_unwrap(receiver) == VSH_RECEIVER_UNWRAP_AUTO &&
           vsh_lit_is_output(receiver->output) != 0;
}

/* Puts the parts of unwrapped meshes in their places. */
static vsh_result unwrap(vshi_asset_place *place, const vsh_receiver *receiver, const vsh_run *run,
                         vsh_error *error) {
    int32_t needs = 0;
    vshi_unwrapped *made = &place->unwrapped;
    VSHI_TRY(vsh_receiver_needs_unwrap(receiver, place->meshes, place->count, run, &needs, error));
    if (needs == 0 && !is_packed(place, receiver)) {
        return vshi_pages_as_they_are(receiver, place->meshes, place->count, made, error);
    }
    VSHI_TRY(vshi_unwrap_receiver(receiver, place->model, place->meshes, place->numbers, place->count, run,
                                  made, error));
    return vshi_unwrapped_take(made, &place->meshes, &place->numbers, &place->count, error);
}

/* A heightfield of four heights, all 0. */
static vsh_result place_plane(vshi_asset_place *place, const vsh_receiver *receiver, const vsh_run *run,
                              vsh_error *error) {
    static const float flat[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    const vsh_heights_source source = {.name = receiver->path,
                                       .columns = 2,
                                       .rows = 2,
                                       .values = flat,
                                       .size = {receiver->extent[0], receiver->extent[1]}};
    VSHI_TRY(vsh_model_from_heights(&source, VSH_HEIGHTS_SURFACE, run, &place->made, error));
    VSHI_TRY(place_model(place, place->made, 0, receiver->transform, error));
    return vshi_pages_as_they_are(receiver, place->meshes, place->count, &place->unwrapped, error);
}

static vsh_result place_receiver(vsh_assets *assets, const vsh_scene *scene, size_t index, const vsh_run *run,
                                 vsh_error *error) {
    const vsh_receiver *receiver = &scene->receivers[index];
    if (receiver->path == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "receiver %zu: no path", index);
    }
    if (receiver->type == VSH_RECEIVER_HEIGHTFIELD) {
        vsh_heights_source source = {.name = receiver->path,
                                     .size = {receiver->extent[0], receiver->extent[1]},
                                     .height = receiver->relief};
        vshi_asset_place *place = &assets->receivers[index];
        const size_t samples = receiver->supersample > 1 ? (size_t)receiver->supersample : 1;
        const size_t texels[2] = {samples * (size_t)receiver->width, samples * (size_t)receiver->height};
        const bool sized =
            receiver->width > 0 && receiver->height > 0 && !vsh_lit_is_output(receiver->output);
        VSHI_TRY(place_heights(assets, place, &source, VSH_HEIGHTS_SURFACE, sized ? texels : NULL,
                               receiver->transform, run, error));
        return vshi_pages_as_they_are(receiver, place->meshes, place->count, &place->unwrapped, error);
    }
    if (receiver->type == VSH_RECEIVER_PLANE) {
        return place_plane(&assets->receivers[index], receiver, run, error);
    }
    const vsh_model *model = NULL;
    unsigned char *chosen = NULL;
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(vshi_asset_model(&assets->files, receiver->path, run, &model, error));
    VSHI_TRY_DONE(vshi_select(model, receiver->path, &receiver->objects, &chosen, error));
    VSHI_TRY_DONE(vshi_select_uvs(model, receiver, run, chosen, error));
    assets->receivers[index].model = model;
    VSHI_TRY_DONE(vshi_place_chosen(&assets->receivers[index], model, chosen, receiver->uv_set, scene->unit,
                                    receiver->transform, error));
    result = unwrap(&assets->receivers[index], receiver, run, error);
done:
    free(chosen);
    return result;
}

static vsh_result allocate_places(vsh_assets *assets, const vsh_scene *scene, vsh_error *error) {
    VSHI_TRY(vshi_asset_files_create(scene, &assets->files, error));
    VSHI_TRY(vshi_allocate((void **)&assets->casters, scene->caster_count, sizeof *assets->casters, "casters",
                           error));
    VSHI_TRY(vshi_allocate((void **)&assets->receivers, scene->receiver_count, sizeof *assets->receivers,
                           "receivers", error));
    assets->caster_count = scene->caster_count;
    assets->receiver_count = scene->receiver_count;
    return VSH_OK;
}

/* `index` of the scene's "casters" or "receivers". A struct that was only zeroed has a transform of zeros. */
static vsh_result check_transform(const double transform[12], const char *list, size_t index,
                                  vsh_error *error) {
    for (int i = 0; i < 12; ++i) {
        if (!isfinite(transform[i])) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "%s[%zu].transform[%d] is %g: expected a finite number", list, index, i,
                             transform[i]);
        }
    }
    if (vshi_transform_flattens(transform)) {
        return vshi_fail(
            error, VSH_ERROR_ARGUMENT,
            "%s[%zu].transform flattens everything (determinant %g); vsh_%.*s_default() gives the "
            "identity",
            list, index, vshi_transform_determinant(transform), (int)strlen(list) - 1, list);
    }
    return VSH_OK;
}

static vsh_result check_transforms(const vsh_scene *scene, vsh_error *error) {
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        VSHI_TRY(check_transform(scene->receivers[i].transform, "receivers", i, error));
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        VSHI_TRY(check_transform(scene->casters[i].transform, "casters", i, error));
    }
    return VSH_OK;
}

vsh_result vsh_assets_load(const vsh_scene *scene, const vsh_run *run, vsh_assets **assets,
                           vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(assets);
    *assets = NULL;
    VSHI_NEEDS(scene);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY(check_transforms(scene, error));
    vsh_assets *loaded = NULL;
    VSHI_TRY(vshi_allocate((void **)&loaded, 1, sizeof *loaded, "assets", error));
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(allocate_places(loaded, scene, error));
    /* Receivers first: what is wrong with them is cheaper to find than a caster's volume is to read. */
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        VSHI_TRY_DONE(place_receiver(loaded, scene, i, &full, error));
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        VSHI_TRY_DONE(place_caster(loaded, scene, i, &full, error));
    }
    vshi_asset_maps_free(&loaded->files);
    VSHI_TRY_DONE(settle_solidity(loaded, scene, &full, error));
    VSHI_TRY_DONE(check_receivers(loaded, scene, &full, error));
    /* with the places in it, which the check asks for */
    VSHI_TRY_DONE(vshi_assets_check(loaded, scene, &full, error));
    *assets = loaded;
    loaded = NULL;
done:
    vsh_assets_free(loaded);
    return result;
}

static void free_places(vshi_asset_place *places, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        vsh_spheres_free(places[i].spheres);
        vsh_heights_free(places[i].heights);
        vsh_model_free(places[i].made);
        vshi_mesh_set_free(&places[i].set);
        vshi_unwrapped_free(&places[i].unwrapped);
        free(places[i].numbers);
        free(places[i].transforms);
        free(places[i].meshes);
        vsh_outline_free(places[i].outline);
    }
    free(places);
}

void vsh_assets_free(vsh_assets *assets) {
    if (assets == NULL) {
        return;
    }
    vshi_mesh_set_free(&assets->set);
    free_places(assets->receivers, assets->receiver_count);
    free_places(assets->casters, assets->caster_count);
    vshi_asset_files_free(&assets->files);
    free(assets);
}

static const vsh_mesh *placed_meshes(const vshi_asset_place *places, size_t count, size_t index,
                                     size_t *mesh_count) {
    *mesh_count = index < count ? places[index].count : 0;
    return index < count ? places[index].meshes : NULL;
}

const vsh_mesh *vsh_assets_receiver(const vsh_assets *assets, size_t index, size_t *mesh_count) {
    return placed_meshes(assets->receivers, assets->receiver_count, index, mesh_count);
}

const vsh_model *vsh_assets_receiver_model(const vsh_assets *assets, size_t index, const size_t **numbers) {
    const vshi_asset_place *place = index < assets->receiver_count ? &assets->receivers[index] : NULL;
    *numbers = place != NULL ? place->numbers : NULL;
    return place == NULL ? NULL : place->made != NULL ? place->made : place->model;
}

size_t vsh_assets_receiver_pages(const vsh_assets *assets, size_t index) {
    if (index >= assets->receiver_count) {
        return 0;
    }
    const vshi_unwrapped *made = &assets->receivers[index].unwrapped;
    return made->page_begins != NULL ? made->page_count : 1;
}

int32_t vsh_assets_receiver_page_info(const vsh_assets *assets, size_t index, size_t page,
                                      vsh_receiver_page *info) {
    if (page >= vsh_assets_receiver_pages(assets, index)) {
        return 0;
    }
    const vshi_unwrapped *made = &assets->receivers[index].unwrapped;
    *info = made->pages != NULL ? made->pages[page] : made->whole;
    return 1;
}

const vsh_mesh *vsh_assets_receiver_page(const vsh_assets *assets, size_t index, size_t page, size_t *first,
                                         size_t *mesh_count) {
    *first = *mesh_count = 0;
    if (page >= vsh_assets_receiver_pages(assets, index)) {
        return NULL;
    }
    const vshi_asset_place *place = &assets->receivers[index];
    const size_t *begins = place->unwrapped.page_begins;
    *first = begins != NULL ? begins[page] : 0;
    *mesh_count = (begins != NULL ? begins[page + 1] : place->count) - *first;
    return place->meshes + *first;
}

const vsh_atlas *vsh_assets_receiver_atlas(const vsh_assets *assets, size_t index, const size_t **numbers) {
    const vshi_unwrapped *made = index < assets->receiver_count ? &assets->receivers[index].unwrapped : NULL;
    *numbers = made != NULL ? made->numbers : NULL;
    return made != NULL ? made->atlas : NULL;
}

const vsh_mesh *vsh_assets_caster(const vsh_assets *assets, size_t index, size_t *mesh_count) {
    return placed_meshes(assets->casters, assets->caster_count, index, mesh_count);
}

const vsh_grid *vshi_assets_grid(const vsh_assets *assets, size_t index) {
    return index < assets->caster_count ? assets->casters[index].grid : NULL;
}

const vsh_outline *vshi_assets_outline(const vsh_assets *assets, size_t index) {
    return index < assets->caster_count ? assets->casters[index].outline : NULL;
}

const vsh_spheres *vshi_assets_spheres(const vsh_assets *assets, size_t index) {
    return index < assets->caster_count ? assets->casters[index].spheres : NULL;
}

const vsh_heights *vsh_assets_heights(const vsh_assets *assets, size_t index) {
    return index < assets->caster_count ? assets->casters[index].heights : NULL;
}

const vsh_spheres *vsh_assets_spheres(const vsh_assets *assets, size_t index) {
    return index < assets->caster_count && assets->casters[index].direct ? assets->casters[index].spheres
                                                                         : NULL;
}
