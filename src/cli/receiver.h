/* One receiver's way: its texels, its lightmap, its file. */
#ifndef CLI_RECEIVER_H
#define CLI_RECEIVER_H

#include "stats.h"

#include <stdbool.h>

typedef struct cli_receiver_job {
    const vsh_scene *scene;
    const vsh_assets *assets;
    const vsh_run *run;
    size_t index; /* of the receiver */
} cli_receiver_job;

/* Whether its image can be written. Needs no assets. CLI_OK or an exit code, having said why. */
int cli_receiver_check(const vsh_scene *scene, size_t index);

/* Rasterises it, warns (where asked to) of what is wrong with its UVs, and hands out the texels. */
int cli_receiver_texels(const cli_receiver_job *job, bool warn, vsh_texels **texels);

/* Shades the texels and writes the file. */
int cli_receiver_bake(const cli_receiver_job *job, const vsh_field *field, const vsh_texels *texels,
                      cli_stats *stats);

#endif
