#include "lit/own_textures.h"

#include "lit/places.h"

#include <stdlib.h>

static const char key[] = "vdbshade_texture";

json_t *vshi_lit_texture_mark(const char *purpose) {
    return json_pack("{s:s}", key, purpose);
}

static bool is_made(const json_t *texture) {
    return json_object_get(json_object_get(texture, "extras"), key) != NULL;
}

static size_t count_of(const vshi_lit_document *document, const char *list) {
    return json_array_size(json_object_get(document->gltf.root, list));
}

/* --- who refers to what */

static void note(const json_t *object, const char *name, bool *used, size_t count) {
    size_t index;
    if (vshi_gltf_count(object, name, SIZE_MAX, &index) && index < count) {
        used[index] = true;
    }
}

/* Textures at or below `value`, of a material: whatever has an index, as those of extensions have. */
static void note_textures(json_t *value, bool *shown, size_t count) {
    size_t i;
    const char *name;
    json_t *member;
    note(value, "index", shown, count);
    json_array_foreach(value, i, member) {
        note_textures(member, shown, count);
    }
    json_object_foreach(value, name, member) {
        note_textures(member, shown, count);
    }
}

vsh_result vshi_lit_textures_find(vshi_lit_document *document, vshi_lit_texture_uses *uses,
                                  vsh_error *error) {
    *uses = (vshi_lit_texture_uses){.texture_count = count_of(document, "textures"),
                                    .image_count = count_of(document, "images"),
                                    .sampler_count = count_of(document, "samplers")};
    VSHI_TRY(
        vshi_gltf_allocate(&document->gltf, (void **)&uses->shown, uses->texture_count, sizeof(bool), error));
    note_textures(json_object_get(document->gltf.root, "materials"), uses->shown, uses->texture_count);
    return VSH_OK;
}

void vshi_lit_textures_free(vshi_lit_texture_uses *uses) {
    free(uses->shown);
    *uses = (vshi_lit_texture_uses){.shown = NULL};
}

/* What a texture is made of: its own image, and those of other formats (KHR_texture_basisu,
 * EXT_texture_webp). */
static void note_parts(json_t *texture, bool *images, size_t image_count, bool *samplers,
                       size_t sampler_count) {
    const char *name;
    json_t *extension;
    note(texture, "sampler", samplers, sampler_count);
    note(texture, "source", images, image_count);
    json_object_foreach(json_object_get(texture, "extensions"), name, extension) {
        note(extension, "source", images, image_count);
    }
}

/* --- taking out */

typedef struct pruning {
    const vshi_lit_texture_uses *before;
    bool *textures; /* [before->texture_count], those that go, and so on */
    bool *images, *samplers;
    bool *kept_images, *kept_samplers; /* that the others are made of */
    vshi_lit_places texture_places, image_places, sampler_places;
} pruning;

static vsh_result find_gone(vshi_lit_document *document, const vshi_lit_texture_uses *after, pruning *p,
                            vsh_error *error) {
    vshi_gltf *gltf = &document->gltf;
    const vshi_lit_texture_uses *before = p->before;
    const size_t images = before->image_count, samplers = before->sampler_count;
    size_t i;
    json_t *texture;
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&p->textures, before->texture_count, sizeof(bool), error));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&p->images, images, sizeof(bool), error));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&p->kept_images, images, sizeof(bool), error));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&p->samplers, samplers, sizeof(bool), error));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&p->kept_samplers, samplers, sizeof(bool), error));
    json_array_foreach(json_object_get(gltf->root, "textures"), i, texture) {
        const bool gone =
            i < before->texture_count && before->shown[i] && !after->shown[i] && is_made(texture);
        if (gone) {
            p->textures[i] = true;
        }
        note_parts(texture, gone ? p->images : p->kept_images, images, gone ? p->samplers : p->kept_samplers,
                   samplers);
    }
    for (i = 0; i < images; ++i) {
        p->images[i] = p->images[i] && !p->kept_images[i];
    }
    for (i = 0; i < samplers; ++i) {
        p->samplers[i] = p->samplers[i] && !p->kept_samplers[i];
    }
    return VSH_OK;
}

/* Where a bake puts its textures, and nowhere else: there may be other numbers in extensions. */
static vsh_result rename_shown(vshi_lit_document *document, const vshi_lit_places *textures,
                               vsh_error *error) {
    size_t i;
    json_t *material;
    json_array_foreach(json_object_get(document->gltf.root, "materials"), i, material) {
        json_t *const infos[] = {
            json_object_get(material, "occlusionTexture"),
            json_object_get(json_object_get(material, "extensions"), "MOZ_lightmap"),
            json_object_get(json_object_get(material, "pbrMetallicRoughness"), "baseColorTexture")};
        for (size_t k = 0; k < sizeof infos / sizeof infos[0]; ++k) {
            VSHI_TRY(vshi_lit_places_rename(document, textures, infos[k], "index", error));
        }
    }
    return VSH_OK;
}

static vsh_result take_out(vshi_lit_document *document, pruning *p, vsh_error *error) {
    const vshi_lit_texture_uses *before = p->before;
    const size_t count = count_of(document, "textures");
    VSHI_TRY(
        vshi_lit_places_find(document, p->textures, before->texture_count, count, &p->texture_places, error));
    VSHI_TRY(vshi_lit_places_find(document, p->images, before->image_count, count_of(document, "images"),
                                  &p->image_places, error));
    VSHI_TRY(vshi_lit_places_find(document, p->samplers, before->sampler_count,
                                  count_of(document, "samplers"), &p->sampler_places, error));
    json_t *textures = json_object_get(document->gltf.root, "textures");
    for (size_t i = before->texture_count; i < count; ++i) {
        json_t *texture = json_array_get(textures, i);
        VSHI_TRY(vshi_lit_places_rename(document, &p->image_places, texture, "source", error));
        VSHI_TRY(vshi_lit_places_rename(document, &p->sampler_places, texture, "sampler", error));
    }
    VSHI_TRY(rename_shown(document, &p->texture_places, error));
    VSHI_TRY(vshi_lit_places_move(document, "textures", &p->texture_places, error));
    VSHI_TRY(vshi_lit_places_move(document, "images", &p->image_places, error));
    return vshi_lit_places_move(document, "samplers", &p->sampler_places, error);
}

vsh_result vshi_lit_textures_prune(vshi_lit_document *document, const vshi_lit_texture_uses *before,
                                   const vshi_lit_texture_uses *after, vsh_error *error) {
    pruning p = {.before = before};
    vsh_result result = find_gone(document, after, &p, error);
    result = result == VSH_OK ? take_out(document, &p, error) : result;
    free(p.sampler_places.moved);
    free(p.image_places.moved);
    free(p.texture_places.moved);
    free(p.kept_samplers);
    free(p.kept_images);
    free(p.samplers);
    free(p.images);
    free(p.textures);
    return result;
}
