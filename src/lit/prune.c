/* Textures, accessors, buffer views and bytes that nothing refers to any more. New items of a list take the
 * places of those that go, so other items keep their numbers. */
#include "lit/work.h"

#include <stdlib.h>
#include <string.h>

/* Where the items first … count - 1, which are new, go. */
typedef struct placing {
    size_t *moved;            /* [count - first] */
    size_t first, count, end; /* end: items that are left */
} placing;

/* Finds places for the items first … count - 1, which are new: those that are gone, in order, then places
 * behind the old items. Places left at the end are cut off. Free `moved` after a failure, too. Errors:
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
static vsh_result find_places(vshi_lit_document *document, const bool *gone, size_t first, size_t count,
                              placing *places, vsh_error *error) {
    const size_t more = count - first;
    size_t done = 0, behind = 0; /* behind: the places that are taken */
    *places = (placing){.first = first, .count = count};
    VSHI_TRY(
        vshi_gltf_allocate(&document->gltf, (void **)&places->moved, more, sizeof *places->moved, error));
    for (size_t i = 0; i < first && done < more; ++i) {
        if (gone[i]) {
            places->moved[done++] = i;
            behind = i + 1;
        }
    }
    places->end = first + more - done;
    for (size_t i = first; done < more; ++i) {
        places->moved[done++] = i;
    }
    while (places->end <= first && places->end > behind && gone[places->end - 1]) {
        --places->end;
    }
    return VSH_OK;
}

/* Marks old places that are taken or cut off: taken[first]. */
static void mark_places(const placing *places, bool *taken) {
    for (size_t i = 0; i < places->count - places->first && places->moved[i] < places->first; ++i) {
        taken[places->moved[i]] = true;
    }
    for (size_t i = places->end; i < places->first; ++i) {
        taken[i] = true;
    }
}

/* Sets a number that is a new item's to its new place. Errors: VSH_ERROR_MEMORY. */
static vsh_result rename_index(const vshi_lit_document *document, const placing *places, json_t *object,
                               const char *key, vsh_error *error) {
    size_t index;
    if (!vshi_gltf_count(object, key, SIZE_MAX, &index) || index < places->first || index >= places->count) {
        return VSH_OK;
    }
    return vshi_lit_set_number(document, object, key, places->moved[index - places->first], error);
}

/* Moves the items of the root's list. Errors: VSH_ERROR_MEMORY. */
static vsh_result move_items(vshi_lit_document *document, const char *name, const placing *places,
                             vsh_error *error) {
    json_t *list = json_object_get(document->gltf.root, name);
    for (size_t i = places->first; i < places->count; ++i) {
        const size_t to = places->moved[i - places->first]; /* never behind i */
        if (to != i && json_array_set(list, to, json_array_get(list, i)) != 0) {
            return vshi_lit_no_memory(document, error);
        }
    }
    while (json_array_size(list) > places->end) {
        json_array_remove(list, json_array_size(list) - 1);
    }
    if (places->end == 0 && places->count > 0) { /* glTF has no empty lists */
        json_object_del(document->gltf.root, name);
    }
    return VSH_OK;
}

static const char texture_key[] = "vdbshade_texture";

json_t *vshi_lit_texture_mark(const char *purpose) {
    return json_pack("{s:s}", texture_key, purpose);
}

static bool is_made(const json_t *texture) {
    return json_object_get(json_object_get(texture, "extras"), texture_key) != NULL;
}

static size_t count_of(const vshi_lit_document *document, const char *list) {
    return json_array_size(json_object_get(document->gltf.root, list));
}

/* --- textures that materials show */

static void note_index(const json_t *object, const char *name, bool *used, size_t count) {
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
    note_index(value, "index", shown, count);
    json_array_foreach(value, i, member) {
        note_textures(member, shown, count);
    }
    json_object_foreach(value, name, member) {
        note_textures(member, shown, count);
    }
}

/* Finds the textures that materials show. Free them after a failure, too. Errors: VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY. */
static vsh_result find_textures(vshi_lit_document *document, vshi_lit_texture_uses *uses, vsh_error *error) {
    *uses = (vshi_lit_texture_uses){.texture_count = count_of(document, "textures"),
                                    .image_count = count_of(document, "images"),
                                    .sampler_count = count_of(document, "samplers")};
    VSHI_TRY(
        vshi_gltf_allocate(&document->gltf, (void **)&uses->shown, uses->texture_count, sizeof(bool), error));
    note_textures(json_object_get(document->gltf.root, "materials"), uses->shown, uses->texture_count);
    return VSH_OK;
}

static void free_textures(vshi_lit_texture_uses *uses) {
    free(uses->shown);
    *uses = (vshi_lit_texture_uses){.shown = NULL};
}

/* Notes a texture's sampler and images, those of other formats too (KHR_texture_basisu, EXT_texture_webp). */
static void note_parts(json_t *texture, bool *images, size_t image_count, bool *samplers,
                       size_t sampler_count) {
    const char *name;
    json_t *extension;
    note_index(texture, "sampler", samplers, sampler_count);
    note_index(texture, "source", images, image_count);
    json_object_foreach(json_object_get(texture, "extensions"), name, extension) {
        note_index(extension, "source", images, image_count);
    }
}

/* --- removing textures */

typedef struct pruning {
    const vshi_lit_texture_uses *before;
    bool *textures; /* [before->texture_count], those that go, and so on */
    bool *images, *samplers;
    bool *kept_images, *kept_samplers; /* that the others are made of */
    placing texture_places, image_places, sampler_places;
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
static vsh_result rename_shown(vshi_lit_document *document, const placing *textures, vsh_error *error) {
    size_t i;
    json_t *material;
    json_array_foreach(json_object_get(document->gltf.root, "materials"), i, material) {
        json_t *const infos[] = {
            json_object_get(material, "occlusionTexture"),
            json_object_get(json_object_get(material, "extensions"), "MOZ_lightmap"),
            json_object_get(json_object_get(material, "pbrMetallicRoughness"), "baseColorTexture")};
        for (size_t k = 0; k < sizeof infos / sizeof infos[0]; ++k) {
            VSHI_TRY(rename_index(document, textures, infos[k], "index", error));
        }
    }
    return VSH_OK;
}

static vsh_result take_out(vshi_lit_document *document, pruning *p, vsh_error *error) {
    const vshi_lit_texture_uses *before = p->before;
    const size_t count = count_of(document, "textures");
    VSHI_TRY(find_places(document, p->textures, before->texture_count, count, &p->texture_places, error));
    VSHI_TRY(find_places(document, p->images, before->image_count, count_of(document, "images"),
                         &p->image_places, error));
    VSHI_TRY(find_places(document, p->samplers, before->sampler_count, count_of(document, "samplers"),
                         &p->sampler_places, error));
    json_t *textures = json_object_get(document->gltf.root, "textures");
    for (size_t i = before->texture_count; i < count; ++i) {
        json_t *texture = json_array_get(textures, i);
        VSHI_TRY(rename_index(document, &p->image_places, texture, "source", error));
        VSHI_TRY(rename_index(document, &p->sampler_places, texture, "sampler", error));
    }
    VSHI_TRY(rename_shown(document, &p->texture_places, error));
    VSHI_TRY(move_items(document, "textures", &p->texture_places, error));
    VSHI_TRY(move_items(document, "images", &p->image_places, error));
    return move_items(document, "samplers", &p->sampler_places, error);
}

/* Takes those out that were made, were shown before, and are not any more, and what only they referred to;
 * new ones take their places. All extensions are known. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
static vsh_result prune_textures(vshi_lit_document *document, const vshi_lit_texture_uses *before,
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

/* --- accessors and buffer views in use */

/* Called for every accessor or buffer view that `object` refers to by `key`. */
typedef vsh_result refer_fn(vshi_lit_document *document, json_t *object, const char *key, bool view,
                            void *user, vsh_error *error);

static vsh_result walk_all_of(vshi_lit_document *document, json_t *object, refer_fn *refer, void *user,
                              vsh_error *error) {
    const char *name;
    json_t *value;
    json_object_foreach(object, name, value) {
        VSHI_TRY(refer(document, object, name, false, user, error));
    }
    return VSH_OK;
}

static json_t *member(json_t *object, const char *first, const char *second) {
    return json_object_get(json_object_get(object, first), second);
}

static vsh_result walk_meshes(vshi_lit_document *document, refer_fn *refer, void *user, vsh_error *error) {
    size_t m, p, t;
    json_t *mesh, *primitive, *target;
    json_array_foreach(json_object_get(document->gltf.root, "meshes"), m, mesh) {
        json_array_foreach(json_object_get(mesh, "primitives"), p, primitive) {
            json_t *draco = member(primitive, "extensions", "KHR_draco_mesh_compression");
            VSHI_TRY(walk_all_of(document, json_object_get(primitive, "attributes"), refer, user, error));
            VSHI_TRY(refer(document, primitive, "indices", false, user, error));
            VSHI_TRY(refer(document, draco, "bufferView", true, user, error));
            json_array_foreach(json_object_get(primitive, "targets"), t, target) {
                VSHI_TRY(walk_all_of(document, target, refer, user, error));
            }
        }
    }
    return VSH_OK;
}

static vsh_result walk(vshi_lit_document *document, refer_fn *refer, void *user, vsh_error *error) {
    size_t i, k;
    json_t *item, *sampler, *root = document->gltf.root;
    VSHI_TRY(walk_meshes(document, refer, user, error));
    json_array_foreach(json_object_get(root, "nodes"), i, item) {
        json_t *instancing = member(item, "extensions", "EXT_mesh_gpu_instancing");
        VSHI_TRY(walk_all_of(document, json_object_get(instancing, "attributes"), refer, user, error));
    }
    json_array_foreach(json_object_get(root, "skins"), i, item) {
        VSHI_TRY(refer(document, item, "inverseBindMatrices", false, user, error));
    }
    json_array_foreach(json_object_get(root, "animations"), i, item) {
        json_array_foreach(json_object_get(item, "samplers"), k, sampler) {
            VSHI_TRY(refer(document, sampler, "input", false, user, error));
            VSHI_TRY(refer(document, sampler, "output", false, user, error));
        }
    }
    json_array_foreach(json_object_get(root, "accessors"), i, item) {
        VSHI_TRY(refer(document, item, "bufferView", true, user, error));
        VSHI_TRY(refer(document, member(item, "sparse", "indices"), "bufferView", true, user, error));
        VSHI_TRY(refer(document, member(item, "sparse", "values"), "bufferView", true, user, error));
    }
    json_array_foreach(json_object_get(root, "images"), i, item) {
        VSHI_TRY(refer(document, item, "bufferView", true, user, error));
    }
    return VSH_OK;
}

static vsh_result note(vshi_lit_document *document, json_t *object, const char *key, bool view, void *user,
                       vsh_error *error) {
    vshi_lit_uses *uses = user;
    size_t index;
    (void)document;
    (void)error;
    if (vshi_gltf_count(object, key, SIZE_MAX, &index) &&
        index < (view ? uses->view_count : uses->accessor_count)) {
        (view ? uses->views : uses->accessors)[index] = true;
    }
    return VSH_OK;
}

vsh_result vshi_lit_uses_find(vshi_lit_document *document, vshi_lit_uses *uses, vsh_error *error) {
    vshi_gltf *gltf = &document->gltf;
    *uses = (vshi_lit_uses){.accessor_count = json_array_size(json_object_get(gltf->root, "accessors")),
                            .view_count = json_array_size(json_object_get(gltf->root, "bufferViews"))};
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&uses->accessors, uses->accessor_count, sizeof(bool), error));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&uses->views, uses->view_count, sizeof(bool), error));
    VSHI_TRY(find_textures(document, &uses->textures, error));
    return walk(document, note, uses, error);
}

void vshi_lit_uses_free(vshi_lit_uses *uses) {
    free_textures(&uses->textures);
    free(uses->accessors);
    free(uses->views);
    *uses = (vshi_lit_uses){.accessors = NULL};
}

/* --- extensions */

/* Those that refer to no accessor and no buffer view but by what is walked through above, and to textures,
 * images and samplers as the functions above say. */
static bool is_known(const char *name) {
    static const char *const names[] = {"KHR_draco_mesh_compression",
                                        "EXT_mesh_gpu_instancing",
                                        "KHR_mesh_quantization",
                                        "EXT_meshopt_compression",
                                        "KHR_meshopt_compression",
                                        "KHR_lights_punctual",
                                        "KHR_animation_pointer",
                                        "KHR_node_visibility",
                                        "KHR_xmp_json_ld",
                                        "MOZ_lightmap"};
    static const char *const beginnings[] = {"KHR_materials_", "KHR_texture_", "EXT_texture_",
                                             "EXT_materials_"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        if (strcmp(name, names[i]) == 0) {
            return true;
        }
    }
    for (size_t i = 0; i < sizeof beginnings / sizeof beginnings[0]; ++i) {
        if (strncmp(name, beginnings[i], strlen(beginnings[i])) == 0) {
            return true;
        }
    }
    return false;
}

/* Whether all extensions of an object, and of what is in it, are known. */
static bool knows_all(json_t *value) {
    const char *name, *extension;
    json_t *item, *inner;
    size_t i;
    json_array_foreach(value, i, item) {
        if (!knows_all(item)) {
            return false;
        }
    }
    json_object_foreach(value, name, item) {
        if (strcmp(name, "extensions") == 0) {
            json_object_foreach(item, extension, inner) {
                if (!is_known(extension)) {
                    return false;
                }
            }
        }
        if (!knows_all(item)) {
            return false;
        }
    }
    return true;
}

/* --- moving new items */

typedef struct moving {
    placing accessors, views;
} moving;

static vsh_result rename_one(vshi_lit_document *document, json_t *object, const char *key, bool view,
                             void *user, vsh_error *error) {
    const moving *m = user;
    return rename_index(document, view ? &m->views : &m->accessors, object, key, error);
}

/* before[count] becomes what was used then and is not any more. */
static void keep_gone(bool *before, const bool *after, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        before[i] = before[i] && !after[i];
    }
}

/* --- bytes */

static int compare_ranges(const void *a, const void *b) {
    const vshi_lit_range *one = a, *other = b;
    return one->buffer != other->buffer ? (one->buffer < other->buffer ? -1 : 1)
           : one->begin != other->begin ? (one->begin < other->begin ? -1 : 1)
                                        : 0;
}

static void add_range(const vshi_lit_document *document, const json_t *view, vshi_lit_range *list,
                      size_t *count) {
    size_t buffer, offset, length;
    if (vshi_gltf_count(view, "buffer", SIZE_MAX, &buffer) && buffer < document->gltf.buffer_count &&
        vshi_gltf_count(view, "byteOffset", 0, &offset) && vshi_gltf_count(view, "byteLength", 0, &length) &&
        length <= SIZE_MAX - offset) {
        list[(*count)++] = (vshi_lit_range){buffer, offset, offset + length};
    }
}

/* The bytes of a view, and of the extension by which it is compressed: two ranges at most. */
static void add_ranges(const vshi_lit_document *document, json_t *view, vshi_lit_range *list, size_t *count) {
    add_range(document, view, list, count);
    const json_t *compressed = member(view, "extensions", "EXT_meshopt_compression");
    compressed = compressed != NULL ? compressed : member(view, "extensions", "KHR_meshopt_compression");
    if (compressed != NULL) {
        add_range(document, compressed, list, count);
    }
}

/* What of `range` is in none of kept[count], which are sorted and apart: whole eights, so that what follows
 * stays aligned. */
static void subtract(vshi_lit_document *document, vshi_lit_range range, const vshi_lit_range *kept,
                     size_t count) {
    enum { ALIGNMENT = 8 };
    size_t begin = range.begin;
    if (range.end <= SIZE_MAX - ALIGNMENT) { /* with what pads it */
        range.end = (range.end + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    }
    for (size_t i = 0; i <= count; ++i) {
        const bool last = i == count;
        if (!last && (kept[i].buffer != range.buffer || kept[i].end <= begin || kept[i].begin >= range.end)) {
            continue;
        }
        const size_t end = last ? range.end : kept[i].begin;
        const size_t low = (begin + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT,
                     high = end / ALIGNMENT * ALIGNMENT;
        if (high > low && end > begin) {
            document->dropped[document->dropped_count++] = (vshi_lit_range){range.buffer, low, high};
        }
        begin = last ? begin : kept[i].end;
    }
}

/* Overlapping ranges become one. */
static size_t merge(vshi_lit_range *list, size_t count) {
    size_t merged = 0;
    qsort(list, count, sizeof *list, compare_ranges);
    for (size_t i = 0; i < count; ++i) {
        vshi_lit_range *last = merged > 0 ? &list[merged - 1] : NULL;
        if (last != NULL && last->buffer == list[i].buffer && list[i].begin <= last->end) {
            last->end = list[i].end > last->end ? list[i].end : last->end;
        } else {
            list[merged++] = list[i];
        }
    }
    return merged;
}

/* Bytes of views that are replaced and that no other view has. Where two views that stay part a replaced one,
 * each part is one more: there are no more than twice as many as views. */
static vsh_result drop_bytes(vshi_lit_document *document, const bool *replaced, vsh_error *error) {
    vshi_gltf *gltf = &document->gltf;
    const size_t most = 2 * document->first_view + 1;
    vshi_lit_range *kept = NULL, *gone = NULL;
    size_t kept_count = 0, gone_count = 0, i;
    json_t *view;
    vsh_result result;
    VSHI_TRY_DONE(vshi_gltf_allocate(gltf, (void **)&kept, most, sizeof *kept, error));
    VSHI_TRY_DONE(vshi_gltf_allocate(gltf, (void **)&gone, most, sizeof *gone, error));
    VSHI_TRY_DONE(
        vshi_gltf_allocate(gltf, (void **)&document->dropped, 2 * most, sizeof *document->dropped, error));
    json_array_foreach(json_object_get(gltf->root, "bufferViews"), i, view) {
        if (i < document->first_view) {
            add_ranges(document, view, replaced[i] ? gone : kept, replaced[i] ? &gone_count : &kept_count);
        }
    }
    kept_count = merge(kept, kept_count);
    gone_count = merge(gone, gone_count);
    for (i = 0; i < gone_count; ++i) {
        subtract(document, gone[i], kept, kept_count);
    }
done:
    free(gone);
    free(kept);
    return result;
}

static vsh_result prune(vshi_lit_document *document, vshi_lit_uses *before, vshi_lit_uses *after, moving *m,
                        bool *replaced, vsh_error *error) {
    VSHI_TRY(prune_textures(document, &before->textures, &after->textures, error));
    /* views of accessors that are no longer used are not either */
    keep_gone(before->accessors, after->accessors, before->accessor_count);
    VSHI_TRY(find_places(document, before->accessors, before->accessor_count, after->accessor_count,
                         &m->accessors, error));
    VSHI_TRY(walk(document, rename_one, m, error)); /* views are not moved yet */
    VSHI_TRY(move_items(document, "accessors", &m->accessors, error));
    vshi_lit_uses_free(after);
    VSHI_TRY(vshi_lit_uses_find(document, after, error));
    keep_gone(before->views, after->views, before->view_count);
    VSHI_TRY(find_places(document, before->views, before->view_count, after->view_count, &m->views, error));
    mark_places(&m->views, replaced);
    VSHI_TRY(drop_bytes(document, replaced, error)); /* while they still say which */
    m->accessors.first = m->accessors.count;         /* they have been moved */
    VSHI_TRY(walk(document, rename_one, m, error));
    VSHI_TRY(move_items(document, "bufferViews", &m->views, error));
    document->replaced = replaced;
    return VSH_OK;
}

vsh_result vshi_lit_prune(vshi_lit_document *document, vshi_lit_uses *before, vsh_error *error) {
    if (!knows_all(document->gltf.root)) {
        return VSH_OK;
    }
    vshi_lit_uses after = {.accessors = NULL};
    moving m = {.accessors = {.moved = NULL}};
    bool *replaced = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_lit_uses_find(document, &after, error));
    VSHI_TRY_DONE(
        vshi_gltf_allocate(&document->gltf, (void **)&replaced, before->view_count, sizeof *replaced, error));
    VSHI_TRY_DONE(prune(document, before, &after, &m, replaced, error));
done:
    if (document->replaced == NULL) {
        free(replaced);
    }
    free(m.views.moved);
    free(m.accessors.moved);
    vshi_lit_uses_free(&after);
    return result;
}
