/* Shades texels with the same number of rays each, in Embree's packets. */
#pragma once

#include "light/light.h"
#include "trace/sampler.h"
#include "trace/trace.h"

/* Shades successive texels: visible fraction of a light, or AO. */
typedef struct bench_rays_task {
    const vshi_triangles *triangles;
    const vshi_sampler *sampler; /* of VSH_SAMPLER_SOBOL, and `rays` rays */
    int32_t rays;
    const vshi_light_place *light; /* parallel; NULL: AO, within */
    double distance;
} bench_rays_task;

/* Digits of the sampler's net for `rays` rays, [rays][2]; NULL if memory is short. A power of two of rays is
 * sorted by cells of the square, so that rays in a packet have similar directions. */
uint32_t (*bench_rays_net(const vshi_sampler *sampler, int32_t rays))[2];

/* Values of `count` texels whose rays begin at origins [count][3], world units. Normals [count][3] are unit.
 * AO leaves out directions below the faces [count][3], unit; NULL: below the normals. `net` is that of
 * bench_rays_net(). Thread safe. */
void bench_rays_trace(const bench_rays_task *task, const uint32_t (*net)[2], size_t count,
                      const double *origins, const float *normals, const float *faces, const uint32_t *texels,
                      float *values);
