#include "scene/asset_place.h"

#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "scene/assets.h"
#include "scene/select.h"

#include <stdlib.h>

/* Adds mesh `number` of a model, as it is or as `mesh` has it. */
static void add_mesh(vshi_asset_place *place, vsh_mesh mesh, size_t number, double scale,
                     const double transform[12]) {
    double *composed = place->transforms + 12 * place->count, scaled[12];
    for (int k = 0; k < 12; ++k) {
        scaled[k] = mesh.transform[k] * scale;
    }
    vshi_transform_compose(transform, scaled, composed);
    mesh.transform = composed;
    place->numbers[place->count] = number;
    place->meshes[place->count++] = mesh;
}

static vsh_result allocate_meshes(vshi_asset_place *place, size_t count, vsh_error *error) {
    VSHI_TRY(vshi_allocate((void **)&place->meshes, count, sizeof *place->meshes, "meshes", error));
    VSHI_TRY(vshi_allocate((void **)&place->transforms, count, 12 * sizeof(double), "transforms", error));
    return vshi_allocate((void **)&place->numbers, count, sizeof *place->numbers, "meshes", error);
}

static double scale_of(const vsh_model *model, double unit) {
    const double own_unit = vsh_model_unit(model) > 0.0 ? vsh_model_unit(model) : 1.0;
    return unit > 0.0 ? unit / own_unit : 1.0;
}

vsh_result vshi_place_chosen(vshi_asset_place *place, const vsh_model *model, const unsigned char *chosen,
                             int32_t uv_set, double unit, const double transform[12], vsh_error *error) {
    const size_t all = vsh_model_mesh_count(model);
    const double scale = scale_of(model, unit);
    VSHI_TRY(allocate_meshes(place, all, error));
    for (size_t i = 0; i < all; ++i) {
        if (chosen == NULL || chosen[i] != 0) {
            add_mesh(place, vsh_model_mesh(model, i, uv_set), i, scale, transform);
        }
    }
    return VSH_OK;
}

/* The meshes that are chosen, as they cast. Those that `parts`, a receiver of the same model, has unwrapped
 * are taken from there: what casts and receives is one; NULL: none. But what a mask cuts out is taken with
 * the UVs of its texture. */
static vsh_result place_casting(vshi_asset_place *place, vshi_masks *masks, const unsigned char *chosen,
                                const vshi_asset_place *parts, double unit, const double transform[12],
                                const vsh_run *run, vsh_error *error) {
    const vsh_model *model = place->model;
    const size_t all = vsh_model_mesh_count(model), part_count = parts != NULL ? parts->count : 0;
    const double scale = scale_of(model, unit);
    unsigned char *left = NULL;
    vsh_result result;
    VSHI_TRY_DONE(allocate_meshes(place, 2 * all + part_count, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&left, all, 1, "meshes", error));
    memcpy(left, chosen, all);
    for (size_t i = 0; i < part_count; ++i) {
        const size_t number = parts->numbers[i];
        vshi_cast_views views = {.count = 0};
        if (chosen[number] != 0) {
            VSHI_TRY_DONE(vshi_masks_cast(masks, number, run, &views, error));
        }
        if (chosen[number] != 0 && !views.cut) {
            vsh_mesh part = parts->meshes[i];
            part.transform = vsh_model_mesh(model, number, -1).transform;
            add_mesh(place, part, number, scale, transform);
            left[number] = 0;
        }
    }
    for (size_t i = 0; i < all; ++i) {
        vshi_cast_views views = {.count = 0};
        if (left[i] != 0) {
            VSHI_TRY_DONE(vshi_masks_cast(masks, i, run, &views, error));
        }
        for (int k = 0; k < views.count; ++k) {
            add_mesh(place, views.meshes[k], i, scale, transform);
        }
    }
done:
    free(left);
    return result;
}

/* Takes glass and the like out of `chosen`; what is a cut-out, though its material is blended, stays. */
static vsh_result leave_out_blended(const vsh_scene *scene, vshi_masks *masks, const vsh_model *model,
                                    const char *path, const vsh_run *run, unsigned char *chosen,
                                    vsh_error *error) {
    const size_t count = vsh_model_mesh_count(model);
    size_t left = 0, blended = 0, cut_out = 0;
    for (size_t i = 0; i < count; ++i) {
        const int32_t alpha = vsh_model_mesh(model, i, -1).alpha;
        bool out = chosen[i] != 0 && alpha == VSH_ALPHA_BLENDED && scene->cast_blended == 0;
        vshi_blend blend = VSHI_BLEND_GLASS;
        if (out) {
            VSHI_TRY(vshi_masks_blend(masks, i, run, &blend, error));
        }
        out = out && blend == VSHI_BLEND_GLASS;
        cut_out += blend == VSHI_BLEND_CUT_OUT;
        blended += out;
        chosen[i] = out ? 0 : chosen[i];
        left += chosen[i] != 0;
    }
    if (left == 0) {
        return vshi_fail(
            error, VSH_ERROR_INPUT,
            "%s: all its materials are blended (glass, smoke), and cast nothing; \"cast_blended\" "
            "in a scene, or --cast-blended, has them cast",
            path);
    }
    if (blended > 0) {
        vshi_warn(run,
                  "%s: %zu of %zu meshes have blended materials (glass, smoke) and cast no shadow; "
                  "--cast-blended makes them cast",
                  path, blended, count);
    }
    if (cut_out > 0) {
        vshi_note(
            run,
            "%s: %zu of %zu meshes have blended materials that their textures cut out (leaves, fences): "
            "they cast where alpha is at least half; --no-cast NAME leaves them out",
            path, cut_out, count);
    }
    return VSH_OK;
}

vsh_result vshi_place_casting(vshi_asset_place *place, const vsh_scene *scene, const vsh_caster *caster,
                              vshi_masks *masks, const vshi_asset_place *parts, const vsh_run *run,
                              vsh_error *error) {
    unsigned char *chosen = NULL, *one_sided = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_select(place->model, caster->path, &caster->objects, &chosen, error));
    VSHI_TRY_DONE(leave_out_blended(scene, masks, place->model, caster->path, run, chosen, error));
    VSHI_TRY_DONE(vshi_select_some(place->model, caster->path, caster->one_sided, caster->one_sided_count,
                                   &one_sided, error));
    VSHI_TRY_DONE(place_casting(place, masks, chosen, parts, scene->unit, caster->transform, run, error));
    for (size_t i = 0; i < place->count; ++i) {
        place->meshes[i].one_sided = one_sided[place->numbers[i]];
    }
    if (place->count == 0) {
        result = vshi_fail(error, VSH_ERROR_INPUT,
                           "%s: the masks of its materials leave nothing of what is to cast", caster->path);
    }
done:
    vshi_masks_trim(masks);
    free(one_sided);
    free(chosen);
    return result;
}
