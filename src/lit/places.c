#include "lit/places.h"

vsh_result vshi_lit_places_find(vshi_lit_document *document, const bool *gone, size_t first, size_t count,
                                vshi_lit_places *places, vsh_error *error) {
    const size_t more = count - first;
    size_t done = 0, behind = 0; /* behind: the places that are taken */
    *places = (vshi_lit_places){.first = first, .count = count};
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

void vshi_lit_places_mark(const vshi_lit_places *places, bool *taken) {
    for (size_t i = 0; i < places->count - places->first && places->moved[i] < places->first; ++i) {
        taken[places->moved[i]] = true;
    }
    for (size_t i = places->end; i < places->first; ++i) {
        taken[i] = true;
    }
}

vsh_result vshi_lit_places_rename(const vshi_lit_document *document, const vshi_lit_places *places,
                                  json_t *object, const char *key, vsh_error *error) {
    size_t index;
    if (!vshi_gltf_count(object, key, SIZE_MAX, &index) || index < places->first || index >= places->count) {
        return VSH_OK;
    }
    const size_t moved = places->moved[index - places->first];
    return json_object_set_new_nocheck(object, key, json_integer((json_int_t)moved)) == 0
               ? VSH_OK
               : vshi_lit_no_memory(document, error);
}

vsh_result vshi_lit_places_move(vshi_lit_document *document, const char *name, const vshi_lit_places *places,
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
