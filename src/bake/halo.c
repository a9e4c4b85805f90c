#include "bake/halo.h"
#include "bake/take.h"

#include <stdlib.h>
#include <string.h>

static void add(vshi_halo *halo, float *plane, size_t channels) {
    if (plane != NULL) {
        halo->given[halo->count] = halo->planes[halo->count] = (vshi_plane){plane, channels};
        ++halo->count;
    }
}

static void list(const vsh_lightmap *given, size_t light_count, vshi_halo *halo) {
    for (size_t i = 0; given->shadow != NULL && i < light_count; ++i) {
        add(halo, given->shadow[i], 1);
    }
    add(halo, given->ao, 1);
    add(halo, given->irradiance, 3);
    add(halo, given->bent, 3);
    for (size_t i = 0; given->tint != NULL && i < light_count; ++i) {
        add(halo, given->tint[i], 3);
    }
    halo->padded = halo->count;
    for (size_t i = 0; given->shadow_error != NULL && i < light_count; ++i) {
        add(halo, given->shadow_error[i], 1);
    }
    add(halo, given->ao_error, 1);
    add(halo, given->coverage, 1);
    add(halo, given->invalid, 1);
}

double vshi_halo_bytes(const vsh_texels *texels, const vsh_lightmap *given, size_t light_count) {
    size_t floats = (given->ao != NULL) + (given->ao_error != NULL) + (given->coverage != NULL) +
                    (given->invalid != NULL) + (given->irradiance != NULL ? 3 : 0) +
                    (given->bent != NULL ? 3 : 0);
    for (size_t i = 0; i < light_count; ++i) {
        floats += given->shadow != NULL && given->shadow[i] != NULL;
        floats += given->tint != NULL && given->tint[i] != NULL ? 3 : 0;
        floats += given->shadow_error != NULL && given->shadow_error[i] != NULL;
    }
    return vshi_texels_has_halo(texels) ? (double)(vshi_texels_held(texels) * floats * sizeof(float)) : 0.0;
}

/* The plane that stands for one of the caller's, in the order of list(). */
static float *next_of(const vshi_halo *halo, const float *given, size_t *next) {
    return given != NULL ? halo->planes[(*next)++].values : NULL;
}

/* Gives every plane memory of its own. */
static vsh_result take_planes(const vsh_texels *texels, const vsh_lightmap *given, size_t light_count,
                              vshi_halo *halo, vsh_error *error) {
    const size_t texel_count = vshi_texels_held(texels);
    const char *what = "lightmap band";
    size_t floats = 0;
    vsh_result result = VSH_OK;
    for (size_t p = 0; p < halo->count; ++p) {
        floats += halo->planes[p].channels;
    }
    halo->shadow = vshi_take(light_count, sizeof *halo->shadow, what, &result, error);
    halo->shadow_error = vshi_take(light_count, sizeof *halo->shadow_error, what, &result, error);
    halo->tint = vshi_take(light_count, sizeof *halo->tint, what, &result, error);
    halo->memory = vshi_take(texel_count, floats * sizeof(float), what, &result, error);
    if (result != VSH_OK) {
        return result;
    }
    float *memory = halo->memory;
    for (size_t p = 0; p < halo->count; ++p) {
        halo->planes[p].values = memory;
        memory += texel_count * halo->planes[p].channels;
    }
    vsh_lightmap *own = &halo->lightmap;
    size_t next = 0;
    for (size_t i = 0; given->shadow != NULL && i < light_count; ++i) {
        halo->shadow[i] = next_of(halo, given->shadow[i], &next);
    }
    own->shadow = given->shadow != NULL ? halo->shadow : NULL;
    own->ao = next_of(halo, given->ao, &next);
    own->irradiance = next_of(halo, given->irradiance, &next);
    own->bent = next_of(halo, given->bent, &next);
    for (size_t i = 0; given->tint != NULL && i < light_count; ++i) {
        halo->tint[i] = next_of(halo, given->tint[i], &next);
    }
    own->tint = given->tint != NULL ? halo->tint : NULL;
    for (size_t i = 0; given->shadow_error != NULL && i < light_count; ++i) {
        halo->shadow_error[i] = next_of(halo, given->shadow_error[i], &next);
    }
    own->shadow_error = given->shadow_error != NULL ? halo->shadow_error : NULL;
    own->ao_error = next_of(halo, given->ao_error, &next);
    own->coverage = next_of(halo, given->coverage, &next);
    own->invalid = next_of(halo, given->invalid, &next);
    return VSH_OK;
}

vsh_result vshi_halo_open(const vsh_texels *texels, const vsh_lightmap *given, size_t light_count,
                          vshi_halo *halo, vsh_error *error) {
    *halo = (vshi_halo){.lightmap = *given};
    const size_t most = 3 * light_count + 6;
    vsh_result result = VSH_OK;
    halo->planes = vshi_take(most, sizeof *halo->planes, "lightmap", &result, error);
    halo->given = vshi_take(most, sizeof *halo->given, "lightmap", &result, error);
    if (result != VSH_OK) {
        return result;
    }
    list(given, light_count, halo);
    if (vshi_texels_has_halo(texels)) {
        return take_planes(texels, given, light_count, halo, error);
    }
    for (size_t p = 0; p < halo->count; ++p) {
        memset(halo->planes[p].values, 0,
               vshi_texels_held(texels) * halo->planes[p].channels * sizeof(float));
    }
    return VSH_OK;
}

void vshi_halo_give(const vsh_texels *texels, const vshi_halo *halo) {
    const vshi_band *band = &texels->band;
    const size_t width = (size_t)texels->info.width;
    const size_t skipped = width * (size_t)(band->own_first - band->first);
    for (size_t p = 0; halo->memory != NULL && p < halo->count; ++p) {
        const size_t channels = halo->planes[p].channels;
        memcpy(halo->given[p].values, halo->planes[p].values + skipped * channels,
               width * (size_t)band->own_rows * channels * sizeof(float));
    }
}

void vshi_halo_close(vshi_halo *halo) {
    free(halo->memory);
    free(halo->tint);
    free(halo->shadow_error);
    free(halo->shadow);
    free(halo->given);
    free(halo->planes);
    *halo = (vshi_halo){0};
}
