/* Traces packets with one ray of each of 16 successive texels. All texels use one net of points, and each
 * shifts its digits. A shift permutes the cells of the square, which hold one point each. So each cell has
 * one point of every texel, and these rays make a packet. */
#include "embree_rays.h"

#include "trace/embree_scene.h"

#include <math.h>
#include <stdlib.h>

enum { LANES = 16 };

static const float QUARTER = 0.78539816339744831f; /* π/4 */

/* The sequences of the sampler in src/trace. */
static const uint32_t LIGHT_PURPOSE = 0, AO_PURPOSE = 0xa0;

static int bits_of(int32_t rays) {
    int bits = 0;
    while (1 << bits < rays) {
        ++bits;
    }
    return bits;
}

/* Cell of a point among 2^bits; the first half of the bits are columns. */
static uint32_t cell_of(int bits, const uint32_t digits[2]) {
    const int rows = bits / 2, columns = bits - rows;
    return (uint32_t)((uint64_t)digits[0] >> (32 - columns) << rows | (uint64_t)digits[1] >> (32 - rows));
}

uint32_t (*bench_rays_net(const vshi_sampler *sampler, int32_t rays))[2] {
    const uint32_t(*net)[2] = vshi_sampler_cells(sampler, 0); /* the net, reordered */
    uint32_t(*sorted)[2] = malloc((size_t)rays * sizeof *sorted);
    const int bits = bits_of(rays);
    for (int32_t i = 0; sorted != NULL && i < rays; ++i) {
        const uint32_t at = rays == 1 << bits ? cell_of(bits, net[i]) : (uint32_t)i;
        sorted[at][0] = net[i][0];
        sorted[at][1] = net[i][1];
    }
    return sorted;
}

/* A packet's texels: what all their rays share. */
typedef struct group {
    struct RTCRay16 ray;
    uint32_t shift[2][LANES], cell[LANES]; /* cell of the shift */
    float normal[3][LANES], u[3][LANES], v[3][LANES];
    float rise[LANES], lean[2][LANES]; /* of AO: vshi_lean */
    int used[LANES];                   /* -1 */
    int free[LANES];
} group;

/* Points of a packet on the unit disc. Series for the angles are exact to 4e-7. */
static inline void to_disc(uint32_t digits[2][LANES], float x[LANES], float y[LANES]) {
    for (int l = 0; l < LANES; ++l) {
        const float a = (float)(int32_t)(digits[0][l] ^ 0x80000000u) * 0x1p-31f;
        const float b = (float)(int32_t)(digits[1][l] ^ 0x80000000u) * 0x1p-31f;
        const int wide = fabsf(a) > fabsf(b);
        const float radius = wide ? a : b, across = wide ? b : a;
        const float angle = QUARTER * (across / (radius != 0.0f ? radius : 1.0f)), q = angle * angle;
        const float sine = angle * (1.0f + q * (-1.0f / 6.0f + q * (1.0f / 120.0f - q * (1.0f / 5040.0f))));
        const float cosine =
            1.0f + q * (-0.5f + q * (1.0f / 24.0f + q * (-1.0f / 720.0f + q * (1.0f / 40320.0f))));
        x[l] = radius * (wide ? cosine : sine);
        y[l] = radius * (wide ? sine : cosine);
    }
}

static void trace_group(const bench_rays_task *task, const uint32_t (*net)[2], group *g) {
    const bool sunlit = task->light != NULL;
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    const float far = sunlit ? INFINITY : (float)(task->distance * task->triangles->scale);
    const bool ordered = task->rays == 1 << bits_of(task->rays);
    for (int32_t i = 0; i < task->rays; ++i) {
        uint32_t digits[2][LANES];
        for (int l = 0; l < LANES; ++l) {
            const uint32_t *point = net[ordered ? (uint32_t)i ^ g->cell[l] : (uint32_t)i];
            digits[0][l] = point[0] ^ g->shift[0][l];
            digits[1][l] = point[1] ^ g->shift[1][l];
        }
        float x[LANES], y[LANES];
        _Alignas(64) int valid[LANES];
        to_disc(digits, x, y);
        struct RTCRay16 *r = &g->ray;
        if (sunlit) {
            const vshi_vec axis = task->light->towards;
            const float a[3] = {(float)axis.x, (float)axis.y, (float)axis.z};
            for (int l = 0; l < LANES; ++l) {
                r->dir_x[l] = a[0] + g->u[0][l] * x[l] + g->v[0][l] * y[l];
                r->dir_y[l] = a[1] + g->u[1][l] * x[l] + g->v[1][l] * y[l];
                r->dir_z[l] = a[2] + g->u[2][l] * x[l] + g->v[2][l] * y[l];
                const float up = r->dir_x[l] * g->normal[0][l] + r->dir_y[l] * g->normal[1][l] +
                                 r->dir_z[l] * g->normal[2][l];
                valid[l] = up > 0.0f ? g->used[l] : 0;
            }
        } else {
            for (int l = 0; l < LANES; ++l) {
                const float along = x[l] * g->lean[0][l] + y[l] * g->lean[1][l];
                const float edge = 1.0f - (x[l] * x[l] + y[l] * y[l]) + along * along;
                const float by = 0.5f * (g->rise[l] - 1.0f) * along +
                                 0.5f * (1.0f - g->rise[l]) * sqrtf(edge > 0.0f ? edge : 0.0f);
                x[l] += by * g->lean[0][l];
                y[l] += by * g->lean[1][l];
                const float square = 1.0f - x[l] * x[l] - y[l] * y[l];
                const float z = sqrtf(square > 0.0f ? square : 0.0f);
                r->dir_x[l] = g->normal[0][l] * z + g->u[0][l] * x[l] + g->v[0][l] * y[l];
                r->dir_y[l] = g->normal[1][l] * z + g->u[1][l] * x[l] + g->v[1][l] * y[l];
                r->dir_z[l] = g->normal[2][l] * z + g->u[2][l] * x[l] + g->v[2][l] * y[l];
                valid[l] = g->used[l];
            }
        }
        for (int l = 0; l < LANES; ++l) {
            r->tfar[l] = far;
        }
        rtcOccluded16(valid, task->triangles->scene, &context, r);
        for (int l = 0; l < LANES; ++l) {
            g->free[l] += valid[l] & (r->tfar[l] >= 0.0f); /* a hit sets it to -∞ */
        }
    }
}

/* True if the whole light is below the horizon of a group's texels. */
static bool is_away(const vshi_light_place *light, size_t count, const float *normals) {
    for (size_t i = 0; i < count; ++i) {
        if (vshi_dot(vshi_vec_off(normals + 3 * i), light->towards) > -light->sine) {
            return false;
        }
    }
    return true;
}

void bench_rays_trace(const bench_rays_task *task, const uint32_t (*net)[2], size_t count,
                      const double *origins, const float *normals, const float *faces, const uint32_t *texels,
                      float *values) {
    const vshi_triangles *t = task->triangles;
    const int bits = bits_of(task->rays);
    for (size_t first = 0; first < count; first += LANES) {
        const size_t some = count - first < LANES ? count - first : LANES;
        if (task->light != NULL && is_away(task->light, some, normals + 3 * first)) {
            for (size_t i = first; i < first + some; ++i) {
                values[i] = 0.0f;
            }
            continue;
        }
        group g = {.used = {0}};
        for (int l = 0; l < LANES; ++l) {
            const size_t i = first + ((size_t)l < some ? (size_t)l : 0);
            float *const from[3] = {g.ray.org_x, g.ray.org_y, g.ray.org_z};
            for (size_t k = 0; k < 3; ++k) {
                from[k][l] = (float)((origins[3 * i + k] - t->centre[k]) * t->scale);
                g.normal[k][l] = normals[3 * i + k];
            }
            const double tangent = task->light != NULL ? task->light->tangent : 1.0;
            vshi_vec u, v;
            vshi_frame(task->light != NULL ? task->light->towards : vshi_vec_off(normals + 3 * i), &u, &v);
            const vshi_lean lean = faces != NULL
                                       ? vshi_dome_lean(vshi_vec_off(faces + 3 * i),
                                                        (vshi_vec[]){u, v, vshi_vec_off(normals + 3 * i)})
                                       : VSHI_WHOLE_DOME;
            g.rise[l] = (float)lean.rise;
            g.lean[0][l] = (float)lean.x;
            g.lean[1][l] = (float)lean.y;
            u = vshi_scale(u, tangent);
            v = vshi_scale(v, tangent);
            g.u[0][l] = (float)u.x, g.u[1][l] = (float)u.y, g.u[2][l] = (float)u.z;
            g.v[0][l] = (float)v.x, g.v[1][l] = (float)v.y, g.v[2][l] = (float)v.z;
            uint32_t shift[2];
            vshi_sampler_shift(task->sampler, texels[i], task->light != NULL ? LIGHT_PURPOSE : AO_PURPOSE,
                               shift);
            g.shift[0][l] = shift[0];
            g.shift[1][l] = shift[1];
            g.cell[l] = cell_of(bits, shift);
            g.ray.mask[l] = 0xffffffffu;
            g.used[l] = (size_t)l < some ? -1 : 0;
        }
        trace_group(task, net, &g);
        for (size_t i = 0; i < some; ++i) {
            values[first + i] = (float)g.free[i] / (float)task->rays;
        }
    }
}
