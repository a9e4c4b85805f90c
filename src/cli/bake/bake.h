/* Steps of `bake`. */
#ifndef CLI_BAKE_H
#define CLI_BAKE_H

#include "options.h"

/* Whether a scene with its lights, that the options were put over, can be shaded so; sets what follows from
 * them. CLI_OK or an exit code, having said why. */
int cli_bake_check_shade(const cli_bake_settings *s, vsh_scene *scene);

/* Puts the sun and the lights of a file that the options name behind those of the scene's file. CLI_OK or an
 * exit code, having said why. */
int cli_bake_add_lights(const cli_bake_settings *s, cli_bake_scene *made);

/* Refuses an output that is a file whose lights are taken. */
int cli_bake_check_lights(const cli_bake_settings *s, const vsh_scene *scene, const char *output);

/* Bakes, or puts parts together, by settings that were taken: frees nothing of them. CLI_OK or an exit code,
 * having said why. */
int cli_bake_by(const cli_bake_settings *settings);

/* --view: whether the page can be written, and writing it when all is baked. CLI_OK or an exit code, having
 * said why. */
int cli_bake_check_view(const cli_bake_settings *settings, const vsh_scene *scene);
int cli_bake_view(const cli_bake_settings *settings, const vsh_scene *scene, const vsh_run *run);

#endif
