/* Layers beside the field: prepared for a light or for AO, then combined with the field's values. */
#pragma once

#include "shade/ao.h"
#include "shade/shadow.h"

/* The layers that take part in one light's shadow, or in AO. */
typedef struct vshi_layers vshi_layers;

/* Checks layers[index]. Errors: VSH_ERROR_ARGUMENT, naming the layer's number, the member, its value and the
 * limit. */
vsh_result vshi_layer_check(const vshi_layer *layers, size_t index, vsh_error *error);

/* Whether a layer's shadows need no field: heights are marched, spheres have closed forms. */
static inline bool vshi_layer_is_closed(const vshi_layer *layer) {
    return layer->heights != NULL || layer->spheres != NULL;
}

/* Prepares the layers that cast for `light`, or for AO (NULL), by resolved options. `sphere` is
 * vshi_ao_prepare()'s. *layers is NULL if there are none. Free with vshi_layers_free(). Errors:
 * VSH_ERROR_ARGUMENT, VSH_ERROR_MEMORY. */
vsh_result vshi_layers_prepare(const vsh_occluders *occluders, const vsh_shade_options *options,
                               const vsh_light *light, bool sphere, vshi_layers **layers, vsh_error *error);
void vshi_layers_free(vshi_layers *layers); /* NULL does nothing */

/* Combines the layers with the values of points begin … end - 1 in the task's arrays: at most VSHI_PIECE
 * points, for AO VSHI_AO_GRAIN. */
void vshi_layers_shadow(const vshi_layers *layers, const vshi_shadow_task *task, size_t begin, size_t end,
                        vsh_shade_stats *stats);
void vshi_layers_ao(const vshi_layers *layers, const vshi_ao_task *task, size_t begin, size_t end,
                    vsh_shade_stats *stats);
