#include "scene/tile_survey.h"

#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "levelset/told.h"
#include "mesh/mesh.h"
#include "scene/asset_place.h"
#include "scene/assets.h"
#include "scene/select.h"

#include <stdlib.h>
#include <string.h>

static vshi_world_box box_of(const vsh_mesh *mesh) {
    vshi_world_box box = vshi_empty_box;
    for (size_t i = 0; i < mesh->vertex_count; ++i) {
        const vshi_vec p = vshi_transform_point(mesh->transform, vshi_vec_off(mesh->positions + 3 * i));
        const vshi_world_box point = {{p.x, p.y, p.z}, {p.x, p.y, p.z}};
        vshi_box_grow(&box, &point);
    }
    return box;
}

static vshi_world_box box_of_all(const vsh_mesh *meshes, size_t count) {
    vshi_world_box all = vshi_empty_box;
    for (size_t i = 0; i < count; ++i) {
        const vshi_world_box box = box_of(&meshes[i]);
        vshi_box_grow(&all, &box);
    }
    return all;
}

/* --- meshes */

static void free_place(vshi_asset_place *place) {
    free(place->numbers);
    free(place->transforms);
    free(place->meshes);
}

/* The meshes of a model that a selection means, where they stand. */
static vsh_result place(const vsh_scene *scene, const vsh_model *model, const char *path,
                        const vsh_selection *selection, const double transform[12], vshi_asset_place *made,
                        vsh_error *error) {
    unsigned char *chosen = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_select(model, path, selection, &chosen, error));
    result = vshi_place_chosen(made, model, chosen, -1, scene->unit, transform, error);
done:
    free(chosen);
    return result;
}

/* Objects are made of meshes that follow each other. */
static vsh_result find_objects(const vshi_asset_place *placed, vshi_survey_caster *caster, vsh_error *error) {
    VSHI_TRY(
        vshi_allocate((void **)&caster->objects, placed->count, sizeof *caster->objects, "objects", error));
    for (size_t i = 0; i < placed->count; ++i) {
        const vsh_mesh *mesh = &placed->meshes[i];
        if (i == 0 || mesh->object == 0 || mesh->object != mesh[-1].object) {
            caster->objects[caster->count++] =
                (vshi_survey_object){.box = vshi_empty_box, .first = placed->numbers[i]};
        }
        vshi_survey_object *object = &caster->objects[caster->count - 1];
        const vshi_world_box box = box_of(mesh);
        vshi_box_grow(&object->box, &box);
        object->triangles += mesh->triangle_count;
        object->last = placed->numbers[i];
    }
    return VSH_OK;
}

/* What a pattern means among the meshes: of objects before materials. */
static unsigned char meaning(const vshi_asset_place *placed, const char *pattern) {
    for (unsigned char kind = VSHI_RULE_OBJECT; pattern != NULL && kind <= VSHI_RULE_MATERIAL; ++kind) {
        for (size_t i = 0; i < placed->count; ++i) {
            if (vshi_mesh_is_meant(&placed->meshes[i], pattern, kind == VSHI_RULE_MATERIAL)) {
                return kind;
            }
        }
    }
    return VSHI_RULE_NONE;
}

typedef struct surveying {
    const vsh_scene *scene;
    const vsh_run *run;
    vshi_survey *survey;
} surveying;

/* Of all rules, what they mean; a tile, which has some of the meshes, could not say. */
static vsh_result find_rules(surveying *s, const vsh_caster *caster, const vsh_model *model,
                             const vshi_asset_place *placed, vshi_survey_caster *found, vsh_error *error) {
    unsigned char *one_sided = NULL;
    const vsh_result result =
        vshi_select_some(model, caster->path, caster->one_sided, caster->one_sided_count, &one_sided, error);
    free(one_sided);
    VSHI_TRY(result);
    VSHI_TRY(vshi_allocate((void **)&found->rules, caster->solidity_count, 1, "solidity", error));
    for (size_t i = 0; i < caster->solidity_count; ++i) {
        const char *pattern = caster->solidity[i].pattern;
        found->rules[i] = meaning(placed, pattern);
        if (pattern != NULL && found->rules[i] == VSHI_RULE_NONE) {
            return vshi_fail_unmatched(model, caster->path, pattern, error);
        }
    }
    for (size_t i = 0; i < s->scene->solidity_count; ++i) {
        const unsigned char own = meaning(placed, s->scene->solidity[i].pattern);
        unsigned char *all = &s->survey->rules[i];
        *all = *all == VSHI_RULE_OBJECT || own == VSHI_RULE_NONE ? *all : own;
    }
    return VSH_OK;
}

static vsh_result look_at_caster(surveying *s, size_t index, const vsh_model *model, vsh_error *error) {
    const vsh_caster *caster = &s->scene->casters[index];
    vshi_survey_caster *found = &s->survey->casters[index];
    vshi_asset_place placed = {.count = 0};
    vsh_result result;
    VSHI_TRY_DONE(place(s->scene, model, caster->path, &caster->objects, caster->transform, &placed, error));
    VSHI_TRY_DONE(find_rules(s, caster, model, &placed, found, error));
    result = find_objects(&placed, found, error);
    found->meshes = vsh_model_mesh_count(model);
    for (size_t i = 0; i < found->count; ++i) {
        s->survey->triangles += found->objects[i].triangles;
    }
    s->survey->objects += found->count;
done:
    free_place(&placed);
    return result;
}

static vsh_result look_at_receiver(surveying *s, size_t index, const vsh_model *model, vsh_error *error) {
    const vsh_receiver *receiver = &s->scene->receivers[index];
    vshi_asset_place placed = {.count = 0};
    const vsh_result result =
        place(s->scene, model, receiver->path, &receiver->objects, receiver->transform, &placed, error);
    if (result == VSH_OK) {
        s->survey->receivers[index] = box_of_all(placed.meshes, placed.count);
    }
    free_place(&placed);
    return result;
}

/* --- what else there is */

static vsh_result look_at_heights(surveying *s, size_t index, vsh_error *error) {
    vsh_scene alone = *s->scene;
    alone.casters = NULL;
    alone.caster_count = alone.solidity_count = 0;
    alone.receivers = &s->scene->receivers[index];
    alone.receiver_count = 1;
    vsh_assets *assets;
    VSHI_TRY(vsh_assets_load(&alone, s->run, &assets, error));
    size_t count;
    const vsh_mesh *meshes = vsh_assets_receiver(assets, 0, &count);
    s->survey->receivers[index] = box_of_all(meshes, count);
    vsh_assets_free(assets);
    return VSH_OK;
}

/* Once for each file, however many casters are of it. */
static vsh_result find_digest(surveying *s, size_t index, vsh_error *error) {
    const vsh_caster *casters = s->scene->casters;
    char *digest = s->survey->casters[index].digest;
    for (size_t i = 0; i < index; ++i) {
        if (casters[i].type == VSH_CASTER_VDB && strcmp(casters[i].path, casters[index].path) == 0) {
            memcpy(digest, s->survey->casters[i].digest, VSH_DIGEST_TEXT);
            return VSH_OK;
        }
    }
    return vsh_file_digest(casters[index].path, s->run, digest, error);
}

static vsh_result look_at_vdb(surveying *s, size_t index, vsh_error *error) {
    const vsh_caster *caster = &s->scene->casters[index];
    vshi_world_box *box = &s->survey->casters[index].box;
    double told[6];
    VSHI_TRY(find_digest(s, index, error));
    VSHI_TRY(vshi_vdb_box(caster->path, caster->grid, s->run, told, error));
    for (int axis = 0; axis < 3 && told[0] <= told[3]; ++axis) {
        box->low[axis] = told[axis];
        box->high[axis] = told[axis + 3];
    }
    return VSH_OK;
}

/* --- all of it */

/* All that stands in one file, from where it is named first. */
static vsh_result look_at_model(surveying *s, const char *path, size_t first_caster, size_t first_receiver,
                                vsh_error *error) {
    const vsh_scene *scene = s->scene;
    vsh_model *model;
    VSHI_TRY(vsh_model_read(path, s->run, &model, error));
    vsh_result result = VSH_OK;
    for (size_t i = first_caster; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        if (caster->type == VSH_CASTER_MESH && caster->path != NULL && strcmp(caster->path, path) == 0) {
            VSHI_TRY_DONE(look_at_caster(s, i, model, error));
        }
    }
    for (size_t i = first_receiver; i < scene->receiver_count; ++i) {
        const vsh_receiver *receiver = &scene->receivers[i];
        if (receiver->type == VSH_RECEIVER_MESH && receiver->path != NULL &&
            strcmp(receiver->path, path) == 0) {
            VSHI_TRY_DONE(look_at_receiver(s, i, model, error));
        }
    }
done:
    vsh_model_free(model);
    return result;
}

static vsh_result look_at_casters(surveying *s, vsh_error *error) {
    for (size_t i = 0; i < s->scene->caster_count; ++i) {
        const vsh_caster *caster = &s->scene->casters[i];
        if (caster->type != VSH_CASTER_MESH && caster->type != VSH_CASTER_VDB) {
            continue;
        }
        if (caster->path == NULL) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "caster %zu: no path", i);
        }
        if (caster->type == VSH_CASTER_VDB) {
            VSHI_TRY(look_at_vdb(s, i, error));
        } else if (s->survey->casters[i].count == 0) {
            VSHI_TRY(look_at_model(s, caster->path, i, 0, error));
        }
    }
    return VSH_OK;
}

static vsh_result look_at_receivers(surveying *s, vsh_error *error) {
    for (size_t i = 0; i < s->scene->receiver_count; ++i) {
        const vsh_receiver *receiver = &s->scene->receivers[i];
        if (receiver->path == NULL) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "receiver %zu: no path", i);
        }
        if (receiver->type != VSH_RECEIVER_MESH) {
            VSHI_TRY(look_at_heights(s, i, error));
        } else if (vshi_box_is_empty(&s->survey->receivers[i])) {
            VSHI_TRY(look_at_model(s, receiver->path, s->scene->caster_count, i, error));
        }
    }
    return VSH_OK;
}

static vsh_result check_matched(const surveying *s, vsh_error *error) {
    for (size_t i = 0; i < s->scene->solidity_count; ++i) {
        if (s->scene->solidity[i].pattern != NULL && s->survey->rules[i] == VSHI_RULE_NONE) {
            return vshi_fail(error, VSH_ERROR_INPUT, "no object is named '%.100s'",
                             s->scene->solidity[i].pattern);
        }
    }
    return VSH_OK;
}

static vshi_world_box find_whole(const surveying *s) {
    vshi_world_box whole = vshi_empty_box;
    for (size_t i = 0; i < s->scene->caster_count; ++i) {
        const vsh_caster *caster = &s->scene->casters[i];
        const vshi_survey_caster *found = &s->survey->casters[i];
        if (!vshi_caster_in_layer(caster, NULL)) {
            continue;
        }
        const vshi_world_box moved = vshi_box_moved(&found->box, caster->transform);
        vshi_box_grow(&whole, &moved);
        for (size_t k = 0; k < found->count; ++k) {
            vshi_box_grow(&whole, &found->objects[k].box);
        }
    }
    return whole;
}

vsh_result vshi_survey_make(const vsh_scene *scene, const vsh_run *run, vshi_survey *survey,
                            vsh_error *error) {
    surveying s = {.scene = scene, .run = run, .survey = survey};
    *survey = (vshi_survey){.caster_count = scene->caster_count};
    VSHI_TRY(vshi_allocate((void **)&survey->casters, scene->caster_count, sizeof *survey->casters, "casters",
                           error));
    VSHI_TRY(vshi_allocate((void **)&survey->receivers, scene->receiver_count, sizeof *survey->receivers,
                           "receivers", error));
    VSHI_TRY(vshi_allocate((void **)&survey->rules, scene->solidity_count, 1, "solidity", error));
    for (size_t i = 0; i < scene->caster_count; ++i) {
        survey->casters[i].box = vshi_empty_box;
    }
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        survey->receivers[i] = vshi_empty_box;
    }
    VSHI_TRY(look_at_casters(&s, error));
    VSHI_TRY(check_matched(&s, error));
    survey->whole = find_whole(&s);
    return look_at_receivers(&s, error);
}

void vshi_survey_free(vshi_survey *survey) {
    for (size_t i = 0; survey->casters != NULL && i < survey->caster_count; ++i) {
        free(survey->casters[i].objects);
        free(survey->casters[i].rules);
    }
    free(survey->rules);
    free(survey->casters);
    free(survey->receivers);
    *survey = (vshi_survey){.caster_count = 0};
}
