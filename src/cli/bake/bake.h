/* Steps of `bake`: what is checked of options, expected of stages, and told by --dry-run. */
#ifndef CLI_BAKE_H
#define CLI_BAKE_H

#include "cli/stats.h"
#include "options.h"

/* Whether a scene with its lights, that the options were put over, can be shaded so; sets what follows from
 * them. CLI_OK or an exit code, having said why. */
int cli_bake_check_shade(const cli_bake_settings *s, vsh_scene *scene);

/* Puts the sun and the lights of a file that the options name behind those of the scene's file. CLI_OK or an
 * exit code, having said why. */
int cli_bake_add_lights(const cli_bake_settings *s, cli_bake_scene *made);

/* Refuses an output that is a file whose lights are taken. */
int cli_bake_check_lights(const cli_bake_settings *s, const vsh_scene *scene, const char *output);

/* Expects all that comes behind a job's vsh_bake_job_measure(). */
void cli_bake_expect(const vsh_scene *scene, const vsh_bake_job *job, int32_t threads);

/* Prints texels, voxels, memory and time of a job to standard output. CLI_OK or an exit code, having said
 * why.
 */
int cli_bake_forecast(const vsh_scene *scene, vsh_bake_job *job, const vsh_run *run);

/* What several bakes of the same lights came to. */
typedef struct cli_bake_sum {
    vsh_bake_report report;
    vsh_bake_error *errors; /* [lights + 2], of the report */
    uint64_t bakes;
} cli_bake_sum;

/* Bakes a scene whose files were checked, or puts its parts together. `sum` not NULL: it is one of several,
 * and what it reports is added there; else it is told. CLI_OK or an exit code, having said why. */
int cli_bake_one(const cli_bake_settings *settings, const vsh_scene *scene, cli_bake_sum *sum);

/* What there is to tell of a bake of the scene, or of all of them. */
cli_stats cli_bake_stats(const vsh_scene *scene, const vsh_bake_report *report, int32_t threads);

/* Bakes it in tiles: those of a shard, or all. The same. */
int cli_bake_tiles(const cli_bake_settings *settings, const vsh_scene *scene);

/* Bakes, or puts parts together, by settings that were taken: frees nothing of them. CLI_OK or an exit code,
 * having said why. */
int cli_bake_by(const cli_bake_settings *settings);

/* --view: whether the page can be written, and writing it when all is baked. CLI_OK or an exit code, having
 * said why. */
int cli_bake_check_view(const cli_bake_settings *settings, const vsh_scene *scene);
int cli_bake_view(const cli_bake_settings *settings, const vsh_scene *scene, const vsh_run *run);

#endif
