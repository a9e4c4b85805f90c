/* Settings of a scene that a command line gives: vsh_setting_get() lists them, and what they are is said
 * there alone. Put over a scene, they are a patch. */
#ifndef CLI_PATCH_H
#define CLI_PATCH_H

#include "options.h"

enum { CLI_MOST_RULES = 64 };

typedef struct cli_patch {
    const char *text[CLI_MOST_SETTINGS]; /* the value of each setting; NULL: not given */
    vsh_solidity_rule rules[CLI_MOST_RULES];
    size_t rule_count;
} cli_patch;

/* Parses an option of a group of settings, or --treat. */
int cli_patch_take(cli_patch *patch, int key, const char *name, const char *value);

/* The same by the option's name, "--size". */
int cli_patch_set(cli_patch *patch, const char *name, const char *value);

/* Returns the value that an option was given, or NULL. */
const char *cli_patch_text(const cli_patch *patch, const char *name);

/* Whether an option was given. */
bool cli_patch_has(const cli_patch *patch, const char *name);

/* --resolution and --voxel-size exclude each other. */
int cli_patch_check(const cli_patch *patch);

/* Puts what was given over a scene, which then refers to the patch, over a receiver and over a flat scene. */
int cli_patch_scene(const cli_patch *patch, vsh_scene *scene);
int cli_patch_receiver(const cli_patch *patch, vsh_receiver *receiver);
int cli_patch_flat(const cli_patch *patch, vsh_flat_scene *scene);

#endif
