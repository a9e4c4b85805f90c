/* Which samples of a tile can be shaded, and where their rays begin. */
#ifndef VSHI_BAKE_ORIGINS_H
#define VSHI_BAKE_ORIGINS_H

#include "bake/tile.h"
#include "heightfield/heights.h"
#include "shade/lift.h"
#include "shade/shade.h"
#include "spheres/spheres.h"

/* A field that samples are looked at in. */
typedef struct vshi_probed_field {
    const vsh_field *field;
    double probe; /* world units: how far above its surface a sample is looked at for whether it is free */
    double shell; /* world units, open meshes on top of it */
    const vsh_triangles *triangles; /* its casters', where rays are traced against them; else NULL */
    bool marched;                   /* it is looked at itself: methods march it, or there are no triangles */
} vshi_probed_field;

/* Decides which samples are valid, by the same rules for all tiles of a bake. */
typedef struct vshi_placement {
    double offset; /* of rays' beginnings over the surface, world units */
    size_t field_count;
    vshi_probed_field fields[1 + VSH_MAX_LAYERS]; /* the occluders' field, then those of its layers */
    size_t solid_count;
    const vsh_heights *heights[VSH_MAX_LAYERS]; /* layers without a field: one of these two */
    const vsh_spheres *spheres[VSH_MAX_LAYERS];
    const vshi_kernel *kernel;
} vshi_placement;

/* What is baked of the samples. */
typedef struct vshi_origins_for {
    bool lights, ao;
} vshi_origins_for;

vshi_placement vshi_placement_open(const vsh_occluders *occluders, const vsh_shade_options *options,
                                   vshi_origins_for what, int32_t isa);

/* The valid samples of a tile in their order, and behind them those around the tile. */
typedef struct vshi_origins {
    size_t count;     /* valid samples */
    size_t frame;     /* samples around the tile, of which nobody knows whether they are valid */
    uint32_t *sample; /* [count + frame]: of the samples */
    double *position; /* [..][3]: start offset above the triangle, where marches begin; world units */
    double *start;    /* [..][3]: where the rays of the channel at hand begin, see vshi_origins_lift() */
    float *normal;    /* [..][3]: smooth; decides shadow */
    float *face;      /* [..][3]: of the triangle */
    uint32_t *texel;  /* [..]: as vsh_points.texels; a texel's further samples get numbers of their own */
    uint8_t *valid;   /* [samples] */
    uint8_t *crease;  /* [samples]: 0, or 1 + the field in whose crease a sample lies, that of the highest
                         probe */
} vshi_origins;

/* Memory for so many samples. Free them also after an error. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_origins_allocate(vshi_origins *origins, size_t room, vsh_error *error);
void vshi_origins_free(vshi_origins *origins);

/* Bytes of one sample. */
enum { VSHI_ORIGIN_BYTES = 6 * sizeof(double) + 6 * sizeof(float) + 2 * sizeof(uint32_t) + 2 };

/* Lifts each sample along its geometric normal by the start offset, and by half a shell's thickness where its
 * mesh is open. A sample is invalid inside a solid or behind a wall of the casters: where there are
 * triangles, by rays against them (see vshi_inside()); where a field is marched, also if it ends up inside
 * the field's solid, or all but. The layers are looked at as well. */
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

/* --- shadow values that rays left noise in, smoothed along penumbrae */

/* Memory that it works in: which sample each texel of a tile has, and what is made of the values. */
typedef struct vshi_smooth_work {
    const vshi_origins *origins;
    const float *deviation;
    uint16_t sample[VSHI_TILE * VSHI_TILE];
    float across[VSHI_TILE * VSHI_TILE], smooth[VSHI_TILE * VSHI_TILE];
} vshi_smooth_work;

/* Smooths the values of a tile's origins by their deviations, where each texel has one sample. */
void vshi_shadow_smooth(const vshi_origins *origins, float *values, const float *deviation,
                        vshi_smooth_work *work);

#endif
