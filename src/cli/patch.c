#include "patch.h"

#include "message.h"
#include "paths.h"

#include <stdio.h>
#include <string.h>

/* `owner` is what the setting is of: a vsh_scene, a vsh_receiver, a vsh_flat_scene. */
static int set(const vsh_setting *setting, const char *text, void *owner) {
    char name[sizeof setting->option + 2];
    snprintf(name, sizeof name, "--%s", setting->option);
    vsh_error error;
    vsh_result result = VSH_OK;
    switch (setting->owner) {
    case VSH_SETTING_OF_SCENE:
        result = vsh_scene_set(owner, name, text, &error);
        break;
    case VSH_SETTING_OF_RECEIVER:
        result = vsh_receiver_set(owner, name, text, &error);
        break;
    default:
        result = vsh_flat_scene_set(owner, name, text, &error);
        break;
    }
    return cli_check(result, &error);
}

/* Checks a text against its range at once, before any file is read. */
static int give(cli_patch *patch, size_t index, const char *value) {
    vsh_scene scene = vsh_scene_default();
    vsh_receiver receiver = vsh_receiver_default();
    vsh_flat_scene flat = vsh_flat_scene_default();
    void *const owners[] = {[VSH_SETTING_OF_SCENE] = &scene,
                            [VSH_SETTING_OF_RECEIVER] = &receiver,
                            [VSH_SETTING_OF_FLAT] = &flat};
    const vsh_setting *setting = cli_setting(index);
    patch->text[index] = value != NULL ? value : "true";
    return set(setting, patch->text[index], owners[setting->owner]);
}

/* Takes PATTERN=solid|sheet|room. */
static int take_rule(cli_patch *patch, const char *name, const char *value) {
    static const struct {
        const char *name;
        int32_t solidity;
    } kinds[] = {{"solid", VSH_SOLIDITY_SOLID}, {"sheet", VSH_SOLIDITY_SHELL}, {"room", VSH_SOLIDITY_INWARD}};
    const char *kind = strrchr(value, '=');
    if (patch->rule_count == CLI_MOST_RULES) {
        return cli_usage("%s %s: more than %d patterns", name, value, CLI_MOST_RULES);
    }
    for (size_t i = 0; kind > value && i < sizeof kinds / sizeof kinds[0]; ++i) {
        if (strcmp(kind + 1, kinds[i].name) == 0) {
            const char *pattern = cli_keep_text("%.*s", (int)(kind - value), value);
            patch->rules[patch->rule_count++] = (vsh_solidity_rule){pattern, kinds[i].solidity};
            return CLI_OK;
        }
    }
    return cli_usage("%s '%s': expected PATTERN=solid, PATTERN=sheet or PATTERN=room", name, value);
}

int cli_patch_take(cli_patch *patch, int key, const char *name, const char *value) {
    return key == CLI_KEY_TREAT ? take_rule(patch, name, value)
                                : give(patch, (size_t)(key - CLI_KEY_SETTING), value);
}

static size_t index_of(const char *name) {
    size_t i = 0;
    while (cli_setting(i) != NULL && strcmp(cli_setting(i)->option, name + strlen("--")) != 0) {
        ++i;
    }
    return i;
}

int cli_patch_set(cli_patch *patch, const char *name, const char *value) {
    return give(patch, index_of(name), value);
}

const char *cli_patch_text(const cli_patch *patch, const char *name) {
    return patch->text[index_of(name)];
}

bool cli_patch_has(const cli_patch *patch, const char *name) {
    return cli_patch_text(patch, name) != NULL;
}

int cli_patch_check(const cli_patch *patch) {
    if (cli_patch_has(patch, "--resolution") && cli_patch_has(patch, "--voxel-size")) {
        return cli_usage("--resolution and --voxel-size: give one of the two");
    }
    return CLI_OK;
}

static int apply(const cli_patch *patch, int32_t owner, void *target) {
    int code = CLI_OK;
    for (size_t i = 0; cli_setting(i) != NULL && code == CLI_OK; ++i) {
        if (patch->text[i] != NULL && cli_setting(i)->owner == owner) {
            code = set(cli_setting(i), patch->text[i], target);
        }
    }
    return code;
}

int cli_patch_scene(const cli_patch *patch, vsh_scene *scene) {
    if (patch->rule_count > 0) {
        scene->solidity = patch->rules;
        scene->solidity_count = patch->rule_count;
    }
    return apply(patch, VSH_SETTING_OF_SCENE, scene);
}

int cli_patch_receiver(const cli_patch *patch, vsh_receiver *receiver) {
    return apply(patch, VSH_SETTING_OF_RECEIVER, receiver);
}

int cli_patch_flat(const cli_patch *patch, vsh_flat_scene *scene) {
    return apply(patch, VSH_SETTING_OF_FLAT, scene);
}
