/* Removes textures, accessors, buffer views and bytes that nothing refers to any more. New items of a list
 * move to the places of removed ones, so other items keep their numbers. */
#include "io/lit/work.h"

#include <stdlib.h>
#include <string.h>

/* Lists of the root, by numbers of vshi_lit_uses. */
enum { ACCESSORS, VIEWS, TEXTURES, IMAGES, SAMPLERS };

static const char *const lists[VSHI_LIT_KINDS] = {"accessors", "bufferViews", "textures", "images",
                                                  "samplers"};

static size_t count_items(const vshi_lit_work *work, int kind) {
    return json_array_size(json_object_get(work->gltf.root, lists[kind]));
}

/* A member of a member of an object; NULL in place of a name: the object itself. */
static json_t *find_member(json_t *object, const char *first, const char *second) {
    object = first != NULL ? json_object_get(object, first) : object;
    return second != NULL ? json_object_get(object, second) : object;
}

static const char texture_key[] = "vdbshade_texture";

json_t *vshi_lit_mark_texture(const char *purpose) {
    return json_pack("{s:s}", texture_key, purpose);
}

/* --- references */

/* Called for every item of a list that `object` refers to by `key`. */
typedef void refer_fn(vshi_lit_work *work, json_t *object, const char *key, int kind, void *user);

static void walk_accessors(vshi_lit_work *work, json_t *object, refer_fn *refer, void *user) {
    const char *name;
    json_t *value;
    json_object_foreach(object, name, value) {
        refer(work, object, name, ACCESSORS, user);
    }
}

static void walk_meshes(vshi_lit_work *work, refer_fn *refer, void *user) {
    size_t m, p, t;
    json_t *mesh, *primitive, *target;
    json_array_foreach(json_object_get(work->gltf.root, "meshes"), m, mesh) {
        json_array_foreach(json_object_get(mesh, "primitives"), p, primitive) {
            walk_accessors(work, json_object_get(primitive, "attributes"), refer, user);
            refer(work, primitive, "indices", ACCESSORS, user);
            refer(work, find_member(primitive, "extensions", "KHR_draco_mesh_compression"), "bufferView",
                  VIEWS, user);
            json_array_foreach(json_object_get(primitive, "targets"), t, target) {
                walk_accessors(work, target, refer, user);
            }
        }
    }
}

/* References of the items of root lists: `key` of a member of a member (NULL: of the item itself). Textures
 * are listed only where a bake sets them: extensions may hold other numbers. */
static const struct {
    const char *list, *first, *second, *key;
    int kind;
} references[] = {{"skins", NULL, NULL, "inverseBindMatrices", ACCESSORS},
                  {"accessors", NULL, NULL, "bufferView", VIEWS},
                  {"accessors", "sparse", "indices", "bufferView", VIEWS},
                  {"accessors", "sparse", "values", "bufferView", VIEWS},
                  {"images", NULL, NULL, "bufferView", VIEWS},
                  {"textures", NULL, NULL, "source", IMAGES},
                  {"textures", NULL, NULL, "sampler", SAMPLERS},
                  {"materials", "occlusionTexture", NULL, "index", TEXTURES},
                  {"materials", "extensions", "MOZ_lightmap", "index", TEXTURES},
                  {"materials", "pbrMetallicRoughness", "baseColorTexture", "index", TEXTURES}};

static void walk(vshi_lit_work *work, refer_fn *refer, void *user) {
    size_t i, k;
    json_t *item, *sampler, *root = work->gltf.root;
    walk_meshes(work, refer, user);
    json_array_foreach(json_object_get(root, "nodes"), i, item) {
        json_t *instancing = find_member(item, "extensions", "EXT_mesh_gpu_instancing");
        walk_accessors(work, json_object_get(instancing, "attributes"), refer, user);
    }
    json_array_foreach(json_object_get(root, "animations"), i, item) {
        json_array_foreach(json_object_get(item, "samplers"), k, sampler) {
            refer(work, sampler, "input", ACCESSORS, user);
            refer(work, sampler, "output", ACCESSORS, user);
        }
    }
    for (size_t r = 0; r < sizeof references / sizeof references[0]; ++r) {
        json_array_foreach(json_object_get(root, references[r].list), i, item) {
            refer(work, find_member(item, references[r].first, references[r].second), references[r].key,
                  references[r].kind, user);
        }
    }
}

/* --- items in use */

static void mark_used(const vshi_lit_uses *uses, const json_t *object, const char *key, int kind) {
    size_t index;
    if (vshi_gltf_count(object, key, SIZE_MAX, &index) && index < uses->count[kind]) {
        uses->used[kind][index] = true;
    }
}

static void mark_array(vshi_lit_work *work, json_t *object, const char *key, int kind, void *user) {
    (void)work;
    if (kind == ACCESSORS || kind == VIEWS) {
        mark_used(user, object, key, kind);
    }
}

/* Marks textures in a part of a material: every object with an index, also in extensions. */
static void mark_textures(const vshi_lit_uses *uses, json_t *value) {
    size_t i;
    const char *name;
    json_t *inner;
    mark_used(uses, value, "index", TEXTURES);
    json_array_foreach(value, i, inner) {
        mark_textures(uses, inner);
    }
    json_object_foreach(value, name, inner) {
        mark_textures(uses, inner);
    }
}

/* Marks samplers and images of textures that stay, also those of other formats (KHR_texture_basisu). */
static void mark_parts(const vshi_lit_uses *uses, const vshi_lit_work *work, const bool *gone,
                       size_t gone_count) {
    size_t i;
    const char *name;
    json_t *texture, *extension;
    json_array_foreach(json_object_get(work->gltf.root, "textures"), i, texture) {
        if (i < gone_count && gone[i]) {
            continue;
        }
        mark_used(uses, texture, "sampler", SAMPLERS);
        mark_used(uses, texture, "source", IMAGES);
        json_object_foreach(json_object_get(texture, "extensions"), name, extension) {
            mark_used(uses, extension, "source", IMAGES);
        }
    }
}

/* Finds the used accessors, views and textures. */
static vsh_result find_arrays(vshi_lit_work *work, vshi_lit_uses *uses, vsh_error *error) {
    *uses = (vshi_lit_uses){.count = {0}};
    for (int kind = 0; kind < VSHI_LIT_KINDS; ++kind) {
        const size_t count = count_items(work, kind);
        VSHI_TRY(vshi_gltf_allocate(&work->gltf, (void **)&uses->used[kind], count, sizeof(bool), error));
        uses->count[kind] = count;
    }
    walk(work, mark_array, uses);
    mark_textures(uses, json_object_get(work->gltf.root, "materials"));
    return VSH_OK;
}

vsh_result vshi_lit_find_uses(vshi_lit_work *work, vshi_lit_uses *uses, vsh_error *error) {
    VSHI_TRY(find_arrays(work, uses, error));
    mark_parts(uses, work, NULL, 0);
    return VSH_OK;
}

void vshi_lit_uses_free(vshi_lit_uses *uses) {
    for (int kind = 0; kind < VSHI_LIT_KINDS; ++kind) {
        free(uses->used[kind]);
    }
    *uses = (vshi_lit_uses){.count = {0}};
}

/* --- extensions */

/* Whether walk() and mark_textures() find all references of an extension. "_" at the end: all names that
 * begin so. */
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

/* Whether all extensions in a value are known. */
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

/* Where a range of a buffer begins (1) or ends (-1), whose view stays (kept) or is replaced (gone). */
typedef struct edge {
    size_t buffer, at;
    int kept, gone;
} edge;

static int compare_edges(const void *a, const void *b) {
    const edge *one = a, *other = b;
    return one->buffer != other->buffer ? (one->buffer < other->buffer ? -1 : 1)
                                        : (one->at > other->at) - (one->at < other->at);
}

/* Adds the edges of a view. Multiples of 8 bytes are dropped, so that later bytes stay aligned. */
static void add_edges(const vshi_lit_work *work, const json_t *view, bool kept, edge *edges, size_t *count) {
    enum { ALIGNMENT = 8 };
    static const size_t most = SIZE_MAX / 4; /* more than any buffer has */
    size_t buffer, offset, length;
    if (!vshi_gltf_count(view, "buffer", SIZE_MAX, &buffer) || buffer >= work->gltf.buffer_count ||
        !vshi_gltf_count(view, "byteOffset", 0, &offset) || offset > most ||
        !vshi_gltf_count(view, "byteLength", 0, &length)) {
        return;
    }
    const size_t end = offset + (length < most ? length : most);
    const size_t from = (offset + (kept ? 0 : ALIGNMENT - 1)) / ALIGNMENT * ALIGNMENT;
    edges[(*count)++] = (edge){buffer, from, kept, !kept};
    edges[(*count)++] = (edge){buffer, (end + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT, -kept, -!kept};
}

/* Lists the bytes of replaced views that no other view has. */
static vsh_result drop_bytes(vshi_lit_work *work, vsh_error *error) {
    static const char *const compressions[] = {"EXT_meshopt_compression", "KHR_meshopt_compression"};
    const size_t most = 6 * work->first_view; /* a view has edges of its own and of each compression */
    edge *edges;
    size_t count = 0, i;
    int kept = 0, gone = 0;
    json_t *view;
    VSHI_TRY(vshi_gltf_allocate(&work->gltf, (void **)&work->dropped.list, most, sizeof *work->dropped.list,
                                error));
    VSHI_TRY(vshi_gltf_allocate(&work->gltf, (void **)&edges, most, sizeof *edges, error));
    json_array_foreach(json_object_get(work->gltf.root, "bufferViews"), i, view) {
        if (i < work->first_view) {
            add_edges(work, view, !work->replaced[i], edges, &count);
            for (size_t k = 0; k < sizeof compressions / sizeof compressions[0]; ++k) {
                const json_t *compressed = find_member(view, "extensions", compressions[k]);
                if (compressed != NULL) {
                    add_edges(work, compressed, !work->replaced[i], edges, &count);
                }
            }
        }
    }
    if (count > 0) {
        qsort(edges, count, sizeof *edges, compare_edges);
    }
    for (i = 0; i < count; ++i) {
        if (gone > 0 && kept == 0 && edges[i].at > edges[i - 1].at) {
            work->dropped.list[work->dropped.count++] =
                (vshi_lit_range){edges[i].buffer, edges[i - 1].at, edges[i].at};
        }
        kept += edges[i].kept;
        gone += edges[i].gone;
    }
    free(edges);
    return VSH_OK;
}

/* --- places */

/* The places of the new items of a list, first … count - 1. */
typedef struct placing {
    int kind;
    size_t *moved; /* [count - first] */
    size_t first, count;
} placing;

static void rename_item(vshi_lit_work *work, json_t *object, const char *key, int kind, void *user) {
    const placing *places = user;
    size_t index;
    if (kind == places->kind && vshi_gltf_count(object, key, SIZE_MAX, &index) && index >= places->first &&
        index < places->count) {
        vshi_lit_set_number(work, object, key, places->moved[index - places->first]);
    }
}

/* Finds places for the new items: those of removed items in order, then places behind the old items. Removed
 * items at the end are cut off. Returns how many items are left. */
static size_t find_places(const placing *places, const bool *gone) {
    const size_t first = places->first, more = places->count - first;
    size_t done = 0, behind = 0; /* behind: the first place behind the taken ones */
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

/* Marks views whose places are taken or cut off, and drops their bytes. */
static vsh_result replace_views(vshi_lit_work *work, const placing *places, size_t end, vsh_error *error) {
    VSHI_TRY(vshi_gltf_allocate(&work->gltf, (void **)&work->replaced, places->first, sizeof(bool), error));
    for (size_t i = 0; i < places->count - places->first && places->moved[i] < places->first; ++i) {
        work->replaced[places->moved[i]] = true;
    }
    for (size_t i = end; i < places->first; ++i) {
        work->replaced[i] = true;
    }
    return drop_bytes(work, error);
}

/* Moves the new items of a list to the places of the removed ones, which `before` has. */
static vsh_result move_items(vshi_lit_work *work, const vshi_lit_uses *before, int kind, vsh_error *error) {
    json_t *list = json_object_get(work->gltf.root, lists[kind]);
    placing places = {.kind = kind, .first = before->count[kind], .count = json_array_size(list)};
    vsh_result result = VSH_OK;
    VSHI_TRY(vshi_gltf_allocate(&work->gltf, (void **)&places.moved, places.count - places.first,
                                sizeof *places.moved, error));
    const size_t end = find_places(&places, before->used[kind]);
    if (kind == VIEWS) { /* before items move */
        VSHI_TRY_DONE(replace_views(work, &places, end, error));
    }
    walk(work, rename_item, &places);
    for (size_t i = places.first; i < places.count; ++i) {
        const size_t to = places.moved[i - places.first]; /* at most i */
        work->refused |= to != i && json_array_set(list, to, json_array_get(list, i)) != 0;
    }
    while (json_array_size(list) > end) {
        json_array_remove(list, json_array_size(list) - 1);
    }
    if (end == 0 && places.count > 0) { /* glTF has no empty lists */
        json_object_del(work->gltf.root, lists[kind]);
    }
done:
    free(places.moved);
    return result;
}

/* Leaves those items in `before` that are not used any more. */
static void keep_unused(const vshi_lit_uses *before, const vshi_lit_uses *after, int kind) {
    for (size_t i = 0; i < before->count[kind]; ++i) {
        before->used[kind][i] = before->used[kind][i] && !after->used[kind][i];
    }
}

vsh_result vshi_lit_prune(vshi_lit_work *work, vshi_lit_uses *before, vsh_error *error) {
    vshi_lit_uses after = {.count = {0}};
    size_t i;
    const json_t *texture;
    vsh_result result;
    if (!knows_all(work->gltf.root)) {
        return VSH_OK;
    }
    VSHI_TRY_DONE(find_arrays(work, &after, error));
    keep_unused(before, &after, ACCESSORS);
    keep_unused(before, &after, TEXTURES);
    json_array_foreach(json_object_get(work->gltf.root, "textures"), i, texture) {
        if (i < before->count[TEXTURES] &&
            json_object_get(json_object_get(texture, "extras"), texture_key) == NULL) {
            before->used[TEXTURES][i] = false; /* the file's own textures stay */
        }
    }
    mark_parts(&after, work, before->used[TEXTURES], before->count[TEXTURES]);
    keep_unused(before, &after, IMAGES);
    keep_unused(before, &after, SAMPLERS);
    VSHI_TRY_DONE(move_items(work, before, TEXTURES, error));
    VSHI_TRY_DONE(move_items(work, before, IMAGES, error));
    VSHI_TRY_DONE(move_items(work, before, SAMPLERS, error));
    VSHI_TRY_DONE(move_items(work, before, ACCESSORS, error));
    vshi_lit_uses_free(&after); /* fewer accessors use fewer views */
    VSHI_TRY_DONE(find_arrays(work, &after, error));
    keep_unused(before, &after, VIEWS);
    result = move_items(work, before, VIEWS, error);
done:
    vshi_lit_uses_free(&after);
    return result;
}
