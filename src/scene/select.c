#include "scene/select.h"
#include "scene/unwrapped.h"

#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "mesh/mesh.h"
#include "scene/parts.h"
#include "json/suggest.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

/* --- in scene files */

static vsh_result read_patterns(vshi_json *reader, const vshi_value *value, const char *const **patterns,
                                size_t *count) {
    static const vshi_key key = {.kind = VSHI_STRING};
    const bool list = json_is_array(value->json);
    *count = list ? json_array_size(value->json) : 1;
    if (*count == 0) {
        return vshi_json_fail(reader, value, "is empty");
    }
    const char **strings;
    VSHI_TRY(vshi_json_allocate(reader, (void **)&strings, *count, sizeof *strings, "patterns"));
    for (size_t i = 0; i < *count; ++i) {
        const vshi_value item = list ? vshi_item(value, i) : *value;
        VSHI_TRY(vshi_read_value(reader, &item, &key, &strings[i]));
    }
    *patterns = strings;
    return VSH_OK;
}

vsh_result vshi_read_only(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_selection *selection = member;
    return read_patterns(reader, value, &selection->only, &selection->only_count);
}

vsh_result vshi_read_except(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_selection *selection = member;
    return read_patterns(reader, value, &selection->except, &selection->except_count);
}

static vsh_result read_rules(vshi_json *reader, const vshi_value *value, vsh_caster *caster,
                             int32_t solidity) {
    vsh_selection given = {.only = NULL};
    VSHI_TRY(vshi_read_only(reader, value, &given));
    const size_t count = caster->solidity_count + given.only_count;
    vsh_solidity_rule *rules;
    VSHI_TRY(vshi_json_allocate(reader, (void **)&rules, count, sizeof *rules, "patterns"));
    for (size_t i = 0; i < count; ++i) {
        rules[i] = i < caster->solidity_count
                       ? caster->solidity[i]
                       : (vsh_solidity_rule){given.only[i - caster->solidity_count], solidity};
    }
    caster->solidity = rules;
    caster->solidity_count = count;
    return VSH_OK;
}

vsh_result vshi_read_solid(vshi_json *reader, const vshi_value *value, void *caster) {
    return read_rules(reader, value, caster, VSH_SOLIDITY_SOLID);
}

vsh_result vshi_read_shell(vshi_json *reader, const vshi_value *value, void *caster) {
    return read_rules(reader, value, caster, VSH_SOLIDITY_SHELL);
}

vsh_result vshi_read_inward(vshi_json *reader, const vshi_value *value, void *caster) {
    return read_rules(reader, value, caster, VSH_SOLIDITY_INWARD);
}

/* --- in a model */

/* A name as messages tell it: that of the object. */
static const char *name_of(const vsh_mesh *mesh) {
    const char *name = mesh->object_name != NULL ? mesh->object_name : mesh->name;
    return name != NULL ? name : "";
}

/* "'floor', 'wall' and 12 more", without those that follow one of the same name. */
static void list_names(const vsh_model *model, char *text, size_t capacity) {
    enum { LISTED = 8, ROOM = 40 };
    const size_t count = vsh_model_mesh_count(model);
    size_t used = 0, listed = 0, more = 0;
    const char *last = NULL;
    for (size_t i = 0; i < count; ++i) {
        const vsh_mesh mesh = vsh_model_mesh(model, i, -1);
        const char *name = name_of(&mesh);
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

static char lower(char c) {
    return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c;
}

/* The letters of a pattern or name, all small: case is what is mistaken most. */
static void fold(const char *from, bool pattern, char to[64]) {
    size_t length = 0;
    for (; *from != '\0' && length < 63; ++from) {
        if (!pattern || strchr("*?[]\\", *from) == NULL) {
            to[length++] = lower(*from);
        }
    }
    to[length] = '\0';
}

/* The name that a pattern which matches nothing comes nearest to, or NULL. */
static const char *nearest_name(const vsh_model *model, const char *pattern) {
    char wanted[64], have[64];
    fold(pattern, true, wanted);
    const char *nearest = NULL;
    size_t least = SIZE_MAX;
    for (size_t i = 0; i < vsh_model_mesh_count(model); ++i) {
        const vsh_mesh mesh = vsh_model_mesh(model, i, -1);
        fold(name_of(&mesh), false, have);
        size_t distance = vshi_edit_distance(wanted, have);
        if (wanted[0] != '\0' && strstr(have, wanted) != NULL) {
            distance = 0;
        }
        if (distance < least) {
            least = distance;
            nearest = name_of(&mesh);
        }
    }
    return nearest != NULL && wanted[0] != '\0' && vshi_is_near(least, wanted) ? nearest : NULL;
}

vsh_result vshi_fail_unmatched(const vsh_model *model, const char *path, const char *pattern,
                               vsh_error *error) {
    char names[600] = "";
    list_names(model, names, sizeof names);
    const char *near = nearest_name(model, pattern);
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: no object is named '%.100s'%s%.100s%s there are %s", path,
                     pattern, near != NULL ? "; did you mean '" : ";", near != NULL ? near : "",
                     near != NULL ? "'?" : "", names);
}

/* Sets those that a pattern matches to `value`. */
static vsh_result apply(const vsh_model *model, const char *path, const char *const *patterns, size_t count,
                        unsigned char value, unsigned char *chosen, vsh_error *error) {
    for (size_t p = 0; p < count; ++p) {
        if (patterns[p] == NULL) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: pattern %zu of objects is NULL", path, p);
        }
        bool matched = false;
        for (size_t i = 0; i < vsh_model_mesh_count(model); ++i) {
            const vsh_mesh mesh = vsh_model_mesh(model, i, -1);
            if (vsh_mesh_matches(&mesh, patterns[p])) {
                chosen[i] = value;
                matched = true;
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
        vshi_warn(run, "%s: %s: no UVs to bake into: it casts only", receiver->path, label.text);
    }
    return VSH_OK;
}

vsh_result vshi_leave_out_blended(const vsh_scene *scene, const vsh_model *model, const char *path,
                                  const vsh_run *run, unsigned char *chosen, vsh_error *error) {
    const size_t count = vsh_model_mesh_count(model);
    size_t left = 0, blended = 0, masked = 0;
    for (size_t i = 0; i < count; ++i) {
        const int32_t alpha = vsh_model_mesh(model, i, -1).alpha;
        const bool out = chosen[i] != 0 && alpha == VSH_ALPHA_BLENDED && scene->cast_blended == 0;
        blended += out;
        masked += chosen[i] != 0 && alpha == VSH_ALPHA_MASKED;
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
                  "--cast-blended has them cast",
                  path, blended, count);
    }
    if (masked > 0) {
        vshi_warn(run,
                  "%s: %zu of %zu meshes have masked materials (leaves, fences) and cast whole, without the "
                  "holes of their textures",
                  path, masked, count);
    }
    return VSH_OK;
}
