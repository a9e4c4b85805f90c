/* The options of `vdbshade bake`, and the scene they make of its input. */
#ifndef CLI_BAKE_OPTIONS_H
#define CLI_BAKE_OPTIONS_H

#include "cli/commands.h"
#include "cli/options.h"
#include "cli/patch.h"
#include "cli/stats.h"

enum { CLI_MAX_EXTRA_CASTERS = 256, CLI_MAX_PATTERNS = 256 };

/* Names of objects, as they were given one after the other. */
typedef struct cli_patterns {
    const char *list[CLI_MAX_PATTERNS];
    size_t count;
} cli_patterns;

/* Options of commands that shade, whose settings begin with cli_bake_settings. */
enum {
    CLI_KEY_SUN = 0x3000,
    CLI_KEY_SUN_ANGLE,
    CLI_KEY_LIGHT_RADIUS,
    CLI_KEY_CASTER,
    CLI_KEY_NO_CAST,
    CLI_KEY_FLOOR
};

/* Stands for INPUT itself, in --lights. */
#define CLI_LIGHTS_OF_INPUT "file"

#define CLI_LIGHTS                                                                                           \
    {CLI_KEY_SUN, "sun", "X,Y,Z", "direction towards the sun; its channel is shadow.sun"},                   \
        {CLI_KEY_SUN_ANGLE, "sun-angle", "DEG", "its angular diameter, degrees, 0 to 179 (0.53)"},           \
        {CLI_TEXT(cli_bake_settings, lights), "lights", "FILE",                                              \
         "also the lights in a glTF or GLB, or by the word file\nthose in INPUT; their channels are "        \
         "shadow.NAME, suns\nare as wide as --sun-angle says"},                                              \
    {                                                                                                        \
        CLI_KEY_LIGHT_RADIUS, "light-radius", "R", "radius of its points and spots, scene units (0: hard)"   \
    }

#define CLI_LIGHT_OPTIONS CLI_LIGHTS, CLI_SETTINGS(VSH_SETTINGS_OCCLUSION)

#define CLI_ACCURACY_OPTIONS {0, NULL, NULL, "Accuracy"}, CLI_SETTINGS(VSH_SETTINGS_ACCURACY)

#define CLI_FLOOR_OPTION                                                                                     \
    {                                                                                                        \
        CLI_KEY_FLOOR, "floor", "W,D[,X,Y,Z]",                                                               \
            "a plane of W x D about X,Y,Z (0,0,0) that faces +y\nreceives, and casts nothing: for casters "  \
            "without receivers"                                                                              \
    }

#define CLI_NO_CAST_OPTION                                                                                   \
    {                                                                                                        \
        CLI_KEY_NO_CAST, "no-cast", "NAME",                                                                  \
            "objects of this name only receive, or where there\nare none, those of materials; may be "       \
            "repeated"                                                                                       \
    }

#define CLI_CASTER_OPTIONS                                                                                   \
    {0, NULL, NULL, "Casters and voxels"}, {                                                                 \
        CLI_KEY_CASTER, "caster", "FILE",                                                                    \
            "another mesh or .vdb (FILE.vdb:GRID) that casts\nshadows; may be repeated"                      \
    }

/* Whether a caster stays out of level sets if a scene's shadows are `hard` or `classic`. */
static inline bool cli_caster_is_direct(const vsh_caster *caster) {
    return caster->type == VSH_CASTER_SPHERES && !caster->voxelised;
}

typedef struct cli_bake_settings {
    const char *input;
    const char *output;
    const char *output_folder; /* for the outputs of a scene, by their names; NULL: where it says */
    cli_patterns receive, no_receive, no_cast;
    cli_densities densities;
    const char *stats;
    const char *invalid_picture; /* NULL: none */
    const char *view;            /* page; NULL: none */
    cli_patch patch;             /* over the scene and its receivers */
    double sun[3];
    double sun_angle_deg;
    const char *lights; /* a file whose lights are taken, or CLI_LIGHTS_OF_INPUT; NULL: none */
    double light_radius;
    const char *casters[CLI_MAX_EXTRA_CASTERS];
    size_t caster_count;
    const char *exr;                       /* beside an asset; NULL: none */
    bool preview;                          /* of an asset */
    double floor_size[2], floor_center[3]; /* size 0: none */
    bool has_sun, has_sun_angle, has_light_radius, per_object, dry_run;
    int32_t shard, shard_count; /* 0: all of it */
    double height, world[2];    /* --height and --size-world; 0: not given. world[1] 0: the image says */
    const char *const *words;   /* [word_count]: the command line that this is */
    size_t word_count;
    const char *merged; /* parts of this name are put together, and nothing is baked; NULL: it is baked */
} cli_bake_settings;

/* Takes an option of the tables above, or a setting. */
int cli_shared_parse(cli_bake_settings *settings, int key, const char *name, const char *value);

/* The file of --lights; NULL: none. */
const char *cli_bake_lights(const cli_bake_settings *settings);

/* Takes the command line, as cli_parse() does. */
int cli_bake_parse(int argc, char **argv, cli_bake_settings *settings);

/* Bakes, or puts parts together, by settings that were taken. CLI_OK or an exit code, having said why. */
int cli_bake_by(const cli_bake_settings *settings);

/* A scene and what of it is ours: the input's, with the options put over it. */
typedef struct cli_bake_scene {
    vsh_scene scene;
    vsh_scene *read; /* the scene file's; NULL for a mesh */
    vsh_caster *casters;
    vsh_receiver *receivers;
    vsh_light *lights; /* [scene.light_count], where they are not all the scene file's */
} cli_bake_scene;

/* These make a scene; free it also after a failure. CLI_OK or an exit code, having said why. */

/* Its casters, and the settings that were given. */
int cli_bake_scene_casters(const cli_bake_settings *settings, cli_bake_scene *made);

/* The lights, too, but no receivers: for points. There may be no light and no AO. */
int cli_bake_scene_for_points(const cli_bake_settings *settings, cli_bake_scene *made);

/* All of it, with something to bake and outputs that replace no input. */
int cli_bake_scene_make(const cli_bake_settings *settings, cli_bake_scene *made);

/* Then adds the receivers, with the options put over them. CLI_OK or an exit code, having said why. */
int cli_bake_scene_receivers(const cli_bake_settings *settings, cli_bake_scene *made);

/* Whether a scene for points has anything to bake: CLI_OK, or CLI_USAGE having said why. */
int cli_bake_check_work(const cli_bake_settings *settings, const cli_bake_scene *made);

/* Refuses an output that is one of the scene's inputs. CLI_OK or an exit code, having said why. */
int cli_bake_check_output(const cli_bake_settings *settings, const vsh_scene *scene, const char *output);

/* The same of outputs that are read with what the scene names, as textures are: looks into its models where
 * such a file is there. */
int cli_bake_check_inputs(const vsh_scene *scene, const char *const *outputs, size_t count);

/* Refuses the output and the file of statistics, either of which may be NULL, where they are one file or an
 * input, or cannot be written. CLI_OK or an exit code, having said why. */
int cli_bake_check_files(const cli_bake_settings *settings, const vsh_scene *scene);
void cli_bake_scene_free(cli_bake_scene *made);

/* --- the work of commands that shade points */

typedef struct cli_shading {
    vsh_scene *scene;
    vsh_run run;
    vsh_assets *assets;
    vsh_occluders *occluders;
    cli_provenance origin;
    cli_stats stats;
} cli_shading;

/* Nothing yet; `of` is CLI_STATS_…. Free it in the end. */
cli_shading cli_shading_begin(vsh_scene *scene, int32_t of);

/* Load the assets, and make what casts. CLI_OK or an exit code, having said why. */
int cli_shading_load(cli_shading *shading);
int cli_shading_cast(cli_shading *shading, const vsh_scene_occluders_options *what);
void cli_shading_free(cli_shading *shading);

#endif
