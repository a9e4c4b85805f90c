/* Materials that show what was baked: occlusionTexture (glTF 2.0, 3.9.3), MOZ_lightmap (docs/lit.md) and
 * KHR_materials_unlit. */
#include "lit/work.h"

#include "base/memory.h"

#include <stdlib.h>
#include <string.h>

static const char variants_name[] = "KHR_materials_variants", transform_name[] = "KHR_texture_transform";

/* --- looks */

static bool has_transform(const vshi_lit_look *look, json_t *transform) {
    return look->transform == NULL || transform == NULL ? look->transform == transform
                                                        : json_equal(look->transform, transform) != 0;
}

static vsh_result find_look(vshi_lit_work *work, const vshi_lit_look *wanted, size_t *index,
                            vsh_error *error) {
    vshi_lit_looks *looks = &work->looks;
    for (*index = 0; *index < looks->count; ++*index) {
        const vshi_lit_look *look = &looks->list[*index];
        if (look->material == wanted->material && look->page == wanted->page && look->set == wanted->set &&
            has_transform(look, wanted->transform)) {
            return VSH_OK;
        }
    }
    VSHI_TRY(vshi_make_room((void **)&looks->list, looks->count, &looks->capacity, sizeof *looks->list,
                            work->document.gltf.path, error));
    looks->list[looks->count++] = *wanted;
    json_incref(wanted->transform);
    return VSH_OK;
}

static vsh_result mark(vshi_lit_work *work, json_t *owner, uint32_t page, size_t set, json_t *transform,
                       vsh_error *error) {
    vshi_lit_look look = {.page = page, .set = set, .transform = transform, .made = SIZE_MAX};
    size_t index;
    VSHI_TRY(vshi_gltf_index(&work->document.gltf, owner, "material", "materials", "a primitive",
                             &look.material, error));
    VSHI_TRY(find_look(work, &look, &index, error));
    vshi_lit_set(&work->document, owner, "material", json_integer(-1 - (json_int_t)index));
    return VSH_OK;
}

vsh_result vshi_lit_mark_primitive(vshi_lit_work *work, json_t *primitive, uint32_t page, size_t set,
                                   json_t *transform, vsh_error *error) {
    const json_t *mappings = json_object_get(vshi_gltf_extension(primitive, variants_name), "mappings");
    size_t i;
    json_t *mapping;
    json_array_foreach(mappings, i, mapping) {
        if (json_object_get(mapping, "material") != NULL) {
            VSHI_TRY(mark(work, mapping, page, set, transform, error));
        }
    }
    return mark(work, primitive, page, set, transform, error);
}

/* --- what they look like */

static bool has_images(const vshi_lit_work *work, uint32_t page) {
    bool any = false;
    for (int purpose = 0; purpose < VSH_LIT_PURPOSES; ++purpose) {
        any = any || work->pages[page].textures[purpose] > 0;
    }
    return any;
}

static json_t *texture_info(const vshi_lit_work *work, int purpose, const vshi_lit_look *look) {
    const json_int_t texture = (json_int_t)work->pages[look->page].textures[purpose] - 1,
                     set = (json_int_t)look->set;
    return look->transform == NULL ? json_pack("{s:I,s:I}", "index", texture, "texCoord", set)
                                   : json_pack("{s:I,s:I,s:{s:O}}", "index", texture, "texCoord", set,
                                               "extensions", transform_name, look->transform);
}

bool vshi_lit_is_cut_by_texture(const json_t *material) {
    const char *mode = json_string_value(json_object_get(material, "alphaMode"));
    return mode != NULL && strcmp(mode, "OPAQUE") != 0 &&
           json_object_get(json_object_get(material, "pbrMetallicRoughness"), "baseColorTexture") != NULL;
}

static vsh_result set_lightmap(vshi_lit_work *work, json_t *material, const vshi_lit_look *look,
                               vsh_error *error) {
    json_t *extensions;
    VSHI_TRY(vshi_lit_object(&work->document, material, "extensions", &extensions, error));
    json_t *info = texture_info(work, VSH_LIT_LIGHTMAP, look);
    vshi_lit_set(&work->document, info, "intensity", json_real(work->pages[look->page].intensity));
    vshi_lit_set(&work->document, extensions, "MOZ_lightmap", info);
    vshi_lit_use_extension(&work->document, "MOZ_lightmap");
    return VSH_OK;
}

static vsh_result set_preview(vshi_lit_work *work, json_t *material, const vshi_lit_look *look,
                              vsh_error *error) {
    json_t *base, *extensions;
    if (vshi_lit_is_cut_by_texture(material)) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_lit_object(&work->document, material, "pbrMetallicRoughness", &base, error));
    VSHI_TRY(vshi_lit_object(&work->document, material, "extensions", &extensions, error));
    vshi_lit_set(&work->document, base, "baseColorTexture", texture_info(work, VSH_LIT_PREVIEW, look));
    vshi_lit_set(&work->document, extensions, "KHR_materials_unlit", json_object());
    vshi_lit_use_extension(&work->document, "KHR_materials_unlit");
    return VSH_OK;
}

static vsh_result dress(vshi_lit_work *work, json_t *material, const vshi_lit_look *look, vsh_error *error) {
    if (work->pages[look->page].textures[VSH_LIT_OCCLUSION] > 0) {
        vshi_lit_set(&work->document, material, "occlusionTexture",
                     texture_info(work, VSH_LIT_OCCLUSION, look));
    }
    if (work->pages[look->page].textures[VSH_LIT_LIGHTMAP] > 0) {
        VSHI_TRY(set_lightmap(work, material, look, error));
    }
    if (work->pages[look->page].textures[VSH_LIT_PREVIEW] > 0) {
        VSHI_TRY(set_preview(work, material, look, error));
    }
    if (look->transform != NULL) {
        vshi_lit_use_extension(&work->document, transform_name);
    }
    return VSH_OK;
}

/* --- who shows them */

typedef vsh_result visit_fn(vshi_lit_work *work, json_t *owner, void *user, vsh_error *error);

/* Calls for every primitive of the document, and every variant of it that names a material. */
static vsh_result visit_all(vshi_lit_work *work, visit_fn *visit, void *user, vsh_error *error) {
    size_t m, p, v;
    json_t *mesh, *primitive, *mapping;
    json_array_foreach(json_object_get(work->document.gltf.root, "meshes"), m, mesh) {
        json_array_foreach(json_object_get(mesh, "primitives"), p, primitive) {
            VSHI_TRY(visit(work, primitive, user, error));
            json_array_foreach(json_object_get(vshi_gltf_extension(primitive, variants_name), "mappings"), v,
                               mapping) {
                if (json_object_get(mapping, "material") != NULL) {
                    VSHI_TRY(visit(work, mapping, user, error));
                }
            }
        }
    }
    return VSH_OK;
}

/* The look of a primitive that is marked, or SIZE_MAX. */
static size_t look_of(const vshi_lit_work *work, const json_t *owner) {
    const json_t *material = json_object_get(owner, "material");
    const json_int_t number = json_is_integer(material) ? json_integer_value(material) : 0;
    return number < 0 && -1 - number < (json_int_t)work->looks.count ? (size_t)(-1 - number) : SIZE_MAX;
}

/* Materials that are shown without light too; `user` NULL: all are only checked. */
static vsh_result find_unlit(vshi_lit_work *work, json_t *owner, void *user, vsh_error *error) {
    bool *unlit = user;
    size_t material = SIZE_MAX;
    if (look_of(work, owner) == SIZE_MAX) {
        VSHI_TRY(vshi_gltf_index(&work->document.gltf, owner, "material", "materials", "a primitive",
                                 &material, error));
    }
    if (material != SIZE_MAX && unlit != NULL) {
        unlit[material] = true;
    }
    return VSH_OK;
}

static vsh_result put(vshi_lit_work *work, json_t *owner, void *user, vsh_error *error) {
    (void)user;
    (void)error;
    const size_t look = look_of(work, owner);
    if (look == SIZE_MAX) {
        return VSH_OK;
    }
    const size_t made = work->looks.list[look].made;
    if (made == SIZE_MAX) {
        json_object_del(owner, "material"); /* it had none */
    } else {
        vshi_lit_set_number(&work->document, owner, "material", made);
    }
    return VSH_OK;
}

vsh_result vshi_lit_materials_check(vshi_lit_work *work, vsh_error *error) {
    return visit_all(work, find_unlit, NULL, error); /* no look is there yet */
}

/* --- all of them */

static vsh_result make(vshi_lit_work *work, vshi_lit_look *look, bool *taken, json_t **dressed,
                       vsh_error *error) {
    vshi_lit_document *document = &work->document;
    json_t *material =
        look->material != SIZE_MAX
            ? vshi_lit_copy_json(document, vshi_gltf_element(&document->gltf, "materials", look->material))
            : json_object();
    const vsh_result result =
        json_is_object(material)
            ? dress(work, material, look, error)
            : vshi_gltf_fail(&document->gltf, error, "materials[%zu] is no object", look->material);
    if (result != VSH_OK) {
        json_decref(material);
        return document->refused || material == NULL ? vshi_lit_no_memory(document, error) : result;
    }
    if (look->material != SIZE_MAX && !taken[look->material]) {
        taken[look->material] = true;
        dressed[look->material] = material; /* not before all have been copied from what was there */
        look->made = look->material;
    } else {
        look->made = vshi_lit_append(document, "materials", material);
    }
    return VSH_OK;
}

static vsh_result make_all(vshi_lit_work *work, size_t count, bool *taken, json_t **dressed,
                           vsh_error *error) {
    VSHI_TRY(visit_all(work, find_unlit, taken, error));
    for (size_t i = 0; i < work->looks.count; ++i) {
        vshi_lit_look *look = &work->looks.list[i];
        if (!has_images(work, look->page)) {
            look->made = look->material;
            if (look->material != SIZE_MAX) {
                taken[look->material] = true;
            }
        }
    }
    for (size_t i = 0; i < work->looks.count; ++i) {
        vshi_lit_look *look = &work->looks.list[i];
        if (has_images(work, look->page)) {
            VSHI_TRY(make(work, look, taken, dressed, error));
        }
    }
    json_t *materials = json_object_get(work->document.gltf.root, "materials");
    for (size_t m = 0; m < count; ++m) {
        work->document.refused |= dressed[m] != NULL && json_array_set(materials, m, dressed[m]) != 0;
    }
    return visit_all(work, put, NULL, error);
}

vsh_result vshi_lit_materials_apply(vshi_lit_work *work, vsh_error *error) {
    vshi_gltf *gltf = &work->document.gltf;
    const size_t count = json_array_size(json_object_get(gltf->root, "materials"));
    bool *taken = NULL; /* by somebody who wants it as it is, or by a look */
    json_t **dressed = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_gltf_allocate(gltf, (void **)&taken, count, sizeof *taken, error));
    VSHI_TRY_DONE(vshi_gltf_allocate(gltf, (void **)&dressed, count, sizeof *dressed, error));
    VSHI_TRY_DONE(make_all(work, count, taken, dressed, error));
done:
    for (size_t m = 0; dressed != NULL && m < count; ++m) {
        json_decref(dressed[m]);
    }
    free(dressed);
    free(taken);
    return result;
}
