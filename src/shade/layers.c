/* Layers beside the field: prepared for a light or for AO, then combined with the field's values. */
#include "shade/ao.h"
#include "shade/shadow.h"

#include "base/memory.h"
#include "light/light.h"
#include "shapes/heights.h"
#include "shapes/spheres.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A layer, prepared for one light or for AO. */
typedef struct prepared {
    vshi_layer layer;
    vsh_light light;
    vshi_shadow_task shadow; /* of heights and spheres only the options */
    vshi_ao_task ao;
} prepared;

struct vshi_layers {
    size_t count;
    prepared items[];
};

static vsh_result check_layer(const vshi_layer *layer, vsh_error *error) {
    const vshi_range ranges[] = {
        {"method", layer->method, -1, VSH_SHADOW_AUTO},
        {"combine", layer->combine, VSH_COMBINE_MULTIPLY, VSH_COMBINE_MIN},
        {"softness", layer->softness, 0, 1000},
        {"remap[0]", layer->remap[0], 0, 1},
        {"remap[1]", layer->remap[1], layer->remap[0], 1},
        {"start_offset", layer->start_offset, -1, 16},
    };
    VSHI_TRY(vshi_check_ranges(ranges, sizeof ranges / sizeof ranges[0], error));
    if (layer->remap[1] > 0.0 && !(layer->remap[0] < layer->remap[1])) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "remap from %g to %g: expected a rise", layer->remap[0],
                         layer->remap[1]);
    }
    for (size_t i = 0; layer->lights != NULL && i < layer->light_count; ++i) {
        if (layer->lights[i] == NULL) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "lights[%zu] is NULL", i);
        }
    }
    return VSH_OK;
}

/* Adds the layer's number to an error. */
static vsh_result name_layer(vsh_result result, size_t index, const vsh_error *why, vsh_error *error) {
    return result == VSH_OK ? VSH_OK : vshi_fail(error, result, "layer %zu: %s", index, why->message);
}

vsh_result vshi_layer_check(const vshi_layer *layers, size_t index, vsh_error *error) {
    vsh_error why;
    return name_layer(check_layer(&layers[index], &why), index, &why, error);
}

/* Whether a layer casts for a light, or for AO (NULL). Heights and spheres cast no ambient occlusion without
 * a field. */
static bool casts_for(const vshi_layer *layer, const vsh_light *light) {
    if (light == NULL) {
        return layer->ao != 0 && layer->field != NULL;
    }
    bool casts = layer->lights == NULL;
    for (size_t i = 0; !casts && i < layer->light_count; ++i) {
        casts = strncmp(layer->lights[i], light->name, sizeof light->name) == 0;
    }
    return casts;
}

static vsh_result prepare(prepared *item, size_t index, double lifted, const vsh_light *light, bool sphere,
                          vsh_shade_options options, vsh_error *error) {
    const vshi_layer *layer = &item->layer;
    const vsh_occluders own = {.field = layer->field, .triangles = layer->triangles, .lifted = lifted};
    options.start_offset = layer->start_offset < 0.0 ? options.start_offset : layer->start_offset;
    options.method = layer->method == VSH_SHADOW_OF_SCENE ? options.method : layer->method;
    if (light == NULL) {
        return vshi_ao_prepare(&own, &options, sphere, &item->ao, error);
    }
    item->light = vshi_light_resized(light, layer->softness);
    if (!vshi_layer_is_closed(layer)) {
        VSHI_TRY(vshi_shadow_prepare(&own, &item->light, &options, &item->shadow, error));
        item->shadow.purpose = 31u * item->shadow.purpose + (uint32_t)index + 1u;
        return VSH_OK;
    }
    vshi_shade_options_settle(&options, own.triangles);
    item->shadow.options = options;
    if (options.method != VSH_SHADOW_HARD && options.method != VSH_SHADOW_CLASSIC) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "heights and spheres are shaded by the methods hard and classic; for method %s "
                         "trace or voxelize them",
                         vsh_get_name(VSH_NAMES_SHADOW, options.method));
    }
    return vsh_light_check(&item->light, error);
}

vsh_result vshi_layers_prepare(const vsh_occluders *occluders, const vsh_shade_options *options,
                               const vsh_light *light, bool sphere, vshi_layers **layers, vsh_error *error) {
    *layers = NULL;
    if (occluders->layer_count == 0) {
        return VSH_OK;
    }
    vshi_layers *made;
    const size_t size = sizeof *made + occluders->layer_count * sizeof made->items[0];
    vsh_result result = VSH_OK;
    VSHI_TRY(vshi_allocate((void **)&made, 1, size, "layers", error));
    for (size_t i = 0; i < occluders->layer_count; ++i) {
        prepared *item = &made->items[made->count];
        item->layer = occluders->layers[i];
        if (casts_for(&item->layer, light)) {
            ++made->count;
            vsh_error why;
            VSHI_TRY_DONE(name_layer(prepare(item, i, occluders->lifted, light, sphere, *options, &why), i,
                                     &why, error));
        }
    }
done:
    if (result == VSH_OK && made->count > 0) {
        *layers = made;
    } else {
        vshi_layers_free(made);
    }
    return result;
}

void vshi_layers_free(vshi_layers *layers) {
    for (size_t i = 0; layers != NULL && i < layers->count; ++i) {
        vshi_shadow_close(&layers->items[i].shadow);
        vshi_ao_close(&layers->items[i].ao);
    }
    free(layers);
}

/* The points of a piece for a layer, numbered from 0 on. */
typedef struct layer_piece {
    vsh_points points;
    uint32_t texels[VSHI_PIECE];
    float value[VSHI_PIECE], deviation[VSHI_PIECE];
    double above[VSHI_PIECE]; /* part of the light above a point's own horizon */
    double share[VSHI_PIECE]; /* share of that part that the layer leaves */
    float bent[3 * VSHI_AO_GRAIN];
} layer_piece;

static void cut(layer_piece *piece, const vsh_points *points, size_t begin, size_t end) {
    piece->points = (vsh_points){end - begin, points->positions + 3 * begin,
                                 points->normals != NULL ? points->normals + 3 * begin : NULL, piece->texels};
    for (size_t i = begin; i < end; ++i) {
        piece->texels[i - begin] = points->texels != NULL ? points->texels[i] : (uint32_t)i;
    }
}

/* The steepest slope of a smoothstep over a unit: a deviation grows by at most this factor. */
static const double STEEPEST = 1.5;

/* Combines a layer's share of the light, or sky, above a point's own horizon with the point's value, a share
 * of the whole. */
static void combine(int32_t how, double share, double deviation, double above, float *of_point,
                    float *deviation_of_point) {
    const double before = (double)*of_point;
    if (how == VSH_COMBINE_MULTIPLY) {
        *of_point = (float)(before * share);
        if (deviation_of_point != NULL) {
            const double a = share * (double)*deviation_of_point, b = before * deviation;
            *deviation_of_point = (float)sqrt(a * a + b * b);
        }
    } else if (share * above < before) {
        *of_point = (float)(share * above);
        if (deviation_of_point != NULL) {
            *deviation_of_point = (float)(deviation * above);
        }
    }
}

/* Shades by the layer's field. Values of the whole light become shares of the light above the horizon, which
 * every layer's value contains. */
static void shade_field(const prepared *item, const vshi_shadow_task *task, size_t begin, layer_piece *piece,
                        vsh_shade_stats *stats) {
    vshi_shadow_task own = item->shadow;
    own.kernel = task->kernel;
    own.points = &piece->points;
    own.places = task->places != NULL ? task->places + 3 * begin : NULL;
    own.visibility = piece->value;
    own.deviation = task->deviation != NULL ? piece->deviation : NULL;
    vshi_shadow_shade(&own, 0, piece->points.count, stats);
    for (size_t i = 0; i < piece->points.count; ++i) {
        const double above = vshi_shadow_above(&own, i), scale = above > 0.0 ? 1.0 / above : 0.0;
        const double share = scale * (double)piece->value[i];
        piece->above[i] = above;
        piece->share[i] = share > 1.0 ? 1.0 : share; /* NaN stays */
        piece->deviation[i] = own.deviation != NULL ? (float)(scale * (double)piece->deviation[i]) : 0.0f;
    }
}

/* Shades by heights or spheres, which give shares. */
static void shade_closed(const prepared *item, const vshi_shadow_task *task, size_t begin, layer_piece *piece,
                         vsh_shade_stats *stats) {
    const vshi_layer *layer = &item->layer;
    const size_t count = piece->points.count;
    if (layer->heights != NULL) {
        vshi_heights_shadow(layer->heights, &item->light, item->shadow.options.method, &piece->points, 0,
                            count, vshi_heights_offset(layer->heights, layer->start_offset), piece->value,
                            stats);
    } else {
        vshi_spheres_shadow(layer->spheres, &item->light, item->shadow.options.method, &piece->points, 0,
                            count, piece->value, stats);
    }
    for (size_t i = 0; i < count; ++i) {
        piece->above[i] = vshi_shadow_above(task, begin + i);
        piece->share[i] = (double)piece->value[i];
        piece->deviation[i] = 0.0f;
    }
}

void vshi_layers_shadow(const vshi_layers *layers, const vshi_shadow_task *task, size_t begin, size_t end,
                        vsh_shade_stats *stats) {
    layer_piece piece;
    cut(&piece, task->points, begin, end);
    for (size_t k = 0; k < layers->count; ++k) {
        const prepared *item = &layers->items[k];
        const double *remap = item->layer.remap;
        if (vshi_layer_is_closed(&item->layer)) {
            shade_closed(item, task, begin, &piece, stats);
        } else {
            shade_field(item, task, begin, &piece, stats);
        }
        for (size_t i = begin, n = 0; i < end; ++i, ++n) {
            if (!(task->visibility[i] > 0.0f)) {
                continue; /* dark already, turned away, or invalid */
            }
            double share = piece.share[n], deviation = (double)piece.deviation[n];
            if (remap[1] > 0.0) {
                const double x = (share - remap[0]) / (remap[1] - remap[0]);
                share = x <= 0.0 ? 0.0 : x >= 1.0 ? 1.0 : x * x * (3.0 - 2.0 * x); /* NaN stays */
                deviation *= STEEPEST / (remap[1] - remap[0]);
            }
            combine(item->layer.combine, share, deviation, piece.above[n], &task->visibility[i],
                    task->deviation != NULL ? &task->deviation[i] : NULL);
        }
    }
}

static void occlude(const prepared *item, const vshi_ao_task *task, size_t begin, layer_piece *piece,
                    vsh_shade_stats *stats) {
    const size_t count = piece->points.count;
    vshi_ao_task own = item->ao;
    memset(piece->deviation, 0, count * sizeof *piece->deviation);
    own.kernel = task->kernel;
    own.outside = task->outside;
    own.points = &piece->points;
    own.faces = task->faces != NULL ? task->faces + 3 * begin : NULL;
    own.values = (vshi_ao_values){piece->value, task->values.deviation != NULL ? piece->deviation : NULL,
                                  task->values.bent != NULL ? piece->bent : NULL};
    vshi_ao_shade(&own, 0, count, stats);
}

void vshi_layers_ao(const vshi_layers *layers, const vshi_ao_task *task, size_t begin, size_t end,
                    vsh_shade_stats *stats) {
    const vshi_ao_values *to = &task->values;
    layer_piece piece;
    cut(&piece, task->points, begin, end);
    for (size_t k = 0; k < layers->count; ++k) {
        occlude(&layers->items[k], task, begin, &piece, stats);
        for (size_t i = begin, n = 0; i < end; ++i, ++n) {
            combine(layers->items[k].layer.combine, (double)piece.value[n], (double)piece.deviation[n], 1.0,
                    &to->ao[i], to->deviation != NULL ? &to->deviation[i] : NULL);
            if (to->bent != NULL) { /* the layer hides this part of the full sky */
                const vshi_vec normal = vshi_unit(vshi_vec_off(task->points->normals + 3 * i));
                float open[3];
                vshi_vec_to_floats(vshi_scale(normal, VSHI_AO_OPEN), open);
                for (size_t axis = 0; axis < 3; ++axis) {
                    to->bent[3 * i + axis] += piece.bent[3 * n + axis] - open[axis];
                }
            }
        }
    }
}
