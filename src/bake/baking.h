/* A lightmap under way, and what those who fill its planes share. */
#ifndef VSHI_BAKE_BAKING_H
#define VSHI_BAKE_BAKING_H

#include "bake/field_error.h"
#include "bake/nearest_valid.h"
#include "bake/origins.h"
#include "bake/work_planes.h"
#include "base/parallel.h"

typedef struct vshi_baking {
    const vsh_occluders *occluders;
    const vsh_texels *texels;
    const vsh_light *lights;
    size_t light_count;
    vsh_shade_options shade;
    vsh_run run;
    vsh_run quiet; /* for steps of milliseconds that come once a plane: no stage of their own */
    const vsh_lightmap *lightmap; /* planes of all rows that the texels hold */
    uint32_t needs;               /* VSHI_NEEDS_… of its planes */
    vshi_work_planes work;
    vshi_origins origins;
    vshi_spread spread;
    uint8_t *state;       /* [rows held][width]: VSHI_TEXEL_… */
    uint32_t *known;      /* [own rows][width]: VSHI_PART_…, of a part; NULL: it is padded, too */
    vshi_ao_keep keep;    /* of a part that leaves AO: what is kept */
    float *values;        /* [origins.count]: of one light, or AO */
    float *deviation;     /* [origins.count]: of the same; NULL where no plane is for it */
    float *irradiance;    /* [origins.count][3] */
    float *bent;          /* [origins.count][3] */
    float *tinted;        /* [origins.count][3]: of one light */
    vsh_layer *layers;    /* the occluders', of points that are lifted already; NULL: none */
    vsh_occluders lifted; /* with them */
    bool layered_ao;
    vshi_field_error held; /* samples that are held against the casters; none where that is not wanted */
    vsh_bake_stats stats;
    double worst; /* error of the channels that are done */
} vshi_baking;

/* Averages samples over texels: of deviations not into the state. */
vsh_result vshi_baking_average(vshi_baking *bake, const float *values, size_t components, float *plane,
                               vsh_error *error);

/* Runs a step over all samples. */
vsh_result vshi_baking_step(vshi_baking *bake, const char *what, vshi_range_fn *step, void *user,
                            vsh_error *error);

/* Shades what is open around each sample, or of the sky over it, into `values`, by the methods of AO.
 * `deviation` and `bent` [origins.count], [..][3] may be NULL. */
vsh_result vshi_baking_open(vshi_baking *bake, bool sky, float *deviation, float *bent, vsh_error *error);

/* Shades a light, or AO, and fills the planes of it. */
vsh_result vshi_bake_light(vshi_baking *bake, size_t light, vsh_error *error);
vsh_result vshi_bake_ao(vshi_baking *bake, vsh_error *error);

/* --- what is known of their errors */

/* Whether samples are to be held against the casters, and choosing them. */
bool vshi_baking_holds(const vshi_baking *bake);
vsh_result vshi_baking_choose_held(vshi_baking *bake, vsh_error *error);

/* Adds what rays left of a channel, by what the stats hold more than `square`, which was before it; and what
 * `values` are off the casters, where they are held against them. `channel` is its place in the errors of
 * vsh_bake_stats. */
vsh_result vshi_baking_add_error(vshi_baking *bake, size_t channel, double square, vsh_error *error);

/* Options that AO, or the sky, is shaded by. */
vsh_shade_options vshi_baking_options(const vshi_baking *bake, bool sky);

/* Adds what is filled, once it is: of the planes that there are. */
vsh_result vshi_baking_add_filled(vshi_baking *bake, vsh_error *error);

/* --- how AO is shaded */

bool vshi_baking_traces_shadow(const vshi_baking *bake);
bool vshi_baking_traces_ao(const vshi_baking *bake);

/* Whether texels share rays of AO. Methods with an error to keep share them, unless layers cast. */
bool vshi_baking_shares(const vshi_baking *bake);
bool vshi_ao_is_shared(const vsh_shade_options *shade, int32_t spacing, bool layered_ao);

#endif
