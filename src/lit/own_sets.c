/* Chooses the set of a primitive that new UVs become. They replace the file's lightmap set, or a set of an
 * earlier bake, which the extras of a primitive list ("vdbshade_uv_sets": [1]). */
#include "lit/work.h"

#include <stdio.h>

static const char key[] = "vdbshade_uv_sets";

/* Of the images of a page, as bits 1 << VSH_LIT_…. */
static uint32_t purposes_of(const vshi_lit_work *work, uint32_t page) {
    uint32_t purposes = 0;
    for (size_t i = 0; i < work->options->image_count; ++i) {
        const vsh_lit_image *image = &work->options->images[i];
        purposes |= image->page == page ? 1U << image->purpose : 0;
    }
    return purposes;
}

/* Those that all pages of a mesh have. */
static uint32_t purposes_of_mesh(const vshi_lit_work *work, const vsh_lit_mesh *mesh) {
    const uint32_t only = vshi_lit_only_page(work, mesh);
    if (only != VSH_LIT_NO_CHART) {
        return purposes_of(work, only);
    }
    uint32_t purposes = UINT32_MAX, before = VSH_LIT_NO_CHART;
    for (size_t t = 0; t < mesh->triangle_count; ++t) {
        const uint32_t page = vshi_lit_page(work, mesh, t);
        if (page != VSH_LIT_NO_CHART && page != before) {
            purposes &= purposes_of(work, page);
            before = page;
        }
    }
    return purposes;
}

/* --- who else uses a set */

static bool is_texture_of(const json_t *info, size_t set) {
    size_t own = 0, moved = 0;
    const json_t *transform = vshi_gltf_extension(info, "KHR_texture_transform");
    if (json_object_get(info, "index") == NULL && json_object_get(info, "texCoord") == NULL) {
        return false;
    }
    return !vshi_gltf_count(info, "texCoord", 0, &own) ||
           !vshi_gltf_count(transform, "texCoord", own, &moved) || moved == set;
}

/* Whether any texture at or below `value`, but `without`, is in the set. */
static bool has_texture(json_t *value, size_t set, const json_t *const without[VSH_LIT_PURPOSES]) {
    for (int i = 0; i < VSH_LIT_PURPOSES; ++i) {
        if (value == without[i]) {
            return false;
        }
    }
    size_t i;
    const char *name;
    json_t *member;
    if (json_is_array(value)) {
        json_array_foreach(value, i, member) {
            if (has_texture(member, set, without)) {
                return true;
            }
        }
    }
    if (is_texture_of(value, set)) {
        return true;
    }
    json_object_foreach(value, name, member) {
        if (has_texture(member, set, without)) {
            return true;
        }
    }
    return false;
}

/* Whether the material of a primitive, or of a variant of it, shows something in the set that stays. */
static bool is_shown(const vshi_lit_work *work, const json_t *owner, size_t set, uint32_t purposes) {
    const json_t *number = json_object_get(owner, "material");
    const json_t *materials = json_object_get(work->document.gltf.root, "materials");
    json_t *material = json_is_integer(number) && json_integer_value(number) >= 0
                           ? json_array_get(materials, (size_t)json_integer_value(number))
                           : NULL;
    const json_t *base = json_object_get(material, "pbrMetallicRoughness");
    const json_t *without[VSH_LIT_PURPOSES] = {
        [VSH_LIT_OCCLUSION] = json_object_get(material, "occlusionTexture"),
        [VSH_LIT_LIGHTMAP] = vshi_gltf_extension(material, "MOZ_lightmap"),
        [VSH_LIT_PREVIEW] =
            vshi_lit_is_cut_by_texture(material) ? NULL : json_object_get(base, "baseColorTexture"),
    };
    for (int i = 0; i < VSH_LIT_PURPOSES; ++i) {
        without[i] = (purposes >> i & 1) != 0 ? without[i] : NULL;
    }
    return material != NULL && has_texture(material, set, without);
}

static void name_of(size_t set, char *name, size_t size) {
    snprintf(name, size, "TEXCOORD_%zu", set);
}

/* Whether a set exists, no morph target moves it, and new textures replace all that use it. */
static bool is_replaceable(const vshi_lit_work *work, const json_t *primitive, size_t set,
                           uint32_t purposes) {
    char name[40];
    size_t i;
    json_t *each;
    name_of(set, name, sizeof name);
    if (json_object_get(json_object_get(primitive, "attributes"), name) == NULL) {
        return false;
    }
    json_array_foreach(json_object_get(primitive, "targets"), i, each) {
        if (json_object_get(each, name) != NULL) {
            return false;
        }
    }
    json_array_foreach(json_object_get(vshi_gltf_extension(primitive, "KHR_materials_variants"), "mappings"),
                       i, each) {
        if (is_shown(work, each, set, purposes)) {
            return false;
        }
    }
    return !is_shown(work, primitive, set, purposes);
}

/* --- sets that were made */

static const json_t *made_sets(const json_t *primitive) {
    return json_object_get(json_object_get(primitive, "extras"), key);
}

/* Whether the file says that a set was made. */
static bool is_made(const json_t *primitive, size_t set) {
    size_t i;
    json_t *number;
    json_array_foreach(made_sets(primitive), i, number) {
        if (json_is_integer(number) && json_integer_value(number) == (json_int_t)set) {
            return true;
        }
    }
    return false;
}

/* As many as are looked at. */
static size_t count_sets(const json_t *attributes) {
    char name[40];
    size_t set = 0;
    do {
        name_of(set, name, sizeof name);
    } while (json_object_get(attributes, name) != NULL && ++set < VSH_MAX_UV_SETS);
    return set;
}

static void drop(json_t *primitive, size_t set) {
    char name[40];
    name_of(set, name, sizeof name);
    json_object_del(json_object_get(primitive, "attributes"), name);
}

vsh_result vshi_lit_tell_set(const vshi_lit_document *document, json_t *primitive, size_t set,
                             vsh_error *error) {
    json_t *extras = json_object_get(primitive, "extras");
    if (extras != NULL && !json_is_object(extras)) {
        return VSH_OK; /* somebody's own, of another kind */
    }
    VSHI_TRY(vshi_lit_object(document, primitive, "extras", &extras, error));
    json_t *list = json_array();
    bool good = list != NULL;
    const size_t count = count_sets(json_object_get(primitive, "attributes"));
    for (size_t i = 0; i <= count || i <= set; ++i) {
        if (i == set || (i < count && is_made(primitive, i))) {
            good = good && json_array_append_new(list, json_integer((json_int_t)i)) == 0;
        }
    }
    if (!good) {
        json_decref(list);
        return vshi_lit_no_memory(document, error);
    }
    return vshi_lit_set(document, extras, key, list, error);
}

vsh_result vshi_lit_choose_set(const vshi_lit_work *work, json_t *primitive, const vsh_lit_mesh *mesh,
                               const char *where, size_t *set, vsh_error *error) {
    const uint32_t purposes = purposes_of_mesh(work, mesh);
    size_t count = count_sets(json_object_get(primitive, "attributes"));
    *set = 0;
    while (*set < count && !((*set == VSHI_LIT_SET || is_made(primitive, *set)) &&
                             is_replaceable(work, primitive, *set, purposes))) {
        ++*set;
    }
    /* sets are numbered without gaps: of others that were made the last can go */
    while (count > *set + 1 && count < VSH_MAX_UV_SETS && is_made(primitive, count - 1) &&
           is_replaceable(work, primitive, count - 1, purposes)) {
        drop(primitive, --count);
    }
    if (*set < count) {
        drop(primitive, *set);
    }
    if (*set < VSH_MAX_UV_SETS) {
        return VSH_OK;
    }
    return vshi_fail(error, VSH_ERROR_LIMIT,
                     "%s: %s has %zu sets of UVs, and textures that stay use those that the lightmap could "
                     "take: no more than %d can be read",
                     work->document.gltf.path, where, *set, VSH_MAX_UV_SETS);
}
