/* The planes that a bake fills, and the image they make. */
#ifndef CLI_PLANES_H
#define CLI_PLANES_H

#include <stdbool.h>
#include <vdbshade/vdbshade.h>

/* Three channels that are baked interleaved. */
typedef struct cli_triple {
    float *values; /* [rows][width][3] */
    size_t first;  /* of their planes */
} cli_triple;

typedef struct cli_planes {
    vsh_image image;       /* the channels, in order: shadow.NAME …, ao, error.NAME …, error.ao,
                              irradiance.R, .G, .B, bent.X, .Y, .Z, tint.NAME.R, .G, .B …,
                              invalid, A */
    vsh_lightmap lightmap; /* the same memory, as the bake takes it */
    char (*names)[VSH_CHANNEL_NAME];
    const char **name_list;
    float **planes;
    cli_triple *triples; /* irradiance, bent normals, tints; split by cli_planes_split() */
    float **tints;       /* [light_count]: of the last of them */
    float *invalid;      /* as the bake writes it; NULL: not asked for */
    size_t triple_count;
    int32_t rows; /* that there is memory for */
} cli_planes;

/* Names the channels of a scene at a size, without memory for values: enough for vsh_image_check(). Returns 0
 * or an exit code, having said why. */
int cli_planes_name(cli_planes *planes, const vsh_scene *scene, int32_t width, int32_t height);

/* Channels of a scene that are baked interleaved, and take memory twice. */
int32_t cli_planes_interleaved(const vsh_scene *scene);

/* Takes the memory for the values of `rows` rows, where they stay within `limit` bytes (0: no limit).
 * `invalid`: where texels are invalid is wanted, whether or not there is a channel of it. */
int cli_planes_allocate(cli_planes *planes, const vsh_scene *scene, int32_t rows, bool invalid,
                        uint64_t limit, const char *output);

/* After the bake: what is interleaved, and what is invalid, into its planes. */
void cli_planes_split(cli_planes *planes);

void cli_planes_free(cli_planes *planes); /* zeroed ones too */

#endif
