#include "render/shafts.h"

#include "base/elementary.h"
#include "base/try.h"
#include "light/view.h"

/* The part of a ray within the box. */
static bool clip(const vshi_shafts *shafts, const vshi_shaft_ray *ray, double *begin, double *end) {
    const double o[3] = {ray->origin.x, ray->origin.y, ray->origin.z};
    const double d[3] = {ray->direction.x, ray->direction.y, ray->direction.z};
    const double low[3] = {shafts->low.x, shafts->low.y, shafts->low.z};
    const double high[3] = {shafts->high.x, shafts->high.y, shafts->high.z};
    *begin = 0.0;
    *end = ray->end;
    for (int axis = 0; axis < 3; ++axis) {
        if (d[axis] == 0.0) {
            if (o[axis] < low[axis] || o[axis] > high[axis]) {
                return false;
            }
            continue;
        }
        const double a = (low[axis] - o[axis]) / d[axis], b = (high[axis] - o[axis]) / d[axis];
        *begin = fmax(*begin, fmin(a, b));
        *end = fmin(*end, fmax(a, b));
    }
    return *begin < *end;
}

/* Points of the tile's rays at one step, and what each adds. */
typedef struct step {
    size_t count;
    double positions[VSHI_TILE_SAMPLES][3];
    float towards[VSHI_TILE_SAMPLES][3];
    float visibility[VSHI_TILE_SAMPLES];
    float light[VSHI_TILE_SAMPLES][3];
    double share[VSHI_TILE_SAMPLES];
} step;

/* All the light that passes, whatever its direction: as if each point faced it. */
static vsh_result light_step(const vshi_shafts *shafts, step *s, vsh_shade_stats *stats, vsh_error *error) {
    const vsh_points points = {s->count, &s->positions[0][0], NULL, NULL};
    for (size_t l = 0; l < shafts->light_count; ++l) {
        const vsh_light *light = &shafts->lights[l];
        float *visibility[VSHI_MOST_LIGHTS] = {NULL};
        vsh_query_output output = vsh_query_output_default();
        visibility[l] = s->visibility;
        output.visibility = visibility;
        VSHI_TRY(vsh_query_points(shafts->query, &points, NULL, shafts->run, &output, stats, error));
        const vshi_light_place place = vshi_light_in_world(light);
        for (size_t i = 0; i < s->count; ++i) {
            vshi_vec to;
            vshi_light_towards(&place, vshi_vec_of(s->positions[i]), &to);
            s->towards[i][0] = (float)to.x, s->towards[i][1] = (float)to.y, s->towards[i][2] = (float)to.z;
        }
        vsh_shade_irradiance(&points, &s->towards[0][0], light, s->visibility, &s->light[0][0]);
    }
    return VSH_OK;
}

vsh_result vshi_shafts_add(const vshi_shafts *shafts, size_t count, const vshi_shaft_ray *rays,
                           vshi_seen **seen, vsh_shade_stats *stats, vsh_error *error) {
    double begin[VSHI_TILE_SAMPLES], length[VSHI_TILE_SAMPLES], jitter[VSHI_TILE_SAMPLES];
    size_t in[VSHI_TILE_SAMPLES], passing = 0;
    for (size_t i = 0; i < count; ++i) {
        double end;
        if (clip(shafts, &rays[i], &begin[i], &end)) {
            length[i] = end - begin[i];
            jitter[i] = vshi_sampler_mask(shafts->sampler, rays[i].texel, 0);
            in[passing++] = i;
            const float left = (float)vshi_exp(-shafts->extinction * length[i]);
            for (int c = 0; c < 3; ++c) {
                seen[i]->color[c] *= left;
            }
        }
    }
    for (int32_t k = 0; k < shafts->steps && passing > 0; ++k) {
        step s = {.count = passing};
        for (size_t j = 0; j < passing; ++j) {
            const size_t i = in[j];
            const double stretch = length[i] / shafts->steps, along = (k + jitter[i]) * stretch;
            const vshi_vec at = vshi_add(rays[i].origin, vshi_scale(rays[i].direction, begin[i] + along));
            s.positions[j][0] = at.x, s.positions[j][1] = at.y, s.positions[j][2] = at.z;
            s.share[j] = vshi_exp(-shafts->extinction * along) * shafts->extinction * stretch;
        }
        VSHI_TRY(light_step(shafts, &s, stats, error));
        for (size_t j = 0; j < passing; ++j) {
            for (int c = 0; c < 3; ++c) {
                seen[in[j]]->color[c] += (float)(s.share[j] * (double)s.light[j][c]);
            }
        }
    }
    return VSH_OK;
}
