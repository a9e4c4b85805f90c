/* Where a lit document comes from: extras of its asset, as images have attributes. */
#include "lit/work.h"

#include "base/utf8.h"

#include <stdlib.h>
#include <string.h>

static const char OURS[] = "vdbshade_";

/* What an earlier bake told of itself. */
static void forget(json_t *extras) {
    const char *key;
    json_t *value;
    void *next;
    json_object_foreach_safe(extras, next, key, value) {
        if (strncmp(key, OURS, sizeof OURS - 1) == 0) {
            json_object_del(extras, key);
        }
    }
}

/* Names of files may be of any bytes. NULL where memory is short. */
static json_t *text_of(const char *value) {
    char *clean = malloc(3 * strlen(value) + 1);
    if (clean == NULL) {
        return NULL;
    }
    vshi_utf8_clean(value, clean);
    json_t *made = json_string(clean);
    free(clean);
    return made;
}

vsh_result vshi_lit_tell_origin(vshi_lit_work *work, vsh_error *error) {
    vshi_lit_document *document = &work->document;
    const vsh_lit_options *options = work->options;
    json_t *asset, *extras;
    if (options->attribute_count == 0) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_lit_object(document, document->gltf.root, "asset", &asset, error));
    extras = json_object_get(asset, "extras");
    if (extras != NULL && !json_is_object(extras)) {
        return VSH_OK; /* somebody's own, of another kind */
    }
    VSHI_TRY(vshi_lit_object(document, asset, "extras", &extras, error));
    forget(extras);
    for (size_t i = 0; i < options->attribute_count; ++i) {
        const vsh_attribute *one = &options->attributes[i];
        VSHI_TRY(vshi_lit_set(document, extras, one->name, text_of(one->value), error));
    }
    return VSH_OK;
}
