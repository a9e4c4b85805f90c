/* The valid samples of a tile, and where their rays begin. */
#pragma once

#include "lightmap/texels.h"
#include "shade/shade.h"
#include "shapes/heights.h"
#include "shapes/spheres.h"

/* A field that samples are tested in. */
typedef struct vshi_probed_field {
    const vsh_field *field;
    double probe;                    /* world units: height above the surface where a sample is tested */
    double shell;                    /* world units: more height for open meshes */
    const vshi_triangles *triangles; /* its casters', if rays are traced against them; else NULL */
    bool marched; /* the field itself is tested: methods march it, or there are no triangles */
} vshi_probed_field;

/* Decides which samples are valid, by the same rules for all tiles of a bake. */
typedef struct vshi_placement {
    double offset; /* height of the rays' origins above the surface, world units */
    size_t field_count;
    vshi_probed_field fields[1 + VSHI_MAX_LAYERS]; /* the occluders' field, then the layers' fields */
    size_t solid_count;
    const vshi_heights *heights[VSHI_MAX_LAYERS]; /* layers without a field have one of these two */
    const vshi_spheres *spheres[VSHI_MAX_LAYERS];
    const vshi_kernel *kernel;
} vshi_placement;

/* `lights`, `ao`: whether these are baked. */
vshi_placement vshi_placement_open(const vsh_occluders *occluders, const vsh_shade_options *options,
                                   bool lights, bool ao, int32_t isa);

/* The valid samples of a tile in their order, then the samples around the tile. */
typedef struct vshi_origins {
    size_t count;     /* valid samples */
    size_t frame;     /* samples around the tile, which are not validated */
    uint32_t *sample; /* [count + frame]: number of the sample */
    double *position; /* [..][3]: start offset above the triangle, where marches begin; world units */
    double *start;    /* [..][3]: where the current channel's rays begin, see vshi_origins_lift() */
    float *normal;    /* [..][3]: smooth; decides shadow */
    float *face;      /* [..][3]: of the triangle */
    uint32_t *texel;  /* [..]: as vsh_points.texels; further samples of a texel get other numbers */
    uint8_t *valid;   /* [samples] */
    uint8_t *crease;  /* [samples]: 0, or 1 + the field in whose crease a sample lies, the field with the
                         highest probe */
} vshi_origins;

/* Allocates origins. Free them also after an error. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_origins_allocate(vshi_origins *origins, size_t room, vsh_error *error);
void vshi_origins_free(vshi_origins *origins);

/* Bytes of one sample. */
enum { VSHI_ORIGIN_BYTES = 6 * sizeof(double) + 6 * sizeof(float) + 2 * sizeof(uint32_t) + 2 };

/* Lifts each sample along its geometric normal by the start offset, and by half a shell's thickness if its
 * mesh is open. A sample is invalid inside a solid or behind a wall of the casters. Rays against triangles
 * decide, if there are any (vshi_inside()). A marched field also makes samples inside its solid, or almost
 * inside, invalid. Layers count too. */
void vshi_origins_find(const vshi_placement *placement, const vshi_samples *samples, vshi_origins *origins);

/* Adds samples `first` and on as the frame. */
void vshi_origins_add_frame(const vshi_placement *placement, const vshi_samples *samples, size_t first,
                            vshi_origins *origins);

/* The sample's position on its triangle. */
static inline vshi_vec vshi_sample_foot(const vshi_samples *samples, size_t i) {
    return vshi_sub(vshi_vec_of(samples->position + 3 * i), vshi_vec_off(samples->lift + 3 * i));
}

static inline vshi_lift_point vshi_sample_lift_point(const vshi_samples *samples, size_t i) {
    return (vshi_lift_point){vshi_sample_foot(samples, i), vshi_vec_off(samples->lift + 3 * i),
                             vshi_vec_off(samples->geometric + 3 * i), vshi_vec_off(samples->normal + 3 * i)};
}

/* Sets origins->start, where the rays to a light begin: on the triangles if `traced`, else at
 * origins->position; plus the lift. */
void vshi_origins_lift(const vshi_lifter *lifter, const vshi_samples *samples, bool traced,
                       vshi_origins *origins);
