/* Layers beside the field: prepared for a light or for AO, then combined with what the field gave. */
#ifndef VSHI_LAYERS_H
#define VSHI_LAYERS_H

#include "shade/ao.h"
#include "shade/shadow.h"

/* The layers that take part in one light's shadow, or in AO. */
typedef struct vshi_layers vshi_layers;

/* Layer `index` of the caller's, resolved and checked. Errors: VSH_ERROR_ARGUMENT, naming number, field,
 * value and limit. */
vsh_result vshi_layer_resolve(const vsh_layer *layers, size_t index, vsh_layer *layer, vsh_error *error);

/* Whether a layer's shadows need no field: heights are marched, spheres have closed forms. */
static inline bool vshi_layer_is_closed(const vsh_layer *layer) {
    return layer->heights != NULL || layer->spheres != NULL;
}

/* Bytes of what a resolved layer refers to, triangles aside. */
double vshi_layer_bytes(const vsh_layer *layer);

/* Prepares the layers, by resolved options, those that cast for `light`, or NULL for AO; `sphere` is
 * vshi_ao_prepare()'s. *layers is NULL where there are none. Free with vshi_layers_free(). Errors:
 * VSH_ERROR_ARGUMENT, VSH_ERROR_MEMORY. */
vsh_result vshi_layers_prepare(const vsh_occluders *occluders, const vsh_shade_options *options,
                               const vsh_light *light, bool sphere, vshi_layers **layers, vsh_error *error);
void vshi_layers_free(vshi_layers *layers); /* NULL does nothing */

/* Combines the layers with the values that the task's arrays hold of points begin … end - 1: at most
 * VSHI_PIECE, of AO VSHI_AO_GRAIN. */
void vshi_layers_shadow(const vshi_layers *layers, const vshi_shadow_task *task, size_t begin, size_t end,
                        vsh_shade_stats *stats);
void vshi_layers_ao(const vshi_layers *layers, const vshi_ao_task *task, size_t begin, size_t end,
                    vsh_shade_stats *stats);

#endif
