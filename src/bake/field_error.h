/* How far values that came by a field are off the casters that it stands for: measured, on some of them. */
#ifndef VSHI_BAKE_FIELD_ERROR_H
#define VSHI_BAKE_FIELD_ERROR_H

#include "bake/ao_kept.h"
#include "bake/origins.h"
#include "trace/trace.h"

/* The most samples of a lightmap, and what each takes, bytes. */
enum { VSHI_FIELD_ERROR_MOST = 16384, VSHI_FIELD_ERROR_BYTES = 80 };

typedef struct vshi_field_error_sample vshi_field_error_sample;

/* The samples that are held against the casters: one of each so many that follow each other, whichever its
 * hash says. */
typedef struct vshi_field_error {
    const vsh_texels *texels;
    vshi_truth truth; /* but for what differs from channel to channel */
    bool traced;
    const vsh_occluders *occluders;
    size_t count;
    vshi_field_error_sample *samples;
    double *square; /* [count]: of one channel */
} vshi_field_error;

/* What stands for the truth, and the lift of rays to them. */
vshi_truth vshi_field_error_truth(const vsh_occluders *occluders, const vsh_shade_options *shade);

/* Chooses them of the band's own rows, and looks at which the casters leave valid. `state` [texels held]
 * holds VSHI_TEXEL_…; `truth` has the casters and the lift; `traced`: all values came by rays to them, so
 * that they decided what is valid too. Free with vshi_field_error_free() also after an error. Errors:
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_field_error_choose(const vsh_texels *texels, const vshi_origins *origins,
                                   const uint8_t *state, const vsh_occluders *occluders,
                                   const vshi_truth *truth, bool traced, const vsh_run *run,
                                   vshi_field_error *share, vsh_error *error);
void vshi_field_error_free(vshi_field_error *share);

/* Adds what is found of a channel to *sum: of valid samples by their `values`, or (NULL) of those that are
 * filled by the plane of the texels held, once it is. Where `light` is NULL it is AO's, or with
 * options->ao_up the sky's: all that goes up, of the whole hemisphere. Of samples that `keep` (may be NULL)
 * says are left, `held` of what is kept is set instead. Errors: the same. */
vsh_result vshi_field_error_add(vshi_field_error *share, const vsh_light *light,
                                const vsh_shade_options *options, const float *values, const float *filled,
                                const vshi_ao_keep *keep, const vsh_run *run, vsh_bake_error *sum,
                                vsh_error *error);

/* Rays that each of a sample's two values is of, at most. */
int32_t vshi_field_error_rays(double max_error);

/* Adds what vshi_field_error_add() would have of a texel that was left, once its value is known. No more of
 * its rays are free than there are. */
void vshi_field_error_settle(const vshi_ao_shot *shot, double max_error, double value, vsh_bake_error *sum);

#endif
