/* The options of `vdbshade volume`. */
#ifndef CLI_VOLUME_H
#define CLI_VOLUME_H

#include "cli/bake/options.h"

typedef struct volume_settings {
    cli_bake_settings bake; /* the scene, as `bake` takes it; its output and stats are ours */
    double band;            /* 0: not given */
    bool has_box;
    double box_min[3], box_max[3], box_voxel_size; /* 0: not given */
    const char *like;                              /* file; NULL: not given */
    const char *like_grid;                         /* NULL: the first */
    char like_text[4096];
    int32_t inside;
    bool half;
    int32_t working; /* shards that have voxels: found before a file says more than all parts know */
} volume_settings;

int volume_parse(int argc, char **argv, volume_settings *settings, bool *help);

/* What can be refused of options alone. */
int volume_check_options(const volume_settings *settings);

/* What can be refused of files before any is read. */
int volume_check_files(const volume_settings *settings, const vsh_scene *scene);

/* How the scene's voxels are to be shaded. */
vsh_volume_options volume_options(const volume_settings *settings, const vsh_scene *scene);

/* How many of the shards have voxels, by what the options and the scene tell of their number. */
int32_t volume_shards(const volume_settings *settings, const vsh_scene *scene);

/* The command. */
int volume_main(int argc, char **argv);

#endif
