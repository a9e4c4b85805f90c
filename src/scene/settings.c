/* Settings: the keys of a scene's file that are also options, one by one. */
#include "base/error.h"
#include "base/memory.h"
#include "base/try.h"
#include "scene/parts.h"

#include <vdbshade/settings.h>

#include <stdio.h>
#include <string.h>

/* Where settings stand, and what their keys are called from the scene on. */
static const struct {
    const vshi_table *table;
    const char *prefix;
    int32_t owner;
} places[] = {
    {&vshi_scene_table, "", VSH_SETTING_OF_SCENE},
    {&vshi_ao_table, "ao.", VSH_SETTING_OF_SCENE},
    {&vshi_receiver_table, "receivers.", VSH_SETTING_OF_RECEIVER},
    {&vshi_flat_table, "", VSH_SETTING_OF_FLAT},
};
enum { PLACES = sizeof places / sizeof places[0] };

static const vshi_key *key_at(size_t index, size_t *place) {
    for (*place = 0; *place < PLACES; ++*place) {
        const vshi_table *table = places[*place].table;
        for (size_t i = 0; i < table->key_count; ++i) {
            if (table->keys[i].option.name != NULL && index-- == 0) {
                return &table->keys[i];
            }
        }
    }
    return NULL;
}

static void tell_default(const vshi_key *key, int32_t owner, char *text, size_t size) {
    const vsh_scene scene = vsh_scene_default();
    const vsh_receiver receiver = vsh_receiver_default();
    const vsh_flat_scene flat = vsh_flat_scene_default();
    const void *const defaults[] = {[VSH_SETTING_OF_SCENE] = &scene,
                                    [VSH_SETTING_OF_RECEIVER] = &receiver,
                                    [VSH_SETTING_OF_FLAT] = &flat};
    if (key->option.otherwise != NULL) {
        snprintf(text, size, "%s", key->option.otherwise);
        return;
    }
    vshi_key_value(key, defaults[owner], text, size);
}

int32_t vsh_setting_get(size_t index, vsh_setting *setting) {
    size_t place;
    const vshi_key *key = key_at(index, &place);
    if (key == NULL) {
        return 0;
    }
    vsh_setting told;
    memset(&told, 0, sizeof told);
    snprintf(told.key, sizeof told.key, "%s%s", places[place].prefix, key->name);
    snprintf(told.option, sizeof told.option, "%s", key->option.name);
    snprintf(told.value, sizeof told.value, "%s", key->option.value != NULL ? key->option.value : "");
    snprintf(told.help, sizeof told.help, "%s", key->option.help);
    vshi_key_range(key, told.range, sizeof told.range);
    tell_default(key, places[place].owner, told.otherwise, sizeof told.otherwise);
    told.group = key->option.group;
    told.owner = places[place].owner;
    *setting = told;
    return 1;
}

static bool is_called(const vshi_key *key, const char *prefix, const char *name) {
    const size_t length = strlen(prefix);
    return (strncmp(name, "--", 2) == 0 && strcmp(name + 2, key->option.name) == 0) ||
           (strncmp(name, prefix, length) == 0 && strcmp(name + length, key->name) == 0);
}

static vsh_result set(int32_t owner, const char *name, const char *text, void *target, vsh_error *error) {
    static const char *const owners[] = {"scene", "receiver", "flat scene"};
    size_t place;
    const vshi_key *key;
    for (size_t i = 0; (key = key_at(i, &place)) != NULL; ++i) {
        if (places[place].owner == owner && is_called(key, places[place].prefix, name)) {
            return vshi_read_text(key, name, text, target, error);
        }
    }
    return vshi_fail(error, VSH_ERROR_ARGUMENT, "%.64s: no such setting of a %s", name, owners[owner]);
}

vsh_result vsh_scene_set(vsh_scene *scene, const char *name, const char *text, vsh_error *error) {
    VSHI_NEEDS(scene);
    VSHI_NEEDS(name);
    vsh_scene changed = *scene;
    VSHI_TRY(set(VSH_SETTING_OF_SCENE, name, text, &changed, error));
    *scene = changed;
    return VSH_OK;
}

vsh_result vsh_receiver_set(vsh_receiver *receiver, const char *name, const char *text, vsh_error *error) {
    VSHI_NEEDS(receiver);
    VSHI_NEEDS(name);
    vsh_receiver changed = *receiver;
    VSHI_TRY(set(VSH_SETTING_OF_RECEIVER, name, text, &changed, error));
    *receiver = changed;
    return VSH_OK;
}

vsh_result vsh_flat_scene_set(vsh_flat_scene *scene, const char *name, const char *text, vsh_error *error) {
    VSHI_NEEDS(scene);
    VSHI_NEEDS(name);
    vsh_flat_scene changed = *scene;
    VSHI_TRY(set(VSH_SETTING_OF_FLAT, name, text, &changed, error));
    *scene = changed;
    return VSH_OK;
}
