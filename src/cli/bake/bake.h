/* The options of `vdbshade bake`, and the scene that they make of its input. Other commands share them. */
#pragma once

#include "cli/cli.h"

/* The word for INPUT in --lights. */
#define CLI_LIGHTS_OF_INPUT "file"

/* Options of commands whose settings begin with cli_bake_settings. */
#define CLI_SUN_OPTIONS                                                                                      \
    {"sun", "X,Y,Z", "direction towards the sun; its channel is shadow.sun",                                 \
     CLI_VALUE(VECTOR, cli_bake_settings, sun)},                                                             \
        {"sun-angle", "DEG", "its angular diameter, degrees, 0 to 179 (0.53)",                               \
         CLI_RANGE(NUMBER, cli_bake_settings, sun_angle_deg, 0.0, 179.0)},                                   \
    {                                                                                                        \
        "lights", "FILE",                                                                                    \
            "also the lights in a glTF or GLB, or by the word file those in INPUT; their channels are "      \
            "shadow.NAME, suns are as wide as --sun-angle says",                                             \
            CLI_VALUE(TEXT, cli_bake_settings, lights)                                                       \
    }

#define CLI_RADIUS_OPTION                                                                                    \
    {                                                                                                        \
        "light-radius", "R", "radius of points and spots of --lights, scene units (0: hard)",                \
            CLI_RANGE(NUMBER, cli_bake_settings, light_radius, 0.0, 1e12)                                    \
    }

#define CLI_LAMP_OPTIONS                                                                                     \
    CLI_RADIUS_OPTION, {                                                                                     \
        CLI_SETTINGS(VSH_SETTINGS_OCCLUSION)                                                                 \
    }

#define CLI_LIGHT_OPTIONS CLI_SUN_OPTIONS, CLI_LAMP_OPTIONS

#define CLI_ACCURACY_OPTIONS                                                                                 \
    {.help = "Accuracy"}, {                                                                                  \
        CLI_SETTINGS(VSH_SETTINGS_ACCURACY)                                                                  \
    }

#define CLI_FLOOR_OPTION                                                                                     \
    {                                                                                                        \
        "floor", "W,D[,X,Y,Z]",                                                                              \
            "a plane of W x D about X,Y,Z (0,0,0) that faces +y receives, and casts nothing: for casters "   \
            "without receivers",                                                                             \
            CLI_PARSED(cli_bake_settings, floor, cli_parse_floor)                                            \
    }
int cli_parse_floor(void *at, const char *name, const char *value);

#define CLI_CASTER_OPTIONS                                                                                   \
    {.help = "Casters and voxels"}, {                                                                        \
        "caster", "FILE", "another mesh or .vdb (FILE.vdb:GRID) that casts shadows; may be repeated",        \
            CLI_RANGE(LIST, cli_bake_settings, casters, 0, CLI_MOST_ITEMS)                                   \
    }

typedef struct cli_bake_settings {
    const char *input;
    const char *output;
    const char *output_folder; /* -o FOLDER/, for the outputs that a scene names; NULL: its own folders */
    const char *stats, *invalid_picture, *view, *exr;
    cli_list receive, no_receive, no_cast, casters;
    cli_densities densities;
    double sun[3];
    double sun_angle_deg; /* cli_was_given() tells whether the user gave these two and the sun */
    double light_radius;
    const char *lights; /* a file, or CLI_LIGHTS_OF_INPUT; NULL: none */
    double floor[5];    /* W, D, X, Y, Z; W 0: none */
    double height;      /* the terrain's height; 0: not given */
    double world[2];    /* its sizes; [0] is 0: not given; [1] is 0: the image's shape decides */
    bool preview, per_object, dry_run;
    int32_t shard[2];         /* number and count of the part; 0: all of it */
    const char *const *words; /* [word_count]: the command line */
    size_t word_count;
    const char *merged; /* prefix of the parts to merge; NULL: bake */
} cli_bake_settings;

/* Returns the file of --lights; NULL: none. */
const char *cli_bake_lights(const cli_bake_settings *settings);

/* Parses a command line of `bake`. */
int cli_bake_parse(int argc, char **argv, cli_bake_settings *settings);

/* Bakes, or merges parts, by parsed settings. */
int cli_bake_by(const cli_bake_settings *settings);

/* A scene and the arrays that it refers to: the input's, changed by the options. */
typedef struct cli_bake_scene {
    vsh_scene scene;
    vsh_scene *read; /* the scene file's; NULL for a mesh */
    vsh_caster *casters;
    vsh_receiver *receivers;
    vsh_light *lights; /* [scene.light_count]; NULL: all are the scene file's */
} cli_bake_scene;

/* Each of these makes a scene. Free it even after a failure. */

/* Makes only its casters and the given settings. */
int cli_bake_scene_casters(const cli_bake_settings *settings, cli_bake_scene *made);

/* Makes all of it. Checks that there is something to bake, and that outputs differ from each other and from
 * the input. */
int cli_bake_scene_make(const cli_bake_settings *settings, cli_bake_scene *made);
void cli_bake_scene_free(cli_bake_scene *made);

/* Adds the receivers to a scene for points. */
int cli_bake_scene_receivers(const cli_bake_settings *settings, cli_bake_scene *made);

/* Refuses a scene for points without anything to bake. */
int cli_bake_check_work(const cli_bake_settings *settings, const cli_bake_scene *made);

/* Refuses lightmaps' outputs that are inputs, or that leave the scene file's folder by a link. */
int cli_bake_check_output(const cli_bake_settings *settings, const char *output);

/* Whether a caster is not part of level sets if the scene's shadows are `hard` or `classic`. */
static inline bool cli_caster_is_direct(const vsh_caster *caster) {
    return caster->type == VSH_CASTER_SPHERES && !caster->voxelised;
}

/* --- the work of commands that shade points */

typedef struct cli_shading {
    cli_bake_scene made;
    vsh_scene *scene; /* made.scene */
    vsh_assets *assets;
    vsh_occluders *occluders;
    cli_provenance origin;
    cli_stats stats;
} cli_shading;

/* Makes the scene for points; `of` is CLI_STATS_…. Free it even after a failure. */
int cli_shading_begin(cli_shading *shading, const cli_bake_settings *settings, int of);
void cli_shading_free(cli_shading *shading);

/* Load the assets, and make the occluders. */
int cli_shading_load(cli_shading *shading);
int cli_shading_cast(cli_shading *shading, const vsh_scene_occluders_options *what);
