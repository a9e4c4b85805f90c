/* The options of `vdbshade bake`, and the scene they make of its input. */
#ifndef CLI_BAKE_OPTIONS_H
#define CLI_BAKE_OPTIONS_H

#include "commands.h"

enum { CLI_MAX_EXTRA_CASTERS = 256 };

typedef struct cli_bake_settings {
    const char *input;
    const char *output;
    const char *stats;
    cli_common common;
    cli_grid_settings grid;
    double sun[3];
    double sun_angle_deg;
    double ao_distance;
    int32_t ao_method;
    int32_t ao_cones;
    int32_t method;
    int32_t rays, sampler, frame, early_rays;
    double max_error;
    int32_t width, height;
    int32_t uv_set;
    int32_t supersample;
    int32_t padding;
    int32_t ao_spacing;
    int32_t band_rows; /* 0: as many as go */
    int32_t bits;
    const char *pack;
    const char *casters[CLI_MAX_EXTRA_CASTERS];
    size_t caster_count;
    bool has_sun, has_sun_angle, has_ao, has_ao_method, has_ao_cones, has_method, has_size, has_uv_set;
    bool has_supersample, has_padding, has_ao_spacing, has_bits, irradiance;
    bool dry_run;
    bool has_rays, has_sampler, has_frame, has_early_rays, has_max_error, error;
} cli_bake_settings;

/* Takes the command line. */
int cli_bake_parse(int argc, char **argv, cli_bake_settings *settings, bool *help);

/* A scene and what of it is ours: the input's, with the options put over it. */
typedef struct cli_bake_scene {
    vsh_scene scene;
    vsh_scene *read; /* the scene file's; NULL for a mesh */
    vsh_caster *casters;
    vsh_receiver *receivers;
    vsh_light sun;
} cli_bake_scene;

/* Makes the scene, checks that it can be baked and that its outputs replace no input. */
int cli_bake_scene_make(const cli_bake_settings *settings, cli_bake_scene *made);

/* Refuses an output that is one of the scene's inputs. CLI_OK or an exit code, having said why. */
int cli_bake_check_output(const cli_bake_settings *settings, const vsh_scene *scene, const char *output);
void cli_bake_scene_free(cli_bake_scene *made);

#endif
