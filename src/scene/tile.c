/* What casts in a tile. */
#include "scene/tile.h"

#include "base/floats.h"
#include "base/memory.h"
#include "base/similarity.h"
#include "base/try.h"
#include "scene/assets.h"

#include <stdlib.h>
#include <string.h>

/* Of the error asked for, what may be left out. */
static const double LEFT_OUT = 0.1;

/* An object of a caster, and what it can hide. */
typedef struct seen_object {
    const vshi_survey_object *object;
    double share;
    size_t caster;
} seen_object;

/* The least first; what hides the same by its place, so that the order is always the same. */
static int by_share(const void *left, const void *right) {
    const seen_object *a = left, *b = right;
    if (a->share != b->share) {
        return a->share < b->share ? -1 : 1;
    }
    if (a->caster != b->caster) {
        return a->caster < b->caster ? -1 : 1;
    }
    return a->object->first < b->object->first ? -1 : a->object->first > b->object->first;
}

static void keep(vsh_tile *tile, const seen_object *seen) {
    vshi_tile_caster *caster = &tile->casters[seen->caster];
    /* what is in between is of the same object, or not chosen */
    memset(caster->kept + seen->object->first, 1, seen->object->last - seen->object->first + 1);
    caster->none = false;
    tile->info.objects += 1;
    tile->info.triangles += seen->object->triangles;
}

/* Whether any caster of a layer, or (NULL) of none, is left. */
static bool is_cast(const vsh_scene *scene, const vsh_scene_layer *layer) {
    for (size_t i = 0; i < scene->caster_count; ++i) {
        if (vshi_caster_in_layer(&scene->casters[i], layer) && vshi_caster_is_left(scene, i)) {
            return true;
        }
    }
    return false;
}

/* Methods want casters: a layer of which nothing is left keeps what hides least. */
static void keep_some(vsh_tile *tile, const vsh_scene_layer *layer, const seen_object *seen, size_t count) {
    for (size_t i = 0; i < count && !is_cast(&tile->scene, layer); ++i) {
        if (vshi_caster_in_layer(&tile->scene.casters[seen[i].caster], layer)) {
            keep(tile, &seen[i]);
        }
    }
}

/* Objects are left out from the one that hides least on, as long as their sum is none to be seen; the others
 * cast. */
static void choose(vsh_tile *tile, const seen_object *seen, size_t count) {
    const double most = LEFT_OUT * tile->scene.shade.max_error;
    for (size_t i = 0; i < count; ++i) {
        if (tile->info.left_out + seen[i].share <= most) {
            tile->info.left_out += seen[i].share;
        } else {
            keep(tile, &seen[i]);
        }
    }
    keep_some(tile, NULL, seen, count);
    for (size_t i = 0; i < tile->scene.layer_count; ++i) {
        keep_some(tile, &tile->scene.layers[i], seen, count);
    }
}

static vsh_result find_objects(const vsh_tiles *tiles, const vshi_world_box *around, vsh_tile *tile,
                               vsh_error *error) {
    seen_object *seen;
    /* one more: qsort wants a place, however few it sorts */
    VSHI_TRY(vshi_allocate((void **)&seen, tiles->survey.objects + 1, sizeof *seen, "objects", error));
    size_t count = 0;
    for (size_t i = 0; i < tiles->survey.caster_count; ++i) {
        const vshi_survey_caster *caster = &tiles->survey.casters[i];
        for (size_t k = 0; k < caster->count; ++k) {
            const vshi_survey_object *object = &caster->objects[k];
            seen[count++] = (seen_object){object, vshi_reach_share(&tiles->reach, around, &object->box), i};
        }
    }
    qsort(seen, count, sizeof *seen, by_share);
    choose(tile, seen, count);
    free(seen);
    return VSH_OK;
}

/* --- .vdb casters */

static bool same_grid(const vsh_caster *a, const vsh_caster *b) {
    const bool named = a->grid != NULL && b->grid != NULL;
    return a->type == b->type && strcmp(a->path, b->path) == 0 &&
           (named ? strcmp(a->grid, b->grid) == 0 : a->grid == b->grid);
}

/* False where it is no turn and one scale, which is refused later. */
static bool invert(const double m[12], double inverse[12]) {
    const double scale = vshi_similarity_scale(m), square = scale * scale;
    for (int row = 0; row < 3; ++row) {
        inverse[4 * row + 3] = 0.0;
        for (int column = 0; column < 3; ++column) {
            inverse[4 * row + column] = m[4 * column + row] / square;
            inverse[4 * row + 3] -= inverse[4 * row + column] * m[4 * column + 3];
        }
    }
    return scale > 0.0;
}

/* The box of a caster's rays, in its own space; empty where that is not to be found. */
static vshi_world_box region_of(const vsh_tiles *tiles, const vshi_world_box *around, size_t index) {
    const vsh_caster *caster = &tiles->whole->casters[index];
    const vshi_world_box *own = &tiles->survey.casters[index].box;
    double inverse[12];
    if (vshi_box_is_empty(own) || !invert(caster->transform, inverse)) {
        return vshi_empty_box;
    }
    const vshi_world_box world = vshi_box_moved(own, caster->transform);
    const vshi_world_box region = vshi_reach_region(&tiles->reach, around, &world);
    return vshi_box_moved(&region, inverse);
}

/* A grid that several casters place is read once, with what any of them needs. */
static void box_grids(const vsh_tiles *tiles, const vshi_world_box *around, vsh_tile *tile) {
    const vsh_scene *scene = &tile->scene;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        vshi_world_box all = vshi_empty_box;
        bool known = scene->casters[i].type == VSH_CASTER_VDB;
        for (size_t k = 0; known && k < scene->caster_count; ++k) {
            if (same_grid(&scene->casters[i], &scene->casters[k])) {
                const vshi_world_box region = region_of(tiles, around, k);
                known = !vshi_box_is_empty(&region);
                vshi_box_grow(&all, &region);
            }
        }
        tile->casters[i].boxed = known;
        memcpy(tile->casters[i].box[0], all.low, sizeof all.low);
        memcpy(tile->casters[i].box[1], all.high, sizeof all.high);
    }
}

/* --- one tile */

static vsh_result allocate_casters(const vsh_tiles *tiles, vsh_tile *tile, vsh_error *error) {
    const vshi_survey *survey = &tiles->survey;
    size_t meshes = 0;
    for (size_t i = 0; i < survey->caster_count; ++i) {
        meshes += survey->casters[i].meshes;
    }
    VSHI_TRY(vshi_allocate((void **)&tile->casters, survey->caster_count, sizeof *tile->casters, "casters",
                           error));
    VSHI_TRY(vshi_allocate((void **)&tile->kept, meshes, 1, "casters", error));
    for (size_t i = 0, at = 0; i < survey->caster_count; at += survey->casters[i++].meshes) {
        tile->casters[i].none = survey->casters[i].count > 0;
        tile->casters[i].digest = survey->casters[i].digest;
        tile->casters[i].rules = survey->casters[i].rules;
        tile->casters[i].kept = survey->casters[i].count > 0 ? tile->kept + at : NULL;
    }
    return VSH_OK;
}

/* Its receivers, and the box around them. */
static vsh_result take_receivers(const vsh_tiles *tiles, size_t index, vsh_tile *tile, vshi_world_box *around,
                                 vsh_error *error) {
    const size_t first = tiles->first[index], count = tiles->first[index + 1] - first;
    VSHI_TRY(vshi_allocate((void **)&tile->receivers, count, sizeof *tile->receivers, "receivers", error));
    *around = vshi_empty_box;
    for (size_t i = 0; i < count; ++i) {
        const size_t receiver = tiles->receivers[first + i];
        tile->receivers[i] = tiles->whole->receivers[receiver];
        vshi_box_grow(around, &tiles->survey.receivers[receiver]);
    }
    tile->scene.receivers = tile->receivers;
    tile->scene.receiver_count = count;
    tile->info.receivers = count;
    memcpy(tile->info.bounds_min, around->low, sizeof around->low);
    memcpy(tile->info.bounds_max, around->high, sizeof around->high);
    return VSH_OK;
}

vsh_result vsh_tile_create(const vsh_tiles *tiles, size_t index, vsh_tile **tile, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(tile);
    *tile = NULL;
    VSHI_NEEDS(tiles);
    if (index >= tiles->count) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "tile %zu: there are %zu", index, tiles->count);
    }
    vsh_tile *made;
    VSHI_TRY(vshi_allocate((void **)&made, 1, sizeof *made, "tile", error));
    made->scene = *tiles->whole;
    made->scene.tile = made;
    made->rules = tiles->survey.rules;
    made->whole = tiles->survey.whole;
    made->info.all_objects = tiles->survey.objects;
    made->info.all_triangles = tiles->survey.triangles;
    vshi_world_box around;
    vsh_result result;
    VSHI_TRY_DONE(take_receivers(tiles, index, made, &around, error));
    VSHI_TRY_DONE(allocate_casters(tiles, made, error));
    VSHI_TRY_DONE(find_objects(tiles, &around, made, error));
    box_grids(tiles, &around, made);
    *tile = made;
    made = NULL;
done:
    vsh_tile_free(made);
    return result;
}

void vsh_tile_free(vsh_tile *tile) {
    if (tile == NULL) {
        return;
    }
    free(tile->kept);
    free(tile->casters);
    free(tile->receivers);
    free(tile);
}

const vsh_scene *vsh_tile_scene(const vsh_tile *tile) {
    return &tile->scene;
}

void vsh_tile_get_info_sized(const vsh_tile *tile, vsh_tile_info *info, size_t info_size) {
    vshi_give(info, info_size, &tile->info, sizeof tile->info);
}
