/* Loads a scene: reads each file once, and puts the meshes where casters and receivers
 * stand. */
#include "scene/assets.h"

#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/similarity.h"
#include "base/suggest.h"
#include "heightfield/heights.h"
#include "mesh/mesh.h"
#include "model/model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <vdbshade/lit.h>

/* --- files */

typedef enum file_kind { MODEL, GRID, HEIGHTS } file_kind;

typedef struct vshi_asset_file {
    file_kind kind;
    const char *path, *name; /* the scene's: not looked at when all is loaded; name: of a grid, or NULL */
    vsh_model *model;
    vshi_masks *masks; /* of the model's textures */
    vsh_grid *grid;
    vshi_height_image heights; /* until all models are made of them */
    bool checked;              /* for triangles of zero area */
} vshi_asset_file;

struct vsh_assets {
    vshi_asset_file *files; /* [file_count] */
    size_t file_count;
    vshi_asset_place *casters;
    size_t caster_count;
    vshi_asset_place *receivers;
    size_t receiver_count;
    vshi_mesh_set set; /* of the casters' meshes */
};

static bool is_same(const char *a, const char *b) {
    return a == NULL || b == NULL ? a == b : strcmp(a, b) == 0;
}

static vsh_result read_file(vsh_assets *assets, file_kind kind, const char *path, const char *name,
                            const vsh_run *run, vshi_asset_file **file, vsh_error *error) {
    for (size_t i = 0; i < assets->file_count; ++i) {
        *file = &assets->files[i];
        if ((*file)->kind == kind && is_same((*file)->path, path) && is_same((*file)->name, name)) {
            return VSH_OK;
        }
    }
    vshi_asset_file *made = *file = &assets->files[assets->file_count++];
    *made = (vshi_asset_file){.kind = kind, .path = path, .name = name};
    if (kind == GRID) {
        return vsh_grid_read(path, name, run, &made->grid, error);
    }
    if (kind == HEIGHTS) {
        return vshi_height_image_read(path, run, &made->heights, error);
    }
    VSHI_TRY(vsh_model_read(path, run, &made->model, error));
    return vshi_masks_create(made->model, path, &made->masks, error);
}

static void free_heights(vsh_assets *assets) {
    for (size_t i = 0; i < assets->file_count; ++i) {
        free(assets->files[i].heights.values);
        assets->files[i].heights.values = NULL;
    }
}

/* --- which of a file's meshes a caster or receiver takes */

#define OF_MATERIAL "material:" /* begins a pattern of materials */

/* The name of the object of mesh `index`; of `materials`, that of material `index`. */
static const char *name_at(const vsh_model *model, size_t index, bool materials) {
    const vsh_mesh mesh = materials ? (vsh_mesh){.name = vsh_model_get_material(model, index).name}
                                    : vsh_model_mesh(model, index, -1);
    return vshi_object_name(&mesh);
}

static size_t count_of(const vsh_model *model, bool materials) {
    return materials ? vsh_model_material_count(model) : vsh_model_mesh_count(model);
}

/* "'floor', 'wall' and 12 more", without those that follow one of the same name. */
static void list_names(const vsh_model *model, bool materials, char *text, size_t capacity) {
    enum { LISTED = 8, ROOM = 40 };
    const size_t count = count_of(model, materials);
    size_t used = 0, listed = 0, more = 0;
    const char *last = NULL;
    for (size_t i = 0; i < count; ++i) {
        const char *name = name_at(model, i, materials);
        if (last != NULL && strcmp(last, name) == 0) {
            continue;
        }
        last = name;
        if (listed == LISTED || used + strlen(name) + ROOM > capacity) {
            ++more;
            continue;
        }
        used += (size_t)snprintf(text + used, capacity - used, "%s'%s'", listed++ > 0 ? ", " : "", name);
    }
    if (more > 0) {
        snprintf(text + used, capacity - used, "%s%zu more", listed > 0 ? " and " : "", more);
    }
}

/* The letters of a pattern or name, all small: case is what is mistaken most. */
static void fold(const char *from, bool pattern, char to[64]) {
    size_t length = 0;
    for (; *from != '\0' && length < 63; ++from) {
        if (!pattern || strchr("*?[]\\", *from) == NULL) {
            to[length++] = (char)(*from >= 'A' && *from <= 'Z' ? *from - 'A' + 'a' : *from);
        }
    }
    to[length] = '\0';
}

/* The name that a pattern which matches nothing comes nearest to, or NULL: of an object (materials 0), then
 * of a material. */
static const char *nearest_name(const vsh_model *model, int materials, const char *pattern) {
    char wanted[64], have[64];
    fold(pattern, true, wanted);
    const char *nearest = NULL;
    size_t least = SIZE_MAX;
    for (; materials < 2; ++materials) {
        for (size_t i = 0; i < count_of(model, materials != 0); ++i) {
            fold(name_at(model, i, materials != 0), false, have);
            size_t distance = vshi_edit_distance(wanted, have);
            if (wanted[0] != '\0' && strstr(have, wanted) != NULL) {
                distance = 0;
            }
            if (distance < least) {
                least = distance;
                nearest = name_at(model, i, materials != 0);
            }
        }
    }
    return nearest != NULL && wanted[0] != '\0' && vshi_is_near(least, wanted) ? nearest : NULL;
}

vsh_result vshi_fail_unmatched(const vsh_model *model, const char *path, const char *pattern,
                               vsh_error *error) {
    char names[600] = "", materials[300] = "";
    list_names(model, false, names, sizeof names);
    list_names(model, true, materials, sizeof materials);
    const size_t prefix =
        strncmp(pattern, OF_MATERIAL, sizeof OF_MATERIAL - 1) == 0 ? sizeof OF_MATERIAL - 1 : 0;
    const char *near = nearest_name(model, prefix > 0, pattern + prefix);
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: no %s is named '%.100s'%s%.100s%s there are %s%s%s", path,
                     prefix > 0 ? "material" : "object", pattern + prefix,
                     near != NULL ? "; did you mean '" : ";", near != NULL ? near : "",
                     near != NULL ? "'?" : "", names, materials[0] != '\0' ? ", and materials " : "",
                     materials);
}

bool vshi_mesh_is_meant(const vsh_mesh *mesh, const char *pattern, bool material) {
    vsh_mesh named = *mesh;
    if (material) {
        named.name = mesh->material_name;
        named.object_name = NULL;
    }
    return (!material || named.name != NULL) && vsh_mesh_matches(&named, pattern) != 0;
}

/* Sets those that a pattern matches to `value`: objects, or where none is called so, materials. */
static vsh_result apply_patterns(const vsh_model *model, const char *path, const char *const *patterns,
                                 size_t count, unsigned char value, unsigned char *chosen, vsh_error *error) {
    for (size_t p = 0; p < count; ++p) {
        bool matched = false;
        if (patterns[p] == NULL) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: pattern %zu of objects is NULL", path, p);
        }
        for (int material = 0; material < 2 && !matched; ++material) {
            for (size_t i = 0; i < vsh_model_mesh_count(model); ++i) {
                const vsh_mesh mesh = vsh_model_mesh(model, i, -1);
                if (vshi_mesh_is_meant(&mesh, patterns[p], material != 0)) {
                    chosen[i] = value;
                    matched = true;
                }
            }
        }
        if (!matched) {
            return vshi_fail_unmatched(model, path, patterns[p], error);
        }
    }
    return VSH_OK;
}

/* *chosen [mesh count]: 1 for each mesh that the selection means; to be freed, also after an error. `path` is
 * the model's, for messages. Errors: VSH_ERROR_INPUT where a pattern matches nothing (with names that it
 * might have meant) or nothing is left; VSH_ERROR_ARGUMENT where a pattern is NULL; VSH_ERROR_MEMORY. */
static vsh_result select_meshes(const vsh_model *model, const char *path, const vsh_selection *selection,
                                unsigned char **chosen, vsh_error *error) {
    const size_t count = vsh_model_mesh_count(model);
    VSHI_TRY(vshi_allocate((void **)chosen, count, 1, "objects", error));
    memset(*chosen, selection->only_count == 0, count);
    VSHI_TRY(apply_patterns(model, path, selection->only, selection->only_count, 1, *chosen, error));
    VSHI_TRY(apply_patterns(model, path, selection->except, selection->except_count, 0, *chosen, error));
    if (memchr(*chosen, 1, count) == NULL) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: no object is left: all that are chosen are excepted, too", path);
    }
    return VSH_OK;
}

vsh_result vshi_select_some(const vsh_model *model, const char *path, const char *const *patterns,
                            size_t count, unsigned char **chosen, vsh_error *error) {
    VSHI_TRY(vshi_allocate((void **)chosen, vsh_model_mesh_count(model), 1, "objects", error));
    return apply_patterns(model, path, patterns, count, 1, *chosen, error);
}

static vsh_result fail_without_uvs(const vsh_receiver *receiver, const char *mesh, int32_t sets,
                                   vsh_error *error) {
    if (sets == 0) {
        return vshi_fail(
            error, VSH_ERROR_INPUT,
            "%s: %s: no UVs to bake into: have them made (--unwrap auto; \"unwrap\" in a scene), or "
            "leave it out of what receives, so that it only casts (--no-receive NAME, "
            "--per-object; \"except\" in a scene)",
            receiver->path, mesh);
    }
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: %s: no UV set %d: it has %s%d", receiver->path, mesh,
                     receiver->uv_set, sets == 1 ? "set " : "sets 0 … ", sets - 1);
}

/* Takes those out of `chosen` that cannot receive, where the receiver is partial and not unwrapped; else
 * errors: VSH_ERROR_INPUT where a mesh has no UVs or not the set, VSH_ERROR_ARGUMENT where there is no such
 * set. */
static vsh_result select_uvs(const vsh_model *model, const vsh_receiver *receiver, const vsh_run *run,
                             unsigned char *chosen, vsh_error *error) {
    if (receiver->uv_set < -1 || receiver->uv_set >= VSH_MAX_UV_SETS) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: UV set %d: expected -1 … %d", receiver->path,
                         receiver->uv_set, VSH_MAX_UV_SETS - 1);
    }
    const size_t count = vsh_model_mesh_count(model);
    bool any = false;
    if (vshi_receiver_unwrap(receiver) != VSH_RECEIVER_UNWRAP_NEVER) {
        return VSH_OK; /* which makes what is missing */
    }
    for (size_t i = 0; i < count; ++i) {
        any = any ||
              (chosen[i] != 0 && vsh_model_uv_sets(model, i) > (receiver->uv_set > 0 ? receiver->uv_set : 0));
    }
    for (size_t i = 0; i < count; ++i) {
        const int32_t sets = vsh_model_uv_sets(model, i);
        if (chosen[i] == 0 || (sets > 0 && receiver->uv_set < sets)) {
            continue;
        }
        const vsh_mesh mesh = vsh_model_mesh(model, i, -1);
        const vshi_mesh_name label = vshi_mesh_label(&mesh, i);
        if (!any || !receiver->partial) {
            return fail_without_uvs(receiver, label.text, sets, error);
        }
        chosen[i] = 0;
        vshi_warn(run, "%s: %s: no UVs to bake into, so it casts only; unwrap it, or use --unwrap auto",
                  receiver->path, label.text);
    }
    return VSH_OK;
}

/* --- meshes of a model */

/* outer × inner, three rows of four each. */
static void compose(const double outer[12], const double inner[12], double result[12]) {
    for (int row = 0; row < 3; ++row) {
        const double *o = outer + 4 * row;
        for (int column = 0; column < 4; ++column) {
            result[4 * row + column] = o[0] * inner[column] + o[1] * inner[4 + column] +
                                       o[2] * inner[8 + column] + (column == 3 ? o[3] : 0.0);
        }
    }
}

/* Adds a mesh: number `number` of a model, or a part of that. */
static void add_mesh(vshi_asset_place *place, vsh_mesh mesh, size_t number, double scale,
                     const double transform[12]) {
    double *composed = place->transforms + 12 * place->count, scaled[12];
    for (int k = 0; k < 12; ++k) {
        scaled[k] = mesh.transform[k] * scale;
    }
    compose(transform, scaled, composed);
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

/* Puts the meshes of the model that are `chosen` there; NULL: all. */
static vsh_result place_chosen(vshi_asset_place *place, const vsh_model *model, const unsigned char *chosen,
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

/* Adds the chosen meshes as they cast. Meshes that `parts`, a receiver of the same model, has unwrapped come
 * from there, so that a mesh that casts and receives is one; NULL: none. A mesh that a mask cuts out keeps
 * the UVs of its texture. */
static vsh_result add_casting(vshi_asset_place *place, vshi_masks *masks, const unsigned char *chosen,
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

/* Adds the meshes of the place's model that a mesh caster takes, as they cast. `parts` is a receiver that has
 * unwrapped meshes of the model, or NULL. Warns of blended meshes that do not cast. */
static vsh_result place_casting(vshi_asset_place *place, const vsh_scene *scene, const vsh_caster *caster,
                                const vshi_asset_place *parts, const vsh_run *run, vsh_error *error) {
    vshi_masks *masks = place->file->masks;
    unsigned char *chosen = NULL, *one_sided = NULL;
    vsh_result result;
    VSHI_TRY_DONE(select_meshes(place->model, caster->path, &caster->objects, &chosen, error));
    VSHI_TRY_DONE(leave_out_blended(scene, masks, place->model, caster->path, run, chosen, error));
    VSHI_TRY_DONE(vshi_select_some(place->model, caster->path, caster->one_sided, caster->one_sided_count,
                                   &one_sided, error));
    VSHI_TRY_DONE(add_casting(place, masks, chosen, parts, scene->unit, caster->transform, run, error));
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

/* --- casters and receivers */

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
    vshi_asset_file *file;
    VSHI_TRY(read_file(assets, HEIGHTS, source->name, NULL, run, &file, error));
    source->columns = file->heights.columns;
    source->rows = file->heights.rows;
    source->values = file->heights.values;
    settle_size(source);
    if (place->direct) {
        vsh_heights_source placed = *source;
        placed.transform = transform;
        VSHI_TRY(vsh_heights_create(&placed, run, &place->heights, error));
    }
    VSHI_TRY(vshi_model_of_heights(source, what, texels, run, &place->made, error));
    return place_chosen(place, place->made, NULL, 0, 0.0, transform, error);
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
        VSHI_TRY(read_file(assets, GRID, caster->path, caster->grid, run, &place->file, error));
        place->grid = place->file->grid;
        return VSH_OK;
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
    VSHI_TRY(read_file(assets, MODEL, caster->path, NULL, run, &place->file, error));
    place->model = place->file->model;
    return place_casting(place, scene, caster, find_unwrapped(assets, place->model), run, error);
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
    return place_chosen(place, place->made, NULL, 0, 0.0, receiver->transform, error);
}

static vsh_result place_terrain(vsh_assets *assets, vshi_asset_place *place, const vsh_receiver *receiver,
                                const vsh_run *run, vsh_error *error) {
    vsh_heights_source source = {.name = receiver->path,
                                 .size = {receiver->extent[0], receiver->extent[1]},
                                 .height = receiver->relief};
    const size_t samples = receiver->supersample > 1 ? (size_t)receiver->supersample : 1;
    const size_t texels[2] = {samples * (size_t)receiver->width, samples * (size_t)receiver->height};
    const bool sized = receiver->width > 0 && receiver->height > 0 && !vsh_lit_is_output(receiver->output);
    return place_heights(assets, place, &source, VSH_HEIGHTS_SURFACE, sized ? texels : NULL,
                         receiver->transform, run, error);
}

static vsh_result place_receiver(vsh_assets *assets, const vsh_scene *scene, size_t index, const vsh_run *run,
                                 vsh_error *error) {
    const vsh_receiver *receiver = &scene->receivers[index];
    vshi_asset_place *place = &assets->receivers[index];
    if (receiver->path == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "receiver %zu: no path", index);
    }
    const bool plane = receiver->type == VSH_RECEIVER_PLANE;
    if (plane || receiver->type == VSH_RECEIVER_HEIGHTFIELD) {
        VSHI_TRY(plane ? place_plane(place, receiver, run, error)
                       : place_terrain(assets, place, receiver, run, error));
        return vshi_place_pages(place, receiver, run, error);
    }
    unsigned char *chosen = NULL;
    vsh_result result;
    VSHI_TRY(read_file(assets, MODEL, receiver->path, NULL, run, &place->file, error));
    const vsh_model *model = place->model = place->file->model;
    VSHI_TRY_DONE(select_meshes(model, receiver->path, &receiver->objects, &chosen, error));
    VSHI_TRY_DONE(select_uvs(model, receiver, run, chosen, error));
    VSHI_TRY_DONE(
        place_chosen(place, model, chosen, receiver->uv_set, scene->unit, receiver->transform, error));
    result = vshi_place_pages(place, receiver, run, error);
done:
    free(chosen);
    return result;
}

/* --- solids and sheets: the scene's rules decide, or the shape of the mesh */

/* Applies the rules of one caster, or of all, each by objects' names, or where none is called so, by those of
 * materials. Each must match something. */
static vsh_result apply_rules(const vsh_solidity_rule *rules, size_t rule_count, vshi_asset_place *casters,
                              size_t count, vsh_error *error) {
    for (size_t r = 0; r < rule_count; ++r) {
        const vsh_solidity_rule *rule = &rules[r];
        const vshi_asset_file *first = NULL;
        bool matched = false;
        if (rule->pattern == NULL || rule->solidity < VSH_SOLIDITY_AUTO ||
            rule->solidity > VSH_SOLIDITY_INWARD) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "rule of solidity %zu: %s", r,
                             rule->pattern == NULL ? "pattern is NULL"
                                                   : "solidity is none of VSH_SOLIDITY_…");
        }
        for (int material = 0; material < 2 && !matched; ++material) {
            for (size_t i = 0; i < count; ++i) {
                first = first == NULL && casters[i].model != NULL ? casters[i].file : first;
                for (size_t m = 0; casters[i].model != NULL && m < casters[i].count; ++m) {
                    vsh_mesh *mesh = &casters[i].meshes[m];
                    if (vshi_mesh_is_meant(mesh, rule->pattern, material != 0)) {
                        mesh->solidity = mesh->mask != NULL ? VSH_SOLIDITY_SHELL : rule->solidity;
                        matched = true;
                    }
                }
            }
        }
        if (!matched) {
            return first != NULL
                       ? vshi_fail_unmatched(first->model, first->path, rule->pattern, error)
                       : vshi_fail(error, VSH_ERROR_INPUT, "no object is named '%.100s': no caster is a mesh",
                                   rule->pattern);
        }
    }
    return VSH_OK;
}

/* Tells a receiver's meshes what is known of those that cast: the same triangles in the same place. */
static void share_solidity(const vshi_mesh_set *casters, vshi_asset_place *receiver) {
    for (size_t i = 0; i < receiver->count; ++i) {
        vsh_mesh *mesh = &receiver->meshes[i];
        for (size_t k = 0; k < casters->count && mesh->checked == NULL; ++k) {
            /* a file's meshes stand in the same order where all of them cast */
            const vsh_mesh *caster = &casters->meshes[(i + k) % casters->count];
            if (mesh->positions == caster->positions && mesh->indices == caster->indices &&
                vshi_mesh_same_transform(mesh->transform, caster->transform)) {
                mesh->checked = caster->checked;
                mesh->solidity = caster->solidity;
            }
        }
    }
}

/* Applies the rules of solidity to the casters' meshes, makes one set of them all and finds what they are,
 * together. Their views know it then. */
static vsh_result settle_solidity(vsh_assets *assets, const vsh_scene *scene, const vsh_run *run,
                                  vsh_error *error) {
    size_t count = 0;
    vsh_mesh *all = NULL;
    vsh_result result;
    for (size_t i = 0; i < assets->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        VSHI_TRY(apply_rules(caster->solidity, caster->solidity_count, &assets->casters[i], 1, error));
        count += assets->casters[i].count;
    }
    VSHI_TRY(
        apply_rules(scene->solidity, scene->solidity_count, assets->casters, assets->caster_count, error));
    if (count == 0) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_allocate((void **)&all, count, sizeof *all, "meshes", error));
    for (size_t i = 0, at = 0; i < assets->caster_count; ++i) {
        for (size_t m = 0; m < assets->casters[i].count; ++m) {
            all[at++] = assets->casters[i].meshes[m];
        }
    }
    VSHI_TRY_DONE(vshi_mesh_set_create(all, count, &assets->set, error));
    VSHI_TRY_DONE(vshi_mesh_set_solve(&assets->set, run, error));
    for (size_t i = 0, at = 0; i < assets->caster_count; ++i) {
        for (size_t m = 0; m < assets->casters[i].count; ++m) {
            assets->casters[i].meshes[m].checked = assets->set.meshes[at++].checked;
        }
    }
    for (size_t i = 0; i < assets->receiver_count; ++i) {
        share_solidity(&assets->set, &assets->receivers[i]);
    }
done:
    free(all);
    return result;
}

/* Checks the meshes of receivers, also of those that do not cast. */
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
        if (shared && place->unwrapped.page_count > 1) { /* connected meshes may be on several pages */
            VSHI_TRY(vshi_mesh_set_solve(&place->set, run, error));
        }
    }
    return VSH_OK;
}

/* Notes the triangles of zero area, which everything skips, of a file that is seen for the first time. The
 * voxeliser tells what is open. */
static vsh_result check_triangles(const vshi_asset_place *place, const vsh_run *run, vsh_error *error) {
    if (place->model == NULL || place->file->checked) {
        return VSH_OK;
    }
    const char *path = place->file->path;
    size_t sound = 0;
    place->file->checked = true;
    for (size_t i = 0; i < place->count; ++i) {
        sound += place->meshes[i].triangle_count - place->meshes[i].checked->report.degenerate_triangles;
    }
    if (sound == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: every triangle has zero area", path);
    }
    for (size_t i = 0; i < place->count; ++i) {
        const vsh_mesh *mesh = &place->meshes[i];
        const size_t skipped = mesh->checked->report.degenerate_triangles;
        if (skipped > 0) {
            vshi_note(run, "%s: mesh '%s': %zu triangles of zero area are skipped", path,
                      mesh->name != NULL ? mesh->name : "", skipped);
        }
    }
    return VSH_OK;
}

/* --- all of it */

static vsh_result allocate_places(vsh_assets *assets, const vsh_scene *scene, vsh_error *error) {
    VSHI_TRY(vshi_allocate((void **)&assets->files, scene->caster_count + scene->receiver_count,
                           sizeof *assets->files, "files", error));
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
    free_heights(loaded);
    VSHI_TRY_DONE(settle_solidity(loaded, scene, &full, error));
    VSHI_TRY_DONE(check_receivers(loaded, scene, &full, error));
    for (size_t i = 0; i < scene->caster_count; ++i) {
        VSHI_TRY_DONE(check_triangles(&loaded->casters[i], &full, error));
    }
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        VSHI_TRY_DONE(check_triangles(&loaded->receivers[i], &full, error));
    }
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
    free_heights(assets);
    for (size_t i = 0; i < assets->file_count; ++i) {
        vshi_masks_free(assets->files[i].masks);
        vsh_model_free(assets->files[i].model);
        vsh_grid_free(assets->files[i].grid);
    }
    free(assets->files);
    free(assets);
}

/* --- what is loaded */

const vshi_asset_place *vshi_assets_caster(const vsh_assets *assets, size_t index) {
    static const vshi_asset_place none;
    return index < assets->caster_count ? &assets->casters[index] : &none;
}

size_t vshi_assets_mesh_count(const vsh_assets *assets) {
    return assets->set.count;
}

const vsh_mesh *vsh_assets_caster(const vsh_assets *assets, size_t index, size_t *mesh_count) {
    const vshi_asset_place *place = vshi_assets_caster(assets, index);
    *mesh_count = place->count;
    return place->meshes;
}

const vsh_heights *vsh_assets_heights(const vsh_assets *assets, size_t index) {
    return vshi_assets_caster(assets, index)->heights;
}

const vsh_spheres *vsh_assets_spheres(const vsh_assets *assets, size_t index) {
    const vshi_asset_place *place = vshi_assets_caster(assets, index);
    return place->direct ? place->spheres : NULL;
}

static const vshi_asset_place *receiver_at(const vsh_assets *assets, size_t index) {
    static const vshi_asset_place none;
    return index < assets->receiver_count ? &assets->receivers[index] : &none;
}

const vsh_mesh *vsh_assets_receiver(const vsh_assets *assets, size_t index, size_t *mesh_count) {
    const vshi_asset_place *place = receiver_at(assets, index);
    *mesh_count = place->count;
    return place->meshes;
}

const vsh_model *vsh_assets_receiver_model(const vsh_assets *assets, size_t index, const size_t **numbers) {
    const vshi_asset_place *place = receiver_at(assets, index);
    *numbers = place->numbers;
    return place->made != NULL ? place->made : place->model;
}

const vsh_atlas *vsh_assets_receiver_atlas(const vsh_assets *assets, size_t index, const size_t **numbers) {
    const vshi_unwrapped *made = &receiver_at(assets, index)->unwrapped;
    *numbers = made->numbers;
    return made->atlas;
}

size_t vsh_assets_receiver_pages(const vsh_assets *assets, size_t index) {
    const vshi_unwrapped *made = &receiver_at(assets, index)->unwrapped;
    return made->page_begins != NULL ? made->page_count : index < assets->receiver_count;
}

int32_t vsh_assets_receiver_page_info(const vsh_assets *assets, size_t index, size_t page,
                                      vsh_receiver_page *info) {
    if (page >= vsh_assets_receiver_pages(assets, index)) {
        return 0;
    }
    const vshi_unwrapped *made = &receiver_at(assets, index)->unwrapped;
    *info = made->pages != NULL ? made->pages[page] : made->whole;
    return 1;
}

const vsh_mesh *vsh_assets_receiver_page(const vsh_assets *assets, size_t index, size_t page, size_t *first,
                                         size_t *mesh_count) {
    *first = *mesh_count = 0;
    if (page >= vsh_assets_receiver_pages(assets, index)) {
        return NULL;
    }
    const vshi_asset_place *place = receiver_at(assets, index);
    const size_t *begins = place->unwrapped.page_begins;
    *first = begins != NULL ? begins[page] : 0;
    *mesh_count = (begins != NULL ? begins[page + 1] : place->count) - *first;
    return place->meshes + *first;
}
