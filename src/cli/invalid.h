/* The picture of --invalid: a lightmap's charts, and the texels of them that are not valid. */
#ifndef CLI_INVALID_H
#define CLI_INVALID_H

#include <stdbool.h>
#include <vdbshade/vdbshade.h>

typedef struct cli_invalid {
    char *path; /* NULL: none is asked for */
    vsh_image image;
    float *planes[3]; /* R, G, B of as many rows as are baked at a time */
    vsh_image_writer *writer;
} cli_invalid;

/* Whether a picture can be written there: CLI_OK or an exit code, having said why. */
int cli_invalid_check(const char *path);

/* Opens the picture for an image `output` of this size, of which `rows` come at a time: at `path`, or where
 * there are several images FILE.OUTPUT.png for it. NULL: does nothing. CLI_OK or an exit code. */
int cli_invalid_open(cli_invalid *picture, const char *path, const char *output, bool several, int32_t width,
                     int32_t height, int32_t rows);

/* Adds rows, of planes as of vsh_lightmap. */
int cli_invalid_add(cli_invalid *picture, int32_t rows, const float *invalid, const float *coverage);

/* Completes the file where `code` is CLI_OK, else leaves what was there. Returns `code`, or why not. */
int cli_invalid_close(cli_invalid *picture, int code);

/* Warns of texels that are not valid, if there are any: how many, of which meshes, and what would help.
 * `path` is that of the receiver, `traced` whether rays against triangles decided. */
void cli_invalid_warn(const vsh_run *run, const char *path, const vsh_mesh *meshes, size_t mesh_count,
                      const vsh_bake_stats *baked, bool traced);

#endif
