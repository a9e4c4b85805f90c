/* Packets of rays of neighbouring points, each over its own disc or dome.
 *
 * All discs use the points of one net; each texel shifts their digits (sampler.h). A block of 2^k points has
 * one point in each of 2^k cells of the square; a shift permutes the cells. So each texel has one ray in any
 * cell, and the rays of one cell, which have similar directions, make a packet. On lobes of 50,000 triangles,
 * under a sun of 30°, a ray takes 24 ns; with packets in the order of the index it takes 52 ns. */
#include "trace/embree_scene.h"

#include <float.h>
#include <string.h>

enum { LANES = VSHI_PACKET };

static const float QUARTER = 0.78539816339744831f; /* π / 4 */

/* A packet's discs: the data that all of their rays share. */
typedef struct group {
    struct RTCRay16 ray;
    float axis[3][LANES], u[3][LANES], v[3][LANES], normal[3][LANES], far[LANES];
    float rise[LANES], lean[2][LANES]; /* of domes: vshi_lean */
    bool leans;                        /* any dome does */
    uint32_t shift[2][LANES];
    float lowest[LANES]; /* least component along the normal: 0, or -∞ without a horizon */
    int valid[LANES];    /* -1: the lane has a disc */
    int used;            /* discs */
} group;

static void set_lane(const vshi_triangles *t, const vshi_disc *disc, int lane, group *g) {
    float *const from[3] = {g->ray.org_x, g->ray.org_y, g->ray.org_z};
    const double axis[3] = {disc->axis.x, disc->axis.y, disc->axis.z};
    const double u[3] = {disc->u.x, disc->u.y, disc->u.z}, v[3] = {disc->v.x, disc->v.y, disc->v.z};
    const double normal[3] = {disc->normal.x, disc->normal.y, disc->normal.z};
    for (size_t k = 0; k < 3; ++k) {
        from[k][lane] = (float)((disc->origin[k] - t->centre[k]) * t->scale);
        g->axis[k][lane] = (float)axis[k];
        g->u[k][lane] = (float)u[k];
        g->v[k][lane] = (float)v[k];
        g->normal[k][lane] = (float)normal[k];
    }
    const double far = disc->far * t->scale;
    g->far[lane] = far < (double)FLT_MAX ? (float)far : INFINITY;
    g->lowest[lane] = normal[0] != 0.0 || normal[1] != 0.0 || normal[2] != 0.0 ? 0.0f : -INFINITY;
    g->leans = g->leans || disc->lean.rise < 1.0;
    g->rise[lane] = (float)disc->lean.rise;
    g->lean[0][lane] = (float)disc->lean.x;
    g->lean[1][lane] = (float)disc->lean.y;
    g->shift[0][lane] = disc->shift[0];
    g->shift[1][lane] = disc->shift[1];
    g->ray.mask[lane] = 0xffffffffu;
}

/* Maps digits to the unit disc (Shirley and Chiu, "A low distortion map between disk and square", 1997). The
 * series for angles are exact to 4e-7. */
static inline void to_disc(uint32_t digits[2][LANES], float x[LANES], float y[LANES]) {
    for (int l = 0; l < LANES; ++l) {
        const float a = (float)(int32_t)(digits[0][l] ^ 0x80000000u) * 0x1p-31f;
        const float b = (float)(int32_t)(digits[1][l] ^ 0x80000000u) * 0x1p-31f;
        const bool wide = fabsf(a) > fabsf(b);
        const float radius = wide ? a : b, across = wide ? b : a;
        const float angle = QUARTER * (across / (radius != 0.0f ? radius : 1.0f)), q = angle * angle;
        const float sine = angle * (1.0f + q * (-1.0f / 6.0f + q * (1.0f / 120.0f - q * (1.0f / 5040.0f))));
        const float cosine =
            1.0f + q * (-0.5f + q * (1.0f / 24.0f + q * (-1.0f / 720.0f + q * (1.0f / 40320.0f))));
        x[l] = radius * (wide ? cosine : sine);
        y[l] = radius * (wide ? sine : cosine);
    }
}

/* Aims the lanes at places of their discs. A ray below its disc's horizon is not valid. */
static inline void aim_at_discs(group *g, const float x[LANES], const float y[LANES], int valid[LANES]) {
    struct RTCRay16 *r = &g->ray;
    for (int l = 0; l < LANES; ++l) {
        const float dx = g->axis[0][l] + (g->u[0][l] * x[l] + g->v[0][l] * y[l]);
        const float dy = g->axis[1][l] + (g->u[1][l] * x[l] + g->v[1][l] * y[l]);
        const float dz = g->axis[2][l] + (g->u[2][l] * x[l] + g->v[2][l] * y[l]);
        const float unit = 1.0f / sqrtf(dx * dx + dy * dy + dz * dz);
        r->dir_x[l] = dx * unit;
        r->dir_y[l] = dy * unit;
        r->dir_z[l] = dz * unit;
        const float up = dx * g->normal[0][l] + dy * g->normal[1][l] + dz * g->normal[2][l];
        valid[l] = up > g->lowest[l] ? g->valid[l] : 0;
    }
}

/* vshi_dome_place() */
static inline void place_on_domes(const group *g, float x[LANES], float y[LANES]) {
    for (int l = 0; l < LANES; ++l) {
        const float along = x[l] * g->lean[0][l] + y[l] * g->lean[1][l];
        const float edge = 1.0f - (x[l] * x[l] + y[l] * y[l]) + along * along;
        const float to = (1.0f + g->rise[l]) * along + (1.0f - g->rise[l]) * sqrtf(edge > 0.0f ? edge : 0.0f);
        const float by = 0.5f * to - along;
        x[l] += by * g->lean[0][l];
        y[l] += by * g->lean[1][l];
    }
}

/* The same on domes. */
static inline void aim_at_domes(group *g, float x[LANES], float y[LANES], int valid[LANES]) {
    struct RTCRay16 *r = &g->ray;
    if (g->leans) {
        place_on_domes(g, x, y);
    }
    for (int l = 0; l < LANES; ++l) {
        const float square = 1.0f - (x[l] * x[l] + y[l] * y[l]);
        const float z = sqrtf(square > 0.0f ? square : 0.0f);
        r->dir_x[l] = g->axis[0][l] * z + (g->u[0][l] * x[l] + g->v[0][l] * y[l]);
        r->dir_y[l] = g->axis[1][l] * z + (g->u[1][l] * x[l] + g->v[1][l] * y[l]);
        r->dir_z[l] = g->axis[2][l] * z + (g->u[2][l] * x[l] + g->v[2][l] * y[l]);
        valid[l] = g->valid[l];
    }
}

/* Traces a block of `size` points of the net for a group, in the order of the cells. The first 2^each lanes
 * have a disc each; the next 2^each have the same discs in the next cell, and so on. */
static void trace(const vshi_triangles *t, const uint32_t (*points)[2], bool domes, group *g, int each,
                  uint32_t size, int32_t *lit) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = vshi_triangles_flags(t, true);
    uint32_t cell[LANES];
    int32_t seen[LANES] = {0};
    for (int l = 0; l < LANES; ++l) {
        const uint32_t beyond = (uint32_t)l >> each;
        g->valid[l] = (l & ((1 << each) - 1)) < g->used && beyond < size ? -1 : 0;
        cell[l] = (beyond < size ? beyond : 0) ^ vshi_sampler_cell(size, g->shift[0][l], g->shift[1][l]);
    }
    for (uint32_t c = 0; c < size; c += (uint32_t)LANES >> each) {
        uint32_t digits[2][LANES];
        float x[LANES], y[LANES];
        _Alignas(64) int valid[LANES];
        for (int l = 0; l < LANES; ++l) {
            const uint32_t *point = points[c ^ cell[l]];
            digits[0][l] = point[0] ^ g->shift[0][l];
            digits[1][l] = point[1] ^ g->shift[1][l];
        }
        to_disc(digits, x, y);
        if (domes) {
            aim_at_domes(g, x, y, valid);
        } else {
            aim_at_discs(g, x, y, valid);
        }
        memcpy(g->ray.tfar, g->far, sizeof g->far);
        vshi_triangles_occlude(t, valid, &context, &g->ray);
        for (int l = 0; l < LANES; ++l) {
            seen[l] += valid[l] & (g->ray.tfar[l] >= 0.0f); /* -∞ if the ray meets something */
        }
    }
    for (int l = 0; l < LANES; ++l) {
        if (g->valid[l] != 0) {
            lit[l & ((1 << each) - 1)] += seen[l];
        }
    }
}

bool vshi_triangles_sees(const vshi_triangles *triangles, const double origin[3]) {
    double distance = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double at = (origin[axis] - triangles->centre[axis]) * triangles->scale;
        distance += at * at;
    }
    return distance <= VSHI_FAR_ORIGIN * VSHI_FAR_ORIGIN;
}

void vshi_triangles_discs(const vshi_triangles *triangles, const vshi_sampler *sampler, bool domes,
                          const vshi_disc *discs, size_t count, int32_t first, int32_t last, int32_t *lit) {
    for (size_t begin = 0; begin < count; begin += LANES) {
        group g = {.used = count - begin < LANES ? (int)(count - begin) : LANES};
        int each = 0;
        while (1 << each < g.used) {
            ++each;
        }
        for (int l = 0; l < LANES; ++l) {
            const int k = l & ((1 << each) - 1);
            set_lane(triangles, &discs[begin + (size_t)(k < g.used ? k : 0)], l, &g);
        }
        /* blocks of the net: the first has VSHI_SAMPLER_BLOCK points, each further one as many as all before
         */
        for (int32_t at = first; at < last;) {
            const int32_t size = at == 0 ? VSHI_SAMPLER_BLOCK : at;
            trace(triangles, vshi_sampler_cells(sampler, (uint32_t)at), domes, &g, each, (uint32_t)size,
                  lit + begin);
            at += size;
        }
    }
}
