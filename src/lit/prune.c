/* Textures, accessors, buffer views and bytes that nothing refers to any more. New items of a list take the
 * places of those that go, so other items keep their numbers. */
#include "lit/work.h"

#include <stdlib.h>
#include <string.h>

/* Lists of the root, by numbers of vshi_lit_uses. */
enum { ACCESSORS, VIEWS, TEXTURES, IMAGES, SAMPLERS };

static const char *const lists[VSHI_LIT_KINDS] = {"accessors", "bufferViews", "textures", "images",
                                                  "samplers"};

static size_t count_of(const vshi_lit_document *document, int kind) {
    return json_array_size(json_object_get(document->gltf.root, lists[kind]));
}

static json_t *member(json_t *object, const char *first, const char *second) {
    return json_object_get(json_object_get(object, first), second);
}

static const char texture_key[] = "vdbshade_texture";

json_t *vshi_lit_texture_mark(const char *purpose) {
    return json_pack("{s:s}", texture_key, purpose);
}

/* --- references */

/* Called for every item of a list that `object` refers to by `key`. */
typedef void refer_fn(vshi_lit_document *document, json_t *object, const char *key, int kind, void *user);

static void walk_accessors(vshi_lit_document *document, json_t *object, refer_fn *refer, void *user) {
    const char *name;
    json_t *value;
    json_object_foreach(object, name, value) {
        refer(document, object, name, ACCESSORS, user);
    }
}

static void walk_meshes(vshi_lit_document *document, refer_fn *refer, void *user) {
    size_t m, p, t;
    json_t *mesh, *primitive, *target;
    json_array_foreach(json_object_get(document->gltf.root, "meshes"), m, mesh) {
        json_array_foreach(json_object_get(mesh, "primitives"), p, primitive) {
            walk_accessors(document, json_object_get(primitive, "attributes"), refer, user);
            refer(document, primitive, "indices", ACCESSORS, user);
            refer(document, member(primitive, "extensions", "KHR_draco_mesh_compression"), "bufferView",
                  VIEWS, user);
            json_array_foreach(json_object_get(primitive, "targets"), t, target) {
                walk_accessors(document, target, refer, user);
            }
        }
    }
}

/* Textures are found only where a bake puts them: extensions may hold other numbers. */
static void walk(vshi_lit_document *document, refer_fn *refer, void *user) {
    size_t i, k;
    json_t *item, *sampler, *root = document->gltf.root;
    walk_meshes(document, refer, user);
    json_array_foreach(json_object_get(root, "nodes"), i, item) {
        json_t *instancing = member(item, "extensions", "EXT_mesh_gpu_instancing");
        walk_accessors(document, json_object_get(instancing, "attributes"), refer, user);
    }
    json_array_foreach(json_object_get(root, "skins"), i, item) {
        refer(document, item, "inverseBindMatrices", ACCESSORS, user);
    }
    json_array_foreach(json_object_get(root, "animations"), i, item) {
        json_array_foreach(json_object_get(item, "samplers"), k, sampler) {
            refer(document, sampler, "input", ACCESSORS, user);
            refer(document, sampler, "output", ACCESSORS, user);
        }
    }
    json_array_foreach(json_object_get(root, "accessors"), i, item) {
        refer(document, item, "bufferView", VIEWS, user);
        refer(document, member(item, "sparse", "indices"), "bufferView", VIEWS, user);
        refer(document, member(item, "sparse", "values"), "bufferView", VIEWS, user);
    }
    json_array_foreach(json_object_get(root, "images"), i, item) {
        refer(document, item, "bufferView", VIEWS, user);
    }
    json_array_foreach(json_object_get(root, "textures"), i, item) {
        refer(document, item, "source", IMAGES, user);
        refer(document, item, "sampler", SAMPLERS, user);
    }
    json_array_foreach(json_object_get(root, "materials"), i, item) {
        refer(document, json_object_get(item, "occlusionTexture"), "index", TEXTURES, user);
        refer(document, member(item, "extensions", "MOZ_lightmap"), "index", TEXTURES, user);
        refer(document, member(item, "pbrMetallicRoughness", "baseColorTexture"), "index", TEXTURES, user);
    }
}

/* --- items in use */

static void note(const vshi_lit_uses *uses, const json_t *object, const char *key, int kind) {
    size_t index;
    if (vshi_gltf_count(object, key, SIZE_MAX, &index) && index < uses->count[kind]) {
        uses->used[kind][index] = true;
    }
}

static void note_array(vshi_lit_document *document, json_t *object, const char *key, int kind, void *user) {
    (void)document;
    if (kind == ACCESSORS || kind == VIEWS) {
        note(user, object, key, kind);
    }
}

/* Textures at or below `value`, of a material: whatever has an index, as those of extensions have. */
static void note_textures(const vshi_lit_uses *uses, json_t *value) {
    size_t i;
    const char *name;
    json_t *inner;
    note(uses, value, "index", TEXTURES);
    json_array_foreach(value, i, inner) {
        note_textures(uses, inner);
    }
    json_object_foreach(value, name, inner) {
        note_textures(uses, inner);
    }
}

/* Samplers and images of textures that stay, those of other formats too (KHR_texture_basisu). */
static void note_parts(const vshi_lit_uses *uses, const vshi_lit_document *document, const bool *gone,
                       size_t gone_count) {
    size_t i;
    const char *name;
    json_t *texture, *extension;
    json_array_foreach(json_object_get(document->gltf.root, "textures"), i, texture) {
        if (i < gone_count && gone[i]) {
            continue;
        }
        note(uses, texture, "sampler", SAMPLERS);
        note(uses, texture, "source", IMAGES);
        json_object_foreach(json_object_get(texture, "extensions"), name, extension) {
            note(uses, extension, "source", IMAGES);
        }
    }
}

/* Finds those of accessors, views and textures. */
static vsh_result find(vshi_lit_document *document, vshi_lit_uses *uses, vsh_error *error) {
    *uses = (vshi_lit_uses){.count = {0}};
    for (int kind = 0; kind < VSHI_LIT_KINDS; ++kind) {
        const size_t count = count_of(document, kind);
        VSHI_TRY(vshi_gltf_allocate(&document->gltf, (void **)&uses->used[kind], count, sizeof(bool), error));
        uses->count[kind] = count;
    }
    walk(document, note_array, uses);
    note_textures(uses, json_object_get(document->gltf.root, "materials"));
    return VSH_OK;
}

vsh_result vshi_lit_uses_find(vshi_lit_document *document, vshi_lit_uses *uses, vsh_error *error) {
    VSHI_TRY(find(document, uses, error));
    note_parts(uses, document, NULL, 0);
    return VSH_OK;
}

void vshi_lit_uses_free(vshi_lit_uses *uses) {
    for (int kind = 0; kind < VSHI_LIT_KINDS; ++kind) {
        free(uses->used[kind]);
    }
    *uses = (vshi_lit_uses){.count = {0}};
}

/* --- extensions */

/* Those that refer to no accessor and no buffer view but by what is walked through above, and to textures,
 * images and samplers as the functions above say. "_" at the end: whatever begins so. */
static bool is_known(const char *name) {
    static const char *const known[] = {"KHR_draco_mesh_compression",
                                        "EXT_mesh_gpu_instancing",
                                        "KHR_mesh_quantization",
                                        "EXT_meshopt_compression",
                                        "KHR_meshopt_compression",
                                        "KHR_lights_punctual",
                                        "KHR_animation_pointer",
                                        "KHR_node_visibility",
                                        "KHR_xmp_json_ld",
                                        "MOZ_lightmap",
                                        "KHR_materials_",
                                        "KHR_texture_",
                                        "EXT_texture_",
                                        "EXT_materials_"};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; ++i) {
        if (vshi_gltf_is_named(name, known[i])) {
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
    bool known = true;
    json_array_foreach(value, i, item) {
        known = known && knows_all(item);
    }
    json_object_foreach(value, name, item) {
        json_object_foreach(strcmp(name, "extensions") == 0 ? item : NULL, extension, inner) {
            known = known && is_known(extension);
        }
        known = known && knows_all(item);
    }
    return known;
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

/* --- places */

/* Where the items first … count - 1 of a list, which are new, go. */
typedef struct placing {
    int kind;
    size_t *moved; /* [count - first] */
    size_t first, count;
} placing;

static void rename_item(vshi_lit_document *document, json_t *object, const char *key, int kind, void *user) {
    const placing *places = user;
    size_t index;
    if (kind == places->kind && vshi_gltf_count(object, key, SIZE_MAX, &index) && index >= places->first &&
        index < places->count) {
        vshi_lit_set_number(document, object, key, places->moved[index - places->first]);
    }
}

/* Finds places for the new items: those that are gone, in order, then places behind the old items. Places
 * left at the end are cut off. Returns how many items are left. */
static size_t find_places(const placing *places, const bool *gone) {
    const size_t first = places->first, more = places->count - first;
    size_t done = 0, behind = 0; /* behind: the places that are taken */
    for (size_t i = 0; i < first && done < more; ++i) {
        if (gone[i]) {
            places->moved[done++] = i;
            behind = i + 1;
        }
    }
    size_t end = first + more - done;
    for (size_t i = first; done < more; ++i) {
        places->moved[done++] = i;
    }
    while (end <= first && end > behind && gone[end - 1]) {
        --end;
    }
    return end;
}

/* Marks views whose places are taken or cut off, and drops bytes that only they had. */
static vsh_result replace_views(vshi_lit_document *document, const placing *places, size_t end,
                                vsh_error *error) {
    VSHI_TRY(vshi_gltf_allocate(&document->gltf, (void **)&document->replaced, places->first, sizeof(bool),
                                error));
    for (size_t i = 0; i < places->count - places->first && places->moved[i] < places->first; ++i) {
        document->replaced[places->moved[i]] = true;
    }
    for (size_t i = end; i < places->first; ++i) {
        document->replaced[i] = true;
    }
    return drop_bytes(document, document->replaced, error);
}

/* Moves the new items of a list. gone[before->count[kind]]: old ones that go. */
static vsh_result replace(vshi_lit_document *document, const vshi_lit_uses *before, int kind,
                          vsh_error *error) {
    json_t *list = json_object_get(document->gltf.root, lists[kind]);
    placing places = {.kind = kind, .first = before->count[kind], .count = json_array_size(list)};
    vsh_result result;
    VSHI_TRY_DONE(vshi_gltf_allocate(&document->gltf, (void **)&places.moved, places.count - places.first,
                                     sizeof *places.moved, error));
    const size_t end = find_places(&places, before->used[kind]);
    if (kind == VIEWS) { /* while they still say which */
        VSHI_TRY_DONE(replace_views(document, &places, end, error));
    }
    walk(document, rename_item, &places);
    for (size_t i = places.first; i < places.count; ++i) {
        const size_t to = places.moved[i - places.first]; /* never behind i */
        document->refused |= to != i && json_array_set(list, to, json_array_get(list, i)) != 0;
    }
    while (json_array_size(list) > end) {
        json_array_remove(list, json_array_size(list) - 1);
    }
    if (end == 0 && places.count > 0) { /* glTF has no empty lists */
        json_object_del(document->gltf.root, lists[kind]);
    }
done:
    free(places.moved);
    return result;
}

/* Leaves the items in `before` that were used then and are not used any more. */
static void keep_gone(const vshi_lit_uses *before, const vshi_lit_uses *after, int kind) {
    for (size_t i = 0; i < before->count[kind]; ++i) {
        before->used[kind][i] = before->used[kind][i] && !after->used[kind][i];
    }
}

static vsh_result prune(vshi_lit_document *document, vshi_lit_uses *before, vshi_lit_uses *after,
                        vsh_error *error) {
    size_t i;
    const json_t *texture;
    VSHI_TRY(find(document, after, error));
    keep_gone(before, after, ACCESSORS);
    keep_gone(before, after, TEXTURES);
    json_array_foreach(json_object_get(document->gltf.root, "textures"), i, texture) {
        if (i < before->count[TEXTURES] &&
            json_object_get(json_object_get(texture, "extras"), texture_key) == NULL) {
            before->used[TEXTURES][i] = false; /* the file's own stay */
        }
    }
    note_parts(after, document, before->used[TEXTURES], before->count[TEXTURES]);
    keep_gone(before, after, IMAGES);
    keep_gone(before, after, SAMPLERS);
    VSHI_TRY(replace(document, before, TEXTURES, error));
    VSHI_TRY(replace(document, before, IMAGES, error));
    VSHI_TRY(replace(document, before, SAMPLERS, error));
    VSHI_TRY(replace(document, before, ACCESSORS, error));
    /* views of accessors that are no longer used are not either */
    vshi_lit_uses_free(after);
    VSHI_TRY(find(document, after, error));
    keep_gone(before, after, VIEWS);
    return replace(document, before, VIEWS, error);
}

vsh_result vshi_lit_prune(vshi_lit_document *document, vshi_lit_uses *before, vsh_error *error) {
    vshi_lit_uses after = {.count = {0}};
    if (!knows_all(document->gltf.root)) {
        return VSH_OK;
    }
    const vsh_result result = prune(document, before, &after, error);
    vshi_lit_uses_free(&after);
    return result;
}
