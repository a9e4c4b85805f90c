/* Which of a file's meshes a caster or receiver takes. */
#include "scene/assets.h"

#include "base/job.h"
#include "base/memory.h"
#include "base/suggest.h"
#include "mesh/mesh.h"

#include <stdint.h>
#include <stdio.h>
#include <string.h>

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
static vsh_result apply(const vsh_model *model, const char *path, const char *const *patterns, size_t count,
                        unsigned char value, unsigned char *chosen, vsh_error *error) {
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

vsh_result vshi_select(const vsh_model *model, const char *path, const vsh_selection *selection,
                       unsigned char **chosen, vsh_error *error) {
    const size_t count = vsh_model_mesh_count(model);
    VSHI_TRY(vshi_allocate((void **)chosen, count, 1, "objects", error));
    memset(*chosen, selection->only_count == 0, count);
    VSHI_TRY(apply(model, path, selection->only, selection->only_count, 1, *chosen, error));
    VSHI_TRY(apply(model, path, selection->except, selection->except_count, 0, *chosen, error));
    if (memchr(*chosen, 1, count) == NULL) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: no object is left: all that are chosen are excepted, too", path);
    }
    return VSH_OK;
}

vsh_result vshi_select_some(const vsh_model *model, const char *path, const char *const *patterns,
                            size_t count, unsigned char **chosen, vsh_error *error) {
    VSHI_TRY(vshi_allocate((void **)chosen, vsh_model_mesh_count(model), 1, "objects", error));
    return apply(model, path, patterns, count, 1, *chosen, error);
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

vsh_result vshi_select_uvs(const vsh_model *model, const vsh_receiver *receiver, const vsh_run *run,
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
