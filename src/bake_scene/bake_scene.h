/* A scene's bake under way, and its lightmaps, from charts to files: one for each page of a receiver. */
#ifndef VSHI_BAKE_SCENE_H
#define VSHI_BAKE_SCENE_H

#include "bake/page.h"
#include "base/store.h"
#include "mesh/mesh_set.h"

#include <stdbool.h>
#include <vdbshade/bake_scene.h>
#include <vdbshade/image.h>
#include <vdbshade/provenance.h>
#include <vdbshade/scene.h>

/* --- lightmaps */

/* One lightmap. */
typedef struct vshi_target {
    vsh_receiver receiver; /* the scene's, with this lightmap's output and size */
    size_t index;          /* of the receiver in the scene */
    const vsh_mesh *meshes;
    size_t mesh_count;
    char *output;      /* FILE.OBJECT.exr of an object, FILE.PAGE.exr of a page, or the receiver's own */
    vshi_mesh_set set; /* the set that holds the meshes */
    size_t page;       /* of the receiver */
    bool unwrapped;    /* its UVs are new, or packed again */
    char *object;      /* the object's name in files, unique among the lightmaps; NULL: several objects */
} vshi_target;

typedef struct vshi_targets {
    vshi_target *list; /* [count] */
    size_t count;
} vshi_targets;

/* The name of a target's file: FILE.OBJECT.exr for an object, FILE.PAGE.exr for one of several `pages`, else
 * FILE.exr. To be freed; NULL if out of memory. */
char *vshi_target_file(const vshi_target *target, size_t pages, const char *file);

/* Finds what is solid of receivers that do not cast. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED. Free them also after a failure. */
vsh_result vshi_targets_make(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                             vshi_targets *targets, vsh_error *error);
void vshi_targets_free(vshi_targets *targets);

/* A receiver's image, of its bits, packing and colours. */
vsh_image_options vshi_receiver_image(const vsh_receiver *receiver);

/* --- the bake */

/* A page that goes into an asset, kept until the receiver's other pages are baked. */
typedef struct vshi_lit_page {
    int32_t width, height;
    const char *object; /* its name; NULL: several objects */
    float *planes[4];   /* AO; light: R, G and B, or one; NULL: none */
} vshi_lit_page;

/* The objects that a light or the sky reaches. */
typedef struct vshi_lit {
    const vsh_mesh *mesh; /* NULL: nothing yet */
    bool several;         /* more than one object */
} vshi_lit;

typedef struct vshi_scene_bake {
    vsh_scene scene;
    vsh_bake_options options;
    vsh_run run; /* resolved */
    vsh_assets *assets;
    vshi_targets targets;
    vsh_scene_lightmap *lightmaps; /* [targets.count] */
    vsh_charts **charts;           /* [targets.count]; NULL before they are counted */
    double receivers[2][3];        /* world box of all samples, min and max; min > max: none, or not needed */
    vsh_occluders *occluders;      /* NULL in merges */
    bool layered_ao;               /* layers take part in AO, so texels do not share its rays */
    struct vshi_tracer *tracer;    /* NULL in merges */
    vsh_provenance *provenance;    /* NULL if the caller receives the rows */
    vsh_bake_error *errors;        /* [error_count]: of each light, of AO, of the sky */
    size_t error_count;
    vshi_lit *lit; /* [light_count + 1]: of each light, of the sky */
    vsh_bake_report report;
    vshi_lit_page *lit_pages; /* [lit_page_count]: of the current receiver */
    size_t lit_page_count;
    struct vshi_parts *parts; /* the source of a merge's tiles; NULL: they are traced */
} vshi_scene_bake;

/* Finds the provenance of the outputs, once the occluders are known. */
vsh_result vshi_bake_find_provenance(vshi_scene_bake *bake, vsh_error *error);

/* Adds a lightmap's results to the report. */
void vshi_bake_report_add(vshi_scene_bake *bake, const vsh_bake_stats *baked);

/* --- the channels of lightmaps: which there are, in which order, and the planes that a bake fills */

typedef struct vshi_channels {
    vsh_image image;       /* their names, in the order of bake/planes.c; A is the last. No planes */
    vsh_lightmap lightmap; /* the values, as the bake takes them */
    char (*names)[VSH_CHANNEL_NAME];
    const char **name_list;
    int32_t *holds;
    float **values;     /* [value_count][height][width][components]: of the store */
    size_t *components; /* [value_count]: 1 or 3 channels each */
    size_t value_count;
    vshi_store *store; /* NULL: there is no memory for values */
} vshi_channels;

/* Names the channels of a scene at a size, without memory for values: enough for vsh_image_check(). Errors:
 * VSH_ERROR_ARGUMENT (more than VSH_MAX_CHANNELS), VSH_ERROR_MEMORY. Free them also after a failure. */
vsh_result vshi_channels_name(const vsh_scene *scene, int32_t width, int32_t height, vshi_channels *channels,
                              vsh_error *error);

/* Takes the memory for the values, zeroed. `output` is for messages. Errors: as vshi_store_take(). */
vsh_result vshi_channels_allocate(vshi_channels *channels, const vsh_scene *scene, vshi_store *store,
                                  const char *output, vsh_error *error);

/* Which planes a scene's bake fills, and how: those that are not NULL, which are none to be written to. */
vsh_lightmap vshi_channels_shape(const vsh_scene *scene);

/* Memory that vshi_channels_rows() takes for so many rows, to be freed. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_channels_allocate_rows(const vshi_channels *channels, int32_t rows, float **memory,
                                       vsh_error *error);

/* Rows of all channels, planes[image.channel_count][rows][width]. */
void vshi_channels_rows(const vshi_channels *channels, int32_t first, int32_t rows, float *memory,
                        const float **planes);

void vshi_channels_free(vshi_channels *channels); /* zeroed ones too */

/* --- pages */

/* One lightmap. */
typedef struct vshi_scene_page {
    vshi_scene_bake *bake;
    const vshi_target *target;
    size_t index; /* of the target */
    const vsh_charts *charts;
    vsh_scene_lightmap *lightmap;
    vshi_channels channels;
    vshi_page page;
    vsh_bake_stats baked;
} vshi_scene_page;

/* Takes memory for a lightmap. Close it also after an error. Errors: as vshi_store_take(). */
vsh_result vshi_scene_page_open(vshi_scene_bake *bake, size_t index, vshi_store *store, vshi_scene_page *page,
                                vsh_error *error);
void vshi_scene_page_close(vshi_scene_page *page);

/* A store for lightmap `index`, whose files lie beside its output. `run` must outlive it. Close it with
 * vshi_scene_store_close(). Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_scene_store_open(const vshi_scene_bake *bake, size_t index, vsh_run *run, vshi_store *store,
                                 vsh_error *error);
void vshi_scene_store_close(vshi_store *store);

/* Bytes that the lightmaps held together take, at most. */
double vshi_bake_bytes(const vshi_scene_bake *bake);

/* Bakes lightmaps, or reads them from parts, finishes and writes them. Lightmaps whose seams are fixed
 * stay in memory together. Errors: as vsh_bake_scene(). */
vsh_result vshi_bake_pages(vshi_scene_bake *bake, vsh_error *error);

/* Adds the file's name to an error of a function that knows arrays only. Returns `result`. */
vsh_result vshi_name_file(const char *path, vsh_result result, vsh_error *error);

/* --- a receiver's own file, written with its light in the materials */

typedef struct vshi_lit_output {
    vshi_scene_bake *bake;
    const vshi_target *target;
    const vsh_scene_lightmap *lightmap;
    vshi_lit_page page;    /* the current one; the bake keeps it when it is complete */
    int32_t rows;          /* received so far */
    vsh_image_writer *exr; /* an EXR of all channels; NULL: not asked for */
    char *exr_path;
    int32_t first_source[4]; /* each plane is the mean of so many channels from this one on */
    int32_t source_count[4];
} vshi_lit_output;

/* Ambient light, linear, of an asset whose scene names none: shadows are not black. */
#define VSHI_LIT_AMBIENT 0.25

/* Adds irradiance and ambient light to a scene whose outputs are all assets. */
void vshi_lit_output_scene(vsh_scene *scene);

/* Whether an asset can be written with these channels. Errors: as vsh_receiver_check(). */
vsh_result vshi_lit_output_check(const vsh_receiver *receiver, const vsh_image *image, vsh_error *error);

/* Whether the receivers' files have room for the UVs of their new atlases; before anything is baked. Errors:
 * as vsh_lit_check_uvs(). */
vsh_result vshi_lit_check_uvs(vshi_scene_bake *bake, vsh_error *error);

/* Takes memory for a page. Close it also after an error. */
vsh_result vshi_lit_output_open(vshi_lit_output *lit, const vshi_scene_page *page, vsh_error *error);

/* Adds the next rows of all channels. */
vsh_result vshi_lit_output_add(vshi_lit_output *lit, int32_t rows, const float *const *planes,
                               vsh_error *error);

/* Keeps the page, and writes the asset with the receiver's last one. */
vsh_result vshi_lit_output_finish(vshi_lit_output *lit, vsh_error *error);
void vshi_lit_output_close(vshi_lit_output *lit); /* zeroed ones too */

/* Frees the pages that wait for others. */
void vshi_lit_pages_free(vshi_scene_bake *bake);

/* --- warnings and errors about a lightmap's UVs, texels and file */

/* Warns of faults in the target's UVs, one line for each mesh and kind. Warns of charts that lie too close
 * for the size, and of charts that cover few texels. */
void vshi_warn_uvs(const vshi_target *target, const vsh_uv_report *reports, uint64_t covered,
                   const vsh_run *run);

/* Charts that cover no texel's centre, or objects that lie over each other on more than VSH_LARGEST_OVERLAP
 * of the texels: VSH_ERROR_INPUT, with why. */
vsh_result vshi_refuse_uvs(const vshi_target *target, const vsh_uv_report *reports, uint64_t covered,
                           vsh_error *error);

/* A lightmap without one valid texel is no lightmap: VSH_ERROR_INPUT. */
vsh_result vshi_refuse_invalid(const vshi_target *target, const vsh_bake_stats *baked, vsh_error *error);

/* Notes texels that are not valid, and warns of marches that did not end or widened too far. */
void vshi_warn_baked(const vsh_scene *scene, const vshi_target *target, const vsh_bake_stats *baked,
                     const vsh_run *run);

/* Notes which lights, and whether the sky, reach the meshes of a baked page. */
void vshi_note_lit(const vshi_scene_page *page);

/* Warns of lights, and of the sky, that one object hides from all other objects of a bake. */
void vshi_warn_hidden_lights(const vshi_scene_bake *bake, const vsh_run *run);

/* Warns of light that the file's integers cut. */
void vshi_warn_clipping(const char *output, const vsh_image_clipping *cut, const vsh_run *run);

#endif
