#include "lit/buffers.h"

#include <stdlib.h>

static bool has_bytes(const vshi_lit_document *document, size_t index) {
    const bool chunk = index == 0 && document->gltf.binary;
    return chunk || json_object_get(vshi_gltf_element(&document->gltf, "buffers", index), "uri") != NULL;
}

/* Bytes of a buffer in front of `offset` that are not written. */
static size_t dropped_before(const vshi_lit_document *document, size_t buffer, size_t offset) {
    size_t sum = 0;
    for (size_t i = 0; i < document->dropped_count; ++i) {
        const vshi_lit_range *range = &document->dropped[i];
        const size_t end = range->end < offset ? range->end : offset;
        sum += range->buffer == buffer && end > range->begin ? end - range->begin : 0;
    }
    return sum;
}

vsh_result vshi_lit_lay_out(vshi_lit_document *document, vshi_lit_layout *l, vsh_error *error) {
    enum { ALIGNMENT = 8 };
    vshi_gltf *gltf = &document->gltf;
    VSHI_TRY(
        vshi_gltf_allocate(gltf, (void **)&l->offsets, gltf->buffer_count + 1, sizeof *l->offsets, error));
    VSHI_TRY(
        vshi_gltf_allocate(gltf, (void **)&l->numbers, gltf->buffer_count + 1, sizeof *l->numbers, error));
    for (size_t i = 0; i < gltf->buffer_count; ++i) {
        l->offsets[i] = SIZE_MAX;
        if (has_bytes(document, i)) {
            VSHI_TRY(vshi_gltf_load(gltf, i, error));
            l->offsets[i] = l->size;
            const size_t size = gltf->buffers[i].bytes.size;
            l->size += (size - dropped_before(document, i, size) + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
        }
    }
    l->added = l->size;
    l->size += document->added.size;
    return VSH_OK;
}

static bool lies_in_added(const vshi_lit_document *document, size_t view) {
    return view >= document->first_view || (document->replaced != NULL && document->replaced[view]);
}

/* Whether a buffer without bytes is referred to still: not where all its views have been replaced. */
static bool is_needed(const vshi_lit_document *document, size_t buffer) {
    size_t i, of;
    const json_t *view;
    json_array_foreach(json_object_get(document->gltf.root, "bufferViews"), i, view) {
        if (!lies_in_added(document, i) && vshi_gltf_count(view, "buffer", SIZE_MAX, &of) && of == buffer) {
            return true;
        }
    }
    return document->dropped_count == 0;
}

/* The new list: one buffer of all bytes, which is the first that had any, and behind it those without. */
static vsh_result list_buffers(vshi_lit_document *document, vshi_lit_layout *l, json_t **one,
                               vsh_error *error) {
    vshi_gltf *gltf = &document->gltf;
    json_t *list = json_array(), *old = json_object_get(gltf->root, "buffers");
    *one = NULL;
    for (size_t i = 0; i < gltf->buffer_count && *one == NULL; ++i) {
        *one = l->offsets[i] != SIZE_MAX ? json_incref(json_array_get(old, i)) : NULL;
    }
    *one = *one == NULL && l->size > 0 ? json_object() : *one;
    bool good = list != NULL && (l->size == 0 || *one != NULL);
    good = (*one == NULL || json_array_append_new(list, *one) == 0) && good;
    for (size_t i = 0; i < gltf->buffer_count; ++i) {
        l->numbers[i] = l->offsets[i] != SIZE_MAX ? 0 : json_array_size(list);
        if (l->offsets[i] == SIZE_MAX && is_needed(document, i)) {
            good = good && json_array_append(list, json_array_get(old, i)) == 0;
        }
    }
    if (json_array_size(list) == 0) {
        json_object_del(gltf->root, "buffers");
        json_decref(list);
        return good ? VSH_OK : vshi_lit_no_memory(document, error);
    }
    const vsh_result result = vshi_lit_set(document, gltf->root, "buffers", list, error);
    return good ? result : vshi_lit_no_memory(document, error);
}

/* Moves what a view (or an extension of it that names a buffer of its own) refers to. */
static vsh_result move_view(const vshi_lit_document *document, const vshi_lit_layout *l, json_t *view,
                            vsh_error *error) {
    size_t buffer, offset;
    if (!vshi_gltf_count(view, "buffer", SIZE_MAX, &buffer) || buffer >= document->gltf.buffer_count ||
        !vshi_gltf_count(view, "byteOffset", 0, &offset)) {
        return vshi_gltf_fail(&document->gltf, error, "a buffer view refers to no buffer");
    }
    VSHI_TRY(vshi_lit_set(document, view, "buffer", json_integer((json_int_t)l->numbers[buffer]), error));
    const size_t base = l->offsets[buffer] != SIZE_MAX ? l->offsets[buffer] : 0;
    const size_t moved = base + offset - dropped_before(document, buffer, offset);
    return moved != offset
               ? vshi_lit_set(document, view, "byteOffset", json_integer((json_int_t)moved), error)
               : VSH_OK;
}

static vsh_result move_views(vshi_lit_document *document, const vshi_lit_layout *l, vsh_error *error) {
    size_t i;
    json_t *view;
    json_array_foreach(json_object_get(document->gltf.root, "bufferViews"), i, view) {
        if (lies_in_added(document, i)) {
            const size_t at = (size_t)json_integer_value(json_object_get(view, "byteOffset"));
            VSHI_TRY(vshi_lit_set(document, view, "buffer", json_integer(0), error));
            VSHI_TRY(
                vshi_lit_set(document, view, "byteOffset", json_integer((json_int_t)(at + l->added)), error));
            continue;
        }
        VSHI_TRY(move_view(document, l, view, error));
        const char *name;
        json_t *extension;
        json_object_foreach(json_object_get(view, "extensions"), name, extension) {
            if (json_object_get(extension, "buffer") != NULL) {
                VSHI_TRY(move_view(document, l, extension, error));
            }
        }
    }
    return VSH_OK;
}

/* Extensions by which no view is compressed any more. */
static void drop_compression(vshi_lit_document *document) {
    static const char *const names[] = {"EXT_meshopt_compression", "KHR_meshopt_compression"};
    static const char *const lists[] = {"bufferViews", "buffers"};
    for (size_t n = 0; n < sizeof names / sizeof names[0] && document->dropped_count > 0; ++n) {
        bool any = false;
        for (size_t k = 0; k < sizeof lists / sizeof lists[0]; ++k) {
            size_t i;
            const json_t *item;
            json_array_foreach(json_object_get(document->gltf.root, lists[k]), i, item) {
                any = any || vshi_gltf_extension(item, names[n]) != NULL;
            }
        }
        if (!any) {
            vshi_lit_drop_extension(document, names[n]);
        }
    }
}

vsh_result vshi_lit_join_buffers(vshi_lit_document *document, vshi_lit_layout *l, json_t **one,
                                 vsh_error *error) {
    VSHI_TRY(list_buffers(document, l, one, error));
    VSHI_TRY(move_views(document, l, error));
    drop_compression(document);
    return VSH_OK;
}

void vshi_lit_layout_free(vshi_lit_layout *l) {
    free(l->numbers);
    free(l->offsets);
}
