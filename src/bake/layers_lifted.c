#include "bake/layers_lifted.h"
#include "base/memory.h"

#include <math.h>

vsh_result vshi_lift_layers(const vsh_shade_options *shade, const vsh_field *field, vsh_layer **layers,
                            bool *ao, vsh_error *error) {
    const double lifted = shade->start_offset * field->voxel_size + shade->surface_offset;
    vsh_result result = vshi_allocate((void **)layers, shade->layer_count, sizeof **layers, "layers", error);
    *ao = false;
    for (size_t i = 0; result == VSH_OK && i < shade->layer_count; ++i) {
        vsh_layer *layer = &(*layers)[i];
        result = vshi_layer_resolve(shade->layers, i, layer, error);
        if (result == VSH_OK) {
            *ao = *ao || layer->ao != 0;
        }
        if (result == VSH_OK && layer->field != NULL) {
            const vsh_field *own = layer->field;
            const double offset = layer->start_offset < 0.0 ? shade->start_offset : layer->start_offset;
            const double height =
                offset * own->voxel_size + 0.5 * own->shell_thickness + shade->surface_offset;
            layer->start_offset = fmin(16.0, fmax(0.0, (height - lifted) / own->voxel_size));
        }
    }
    return result;
}
