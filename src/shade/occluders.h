/* What casts, as shading sees it. */
#ifndef VSHI_OCCLUDERS_H
#define VSHI_OCCLUDERS_H

#include <vdbshade/occluders.h>

/* Handles that are made for a caller own what they are made of; one that stands for a part of another within
 * a call (a layer's casters) is a plain struct. */
struct vsh_occluders {
    const vsh_field *field; /* never NULL */
    const vsh_triangles *triangles;
    const vsh_layer *layers; /* [layer_count]: resolved and checked */
    size_t layer_count;
    const vsh_triangles *true_triangles;
    const vsh_solids *true_solids;
    double lifted; /* what the points to be shaded are off their surfaces already, of a start offset; world
                    * units */
    struct vshi_occluders_own *own;
};

/* What a handle owns. It frees the members; those that are NULL are the caller's, or not there. */
typedef struct vshi_occluders_own {
    vsh_field *field;
    vsh_triangles *triangles;
    vsh_triangles *true_triangles;
    vsh_solids *true_solids;
    vsh_layer *layers;        /* [layer_count] */
    vsh_field **layer_fields; /* these two: [layer_capacity], or NULL */
    vsh_triangles **layer_triangles;
    size_t layer_capacity;
    uint64_t grid_bytes; /* that level sets took */
    double voxelize_s, field_s, triangles_s;
} vshi_occluders_own;

/* Voxels along the longest side, of casters that are traced only, that lengths are told in. */
enum { VSHI_TRACED_RESOLUTION = 96 };

/* What stands for the field of casters that are traced only; *field is NULL where there are no triangles.
 * voxel_size 0: the box's longest side over VSHI_TRACED_RESOLUTION. Errors: as vshi_field_create_unknown(),
 * VSH_ERROR_LIMIT (voxel_size 0: the box is larger, smaller or farther from the origin than one with voxels
 * may be). */
vsh_result vshi_occluders_unknown(const vsh_triangles *triangles, double voxel_size, vsh_field **field,
                                  vsh_error *error);

/* As vsh_occluders_from_parts(), and takes over what `own` holds, which is freed also after an error. */
vsh_result vshi_occluders_make(const vsh_occluder_parts *parts, vshi_occluders_own *own,
                               vsh_occluders **occluders, vsh_error *error);
void vshi_occluders_own_free(vshi_occluders_own *own);

#endif
