#include "bake/ambient.h"

void vshi_ambient_add(const vsh_texels *texels, const uint8_t *state, const vsh_lightmap *lightmap) {
    for (size_t i = 0; i < vshi_texels_held(texels); ++i) {
        const float open = lightmap->ao != NULL ? lightmap->ao[i] : 1.0f;
        for (size_t c = 0; c < 3; ++c) {
            float *value = &lightmap->irradiance[3 * i + c];
            if (lightmap->ambient == NULL) {
                *value *= open;
            } else if (state[i] == VSHI_TEXEL_VALID) {
                *value += (float)lightmap->ambient[c] * open;
            }
        }
    }
}
