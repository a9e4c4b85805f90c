/* What vsh_bake_lightmap() does last, of rows that were baked by themselves. */
#include "bake/nearest_valid.h"
#include "bake/part.h"
#include "bake/pull_push.h"
#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>

enum { STATES = 2 }; /* bytes a texel: what it is, and whether it is filled */

int32_t vshi_part_padding(const vsh_charts *charts, bool *fills) {
    *fills = charts->fills;
    return charts->padding;
}

int32_t vshi_part_reach(const vsh_charts *charts) {
    const int32_t least = VSHI_SPREAD_REACH;
    return charts->padding > least ? charts->padding : least;
}

double vshi_rows_complete_bytes(int32_t width, int32_t rows, bool fills) {
    const double texels = (double)width * (double)rows;
    return texels * (STATES + VSHI_PADDING_TEXEL_BYTES + VSHI_SPREAD_TEXEL_BYTES + sizeof(uint32_t)) +
           (fills ? vshi_pull_push_bytes(width, rows) : 0.0);
}

/* Where invalid texels take their values from, by what was known of them before they were shaded. */
static vsh_result find_spread(const vshi_rows_given *given, uint8_t *state, vshi_spread *spread,
                              vsh_error *error) {
    const size_t texels = (size_t)given->width * (size_t)given->rows;
    uint32_t *mesh = NULL;
    VSHI_TRY(vshi_allocate((void **)&mesh, texels, sizeof *mesh, "lightmap", error));
    for (size_t i = 0; i < texels; ++i) {
        const uint32_t known = given->known[i];
        mesh[i] = known & VSHI_PART_MESH;
        state[i] = (known & VSHI_PART_MESH) == 0        ? VSHI_TEXEL_EMPTY
                   : (known & VSHI_PART_SHADEABLE) != 0 ? VSHI_TEXEL_VALID
                                                        : VSHI_TEXEL_INVALID;
    }
    const vsh_result result =
        vshi_spread_find_among((size_t)given->width, (size_t)given->rows, mesh, state, spread, error);
    free(mesh);
    return result;
}

/* What texels are once they are shaded; returns whether one has no value. */
static bool settle(const vshi_rows_given *given, uint8_t *state) {
    const size_t texels = (size_t)given->width * (size_t)given->rows;
    bool any = false;
    for (size_t i = 0; i < texels; ++i) {
        if (state[i] != VSHI_TEXEL_EMPTY) {
            state[i] = given->coverage[i] == 1.0f ? VSHI_TEXEL_VALID : VSHI_TEXEL_INVALID;
            any = any || state[i] == VSHI_TEXEL_INVALID;
        }
    }
    return any;
}

vsh_result vshi_rows_complete(const vshi_rows_given *given, const vsh_run *run, vsh_error *error) {
    const size_t texels = (size_t)given->width * (size_t)given->rows;
    const int32_t least = VSHI_LEAST_INVALID_RADIUS;
    uint8_t *state = NULL, *filled = NULL;
    vshi_spread spread = {0};
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&state, texels, 1, "lightmap", error));
    VSHI_TRY_DONE(find_spread(given, state, &spread, error));
    const bool invalid = settle(given, state);
    vshi_spread_copy(&spread, state, given->planes, given->plane_count);
    const int32_t radius[VSHI_TEXEL_KINDS] = {
        [VSHI_TEXEL_EMPTY] = given->padding,
        [VSHI_TEXEL_INVALID] = !invalid                 ? 0
                               : given->padding > least ? given->padding
                                                        : least,
    };
    if (given->fills) {
        VSHI_TRY_DONE(vshi_allocate((void **)&filled, texels, 1, "padding", error));
    }
    VSHI_TRY_DONE(vshi_padding_fill(run, given->width, given->rows, state, radius, given->planes,
                                    given->plane_count, filled, error));
    if (given->fills) {
        result =
            vshi_pull_push(run, given->width, given->rows, filled, given->planes, given->plane_count, error);
    }
done:
    free(filled);
    vshi_spread_free(&spread);
    free(state);
    return result;
}
