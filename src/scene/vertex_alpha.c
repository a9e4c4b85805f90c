#include "scene/vertex_alpha.h"

#include "base/memory.h"
#include "base/try.h"

#include <math.h>
#include <stdlib.h>

bool vshi_alpha_is_binary(const uint8_t *alpha, size_t count) {
    static const double BETWEEN = 0.25, SOME = 0.01;
    enum { CLEAR = 25, OPAQUE = 230 };
    size_t clear = 0, opaque = 0;
    for (size_t i = 0; i < count; ++i) {
        clear += alpha[i] <= CLEAR;
        opaque += alpha[i] >= OPAQUE;
    }
    const double all = (double)count;
    return (double)(count - clear - opaque) <= BETWEEN * all && (double)clear >= SOME * all &&
           (double)opaque >= SOME * all;
}

/* 0 … 1 */
static float within(float alpha) {
    return !isfinite(alpha) || alpha > 1.0F ? 1.0F : alpha < 0.0F ? 0.0F : alpha;
}

static vsh_result fill(const float *alphas, size_t count, const char *what, const vsh_run *run,
                       vshi_vertex_alpha *alpha, vsh_error *error) {
    uint8_t *bytes = NULL;
    vsh_result result;
    VSHI_TRY(vshi_check_limit(run, (1.0 + sizeof(float[2])) * (double)count, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&bytes, count, 1, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&alpha->uvs, count, sizeof(float[2]), what, error));
    for (size_t v = 0; v < count; ++v) {
        alpha->uvs[2 * v] = within(alphas[v]);
        bytes[v] = (uint8_t)(255.0F * alpha->uvs[2 * v] + 0.5F);
    }
    alpha->binary = vshi_alpha_is_binary(bytes, count);
done:
    free(bytes);
    return result;
}

vsh_result vshi_vertex_alpha_look(const float *alphas, size_t count, const char *what, const vsh_run *run,
                                  vshi_vertex_alpha *alpha, vsh_error *error) {
    *alpha = (vshi_vertex_alpha){.uniform = true, .factor = count > 0 ? (double)within(alphas[0]) : 1.0};
    for (size_t v = 1; v < count && alpha->uniform; ++v) {
        alpha->uniform = (double)within(alphas[v]) == alpha->factor;
    }
    return alpha->uniform ? VSH_OK : fill(alphas, count, what, run, alpha, error);
}

void vshi_vertex_alpha_free(vshi_vertex_alpha *alpha) {
    free(alpha->uvs);
    alpha->uvs = NULL;
}

vsh_alpha_mask vshi_vertex_alpha_mask(double base_alpha, double alpha_cutoff) {
    static const uint8_t ramp[2] = {0, 255};
    return (vsh_alpha_mask){.alpha = ramp,
                            .width = 2,
                            .height = 1,
                            .wrap = {VSH_WRAP_CLAMP, VSH_WRAP_CLAMP},
                            /* from the middle of the first texel to that of the second */
                            .uv_transform = {0.5, 0.0, 0.25, 0.0, 0.0, 0.5},
                            .alpha_cutoff = alpha_cutoff,
                            .base_alpha = base_alpha};
}
