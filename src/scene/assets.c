/* Loads a scene: reads each file once, and puts the meshes where casters and receivers
 * stand. */
#include "scene/assets.h"

#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/text.h"
#include "base/vec.h"
#include "geometry/mesh.h"
#include "io/model/model.h"
#include "shapes/heights.h"
#include "shapes/outline.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <vdbshade/scene.h>

/* --- files */

typedef enum file_kind { MODEL, GRID, HEIGHTS } file_kind;

typedef struct vshi_asset_file {
    file_kind kind;
    const char *path, *name; /* from the scene, used while loading; name: of a grid, or NULL */
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
    vsh_assets_info info;
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

/* Name `i` of a model: its meshes' objects come first, then its materials. */
static const char *find_name(const vsh_model *model, size_t i) {
    const size_t meshes = vsh_model_mesh_count(model);
    const vsh_mesh mesh = i < meshes ? vsh_model_mesh(model, i, -1)
                                     : (vsh_mesh){.name = vshi_model_get_material(model, i - meshes).name};
    return vshi_object_name(&mesh);
}

/* Lists names as "'floor', 'wall' and 12 more". Equal names in a row count once. */
static void list_names(const vsh_model *model, size_t first, size_t end, char *text, size_t capacity) {
    enum { LISTED = 8, ROOM = 40 };
    size_t used = 0, listed = 0, more = 0;
    const char *last = NULL;
    for (size_t i = first; i < end; ++i) {
        const char *name = find_name(model, i);
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

/* Copies the letters of a pattern or name in lower case: most mistakes are in the case. */
static void fold(const char *from, bool pattern, char to[64]) {
    size_t length = 0;
    for (; *from != '\0' && length < 63; ++from) {
        if (!pattern || strchr("*?[]\\", *from) == NULL) {
            to[length++] = (char)(*from >= 'A' && *from <= 'Z' ? *from - 'A' + 'a' : *from);
        }
    }
    to[length] = '\0';
}

/* Finds the name from `first` on that is nearest to a pattern without matches; NULL: none is near. */
static const char *find_nearest(const vsh_model *model, size_t first, size_t end, const char *pattern) {
    char wanted[64], have[64];
    fold(pattern, true, wanted);
    const char *nearest = NULL;
    size_t least = SIZE_MAX;
    for (size_t i = first; i < end && wanted[0] != '\0'; ++i) {
        fold(find_name(model, i), false, have);
        const size_t distance = strstr(have, wanted) != NULL ? 0 : vshi_edit_distance(wanted, have);
        if (distance < least) {
            least = distance;
            nearest = find_name(model, i);
        }
    }
    return nearest != NULL && vshi_is_near(least, wanted) ? nearest : NULL;
}

/* Fails because a pattern matches none of a model's meshes, and suggests names. */
static vsh_result fail_unmatched(const vsh_model *model, const char *path, const char *pattern,
                                 vsh_error *error) {
    char names[600] = "", materials[300] = "";
    const size_t meshes = vsh_model_mesh_count(model), end = meshes + model->material_count;
    list_names(model, 0, meshes, names, sizeof names);
    list_names(model, meshes, end, materials, sizeof materials);
    const bool of_material = strncmp(pattern, OF_MATERIAL, strlen(OF_MATERIAL)) == 0;
    pattern += of_material ? strlen(OF_MATERIAL) : 0;
    const char *near = find_nearest(model, of_material ? meshes : 0, end, pattern);
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: no %s is named '%.100s'%s%.100s%s there are %s%s%s", path,
                     of_material ? "material" : "object", pattern, near != NULL ? "; did you mean '" : ";",
                     near != NULL ? near : "", near != NULL ? "'?" : "", names,
                     materials[0] != '\0' ? ", and materials " : "", materials);
}

/* Whether a pattern matches a mesh by its object's name, or by its `material`'s. Patterns match materials
 * only if they match no object. */
static bool is_matched(const vsh_mesh *mesh, const char *pattern, bool material) {
    vsh_mesh named = *mesh;
    if (material) {
        named.name = mesh->material_name;
        named.object_name = NULL;
    }
    return (!material || named.name != NULL) && vshi_mesh_matches(&named, pattern) != 0;
}

/* Sets the meshes that the patterns match to `value`, by objects, else by materials. */
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
                if (is_matched(&mesh, patterns[p], material != 0)) {
                    chosen[i] = value;
                    matched = true;
                }
            }
        }
        if (!matched) {
            return fail_unmatched(model, path, patterns[p], error);
        }
    }
    return VSH_OK;
}

/* Sets *chosen [mesh count] to 1 for each selected mesh; to be freed, even after an error. Errors:
 * VSH_ERROR_INPUT (a pattern matches nothing, or no mesh is left); VSH_ERROR_ARGUMENT (a pattern is NULL);
 * VSH_ERROR_MEMORY. */
static vsh_result select_meshes(const vsh_model *model, const char *path, const vsh_selection *selection,
                                unsigned char **chosen, vsh_error *error) {
    const size_t count = vsh_model_mesh_count(model);
    VSHI_TRY(vshi_allocate((void **)chosen, count, 1, "objects", error));
    memset(*chosen, selection->only_count == 0, count);
    VSHI_TRY(apply_patterns(model, path, selection->only, selection->only_count, 1, *chosen, error));
    VSHI_TRY(apply_patterns(model, path, selection->except, selection->except_count, 0, *chosen, error));
    if (memchr(*chosen, 1, count) == NULL) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: no object is left: all chosen ones are excepted, too",
                         path);
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
            "%s: %s: no UVs to bake into: make them (--unwrap auto; \"unwrap\" in a scene), or let the mesh "
            "only cast (--no-receive NAME, --per-object; \"except\" in a scene)",
            receiver->path, mesh);
    }
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: %s: no UV set %d: it has %s%d", receiver->path, mesh,
                     receiver->uv_set, sets == 1 ? "set " : "sets 0 … ", sets - 1);
}

/* Checks that the chosen meshes have the UV set, unless they are unwrapped. A partial receiver leaves out
 * those that lack it, with a warning. Errors: VSH_ERROR_INPUT; VSH_ERROR_ARGUMENT (the set's number). */
static vsh_result select_uvs(const vsh_model *model, const vsh_receiver *receiver, const vsh_run *run,
                             unsigned char *chosen, vsh_error *error) {
    if (receiver->uv_set < -1 || receiver->uv_set >= VSH_MAX_UV_SETS) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: UV set %d: expected -1 … %d", receiver->path,
                         receiver->uv_set, VSH_MAX_UV_SETS - 1);
    }
    const size_t count = vsh_model_mesh_count(model);
    bool any = false;
    if (vshi_receiver_unwrap(receiver) != VSH_RECEIVER_UNWRAP_NEVER || receiver->vertex_colors != NULL) {
        return VSH_OK;
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

/* Adds a mesh, or a part of it, with its number in the model. */
static void add_mesh(vshi_asset_place *place, vsh_mesh mesh, size_t number) {
    double *composed = place->transforms + 12 * place->count, scaled[12];
    for (int k = 0; k < 12; ++k) {
        scaled[k] = mesh.transform[k] * place->scale;
    }
    compose(place->transform, scaled, composed);
    mesh.transform = composed;
    place->numbers[place->count] = number;
    place->meshes[place->count++] = mesh;
}

/* Makes room for `count` meshes of a model. `unit`: metres of its numbers; 0: as the model says. */
static vsh_result prepare_place(vshi_asset_place *place, const vsh_model *model, size_t count, double unit,
                                vsh_error *error) {
    const double own_unit = vsh_model_unit(model) > 0.0 ? vsh_model_unit(model) : 1.0;
    const vshi_array arrays[] = {VSHI_ARRAY(place->meshes, count), VSHI_ARRAY(place->transforms, 12 * count),
                                 VSHI_ARRAY(place->numbers, count)};
    place->scale = unit > 0.0 ? unit / own_unit : 1.0;
    return VSHI_ALLOCATE_ALL(arrays, "meshes", error);
}

/* Adds the chosen meshes of a model; NULL: all. */
static vsh_result add_chosen(vshi_asset_place *place, const vsh_model *model, const unsigned char *chosen,
                             int32_t uv_set, double unit, vsh_error *error) {
    const size_t all = vsh_model_mesh_count(model);
    VSHI_TRY(prepare_place(place, model, all, unit, error));
    for (size_t i = 0; i < all; ++i) {
        if (chosen == NULL || chosen[i] != 0) {
            add_mesh(place, vsh_model_mesh(model, i, uv_set), i);
        }
    }
    return VSH_OK;
}

/* Adds the chosen meshes as they cast. If `parts`, a receiver of the same model or NULL, has unwrapped a
 * mesh, takes its parts, so that the mesh that casts equals the one that receives. A mesh that a texture cuts
 * keeps the UVs of that texture. */
static vsh_result add_casting(vshi_asset_place *place, const unsigned char *chosen,
                              const vshi_asset_place *parts, const vsh_run *run, vsh_error *error) {
    const vsh_model *model = place->model;
    const size_t all = vsh_model_mesh_count(model), part_count = parts != NULL ? parts->count : 0;
    unsigned char *left = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&left, all, 1, "meshes", error));
    memcpy(left, chosen, all);
    for (size_t i = 0; i < part_count; ++i) {
        const size_t number = parts->numbers[i];
        vshi_cast_views views = {.cut = true};
        if (chosen[number] != 0) {
            VSHI_TRY_DONE(vshi_masks_cast(place->file->masks, number, run, &views, error));
        }
        if (!views.cut) {
            vsh_mesh part = parts->meshes[i];
            part.transform = vsh_model_mesh(model, number, -1).transform;
            add_mesh(place, part, number);
            left[number] = 0;
        }
    }
    for (size_t i = 0; i < all; ++i) {
        vshi_cast_views views = {.count = 0};
        if (left[i] != 0) {
            VSHI_TRY_DONE(vshi_masks_cast(place->file->masks, i, run, &views, error));
        }
        for (int k = 0; k < views.count; ++k) {
            add_mesh(place, views.meshes[k], i);
        }
    }
done:
    free(left);
    return result;
}

/* Leaves glass and the like out of `chosen`. Cut-outs stay, though their materials are blended. */
static vsh_result leave_out_blended(const vsh_scene *scene, const vshi_asset_place *place, const vsh_run *run,
                                    unsigned char *chosen, vsh_error *error) {
    const char *path = place->file->path;
    const size_t count = vsh_model_mesh_count(place->model);
    size_t left = 0, blended = 0, cut_out = 0;
    for (size_t i = 0; i < count; ++i) {
        if (chosen[i] != 0 && scene->cast_blended == 0 &&
            vsh_model_mesh(place->model, i, -1).alpha == VSH_ALPHA_BLENDED) {
            vshi_blend blend;
            VSHI_TRY(vshi_masks_blend(place->file->masks, i, run, &blend, error));
            cut_out += blend == VSHI_BLEND_CUT_OUT;
            blended += blend == VSHI_BLEND_GLASS;
            chosen[i] = blend != VSHI_BLEND_GLASS;
        }
        left += chosen[i] != 0;
    }
    if (left == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: all its materials are blended (glass, smoke), and cast nothing; "
                         "\"cast_blended\" in a scene, or --cast-blended, has them cast",
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

/* Adds the meshes of a mesh caster, as they cast. `parts` is a receiver that has unwrapped meshes of the
 * model, or NULL. */
static vsh_result place_casting(vshi_asset_place *place, const vsh_scene *scene, const vsh_caster *caster,
                                const vshi_asset_place *parts, const vsh_run *run, vsh_error *error) {
    const size_t most = 2 * vsh_model_mesh_count(place->model) + (parts != NULL ? parts->count : 0);
    unsigned char *chosen = NULL, *one_sided = NULL;
    vsh_result result;
    VSHI_TRY_DONE(prepare_place(place, place->model, most, scene->unit, error));
    VSHI_TRY_DONE(select_meshes(place->model, caster->path, &caster->objects, &chosen, error));
    VSHI_TRY_DONE(leave_out_blended(scene, place, run, chosen, error));
    VSHI_TRY_DONE(vshi_select_some(place->model, caster->path, caster->one_sided, caster->one_sided_count,
                                   &one_sided, error));
    VSHI_TRY_DONE(add_casting(place, chosen, parts, run, error));
    for (size_t i = 0; i < place->count; ++i) {
        place->meshes[i].one_sided = one_sided[place->numbers[i]];
    }
    if (place->count == 0) {
        result = vshi_fail(error, VSH_ERROR_INPUT, "%s: the masks of its materials leave nothing to cast",
                           caster->path);
    }
done:
    vshi_masks_trim(place->file->masks);
    free(one_sided);
    free(chosen);
    return result;
}

/* --- casters and receivers */

/* Makes a place's model of an image of heights. `source` is filled except for the image's values. */
static vsh_result place_heights(vsh_assets *assets, vshi_asset_place *place, vsh_heights_source *source,
                                int32_t what, const size_t *texels, const vsh_run *run, vsh_error *error) {
    vshi_asset_file *file;
    VSHI_TRY(read_file(assets, HEIGHTS, source->name, NULL, run, &file, error));
    source->columns = file->heights.columns;
    source->rows = file->heights.rows;
    source->values = file->heights.values;
    if (source->size[1] == 0.0) { /* by the cells; the first side is the longer one */
        const double across = source->columns - 1, down = source->rows - 1, longer = source->size[0];
        source->size[0] = longer * fmin(1.0, across / down);
        source->size[1] = longer * fmin(1.0, down / across);
    }
    if (place->direct) {
        vsh_heights_source placed = *source;
        placed.transform = place->transform;
        VSHI_TRY(vshi_heights_create(&placed, run, &place->heights, error));
    }
    VSHI_TRY(vshi_model_of_heights(source, what, texels, run, &place->made, error));
    return add_chosen(place, place->made, NULL, 0, 0.0, error);
}

static vsh_result place_spheres(vshi_asset_place *place, const vsh_caster *caster, size_t index,
                                const vsh_run *run, vsh_error *error) {
    const double *spheres = caster->spheres;
    size_t count = caster->sphere_count;
    double *read = NULL;
    vsh_error why;
    if (caster->path != NULL) {
        VSHI_TRY(vshi_spheres_read(caster->path, run, &read, &count, error));
        spheres = read;
    }
    const vsh_result result =
        vshi_spheres_create(spheres, count, caster->transform, run, &place->spheres, &why);
    free(read);
    return result == VSH_OK ? VSH_OK
                            : vshi_fail(error, result, "caster %zu: %s%s%s", index,
                                        caster->path != NULL ? caster->path : "",
                                        caster->path != NULL ? ": " : "", why.message);
}

/* The first receiver that unwraps meshes of a model; NULL: none. */
static const vshi_asset_place *find_unwrapped(const vsh_assets *assets, const vsh_model *model) {
    for (size_t i = 0; i < assets->receiver_count; ++i) {
        if (assets->receivers[i].model == model && assets->receivers[i].pages.atlas != NULL) {
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
    if ((uint32_t)caster->type > VSH_CASTER_TEXT) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "caster %zu: type %d: expected 0 … %d", index,
                         caster->type, VSH_CASTER_TEXT);
    }
    place->direct = vshi_caster_is_direct(scene, caster);
    place->transform = caster->transform;
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
        return vshi_outline_from_image(caster->path, &caster->mask, run, &place->outline, error);
    }
    if (caster->type == VSH_CASTER_TEXT) {
        return vshi_outline_from_text(caster->text, caster->path, &caster->letters, run, &place->outline,
                                      error);
    }
    if (caster->type == VSH_CASTER_HEIGHTFIELD) {
        vsh_heights_source source = {.name = caster->path,
                                     .size = {caster->size[0], caster->size[1]},
                                     .height = caster->height,
                                     .base = caster->base};
        return place_heights(assets, place, &source, VSH_HEIGHTS_SOLID, NULL, run, error);
    }
    VSHI_TRY(read_file(assets, MODEL, caster->path, NULL, run, &place->file, error));
    place->model = place->file->model;
    return place_casting(place, scene, caster, find_unwrapped(assets, place->model), run, error);
}

/* A plane is a heightfield of four heights, all 0. */
static vsh_result place_plane(vshi_asset_place *place, const vsh_receiver *receiver, const vsh_run *run,
                              vsh_error *error) {
    static const float flat[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    const vsh_heights_source source = {.name = receiver->path,
                                       .columns = 2,
                                       .rows = 2,
                                       .values = flat,
                                       .size = {receiver->extent[0], receiver->extent[1]}};
    VSHI_TRY(vsh_model_from_heights(&source, VSH_HEIGHTS_SURFACE, run, &place->made, error));
    return add_chosen(place, place->made, NULL, 0, 0.0, error);
}

static vsh_result place_terrain(vsh_assets *assets, vshi_asset_place *place, const vsh_receiver *receiver,
                                const vsh_run *run, vsh_error *error) {
    vsh_heights_source source = {.name = receiver->path,
                                 .size = {receiver->extent[0], receiver->extent[1]},
                                 .height = receiver->relief};
    const size_t samples = receiver->supersample > 1 ? (size_t)receiver->supersample : 1;
    const size_t texels[2] = {samples * (size_t)receiver->width, samples * (size_t)receiver->height};
    const bool sized = receiver->width > 0 && receiver->height > 0 && !vsh_lit_is_output(receiver->output);
    return place_heights(assets, place, &source, VSH_HEIGHTS_SURFACE, sized ? texels : NULL, run, error);
}

/* Adds the chosen meshes of a file. */
static vsh_result place_receiving(vsh_assets *assets, vshi_asset_place *place, const vsh_scene *scene,
                                  const vsh_receiver *receiver, const vsh_run *run, vsh_error *error) {
    unsigned char *chosen = NULL;
    vsh_result result;
    VSHI_TRY(read_file(assets, MODEL, receiver->path, NULL, run, &place->file, error));
    place->model = place->file->model;
    VSHI_TRY_DONE(select_meshes(place->model, receiver->path, &receiver->objects, &chosen, error));
    VSHI_TRY_DONE(select_uvs(place->model, receiver, run, chosen, error));
    result = add_chosen(place, place->model, chosen, receiver->uv_set, scene->unit, error);
done:
    free(chosen);
    return result;
}

static vsh_result place_receiver(vsh_assets *assets, const vsh_scene *scene, size_t index, const vsh_run *run,
                                 vsh_error *error) {
    const vsh_receiver *receiver = &scene->receivers[index];
    vshi_asset_place *place = &assets->receivers[index];
    if (receiver->path == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "receiver %zu: no path", index);
    }
    place->transform = receiver->transform;
    VSHI_TRY(receiver->type == VSH_RECEIVER_PLANE ? place_plane(place, receiver, run, error)
             : receiver->type == VSH_RECEIVER_HEIGHTFIELD
                 ? place_terrain(assets, place, receiver, run, error)
                 : place_receiving(assets, place, scene, receiver, run, error));
    return vshi_place_pages(place, receiver, run, error);
}

/* --- solids and sheets: the scene's rules decide, or the shape of the mesh */

/* Applies the rules of one caster, or of all. A pattern that matches no object's name is tried with
 * materials' names. Each rule must match something. */
static vsh_result apply_rules(const vsh_solidity_rule *rules, size_t rule_count, vshi_asset_place *casters,
                              size_t count, vsh_error *error) {
    for (size_t r = 0; r < rule_count; ++r) {
        const vsh_solidity_rule *rule = &rules[r];
        const vshi_asset_file *first = NULL;
        bool matched = false;
        if (rule->pattern == NULL || (uint32_t)rule->solidity > VSH_SOLIDITY_INWARD) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "rule of solidity %zu: %s", r,
                             rule->pattern == NULL ? "pattern is NULL"
                                                   : "solidity is none of VSH_SOLIDITY_…");
        }
        for (int material = 0; material < 2 && !matched; ++material) {
            for (size_t i = 0; i < count; ++i) {
                first = first == NULL && casters[i].model != NULL ? casters[i].file : first;
                for (size_t m = 0; casters[i].model != NULL && m < casters[i].count; ++m) {
                    vsh_mesh *mesh = &casters[i].meshes[m];
                    if (is_matched(mesh, rule->pattern, material != 0)) {
                        mesh->solidity = mesh->mask != NULL ? VSH_SOLIDITY_SHELL : rule->solidity;
                        matched = true;
                    }
                }
            }
        }
        if (!matched) {
            return first != NULL
                       ? fail_unmatched(first->model, first->path, rule->pattern, error)
                       : vshi_fail(error, VSH_ERROR_INPUT, "no object is named '%.100s': no caster is a mesh",
                                   rule->pattern);
        }
    }
    return VSH_OK;
}

/* Gives a receiver's meshes the solidity of casters with the same triangles in the same place. */
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

/* Applies the rules of solidity to the casters' meshes, then finds the solids and sheets of all together. */
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
        if (shared && place->pages.count > 1) { /* connected meshes may be on several pages */
            VSHI_TRY(vshi_mesh_set_solve(&place->set, run, error));
        }
    }
    return VSH_OK;
}

/* Notes the triangles of zero area, which everything skips, once for each file. */
static vsh_result check_triangles(const vshi_asset_place *place, const vsh_run *run, vsh_error *error) {
    if (place->model == NULL || place->file->checked) {
        return VSH_OK;
    }
    size_t sound = 0;
    place->file->checked = true;
    for (size_t i = 0; i < place->count; ++i) {
        const vsh_mesh *mesh = &place->meshes[i];
        const size_t skipped = mesh->checked->report.degenerate_triangles;
        sound += mesh->triangle_count - skipped;
        if (skipped > 0) {
            vshi_note(run, "%s: mesh '%s': %zu triangles of zero area are skipped", place->file->path,
                      mesh->name != NULL ? mesh->name : "", skipped);
        }
    }
    return sound > 0
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT, "%s: every triangle has zero area", place->file->path);
}

/* --- loading */

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

vsh_result vsh_assets_load(vsh_scene *scene, const vsh_run *run, vsh_assets **assets, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(assets);
    VSHI_NEEDS(scene);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        VSHI_TRY(check_transform(scene->receivers[i].transform, "receivers", i, error));
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        VSHI_TRY(check_transform(scene->casters[i].transform, "casters", i, error));
    }
    vsh_assets *loaded = NULL;
    VSHI_TRY(vshi_allocate((void **)&loaded, 1, sizeof *loaded, "assets", error));
    const size_t casters = scene->caster_count, receivers = scene->receiver_count;
    const vshi_array arrays[] = {VSHI_ARRAY(loaded->files, casters + receivers),
                                 VSHI_ARRAY(loaded->casters, casters),
                                 VSHI_ARRAY(loaded->receivers, receivers)};
    vsh_result result;
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, "assets", error));
    loaded->caster_count = casters;
    loaded->receiver_count = receivers;
    /* receivers first: their errors are cheaper to find than a caster's volume is to read */
    for (size_t i = 0; i < receivers; ++i) {
        VSHI_TRY_DONE(place_receiver(loaded, scene, i, &full, error));
    }
    for (size_t i = 0; i < casters; ++i) {
        VSHI_TRY_DONE(place_caster(loaded, scene, i, &full, error));
    }
    free_heights(loaded);
    VSHI_TRY_DONE(settle_solidity(loaded, scene, &full, error));
    VSHI_TRY_DONE(check_receivers(loaded, scene, &full, error));
    for (size_t i = 0; i < casters + receivers; ++i) {
        VSHI_TRY_DONE(check_triangles(i < casters ? &loaded->casters[i] : &loaded->receivers[i - casters],
                                      &full, error));
    }
    VSHI_TRY_DONE(vshi_scene_measure(scene, loaded, &loaded->info, error));
    if (scene->ao != 0 && scene->shade.ao_distance == 0.0) {
        scene->shade.ao_distance = loaded->info.ao_distance;
    }
    *assets = loaded;
    loaded = NULL;
done:
    vsh_assets_free(loaded);
    return result;
}

static void free_places(vshi_asset_place *places, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        vshi_spheres_free(places[i].spheres);
        vshi_heights_free(places[i].heights);
        vsh_model_free(places[i].made);
        vshi_mesh_set_free(&places[i].set);
        vshi_receiver_pages_free(&places[i].pages);
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

/* --- loaded assets */

void vsh_assets_get_info(const vsh_assets *assets, vsh_assets_info *info) {
    *info = assets->info;
}

const vshi_asset_place *vshi_assets_caster(const vsh_assets *assets, size_t index) {
    static const vshi_asset_place none;
    return index < assets->caster_count ? &assets->casters[index] : &none;
}

const vshi_mesh_set *vshi_assets_set(const vsh_assets *assets) {
    return &assets->set;
}

const vsh_mesh *vsh_assets_caster(const vsh_assets *assets, size_t index, size_t *mesh_count) {
    const vshi_asset_place *place = vshi_assets_caster(assets, index);
    *mesh_count = place->count;
    return place->meshes;
}

const vshi_asset_place *vshi_assets_receiver(const vsh_assets *assets, size_t index) {
    static const vshi_asset_place none;
    return index < assets->receiver_count ? &assets->receivers[index] : &none;
}

const vsh_mesh *vsh_assets_receiver(const vsh_assets *assets, size_t index, size_t *mesh_count) {
    const vshi_asset_place *place = vshi_assets_receiver(assets, index);
    *mesh_count = place->count;
    return place->meshes;
}

const vsh_mesh *vshi_place_page(const vshi_asset_place *place, size_t page, size_t *first,
                                size_t *mesh_count) {
    *first = place->pages.begins[page];
    *mesh_count = place->pages.begins[page + 1] - *first;
    return place->meshes + *first;
}
