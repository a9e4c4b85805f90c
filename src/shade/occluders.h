/* Casters as shading sees them, and how many voxels pay for them. */
#pragma once

#include "shapes/heights.h"
#include "shapes/spheres.h"
#include "trace/trace.h"

#include <vdbshade/light.h>
#include <vdbshade/occluders.h>

enum { VSHI_MAX_LAYERS = 128 };

/* Casters that are shaded in their own way. A view: what it points to must outlive the occluders. */
typedef struct vshi_layer {
    const char *name;                /* NULL: none */
    const vsh_field *field;          /* NULL if `heights` or `spheres` cast without AO */
    const vshi_triangles *triangles; /* for exact methods; NULL: none */
    const vshi_heights *heights;     /* at most one of these two casts in closed form; */
    const vshi_spheres *spheres;     /* AO uses the field and the triangles */
    int32_t method;                  /* the rest as in vsh_scene_layer */
    int32_t combine;
    double softness;
    double remap[2];
    double start_offset;
    const char *const *lights;
    size_t light_count;
    int32_t ao;
} vshi_layer;

static inline vshi_layer vshi_layer_default(void) {
    return (vshi_layer){.method = -1, .softness = 1.0, .start_offset = -1.0, .ao = 1};
}

/* Checks layers[index]. Errors: VSH_ERROR_ARGUMENT, naming the layer's number, the member, its value and the
 * limit. */
vsh_result vshi_layer_check(const vshi_layer *layers, size_t index, vsh_error *error);

/* Whether a layer's shadows need no field: heights are marched, spheres have closed forms. */
static inline bool vshi_layer_is_closed(const vshi_layer *layer) {
    return layer->heights != NULL || layer->spheres != NULL;
}

/* The parts of a handle: at least a field, triangles or a layer. Views: nothing is owned. */
typedef struct vshi_occluder_parts {
    const vsh_field *field; /* casters in no layer; NULL: they are known by their triangles alone, or all
                               casters are in layers */
    const vshi_triangles *triangles; /* of the same casters, for exact methods; NULL: none */
    const vshi_layer *layers;        /* [layer_count]: casters beside those */
    size_t layer_count;              /* 0 … VSHI_MAX_LAYERS */
    const vshi_triangles
        *true_triangles; /* these two together are all casters, the truth that the errors of a
                            bake are measured against; not with layers. NULL: no measuring */
    const vshi_solids *true_solids;
} vshi_occluder_parts;

/* The parts that a handle owns and frees. Other members are NULL. */
typedef struct vshi_occluders_own {
    vsh_field *field;
    vshi_triangles *triangles;
    vshi_triangles *true_triangles;
    vshi_solids *true_solids;
    vshi_layer *layers;       /* [layer_count] */
    vsh_field **layer_fields; /* these two: [layer_capacity], or NULL */
    vshi_triangles **layer_triangles;
    size_t layer_capacity;
    uint64_t grid_bytes; /* of the level sets, before they were freed */
    double voxelize_s, field_s, triangles_s;
} vshi_occluders_own;

/* A handle made for a caller owns its parts. A handle for a part of another within a call, such as a layer's
 * casters, is a plain struct. */
struct vsh_occluders {
    const vsh_field *field; /* never NULL */
    const vshi_triangles *triangles;
    const vshi_layer *layers; /* [layer_count]: resolved and checked */
    size_t layer_count;
    const vshi_triangles *true_triangles;
    const vshi_solids *true_solids;
    double lifted; /* part of a start offset that the points already have, world units */
    vshi_occluders_own own;
};

/* Voxels along the longest side that define lengths for casters without voxels. */
enum { VSHI_TRACED_RESOLUTION = 96 };

/* Makes a field without distances for casters that are only traced. *field is NULL if there are no triangles.
 * Errors: as vshi_field_create_unknown(), VSH_ERROR_LIMIT (the box is too large, too small or too far from
 * the origin for voxels). */
vsh_result vshi_occluders_unknown(const vshi_triangles *triangles, vsh_field **field, vsh_error *error);

/* Makes occluders of parts. Without a field, start offsets count voxels of VSHI_TRACED_RESOLUTION, else of
 * the finest layer, else 1e-5 of the first layer's longest side. The layers are copied; what they and the
 * parts refer to must outlive the handle, unless it is in `own` (NULL: nothing). The handle takes over the
 * contents of `own`, which are freed even after an error. Errors: as vshi_layer_check() and
 * vshi_occluders_unknown(), VSH_ERROR_MEMORY. */
vsh_result vshi_occluders_make(const vshi_occluder_parts *parts, vshi_occluders_own *own,
                               vsh_occluders **occluders, vsh_error *error);
void vshi_occluders_own_free(vshi_occluders_own *own);

/* Bytes of the fields and layers. */
double vshi_occluders_bytes(const vsh_occluders *occluders);

/* --- the number of voxels that pays */

/* Casters, and the values that are computed from them. */
typedef struct vshi_resolution_need {
    double values;    /* shadow values, by rays against triangles: points × lights */
    double max_error; /* of each value */
    double triangles;
    double area;    /* of the triangles, world units² */
    double longest; /* side of the casters' box, world units */
} vshi_resolution_need;

/* Voxels along the longest side of traced casters, so that proofs save the most time; 0: voxels save none. */
int32_t vshi_resolution_traced(const vshi_resolution_need *need);

/* Voxels along the longest side of casters known only by voxels, so that these displace shadows, or
 * (`ao_only`) AO, by no more than max_error. */
int32_t vshi_resolution_marched(double max_error, int32_t ao_only);
