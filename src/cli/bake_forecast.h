/* What a bake will take, found out by a small one. */
#ifndef CLI_BAKE_FORECAST_H
#define CLI_BAKE_FORECAST_H

#include "targets.h"

#include <vdbshade/vdbshade.h>

/* Prints texels, voxels, memory and time of baking the targets to standard output. Levels of few voxels and a
 * part of the texels are really made, by the same methods, and what they took is scaled up. `band_rows` as of
 * cli_receiver_job. CLI_OK or an exit code, having said why. */
int cli_bake_forecast(const cli_targets *targets, const vsh_assets *assets, const vsh_run *run,
                      int32_t band_rows);

#endif
