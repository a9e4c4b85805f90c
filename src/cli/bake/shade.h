/* What is shaded, how, and how exactly: which options of `bake` go together. */
#ifndef CLI_BAKE_SHADE_H
#define CLI_BAKE_SHADE_H

#include "options.h"

/* Whether a scene with its lights, that the options were put over, can be shaded so; sets what follows from
 * them. CLI_OK or an exit code, having said why. */
int cli_bake_check_shade(const cli_bake_settings *s, vsh_scene *scene);

#endif
