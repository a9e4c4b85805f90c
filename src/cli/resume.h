/* Bands of a lightmap that are kept until it is whole, so that a bake that was ended goes on from them. They
 * stand in OUT.resume: what the bake is, as its output tells it, and for each band the statistics so far, its
 * channels and a checksum. */
#ifndef CLI_RESUME_H
#define CLI_RESUME_H

#include "origin.h"
#include "planes.h"

#include <stdbool.h>
#include <stdio.h>

typedef struct cli_resume {
    FILE *file; /* NULL: nothing is kept */
    char path[4096];
    bool taking;  /* there may be bands to take yet */
    int32_t rows; /* kept or taken so far */
    size_t error_count;
} cli_resume;

/* Opens, or begins, the file of an output, which no other run may have open: CLI_OK or an exit code, having
 * said why. Bands of another bake, or of other heights, are told and dropped. `error_count` is the number of
 * the statistics' `errors`. */
int cli_resume_open(cli_resume *resume, const char *output, const cli_origin *origin, const vsh_image *image,
                    int32_t band_rows, size_t error_count);

/* Takes the next band into the image's planes, and the statistics up to its end (invalid_by_mesh
 * [mesh_count]). False where there is none: it is to be baked, and so is all behind it. */
bool cli_resume_take(cli_resume *resume, int32_t first, int32_t rows, cli_planes *planes,
                     vsh_bake_stats *stats, size_t mesh_count);

/* Keeps a band, on the disk when this returns. Where that fails, says so, and no more is kept. */
void cli_resume_keep(cli_resume *resume, int32_t first, int32_t rows, const cli_planes *planes,
                     const vsh_bake_stats *stats, size_t mesh_count);

/* Closes the file; where the bake failed (`code`), says what of it is kept. */
void cli_resume_close(cli_resume *resume, const char *output, int32_t height, int code);

/* The lightmap is whole: takes the file of an output away. */
void cli_resume_remove(const char *output);

#endif
