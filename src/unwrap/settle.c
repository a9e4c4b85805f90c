#include "unwrap/patch.h"

#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>

static const double LEAST_STEP = 0x1p-24; /* half of a last place just below 1 */

enum {
    PASSES = 6,
    LENGTHS = 7,      /* of steps, each twice the one before */
    MOST_AROUND = 256 /* triangles of a corner that is moved */
};

typedef struct settling {
    const vshi_patch *patch;
    float (*uvs)[2];
    uint32_t *begin, *around; /* around[begin[v] …]: triangles of vertex v */
} settling;

/* Not positive: flipped, or without area. Exact but for the last rounding, which keeps the sign: differences
 * and products of floats of one range are doubles. */
static bool is_bad(const vshi_patch *p, float (*const uvs)[2], uint32_t i) {
    const float *a = uvs[p->corner[i][0]], *b = uvs[p->corner[i][1]], *c = uvs[p->corner[i][2]];
    return !(((double)b[0] - (double)a[0]) * ((double)c[1] - (double)a[1]) -
                 ((double)b[1] - (double)a[1]) * ((double)c[0] - (double)a[0]) >
             0.0);
}

static vsh_result list_around(settling *s, vsh_error *error) {
    const vshi_patch *p = s->patch;
    VSHI_TRY(
        vshi_allocate((void **)&s->begin, (size_t)p->vertex_count + 2, sizeof *s->begin, "a chart", error));
    VSHI_TRY(vshi_allocate((void **)&s->around, p->count, 3 * sizeof *s->around, "a chart", error));
    for (uint32_t i = 0; i < p->count; ++i) {
        for (int k = 0; k < 3; ++k) {
            ++s->begin[p->corner[i][k] + 2];
        }
    }
    for (uint32_t v = 0; v < p->vertex_count; ++v) {
        s->begin[v + 2] += s->begin[v + 1];
    }
    for (uint32_t i = 0; i < p->count; ++i) {
        for (int k = 0; k < 3; ++k) {
            s->around[s->begin[p->corner[i][k] + 1]++] = i;
        }
    }
    return VSH_OK;
}

/* Bad triangles around a vertex. */
static uint32_t count_bad(const settling *s, uint32_t v) {
    uint32_t bad = 0;
    for (uint32_t i = s->begin[v]; i < s->begin[v + 1]; ++i) {
        bad += is_bad(s->patch, s->uvs, s->around[i]);
    }
    return bad;
}

/* Moves a vertex to where fewer triangles around it are bad, if it finds such a place. */
static void move(settling *s, uint32_t v) {
    static const int ways[8][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}};
    if (s->begin[v + 1] - s->begin[v] > MOST_AROUND) {
        return;
    }
    float *uv = s->uvs[v], best[2] = {uv[0], uv[1]};
    const float from[2] = {uv[0], uv[1]};
    uint32_t least = count_bad(s, v);
    double step = LEAST_STEP;
    for (int length = 0; length < LENGTHS && least > 0; ++length, step *= 2.0) {
        for (int way = 0; way < 8 && least > 0; ++way) {
            for (int d = 0; d < 2; ++d) {
                const float to = (float)((double)from[d] + step * ways[way][d]);
                uv[d] = to < 0.0F ? 0.0F : to > 1.0F ? 1.0F : to;
            }
            const uint32_t bad = count_bad(s, v);
            if (bad < least) {
                least = bad;
                best[0] = uv[0];
                best[1] = uv[1];
            }
        }
    }
    uv[0] = best[0];
    uv[1] = best[1];
}

vsh_result vshi_settle(const vshi_patch *p, float (*uvs)[2], vsh_error *error) {
    settling s = {.patch = p, .uvs = uvs};
    vsh_result result = VSH_OK;
    uint32_t bad = 0;
    for (uint32_t i = 0; i < p->count; ++i) {
        bad += is_bad(p, uvs, i);
    }
    if (bad == 0) {
        return VSH_OK;
    }
    VSHI_TRY_DONE(list_around(&s, error));
    for (int pass = 0; pass < PASSES && bad > 0; ++pass) {
        bad = 0;
        for (uint32_t i = 0; i < p->count; ++i) {
            for (int k = 0; k < 3 && is_bad(p, uvs, i); ++k) {
                move(&s, p->corner[i][k]);
            }
            bad += is_bad(p, uvs, i);
        }
    }
done:
    free(s.around);
    free(s.begin);
    return result;
}
