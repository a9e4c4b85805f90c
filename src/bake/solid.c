#include "bake/solid.h"

#include "shade/layers.h"

#include <math.h>

vsh_result vshi_solid_of(const vsh_field *field, const vsh_shade_options *options, vshi_solid *solid,
                         vsh_error *error) {
    *solid = (vshi_solid){.fields = {field}, .count = 1};
    vsh_result result = VSH_OK;
    for (size_t i = 0; i < options->layer_count && result == VSH_OK; ++i) {
        vsh_layer layer;
        result = vshi_layer_resolve(options, i, &layer, error);
        if (result == VSH_OK) {
            solid->fields[solid->count++] = layer.field;
        }
    }
    for (size_t i = 0; i < solid->count; ++i) {
        vsh_field_info info;
        vsh_field_get_info(solid->fields[i], &info);
        solid->voxel_size = fmax(solid->voxel_size, info.voxel_size);
    }
    return result;
}

void vshi_solid_sample(const vshi_solid *solid, size_t count, const double *positions, float *distances) {
    vsh_field_sample(solid->fields[0], count, positions, distances);
    for (size_t f = 1; f < solid->count; ++f) {
        float other[VSHI_SOLID_MOST];
        vsh_field_sample(solid->fields[f], count, positions, other);
        for (size_t i = 0; i < count; ++i) {
            distances[i] = other[i] < distances[i] ? other[i] : distances[i]; /* NaN stays */
        }
    }
}
