/* Removes accessors and buffer views that nothing refers to, and textures of earlier bakes with their images
 * and samplers, and numbers the other items anew. */
#include "io/lit/work.h"

#include <stdlib.h>
#include <string.h>

enum { ACCESSORS, VIEWS, TEXTURES, IMAGES, SAMPLERS, KINDS };

static const char *const lists[KINDS] = {"accessors", "bufferViews", "textures", "images", "samplers"};

typedef struct pruning {
    vshi_lit_work *work;
    size_t count[KINDS];
    bool *kept[KINDS];     /* [count] */
    size_t *number[KINDS]; /* [count]: the new numbers, once they are known; NULL before */
} pruning;

static const char texture_key[] = "vdbshade_texture";

json_t *vshi_lit_mark_texture(const char *purpose) {
    return json_pack("{s:s}", texture_key, purpose);
}

/* --- references */

/* Keeps the item of a list that `object` refers to by `key` or, once there are new numbers, sets its number.
 */
static void refer(pruning *p, json_t *object, const char *key, int kind) {
    size_t index;
    if (!vshi_gltf_count(object, key, SIZE_MAX, &index) || index >= p->count[kind]) {
        return;
    }
    if (p->number[kind] == NULL) {
        p->kept[kind][index] = true;
    } else if (p->number[kind][index] != index) {
        vshi_lit_set_number(p->work, object, key, p->number[kind][index]);
    }
}

static void refer_accessors(pruning *p, json_t *object) {
    const char *name;
    json_t *value;
    json_object_foreach(object, name, value) {
        refer(p, object, name, ACCESSORS);
    }
}

/* Every object in a material with an index is a texture, also in extensions. */
static void refer_textures(pruning *p, json_t *value) {
    size_t i;
    const char *name;
    json_t *inner;
    refer(p, value, "index", TEXTURES);
    json_array_foreach(value, i, inner) {
        refer_textures(p, inner);
    }
    json_object_foreach(value, name, inner) {
        refer_textures(p, inner);
    }
}

static void refer_primitive(pruning *p, json_t *primitive) {
    size_t i;
    json_t *target;
    refer_accessors(p, json_object_get(primitive, "attributes"));
    refer(p, primitive, "indices", ACCESSORS);
    refer(p, vshi_gltf_extension(primitive, "KHR_draco_mesh_compression"), "bufferView", VIEWS);
    json_array_foreach(json_object_get(primitive, "targets"), i, target) {
        refer_accessors(p, target);
    }
}

/* References of meshes, nodes, skins, animations and materials, which all stay. */
static void refer_roots(pruning *p) {
    size_t i, k;
    json_t *item, *inner, *root = p->work->gltf.root;
    json_array_foreach(json_object_get(root, "meshes"), i, item) {
        json_array_foreach(json_object_get(item, "primitives"), k, inner) {
            refer_primitive(p, inner);
        }
    }
    json_array_foreach(json_object_get(root, "nodes"), i, item) {
        refer_accessors(p,
                        json_object_get(vshi_gltf_extension(item, "EXT_mesh_gpu_instancing"), "attributes"));
    }
    json_array_foreach(json_object_get(root, "skins"), i, item) {
        refer(p, item, "inverseBindMatrices", ACCESSORS);
    }
    json_array_foreach(json_object_get(root, "animations"), i, item) {
        json_array_foreach(json_object_get(item, "samplers"), k, inner) {
            refer(p, inner, "input", ACCESSORS);
            refer(p, inner, "output", ACCESSORS);
        }
    }
    refer_textures(p, json_object_get(root, "materials"));
}

/* References of the kept items of a list. A texture may have images of other formats (KHR_texture_basisu). */
static void refer_items(pruning *p, int kind) {
    size_t i;
    const char *name;
    json_t *item, *sparse, *extension;
    json_array_foreach(json_object_get(p->work->gltf.root, lists[kind]), i, item) {
        if (p->number[kind] == NULL && !p->kept[kind][i]) {
            continue;
        }
        if (kind == TEXTURES) {
            refer(p, item, "sampler", SAMPLERS);
            refer(p, item, "source", IMAGES);
            json_object_foreach(json_object_get(item, "extensions"), name, extension) {
                refer(p, extension, "source", IMAGES);
            }
        } else {
            sparse = json_object_get(item, "sparse");
            refer(p, item, "bufferView", VIEWS);
            refer(p, json_object_get(sparse, "indices"), "bufferView", VIEWS);
            refer(p, json_object_get(sparse, "values"), "bufferView", VIEWS);
        }
    }
}

/* --- extensions */

/* Whether the functions above find all references of an extension. "_" at the end: all names that begin so.
 */
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

/* --- items */

/* Keeps the file's own textures, those of this bake, which are the last, and others that a material shows.
 * With a texture go its images and samplers, unless a kept one has them, too. */
static void keep_textures(pruning *p) {
    const size_t own = p->count[TEXTURES] - p->work->options->image_count;
    size_t i;
    json_t *texture;
    bool *shown = p->kept[TEXTURES];
    json_array_foreach(json_object_get(p->work->gltf.root, lists[TEXTURES]), i, texture) {
        const bool marked = json_object_get(json_object_get(texture, "extras"), texture_key) != NULL;
        shown[i] = !(shown[i] || i >= own || !marked);
    }
    refer_items(p, TEXTURES); /* of textures that go */
    for (int kind = TEXTURES; kind < KINDS; ++kind) {
        for (i = 0; i < p->count[kind]; ++i) {
            p->kept[kind][i] = !p->kept[kind][i];
        }
    }
    refer_items(p, TEXTURES);
}

/* Removes the items of a list that are not kept, and finds the numbers of the others. */
static vsh_result remove_items(pruning *p, int kind, vsh_error *error) {
    json_t *root = p->work->gltf.root, *list = json_object_get(root, lists[kind]);
    size_t left = 0;
    VSHI_TRY(vshi_gltf_allocate(&p->work->gltf, (void **)&p->number[kind], p->count[kind],
                                sizeof *p->number[kind], error));
    for (size_t i = 0; i < p->count[kind]; ++i) {
        p->number[kind][i] = left;
        if (p->kept[kind][i]) {
            p->work->refused |= left != i && json_array_set(list, left, json_array_get(list, i)) != 0;
            ++left;
        }
    }
    while (json_array_size(list) > left) {
        json_array_remove(list, json_array_size(list) - 1);
    }
    if (left == 0) { /* glTF has no empty lists */
        json_object_del(root, lists[kind]);
    }
    return VSH_OK;
}

static vsh_result prune(pruning *p, vsh_error *error) {
    for (int kind = 0; kind < KINDS; ++kind) {
        p->count[kind] = json_array_size(json_object_get(p->work->gltf.root, lists[kind]));
        VSHI_TRY(
            vshi_gltf_allocate(&p->work->gltf, (void **)&p->kept[kind], p->count[kind], sizeof(bool), error));
    }
    refer_roots(p);
    keep_textures(p);
    refer_items(p, ACCESSORS);
    refer_items(p, IMAGES);
    for (int kind = 0; kind < KINDS; ++kind) {
        VSHI_TRY(remove_items(p, kind, error));
    }
    refer_roots(p);
    refer_items(p, TEXTURES);
    refer_items(p, ACCESSORS);
    refer_items(p, IMAGES);
    return VSH_OK;
}

vsh_result vshi_lit_prune(vshi_lit_work *work, vsh_error *error) {
    pruning p = {.work = work};
    work->pruned = knows_all(work->gltf.root);
    const vsh_result result = work->pruned ? prune(&p, error) : VSH_OK;
    for (int kind = 0; kind < KINDS; ++kind) {
        free(p.number[kind]);
        free(p.kept[kind]);
    }
    return result;
}
