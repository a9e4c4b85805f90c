/* How many rows of a lightmap are baked at a time: all, or as many as the memory limit allows. */
#ifndef CLI_BANDS_H
#define CLI_BANDS_H

#include <stdbool.h>
#include <vdbshade/vdbshade.h>

/* What a lightmap takes, whatever is baked at a time. */
typedef struct cli_bands_need {
    int32_t channels;    /* of the image */
    int32_t interleaved; /* those that are baked interleaved */
    bool errors, irradiance, bent, tint;
    uint64_t held;     /* bytes: field, triangles, and what else is held meanwhile */
    uint64_t writer;   /* bytes: vsh_image_writer_bytes() */
    uint64_t limit;    /* bytes; 0: none */
    int32_t rows;      /* wanted; 0: as many as go */
    const char *where; /* output, for messages */
} cli_bands_need;

typedef struct cli_bands {
    int32_t rows;   /* of each band but the last: a multiple of VSH_BAND_STEP, or all */
    int32_t count;  /* bands */
    uint64_t bytes; /* that the largest takes, with what is held */
} cli_bands;

/* What the scene's images of this shape take, without `held`, `limit` and `rows`. */
cli_bands_need cli_bands_need_of(const vsh_scene *scene, const vsh_image *image, const char *output,
                                 const vsh_image_options *options);

/* Finds the fewest bands that keep within the limit, all of about one height. CLI_OK, or CLI_LIMIT where not
 * even the smallest bands do, having said what takes how much. */
int cli_bands_plan(const vsh_charts *charts, const cli_bands_need *need, cli_bands *bands);

#endif
