/* Bands of a lightmap that are kept until it is whole, so that a bake that was ended goes on from them. They
 * stand in OUTPUT.resume: what the bake is, as its output tells it, and for each band the statistics so far,
 * its channels (of a part also what is known of its texels, and kept of their AO) and a checksum. */
#ifndef VSHI_RESUME_H
#define VSHI_RESUME_H

#include "bake_scene/channels.h"

#include <stdio.h>

typedef struct vshi_resume {
    FILE *file;         /* NULL: nothing is kept */
    const vsh_run *run; /* that is warned */
    char path[4096];
    bool taking;  /* there may be bands to take yet */
    int32_t rows; /* kept or taken so far */
    size_t error_count;
} vshi_resume;

/* What a bake is: bands of another one are not taken. */
typedef struct vshi_resume_key {
    const vsh_attribute *attributes; /* [attribute_count]: where its output comes from */
    size_t attribute_count;
    const vsh_image *image;
    int32_t band_rows;
    bool part; /* of the rows first … end - 1 by themselves */
    int32_t first, end;
} vshi_resume_key;

/* Opens, or begins, the file of an output, which no other run may have open. Bands of another bake, or of
 * other heights, are dropped with a warning. `error_count` is the number of the statistics' `errors`. Errors:
 * VSH_ERROR_WRITE (something else stands there, or another run has it open), VSH_ERROR_ARGUMENT (the name is
 * too long), VSH_ERROR_MEMORY. */
vsh_result vshi_resume_open(const char *output, const vshi_resume_key *key, size_t error_count,
                            const vsh_run *run, vshi_resume *resume, vsh_error *error);

/* Takes the next band into the image's planes, and the statistics up to its end (invalid_by_mesh
 * [mesh_count]). False where there is none: it is to be baked, and so is all behind it. */
bool vshi_resume_take(vshi_resume *resume, int32_t first, int32_t rows, vshi_channels *channels,
                      vsh_bake_stats *stats, size_t mesh_count);

/* Keeps a band, on the disk when this returns. Where that fails it warns, and no more is kept. */
void vshi_resume_keep(vshi_resume *resume, int32_t first, int32_t rows, const vshi_channels *channels,
                      const vsh_bake_stats *stats, size_t mesh_count);

/* Closes the file and returns how many rows it keeps. */
int32_t vshi_resume_close(vshi_resume *resume);

/* The lightmap is whole: takes the file of an output away. */
void vshi_resume_remove(const char *output);

#endif
