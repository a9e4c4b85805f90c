/* A scene's bake under way, and its lightmaps: one for each page of a receiver. */
#ifndef VSHI_BAKE_SCENE_H
#define VSHI_BAKE_SCENE_H

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

/* Of a file that an asset has for each of its `pages`: FILE.OBJECT.exr of an object, FILE.PAGE.exr of one
 * page of several, else FILE.exr. To be freed; NULL where the system refuses memory. */
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

#endif
