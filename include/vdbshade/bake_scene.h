/* Baking a scene: from its files to its lightmaps' files, in one call or step by step. */
#ifndef VDBSHADE_BAKE_SCENE_H
#define VDBSHADE_BAKE_SCENE_H

#include "image.h"
#include "lit.h"
#include "parts.h"
#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- where rows go */

/* A lightmap of a job. The pointers belong to the job and hold until it is freed. */
typedef struct vsh_job_lightmap {
    size_t receiver;        /* its number in the scene */
    const char *path;       /* of the receiver's file */
    const char *output;     /* file that it goes to; of an object its own */
    const vsh_mesh *meshes; /* [mesh_count]: that receive */
    size_t mesh_count;
    int32_t width; /* texels */
    int32_t height;
    uint64_t covered;        /* texels with at least one sample; these two from vsh_bake_job_measure() on */
    uint64_t samples;        /* evaluated positions, supersampling counted */
    uint64_t invalid_texels; /* once it is baked: as in vsh_bake_stats */
    size_t page; /* of the receiver, where it is unwrapped onto several, or has one for each object: an
                    image's name then has its number before the ending, OUT.0.exr, or the object's name */
} vsh_job_lightmap;

/* Takes the rows of lightmaps, one lightmap after the other, from the top on, in the thread that called
 * vsh_bake_job_run(). A call that does not return VSH_OK ends the bake with that result; it fills `error`. */
typedef struct vsh_row_sink {
    size_t struct_size;
    /* The lightmap's rows follow. `image` has its channels' names, and no planes. */
    vsh_result (*begin)(void *user, const vsh_job_lightmap *lightmap, const vsh_image *image,
                        vsh_error *error);
    /* The next `rows` rows: planes[image->channel_count][rows × width]. */
    vsh_result (*add)(void *user, int32_t rows, const float *const *planes, vsh_error *error);
    /* It is whole, or `result` (not VSH_OK) says why it will not be, which what `end` returns then does not
     * change. Called once for each `begin` that returned VSH_OK. */
    vsh_result (*end)(void *user, vsh_result result, vsh_error *error);
    void *user; /* handed to its functions */
} vsh_row_sink;

static inline vsh_row_sink vsh_row_sink_default(void) {
    vsh_row_sink sink = {sizeof(vsh_row_sink), NULL, NULL, NULL, NULL};
    return sink;
}

/* --- jobs */

typedef struct vsh_bake_job_options {
    size_t struct_size;
    int32_t per_object;    /* nonzero: every receiver is of VSH_ATLAS_OBJECTS, a lightmap for each object. An
                              image's name has the object's, in place of "%s", or else before the ending:
                              OUT.NAME.exr */
    int32_t allow_overlap; /* nonzero: objects may share texels, whatever their receivers say */
    const char *scratch;   /* folder of nameless files for what run->memory_limit has no room for; NULL: that
                              of the lightmap's output */
    const char *invalid_picture; /* PNG of the texels that are not valid, for each lightmap: where there are
                                    several, FILE.OUTPUT.png, of pages of an asset with the number or the
                                    object; of outputs of one name FILE.OUTPUT-2.png and so on from the
                                    second. NULL: none */
    const vsh_row_sink *sink; /* NULL: image files at the receivers' outputs, which say where they come from
                                 (vsh_provenance); where an output's name ends in .glb, .gltf or .obj, the
                                 receiver's file with its light (vsh_lit_write()): AO as occlusion, irradiance
                                 or else the mean of the lights' shadows as lightmap, whose intensity is π:
                                 what is lit fully shows its own colour */
    const char *command;      /* these three as in vsh_provenance_source */
    const char *const *files;
    size_t file_count;
    /* A lightmap is done, or (`result`) failed. May be NULL. */
    void (*done)(void *user, const vsh_job_lightmap *lightmap, vsh_result result);
    /* A file is written from here on, beside its place under a temporary name; NULL: no more. For programs
     * that may end in the middle of it, and take it away then. May be NULL. */
    void (*writing)(void *user, const char *path);
    void *user;          /* handed to both */
    int32_t lit_preview; /* these three of outputs that are assets (vsh_lit_is_output()). Nonzero: what the
                            image shows is their unlit base colour */
    int32_t lit_image_place; /* VSH_LIT_IMAGES_… */
    const char *lit_exr;     /* EXR of all channels beside the one output; NULL: none */
    int32_t shard; /* 1 … shard_count: vsh_bake_job_run() bakes every shard_count-th tile of those with
                      texels, and writes them into the file PARTS.SHARD-of-COUNT.part, whole or not at all; 0:
                      all tiles. Not with a sink or `invalid_picture` */
    int32_t shard_count; /* 1 … 10000; for vsh_bake_job_merge() also 0: as many as there are beside PARTS */
    const char *parts;   /* what the names of parts begin with; NULL: the first lightmap's output */
    const char *const *words; /* [word_count]: kept in a part as they are, for vsh_part_words() */
    size_t word_count;
    int32_t forecast; /* nonzero: the job is for vsh_bake_job_forecast() alone, so folders of outputs
                         need not exist */
} vsh_bake_job_options;

static inline vsh_bake_job_options vsh_bake_job_options_default(void) {
    vsh_bake_job_options options = {
        sizeof(vsh_bake_job_options), 0,    0, NULL, NULL, NULL, NULL, NULL, 0, NULL, NULL, NULL, 0,
        VSH_LIT_IMAGES_AUTO,          NULL, 0, 0,    NULL, NULL, 0,    0};
    return options;
}

/* The lightmaps of a scene under way. Not for several threads at once. Free it with vsh_bake_job_free(). */
typedef struct vsh_bake_job vsh_bake_job;

/* Whether the image (or the asset) of receiver `index` can be written as it asks, its channels included,
 * without reading a file. Errors: as vsh_image_check(); VSH_ERROR_ARGUMENT (scene NULL, no such
 * receiver, more channels than VSH_MAX_CHANNELS; an asset without AO, irradiance and shadows, or of 32 bits,
 * or with a pack). */
VSH_API vsh_result vsh_receiver_check(const vsh_scene *scene, size_t index, vsh_error *error);

/* Loads the scene's files and finds its lightmaps. Scene, options and what they point to must outlive the
 * job. Errors: as vsh_assets_load(), vsh_receiver_check() and, of assets, vsh_lit_check_uvs();
 * VSH_ERROR_ARGUMENT (a pointer NULL, options, run; no receivers). */
VSH_API vsh_result vsh_bake_job_create(const vsh_scene *scene, const vsh_bake_job_options *options,
                                       const vsh_run *run, vsh_bake_job **job, vsh_error *error);
VSH_API void vsh_bake_job_free(vsh_bake_job *job); /* NULL does nothing */

/* Rasterises the lightmaps to count their texels, and warns of what is wrong with their UVs. Errors:
 * VSH_ERROR_INPUT (as vsh_charts_create(); UVs that cover no texel; objects that share more than
 * VSH_LARGEST_OVERLAP of the texels), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_bake_job_measure(vsh_bake_job *job, const vsh_run *run, vsh_error *error);

/* Makes what casts, if vsh_bake_job_measure() went well. Errors: as vsh_scene_occluders(); VSH_ERROR_ARGUMENT
 * (not measured). */
VSH_API vsh_result vsh_bake_job_prepare(vsh_bake_job *job, const vsh_run *run, vsh_error *error);

/* Bakes every lightmap and hands over its rows, once vsh_bake_job_prepare() went well. Errors: as
 * vsh_bake_lightmap() and the sink, and for files as vsh_image_writer_create() to …_finish();
 * VSH_ERROR_INPUT (a lightmap whose texels are all invalid); VSH_ERROR_LIMIT (what is worked on at a time is
 * over the limit); VSH_ERROR_WRITE (no room in the scratch folder). Lightmaps that are done by then stay. */
VSH_API vsh_result vsh_bake_job_run(vsh_bake_job *job, const vsh_run *run, vsh_error *error);

/* Puts the parts of all shards together, which vsh_bake_job_run() wrote for the same scene and options on
 * whatever machines, in place of …_prepare() and …_run(): estimates AO, fills, pads, stitches, and writes the
 * same files, bit by bit, as one bake. What casts is not made. The parts stay. Errors: as …_measure() and the
 * writing of …_run(); VSH_ERROR_READ (a part is missing), VSH_ERROR_INPUT (there are none; one is damaged, or
 * of other inputs, options or another version than this job, all of which it names). */
VSH_API vsh_result vsh_bake_job_merge(vsh_bake_job *job, const vsh_run *run, vsh_error *error);

/* How many lightmaps there are (0 of a shard without tiles), and one of them, whose `index` is below it. */
VSH_API size_t vsh_bake_job_count(const vsh_bake_job *job);
VSH_API void vsh_bake_job_lightmap(const vsh_bake_job *job, size_t index, vsh_job_lightmap *lightmap);

/* The files that it loaded; NULL before. They belong to the job. */
VSH_API const vsh_assets *vsh_bake_job_assets(const vsh_bake_job *job);

/* What a job has done so far. */
typedef struct vsh_bake_report {
    double load_s;   /* seconds: files read and hashed */
    double bake_s;   /* texels made and shaded */
    double write_s;  /* rows packed and written */
    uint64_t texels; /* these two of all lightmaps, as in vsh_bake_stats */
    uint64_t invalid_texels;
    vsh_shade_stats shade;        /* of all lightmaps */
    vsh_occluders_info occluders; /* that all of them share */
    const vsh_bake_error *errors; /* [error_count]: of each light, of AO, of the sky; belong to the job */
    size_t error_count;           /* 2 + lights of the scene; 0 before vsh_bake_job_prepare() */
} vsh_bake_report;

/* Cannot fail. */
VSH_API void vsh_bake_job_get_report(const vsh_bake_job *job, vsh_bake_report *report);

/* All of it: vsh_bake_job_create(), …_measure(), …_prepare() and …_run(). `report` (may be NULL) is filled on
 * success, without `errors`. Errors: as these. */
VSH_API vsh_result vsh_bake_scene(const vsh_scene *scene, const vsh_bake_job_options *options,
                                  const vsh_run *run, vsh_bake_report *report, vsh_error *error);

/* --- what a job will take */

/* Found by making few voxels, and scaling up what they took. */
typedef struct vsh_bake_forecast {
    uint64_t texels;  /* with at least one sample */
    uint64_t samples; /* evaluated positions */
    double voxels;    /* active, of all level sets; these three 0 where none are made */
    double voxel_size;
    double resolution;     /* voxels along the longest side */
    double peak_bytes;     /* at most */
    double grid_bytes;     /* of the level sets */
    double field_bytes;    /* of the fields */
    int32_t has_triangles; /* nonzero: they are traced, and auto is exact */
} vsh_bake_forecast;

/* Of a job that was created and not measured. The job is then measured, without warnings. Errors: as
 * vsh_bake_job_measure() and …_prepare(), vsh_bake_lightmap(). */
VSH_API vsh_result vsh_bake_job_forecast(vsh_bake_job *job, const vsh_run *run, vsh_bake_forecast *forecast,
                                         vsh_error *error);

/* The charts of a receiver's meshes, sorted and counted as its bake does, with the warnings of
 * vsh_bake_job_measure(). The meshes must outlive them. Free them with vsh_charts_free(). Errors: as there;
 * VSH_ERROR_ARGUMENT (a pointer NULL, no such receiver). */
VSH_API vsh_result vsh_receiver_charts(const vsh_scene *scene, size_t index, const vsh_mesh *meshes,
                                       size_t mesh_count, int32_t allow_overlap, const vsh_run *run,
                                       vsh_charts **charts, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
