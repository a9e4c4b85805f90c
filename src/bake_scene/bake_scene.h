/* A scene's bake under way. */
#ifndef VSHI_BAKE_SCENE_H
#define VSHI_BAKE_SCENE_H

#include "bake_scene/target.h"

#include <vdbshade/bake_scene.h>
#include <vdbshade/provenance.h>

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
