/* One receiver's way: its texels, its lightmap, its file. */
#ifndef CLI_RECEIVER_H
#define CLI_RECEIVER_H

#include "bands.h"
#include "origin.h"
#include "stats.h"

#include <stdbool.h>

/* The share of a lightmap's covered texels that objects may take from each other: charts that touch. */
#define CLI_LARGEST_OVERLAP 0.01

typedef struct cli_receiver_job {
    const vsh_scene *scene;
    const vsh_mesh *meshes; /* of the receiver */
    size_t mesh_count;
    const vsh_run *run;
    size_t index;                /* of the receiver */
    int32_t band_rows;           /* wanted; 0: as many as go */
    const cli_origin *origin;    /* of its file; NULL where none is written */
    bool resume;                 /* bands are kept, and taken where they are there */
    const char *invalid_picture; /* as of cli_invalid_open(); NULL: none */
    bool allow_overlap;          /* whatever the receiver says of it */
} cli_receiver_job;

/* Whether its image can be written, which `file` names (NULL: the command line does). Needs no assets. CLI_OK
 * or an exit code, having said why. */
int cli_receiver_check(const vsh_scene *scene, size_t index, const char *file);

/* Sorts and counts it, and warns (where asked to) of what is wrong with its UVs. CLI_USAGE where objects lie
 * over each other on more than CLI_LARGEST_OVERLAP of the texels. */
int cli_receiver_charts(const cli_receiver_job *job, bool warn, vsh_charts **charts);

/* How many rows go at a time, where `held` bytes are taken beside them. */
int cli_receiver_plan(const cli_receiver_job *job, const vsh_charts *charts, uint64_t held, cli_bands *bands);

/* The texels of some rows. */
int cli_receiver_texels(const vsh_charts *charts, int32_t first, int32_t rows, const vsh_run *run,
                        vsh_texels **texels);

/* What a receiver is baked from. */
typedef struct cli_receiver_input {
    const vsh_occluders *occluders;
    const vsh_charts *charts;
    const vsh_texels *texels; /* all, where they are there already; or NULL */
    cli_bands bands;
} cli_receiver_input;

/* Shades the texels and writes the file. */
int cli_receiver_bake(const cli_receiver_job *job, const cli_receiver_input *input, cli_stats *stats);

#endif
