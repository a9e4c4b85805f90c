#include "bake/wanted.h"

#include <math.h>

float *vshi_tint_of(const vsh_lightmap *lightmap, size_t light) {
    return lightmap->tint != NULL ? lightmap->tint[light] : NULL;
}

bool vshi_tint_wanted(const vsh_lightmap *lightmap, size_t light_count) {
    bool wanted = false;
    for (size_t i = 0; i < light_count; ++i) {
        wanted = wanted || vshi_tint_of(lightmap, i) != NULL;
    }
    return wanted;
}

bool vshi_light_wanted(const vsh_lightmap *lightmap, size_t light) {
    return lightmap->irradiance != NULL || vshi_tint_of(lightmap, light) != NULL ||
           (lightmap->shadow != NULL && lightmap->shadow[light] != NULL) ||
           (lightmap->shadow_error != NULL && lightmap->shadow_error[light] != NULL);
}

bool vshi_ao_wanted(const vsh_lightmap *lightmap) {
    return lightmap->ao != NULL || lightmap->ao_error != NULL || lightmap->bent != NULL;
}

bool vshi_errors_wanted(const vsh_lightmap *lightmap, size_t light_count) {
    bool wanted = lightmap->ao_error != NULL;
    for (size_t i = 0; i < light_count && lightmap->shadow_error != NULL; ++i) {
        wanted = wanted || lightmap->shadow_error[i] != NULL;
    }
    return wanted;
}

vsh_result vshi_wanted_check(const vsh_lightmap *lightmap, const vsh_texels *texels, const vsh_light *lights,
                             size_t light_count, bool *light, vsh_error *error) {
    *light = false;
    if (lightmap->bent != NULL && lightmap->bent_space != VSH_BENT_WORLD &&
        (lightmap->bent_space != VSH_BENT_TANGENT || texels->tangent == NULL)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "bent_space %d: expected %d, or %d with texels that have tangents",
                         lightmap->bent_space, VSH_BENT_WORLD, VSH_BENT_TANGENT);
    }
    vsh_result result = vsh_tint_check(&lightmap->tint_by, error);
    for (int c = 0; result == VSH_OK && lightmap->ambient != NULL && c < 3; ++c) {
        if (!(lightmap->ambient[c] >= 0.0 && isfinite(lightmap->ambient[c]))) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "ambient[%d] %g: expected a finite number, at least 0", c, lightmap->ambient[c]);
        }
    }
    for (size_t i = 0; result == VSH_OK && i < light_count; ++i) {
        result = vsh_light_check(&lights[i], error);
        *light = *light || vshi_light_wanted(lightmap, i);
    }
    return result;
}
