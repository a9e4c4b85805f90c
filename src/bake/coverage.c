#include "bake/coverage.h"

/* Whether the texel that sample i is the first of is in plain sight, none of whose samples is valid. */
static bool is_seen(const vsh_texels *texels, const vshi_origins *origins, size_t i) {
    bool seen = false;
    for (size_t k = i; k < texels->count && texels->texel[k] == texels->texel[i]; ++k) {
        seen = seen || origins->seen[k] != 0;
    }
    return seen;
}

void vshi_coverage_write(const vsh_texels *texels, const vshi_origins *origins, const uint8_t *state,
                         const vsh_lightmap *lightmap, vsh_bake_stats *stats) {
    const vshi_band *band = &texels->band;
    const size_t first = texels->row_start[band->own_begin - band->held_begin];
    const size_t last = texels->row_start[band->own_end - band->held_begin];
    size_t invalid = 0;
    for (size_t i = first; i < last; ++i) {
        if (i > first && texels->texel[i] == texels->texel[i - 1]) {
            continue;
        }
        const size_t texel = vshi_sample_held(texels, i);
        if (state[texel] == VSHI_TEXEL_INVALID) {
            const bool seen = is_seen(texels, origins, i);
            ++invalid;
            stats->seen_texels += seen;
            if (lightmap->invalid != NULL) {
                lightmap->invalid[texel] = seen ? 2.0f : 1.0f;
            }
            if (stats->invalid_by_mesh != NULL) {
                ++stats->invalid_by_mesh[vshi_sample_mesh(texels, i)];
            }
        } else if (lightmap->coverage != NULL) {
            lightmap->coverage[texel] = 1.0f;
        }
    }
    stats->texels = texels->info.covered;
    stats->invalid_texels = invalid;
}
