/* What is shaded, how, and how exactly: from the options of `bake` to a scene. */
#ifndef CLI_BAKE_SHADE_H
#define CLI_BAKE_SHADE_H

#include "options.h"

/* Sets what the options say over what the scene has, whose lights are there. Returns an exit code. */
int cli_bake_set_shade(const cli_bake_settings *s, vsh_scene *scene);

#endif
