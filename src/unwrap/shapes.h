/* Meshes that are laid out: each set of instances once. */
#ifndef VSHI_UNWRAP_SHAPES_H
#define VSHI_UNWRAP_SHAPES_H

#include "unwrap/mask.h"

#include <vdbshade/unwrap.h>

/* --- charts joined to larger ones, as long as these lie as flat: fewer charts have fewer seams, and waste
 * less of the atlas on what keeps them apart */

/* Two charts that are tried as one. */
typedef struct vshi_trial {
    const struct vshi_merging *merging;
    uint32_t a, b;
    double perimeter; /* of both together */
    vshi_patch patch; /* both as one, where it lies flat */
    bool good;
} vshi_trial;

typedef struct vshi_merging {
    const vshi_cut_mesh *surface;
    vshi_patches *patches;
    double max_stretch, max_area;
    uint32_t *owner;   /* [triangles]: chart; VSHI_NONE: flat */
    double *perimeter; /* [charts] */
    uint32_t *version; /* [charts]: a number that no other chart had before */
    uint32_t versions;
    vshi_trial *trials; /* of this round: no chart is in two */
    uint32_t trial_count;
    uint64_t *failed; /* pairs of versions, sorted */
    size_t failed_count, failed_capacity;
} vshi_merging;

/* Begins with the charts of a surface. They must outlive it. No chart is joined to one of more than max_area,
 * surface units². Errors: VSH_ERROR_MEMORY. Free with vshi_merging_free(), after a failure too. */
vsh_result vshi_merging_begin(const vshi_cut_mesh *surface, vshi_patches *patches, double max_stretch,
                              double max_area, vshi_merging *merging, vsh_error *error);
void vshi_merging_free(vshi_merging *merging);

/* Chooses the next round's trials: none, and it is done. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_merging_plan(vshi_merging *merging, vsh_error *error);

/* Tries one. Several threads may try others. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_merging_try(vshi_trial *trial, vsh_error *error);

/* Takes those that are good. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_merging_apply(vshi_merging *merging, vsh_error *error);

/* --- shapes */

typedef struct vshi_shape {
    const vsh_mesh *mesh; /* the first of its instances */
    vshi_cut_mesh surface;
    vshi_patches patches;
    vshi_boxes *boxes; /* [patches.count] */
    bool kept;         /* patches are those of the mesh's UVs */
    /* while charts are made */
    uint32_t chart_count;
    uint32_t *chart_begin; /* [chart_count + 2] in `triangles` */
    uint32_t *triangles;   /* by chart, ascending */
    vshi_merging merging;
} vshi_shape;

/* What a mesh is laid out as. */
typedef struct vshi_instance {
    uint32_t shape;
    double scale; /* of the shape's first mesh that makes this one's size */
} vshi_instance;

typedef struct vshi_shapes {
    const vsh_mesh *meshes; /* [mesh_count] */
    size_t mesh_count;
    vshi_shape *list; /* [count] */
    size_t count;
    vshi_instance *instances; /* [mesh_count] */
} vshi_shapes;

/* Finds which meshes are instances of one shape. Errors: VSH_ERROR_MEMORY. Free with vshi_shapes_free(),
 * after a failure too. */
vsh_result vshi_shapes_find(const vsh_mesh *meshes, size_t mesh_count, vshi_shapes *shapes, vsh_error *error);
void vshi_shapes_free(vshi_shapes *shapes);

/* Makes their charts, straightened, as the options have it. The stage is "unwrap". Errors: VSH_ERROR_LIMIT
 * (2^32 / 3 triangles), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_shapes_lay_out(vshi_shapes *shapes, const vsh_unwrap_options *options, const vsh_run *run,
                               vsh_error *error);

#endif
