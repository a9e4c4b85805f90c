/* The options of `vdbshade bake`, and the scene they make of its input. */
#ifndef CLI_BAKE_OPTIONS_H
#define CLI_BAKE_OPTIONS_H

#include "cli/commands.h"

enum { CLI_MAX_EXTRA_CASTERS = 256, CLI_MAX_PATTERNS = 256 };

/* Names of objects, as they were given one after the other. */
typedef struct cli_patterns {
    const char *list[CLI_MAX_PATTERNS];
    size_t count;
} cli_patterns;

/* What commands that shade share: keys, rows of their tables, and who takes them. */
enum {
    CLI_KEY_SUN = 0x3000,
    CLI_KEY_SUN_ANGLE,
    CLI_KEY_AO,
    CLI_KEY_AO_METHOD,
    CLI_KEY_AO_CONES,
    CLI_KEY_METHOD,
    CLI_KEY_RAYS,
    CLI_KEY_SAMPLER,
    CLI_KEY_FRAME,
    CLI_KEY_EARLY_RAYS,
    CLI_KEY_MAX_ERROR,
    CLI_KEY_JITTER,
    CLI_KEY_ERROR,
    CLI_KEY_CASTER
};

#define CLI_LIGHT_OPTIONS                                                                                    \
    {CLI_KEY_SUN, "sun", "X,Y,Z", "direction towards the sun; its channel is shadow.sun"},                   \
        {CLI_KEY_SUN_ANGLE, "sun-angle", "DEG", "its angular diameter, degrees, 0 to 179 (0.53)"},           \
        {CLI_KEY_AO, "ao", "DISTANCE", "ambient occlusion within a distance, scene units"},                  \
        {CLI_KEY_AO_METHOD, "ao-method", "NAME",                                                             \
         "auto, exact, adaptive or rays; previews: cones, taps\n(auto)"},                                    \
        {CLI_KEY_AO_CONES, "ao-cones", "N", "cones a texel, 1 to 256 (16)"}, {                               \
        CLI_KEY_METHOD, "method", "NAME",                                                                    \
            "of the shadow (auto: exact where all casters are\ntriangles, else adaptive): exact, adaptive "  \
            "and rays; or a\n"                                                                               \
            "preview, which keeps no error: cone, smooth, hard;\nclassic, practical and improved have the "  \
            "outer half of\nthe penumbra only"                                                               \
    }

#define CLI_ACCURACY_OPTIONS                                                                                 \
    {0, NULL, NULL, "Accuracy"},                                                                             \
        {CLI_KEY_MAX_ERROR, "max-error", "E",                                                                \
         "standard error that a value may keep, 0.0001 to 1\n(0.02): rays follow from it. Takes the place "  \
         "of a\nscene's preview methods by auto"},                                                           \
        {CLI_KEY_RAYS, "rays", "N",                                                                          \
         "rays a texel (64); with adaptive and exact a limit,\n1 to 4096 (as many as the error takes)"},     \
        {CLI_KEY_SAMPLER, "sampler", "NAME", "where they go: sobol, white or blue (sobol)"},                 \
        {CLI_KEY_FRAME, "frame", "N",                                                                        \
         "another set of them: bakes of frames 0, 1, 2 … may\nbe averaged (0)"},                             \
        {CLI_KEY_JITTER, "jitter", "J",                                                                      \
         "shadows by one march: steps are shortened by a part\nof up to this, another a texel, 0 to 1 (0)"}, \
        {CLI_KEY_EARLY_RAYS, "early-rays", "N",                                                              \
         "with rays: where the first N agree, the rest are not\nmarched, 0 to 4096 (0: never)"},             \
    {                                                                                                        \
        CLI_KEY_ERROR, "error", NULL,                                                                        \
            "also error.NAME of each light and error.ao: the\nstandard error left in each value"             \
    }

#define CLI_CASTER_OPTIONS                                                                                   \
    {0, NULL, NULL, "Casters and voxels"}, {                                                                 \
        CLI_KEY_CASTER, "caster", "FILE", "another mesh or .vdb that casts shadows; may be\nrepeated"        \
    }

typedef struct cli_bake_settings {
    const char *input;
    const char *output;
    const char *output_folder; /* for the outputs of a scene, by their names; NULL: where it says */
    cli_patterns receive, no_receive, no_cast;
    bool per_object, allow_overlap;
    vsh_planes planes; /* that options ask for */
    const char *stats;
    const char *invalid_picture; /* NULL: none */
    cli_common common;
    cli_grid_settings grid;
    double sun[3];
    double sun_angle_deg;
    double ao_distance;
    int32_t bent; /* as of vsh_scene */
    vsh_tint tint;
    double ambient[3];
    int32_t ao_method;
    int32_t ao_cones;
    int32_t method;
    int32_t rays, sampler, frame, early_rays;
    double max_error, jitter;
    int32_t width, height;
    int32_t uv_set;
    int32_t supersample;
    int32_t padding;
    int32_t ao_spacing;
    int32_t band_rows; /* 0: as many as go */
    int32_t bits;
    int32_t color_space; /* VSH_COLOR_… */
    const char *pack;
    const char *casters[CLI_MAX_EXTRA_CASTERS];
    size_t caster_count;
    bool has_sun, has_sun_angle, has_ao, has_ao_method, has_ao_cones, has_method, has_size, has_uv_set;
    bool has_supersample, has_padding, has_ao_spacing, has_bits, has_color_space, irradiance, has_tint,
        has_ambient;
    bool dry_run, resume;
    bool has_rays, has_sampler, has_frame, has_early_rays, has_max_error, has_jitter, error;
} cli_bake_settings;

/* Takes an option of the tables above, of the grid's or of the common ones. */
int cli_shared_take(cli_bake_settings *settings, int key, const char *name, const char *value);

/* Takes the command line. */
int cli_bake_parse(int argc, char **argv, cli_bake_settings *settings, bool *help);

/* A scene and what of it is ours: the input's, with the options put over it. */
typedef struct cli_bake_scene {
    vsh_scene scene;
    vsh_scene *read; /* the scene file's; NULL for a mesh */
    vsh_caster *casters;
    vsh_receiver *receivers;
    char **outputs; /* [receiver_count], where they are not the scene's own; NULL: none is */
    vsh_light sun;
} cli_bake_scene;

/* Makes the scene, checks that it can be baked and that its outputs replace no input. */
int cli_bake_scene_make(const cli_bake_settings *settings, cli_bake_scene *made);

/* The same without its receivers: for points, which may ask for no light and no AO. */
int cli_bake_scene_for_points(const cli_bake_settings *settings, cli_bake_scene *made);

/* Then adds the receivers, with the options put over them. CLI_OK or an exit code, having said why. */
int cli_bake_scene_receivers(const cli_bake_settings *settings, cli_bake_scene *made);

/* Whether a scene for points has anything to bake: CLI_OK, or CLI_USAGE having said why. */
int cli_bake_check_work(const cli_bake_settings *settings, const cli_bake_scene *made);

/* Refuses an output that is one of the scene's inputs. CLI_OK or an exit code, having said why. */
int cli_bake_check_output(const cli_bake_settings *settings, const vsh_scene *scene, const char *output);
void cli_bake_scene_free(cli_bake_scene *made);

#endif
