/* Layers for points that are lifted already. */
#ifndef VSHI_BAKE_LAYERS_LIFTED_H
#define VSHI_BAKE_LAYERS_LIFTED_H

#include "field/field.h"
#include "shade/layers.h"

/* The options' layers for points that start_offset and surface_offset have lifted off `field`: what their own
 * voxels need beyond that is left. *layers [occluders->layer_count], which the caller frees also after an
 * error; *ao: whether any takes part in AO. Errors: VSH_ERROR_ARGUMENT, VSH_ERROR_MEMORY. */
vsh_result vshi_lift_layers(const vsh_occluders *occluders, const vsh_shade_options *shade,
                            vsh_layer **layers, bool *ao, vsh_error *error);

#endif
