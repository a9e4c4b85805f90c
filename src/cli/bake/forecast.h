/* What a bake will take, as text. */
#ifndef CLI_BAKE_FORECAST_H
#define CLI_BAKE_FORECAST_H

#include <vdbshade/vdbshade.h>

/* Prints texels, voxels, memory and time of a job to standard output. CLI_OK or an exit code, having said
 * why.
 */
int cli_bake_forecast(const vsh_scene *scene, vsh_bake_job *job, const vsh_run *run);

#endif
