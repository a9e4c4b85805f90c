/* Counts, times and errors of a run: the --stats file and the summary. */
#ifndef CLI_STATS_H
#define CLI_STATS_H

#include <stdbool.h>
#include <vdbshade/vdbshade.h>

enum {
    CLI_STAGE_LOAD,
    CLI_STAGE_VOXELIZE,
    CLI_STAGE_FIELD,
    CLI_STAGE_BAKE,
    CLI_STAGE_WRITE,
    CLI_STAGE_COUNT
};

enum { CLI_STATS_TEXELS, CLI_STATS_POINTS, CLI_STATS_VOXELS };

enum { CLI_STATS_SHADOW, CLI_STATS_AO, CLI_STATS_SKY, CLI_STATS_KINDS };

/* The method that made the values of a kind. */
typedef struct cli_method {
    const char *name; /* NULL: there are no such values */
    bool keeps_error, traces;
} cli_method;

typedef struct cli_stats {
    double seconds[CLI_STAGE_COUNT];
    uint64_t texels;
    uint64_t invalid_texels;
    int of; /* CLI_STATS_…: what is counted */
    uint64_t points, bad_rows;
    uint64_t voxels, inside_voxels, tiles;
    int32_t ao_spacing; /* the smallest of all lightmaps; 0: no lightmap */
    vsh_shade_stats shade;
    const vsh_bake_error
        *errors;             /* [light_count + 2]: of each light, of AO, of the sky; NULL: none are known */
    const vsh_light *lights; /* of `errors` */
    size_t light_count;
    cli_method methods[CLI_STATS_KINDS]; /* NULL names where nothing is baked by one */
    double max_error;                    /* of --max-error */
    int32_t threads;
    vsh_occluders_info casters;
} cli_stats;

/* Adds the seconds since `since` to a stage and returns the time now. */
double cli_stats_stage(cli_stats *stats, int stage, double since);

/* Begins with nothing counted; `threads` as of vsh_run. */
cli_stats cli_stats_begin(int32_t of, int32_t threads);

/* Stores the methods that the scene's settings choose, with triangles (not 0) or without. */
void cli_stats_methods(cli_stats *stats, const vsh_scene *scene, int32_t has_triangles);

/* Stores the casters, adds the seconds that making them took, and stores the scene's methods. */
void cli_stats_casters(cli_stats *stats, const vsh_scene *scene, const vsh_occluders_info *casters);

/* "shadow exact, AO exact, max error 0.02". Returns text. */
const char *cli_stats_methods_text(const cli_stats *stats, char *text, size_t size);

/* Warns if an error is above --max-error: by how much, and what would help. */
void cli_stats_warn(const cli_stats *stats, const vsh_scene *scene, const vsh_run *run);

/* Ends a run that went well: writes the JSON file, if `path` is not NULL. After that, signals end nothing any
 * more. CLI_OK or an exit code, having said why. */
int cli_stats_finish(const cli_stats *stats, const vsh_run *run, const char *path);

/* Prints the summary on standard error. */
void cli_stats_say(const cli_stats *stats);

#endif
