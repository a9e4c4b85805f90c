/* Shares of a light or of the sky that points see, by rays of the library against the casters themselves. */
#pragma once

#include "testing.h"

#include "trace/trace.h"

/* Casts about `rays` rays from each point, half of them in each of the library's two sets. NAN: no value. */
static inline void see(vshi_truth truth, size_t count, const double *positions, const float *normals,
                       int32_t rays, float *seen) {
    truth.rays = rays > 1 ? rays / 2 : 1;
    vshi_sampler *sampler = vshi_sampler_create(VSH_SAMPLER_SOBOL, truth.rays, 0);
    assert_non_null(sampler);
    truth.sampler = sampler;
    for (size_t i = 0; i < count; ++i) {
        int32_t free[2], even;
        const bool any =
            vshi_truth_count(&truth, positions + 3 * i, normals + 3 * i, NULL, (uint32_t)i, free, &even);
        seen[i] = any ? (float)(free[0] + free[1]) / (float)(2 * truth.rays) : NAN;
    }
    vshi_sampler_free(sampler);
}

/* The share of a light. Rays begin `offset` above the points. Triangles or solids may be NULL. */
static inline void see_light(const vshi_triangles *triangles, const vshi_solids *solids, size_t count,
                             const double *positions, const float *normals, double offset,
                             const vsh_light *light, int32_t rays, float *seen) {
    const vshi_truth truth = {.triangles = triangles,
                              .solids = solids,
                              .light = light,
                              .place = vshi_light_in_world(light),
                              .offset = offset};
    see(truth, count, positions, normals, vshi_light_is_point(&truth.place) ? 1 : rays, seen);
}

/* The share of the sky within `distance`, weighted by the cosine. */
static inline void see_sky(const vshi_triangles *triangles, const vshi_solids *solids, size_t count,
                           const double *positions, const float *normals, double offset, double distance,
                           int32_t rays, float *seen) {
    const vshi_truth truth = {
        .triangles = triangles, .solids = solids, .distance = distance, .offset = offset};
    see(truth, count, positions, normals, rays, seen);
}
