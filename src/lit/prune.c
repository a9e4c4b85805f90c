#include "lit/prune.h"

#include "lit/own_textures.h"
#include "lit/places.h"

#include <stdlib.h>
#include <string.h>

/* --- who refers to what */

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
    VSHI_TRY(vshi_lit_textures_find(document, &uses->textures, error));
    return walk(document, note, uses, error);
}

void vshi_lit_uses_free(vshi_lit_uses *uses) {
    vshi_lit_textures_free(&uses->textures);
    free(uses->accessors);
    free(uses->views);
    *uses = (vshi_lit_uses){.accessors = NULL};
}

/* --- extensions */

/* Those that refer to no accessor and no buffer view but by what is walked through above, and to textures,
 * images and samplers as lit/own_textures.c says. */
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

/* --- new ones into old places */

typedef struct moving {
    vshi_lit_places accessors, views;
} moving;

static vsh_result rename_one(vshi_lit_document *document, json_t *object, const char *key, bool view,
                             void *user, vsh_error *error) {
    const moving *m = user;
    return vshi_lit_places_rename(document, view ? &m->views : &m->accessors, object, key, error);
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
    VSHI_TRY(vshi_lit_textures_prune(document, &before->textures, &after->textures, error));
    /* views of accessors that are no longer used are not either */
    keep_gone(before->accessors, after->accessors, before->accessor_count);
    VSHI_TRY(vshi_lit_places_find(document, before->accessors, before->accessor_count, after->accessor_count,
                                  &m->accessors, error));
    VSHI_TRY(walk(document, rename_one, m, error)); /* views are not moved yet */
    VSHI_TRY(vshi_lit_places_move(document, "accessors", &m->accessors, error));
    vshi_lit_uses_free(after);
    VSHI_TRY(vshi_lit_uses_find(document, after, error));
    keep_gone(before->views, after->views, before->view_count);
    VSHI_TRY(vshi_lit_places_find(document, before->views, before->view_count, after->view_count, &m->views,
                                  error));
    vshi_lit_places_mark(&m->views, replaced);
    VSHI_TRY(drop_bytes(document, replaced, error)); /* while they still say which */
    m->accessors.first = m->accessors.count;         /* they have been moved */
    VSHI_TRY(walk(document, rename_one, m, error));
    VSHI_TRY(vshi_lit_places_move(document, "bufferViews", &m->views, error));
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
