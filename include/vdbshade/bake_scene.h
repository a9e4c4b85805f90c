/* Baking a scene: from its files to its lightmaps' files, in one call. */
#ifndef VDBSHADE_BAKE_SCENE_H
#define VDBSHADE_BAKE_SCENE_H

#include "image.h"
#include "lit.h"
#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A lightmap of a scene. The pointers hold until the bake returns. */
typedef struct vsh_scene_lightmap {
    size_t receiver;  /* its number in the scene */
    size_t page;      /* of the receiver, which has several if it is unwrapped onto several, or per object */
    const char *path; /* of the receiver's file */
    const char
        *output; /* the file to write: OUT.exr; of one page of several OUT.PAGE.exr or OUT.OBJECT.exr */
    const vsh_mesh *meshes; /* [mesh_count]: that receive */
    size_t mesh_count;
    int32_t width; /* texels */
    int32_t height;
    uint64_t covered;        /* texels with at least one sample; 0 until the charts are counted */
    uint64_t samples;        /* evaluated positions, supersampling counted; 0 until then */
    uint64_t invalid_texels; /* as in vsh_bake_stats; 0 until it is baked */
} vsh_scene_lightmap;

/* Receives `count` rows of a lightmap, from row `first` on: planes[image->channel_count][count][width].
 * Lightmaps come one after the other, each from row 0 on, in the calling thread. `image` has the channels'
 * names and no planes. A result that is not VSH_OK ends the bake; the callback then fills `error`. */
typedef vsh_result vsh_rows_fn(void *user, const vsh_scene_lightmap *lightmap, const vsh_image *image,
                               int32_t first, int32_t count, const float *const *planes, vsh_error *error);

/* How vsh_bake_scene() bakes. */
typedef struct vsh_bake_options {
    size_t struct_size;
    const char *scratch; /* folder for nameless files with what run->memory_limit has no room for; NULL: the
                            output's folder */
    const char *invalid_picture; /* PNG of the texels that are not valid, one for each lightmap. Several are
                                    named FILE.OUTPUT.png. NULL: none */
    vsh_rows_fn *rows;           /* receives the lightmaps; no file is written then. NULL: they are written to
                                    the receivers' outputs, with their provenance. If an output ends in .glb,
                                    .gltf or .obj, the receiver's file is written with its light
                                    (vsh_lit_write()) */
    const char *command;         /* these three as in vsh_provenance_source */
    const char *const *files;
    size_t file_count;
    /* The scene's files are read, and lightmaps[count] are known; nothing is baked yet. A result that is not
     * VSH_OK ends the bake; the callback then fills `error`. May be NULL. */
    vsh_result (*loaded)(void *user, const vsh_scene_lightmap *lightmaps, size_t count, vsh_error *error);
    /* A lightmap is written. May be NULL. */
    void (*done)(void *user, const vsh_scene_lightmap *lightmap);
    void *user;          /* passed to the callbacks */
    int32_t lit_preview; /* nonzero: assets show the light as their unlit base colour */
    const char *lit_exr; /* EXR of all channels beside the one asset; NULL: none */
    int32_t shard; /* 1 … shard_count: vsh_bake_scene() bakes every shard_count-th tile of those with texels
                      into the file PARTS.SHARD-of-COUNT.part; 0: all tiles. Not with `rows` or
                      `invalid_picture` */
    int32_t shard_count; /* 1 … 10000; vsh_merge_scene() also takes 0: as many as there are beside PARTS */
    const char *parts;   /* prefix of the parts' names; NULL: the first lightmap's output */
    const char *const *words; /* [word_count]: stored in a part for vsh_part_words() */
    size_t word_count;
} vsh_bake_options;

static inline vsh_bake_options vsh_bake_options_default(void) {
    vsh_bake_options options = {sizeof(vsh_bake_options),
                                NULL,
                                NULL,
                                NULL,
                                NULL,
                                NULL,
                                0,
                                NULL,
                                NULL,
                                NULL,
                                0,
                                NULL,
                                0,
                                0,
                                NULL,
                                NULL,
                                0};
    return options;
}

/* Times and counts of a bake. The caller zeroes it. */
typedef struct vsh_bake_report {
    double load_s;   /* seconds: files read and hashed */
    double bake_s;   /* texels made and shaded */
    double write_s;  /* rows packed and written */
    uint64_t texels; /* these three of all lightmaps */
    uint64_t samples;
    uint64_t invalid_texels;
    size_t lightmap_count;        /* 0 for a shard without tiles */
    vsh_shade_stats shade;        /* of all lightmaps */
    vsh_occluders_info occluders; /* shared by all lightmaps */
    vsh_bake_error *errors; /* the caller's [2 + lights of the scene]: of each light, of AO, of the sky. NULL:
                               not wanted */
} vsh_bake_report;

/* Whether the image (or the asset) of receiver `index` can be written as it asks, its channels included,
 * without reading a file. Errors: as vsh_image_check(); VSH_ERROR_ARGUMENT (scene NULL, no such
 * receiver, more channels than VSH_MAX_CHANNELS; an asset without AO, irradiance and shadows, or of 32 bits,
 * or with a pack). */
VSH_API vsh_result vsh_receiver_check(const vsh_scene *scene, size_t index, vsh_error *error);

/* Bakes a scene: loads its files, makes its occluders, bakes its lightmaps tile by tile and writes them. With
 * a shard, it writes a part instead. `options` and `report` may be NULL; the report is filled on success.
 * Lightmaps that are written before an error stay. Errors: as vsh_assets_load(), vsh_receiver_check(),
 * vsh_charts_create(), vsh_scene_occluders(), vsh_bake_lightmap(), the image writer and the callbacks;
 * VSH_ERROR_ARGUMENT (a pointer NULL, options, run; no receivers); VSH_ERROR_INPUT (UVs that cover no texel;
 * objects that share more than VSH_LARGEST_OVERLAP of the texels; a lightmap whose texels are all invalid);
 * VSH_ERROR_WRITE (no room in the scratch folder); VSH_ERROR_LIMIT; VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_bake_scene(const vsh_scene *scene, const vsh_bake_options *options, const vsh_run *run,
                                  vsh_bake_report *report, vsh_error *error);

/* Merges the parts that vsh_bake_scene() wrote for the same scene and options, on whatever machines: loads
 * receivers, estimates AO, fills, pads, stitches, and writes the same files, bit by bit, as one bake. The
 * parts stay. Errors: as vsh_bake_scene(); VSH_ERROR_READ (a part is missing); VSH_ERROR_INPUT (there are no
 * parts; a part is damaged, or of other inputs, options or another version, and is named). */
VSH_API vsh_result vsh_merge_scene(const vsh_scene *scene, const vsh_bake_options *options,
                                   const vsh_run *run, vsh_bake_report *report, vsh_error *error);

/* Reads the words stored in the first part that exists of `shard_count` (0: as many as there are beside
 * `parts`):
 * (*words)[*count], then NULL. Free them with vsh_part_words_free(). Anybody may have written the part, so do
 * not trust its words. Errors: VSH_ERROR_ARGUMENT (NULL, run), VSH_ERROR_READ, VSH_ERROR_INPUT (no parts,
 * parts of several shard counts, not a part), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_part_words(const char *parts, int32_t shard_count, const vsh_run *run, char ***words,
                                  size_t *count, vsh_error *error);
VSH_API void vsh_part_words_free(char **words); /* NULL does nothing */

/* Texels, voxels and memory of a bake, scaled up from a trial with few voxels. */
typedef struct vsh_bake_forecast {
    size_t lightmap_count; /* of all receivers */
    uint64_t texels;       /* with at least one sample */
    uint64_t samples;      /* evaluated positions */
    double voxels;         /* active, of all level sets; 0, as the next two, if there are none */
    double voxel_size;     /* world units */
    double resolution;     /* voxels along the longest side */
    double peak_bytes;     /* at most */
    double grid_bytes;     /* of the level sets */
    double field_bytes;    /* of the fields */
    int32_t has_triangles; /* nonzero: they are traced, and auto is exact */
} vsh_bake_forecast;

/* Forecasts vsh_bake_scene() of the whole scene. The outputs' folders need not exist. Errors: as there. */
VSH_API vsh_result vsh_forecast_scene(const vsh_scene *scene, const vsh_bake_options *options,
                                      const vsh_run *run, vsh_bake_forecast *forecast, vsh_error *error);

/* The charts of a receiver's meshes, sorted and counted as its bake does, with its warnings about UVs. The
 * meshes must outlive them. Free them with vsh_charts_free(). Errors: as vsh_bake_scene(); VSH_ERROR_ARGUMENT
 * (a pointer NULL, no such receiver). */
VSH_API vsh_result vsh_receiver_charts(const vsh_scene *scene, size_t index, const vsh_mesh *meshes,
                                       size_t mesh_count, const vsh_run *run, vsh_charts **charts,
                                       vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
