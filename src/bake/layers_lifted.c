#include "bake/layers_lifted.h"
#include "base/memory.h"
#include "base/try.h"

#include <math.h>

vsh_result vshi_lift_layers(const vsh_occluders *occluders, const vsh_shade_options *shade,
                            vsh_layer **layers, bool *ao, vsh_error *error) {
    const double lifted = shade->start_offset * occluders->field->voxel_size + shade->surface_offset;
    *ao = false;
    VSHI_TRY(vshi_allocate((void **)layers, occluders->layer_count, sizeof **layers, "layers", error));
    for (size_t i = 0; i < occluders->layer_count; ++i) {
        vsh_layer *layer = &(*layers)[i];
        *layer = occluders->layers[i];
        *ao = *ao || layer->ao != 0;
        if (layer->field != NULL) {
            const vsh_field *own = layer->field;
            const double offset = layer->start_offset < 0.0 ? shade->start_offset : layer->start_offset;
            const double height =
                offset * own->voxel_size + 0.5 * own->shell_thickness + shade->surface_offset;
            layer->start_offset = fmin(16.0, fmax(0.0, (height - lifted) / own->voxel_size));
        }
    }
    return VSH_OK;
}
