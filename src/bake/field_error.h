/* How far values that came by a field are off the casters that it stands for: measured, on some of them. */
#ifndef VSHI_BAKE_FIELD_ERROR_H
#define VSHI_BAKE_FIELD_ERROR_H

#include "bake/origins.h"
#include "trace/trace.h"

#include <vdbshade/bake.h>

/* Compares samples of a bake with the casters: one of every `step` samples in a row, chosen by a hash. */
typedef struct vshi_field_error {
    const vsh_occluders *occluders;
    vshi_truth truth; /* but for what differs from channel to channel */
    bool traced;      /* all values come by rays to the casters, which then decide what is valid, too */
    size_t step;
} vshi_field_error;

/* Prepares it for a lightmap with `samples` samples. */
vshi_field_error vshi_field_error_open(const vsh_occluders *occluders, const vsh_shade_options *shade,
                                       uint64_t samples, bool traced);

/* One channel: a light, or (NULL) AO, or with options->ao_up the sky: all that goes up, of the whole
 * hemisphere. Close it also after an error. Errors: VSH_ERROR_MEMORY. */
typedef struct vshi_truth_channel {
    vshi_truth truth;
    vshi_lifter lifter;
    vshi_vec up;
    vshi_sampler *sampler;
} vshi_truth_channel;

vsh_result vshi_truth_channel_open(const vshi_field_error *of, const vsh_light *light,
                                   const vsh_shade_options *options, vshi_truth_channel *channel,
                                   vsh_error *error);
void vshi_truth_channel_close(vshi_truth_channel *channel);

/* A sample of a tile to compare with the casters. */
typedef struct vshi_held_sample {
    uint32_t sample, origin; /* its number among the samples, among the origins */
    uint32_t weight;         /* samples that it stands for */
} vshi_held_sample;

/* The most samples of a tile that are. */
static inline size_t vshi_field_error_most(const vshi_field_error *of, size_t samples) {
    return (samples + of->step - 1) / of->step;
}

/* Chooses them, of those that the casters leave valid; returns how many. */
size_t vshi_field_error_choose(const vshi_field_error *of, const vshi_samples *samples,
                               const vshi_origins *origins, vshi_held_sample *held);

/* Adds what a channel's values [origins] are off. */
void vshi_field_error_add(const vshi_truth_channel *channel, const vshi_samples *samples,
                          const vshi_held_sample *held, size_t count, const float *values,
                          vsh_bake_error *sum);

/* Rays to the casters from a texel whose value is not known yet. */
typedef struct vshi_held_texel {
    uint32_t texel; /* vsh_texel() */
    uint32_t weight;
    uint16_t free[2]; /* rays of each of two sets that are */
    int16_t even;     /* VSHI_TRUTH_… */
    int16_t zero;     /* no byte is left open: it is written as it is */
} vshi_held_texel;

/* Counts the rays of a channel; returns how many texels there are. */
size_t vshi_field_error_count(const vshi_truth_channel *channel, const vshi_samples *samples,
                              const vshi_held_sample *held, size_t count, vshi_held_texel *texels);

/* Adds what a texel is off, once its value is known. */
void vshi_field_error_settle(const vshi_held_texel *texel, double max_error, float value,
                             vsh_bake_error *sum);

/* Rays that each of a sample's two values is of, at most. */
int32_t vshi_field_error_rays(double max_error);

#endif
