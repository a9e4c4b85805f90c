/* Meshes that are laid out: each set of instances once. */
#ifndef VSHI_UNWRAP_SHAPES_H
#define VSHI_UNWRAP_SHAPES_H

#include "unwrap/mask.h"

#include <vdbshade/unwrap.h>

typedef struct vshi_shape {
    const vsh_mesh *mesh; /* the first of its instances */
    vshi_cut_mesh surface;
    vshi_patches patches;
    vshi_boxes *boxes; /* [patches.count] */
    bool kept;         /* patches are those of the mesh's UVs */
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
