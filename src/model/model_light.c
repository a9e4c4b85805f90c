/* Lights of a model: those of its file's nodes, in the world. */
#include "base/memory.h"
#include "base/try.h"
#include "model/model.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

size_t vsh_model_light_count(const vsh_model *model) {
    return model->light_count;
}

vsh_model_light vsh_model_get_light(const vsh_model *model, size_t index) {
    return model->lights[index];
}

static vsh_result grow(vsh_model *model, vsh_error *error) {
    if (model->light_count < model->light_capacity) {
        return VSH_OK;
    }
    const size_t capacity = 2 * model->light_capacity + 8;
    vsh_model_light *lights = NULL;
    VSHI_TRY(vshi_allocate((void **)&lights, capacity, sizeof *lights, "a model's lights", error));
    if (model->light_count > 0) {
        memcpy(lights, model->lights, model->light_count * sizeof *lights);
    }
    free(model->lights);
    model->lights = lights;
    model->light_capacity = capacity;
    return VSH_OK;
}

vsh_result vshi_model_add_light(vsh_model *model, const vsh_model_light *light, const char *name,
                                vsh_error *error) {
    VSHI_TRY(grow(model, error));
    char *copy = NULL;
    if (name != NULL && name[0] != '\0') {
        VSHI_TRY(vshi_model_copy_line(name, &copy, error));
    }
    vsh_model_light *added = &model->lights[model->light_count++];
    *added = *light;
    added->name = copy;
    return VSH_OK;
}

void vshi_model_free_lights(vsh_model *model) {
    for (size_t i = 0; i < model->light_count; ++i) {
        free((char *)(uintptr_t)model->lights[i].name);
    }
    free(model->lights);
}

/* --- between a reader and its caller */

enum { VALUES = 13 };

void vshi_model_put_lights(vshi_encoder *encoder, const vsh_model *model) {
    vshi_encode_count(encoder, model->light_count);
    for (size_t i = 0; i < model->light_count; ++i) {
        const vsh_model_light *l = &model->lights[i];
        const double values[VALUES] = {l->position[0],  l->position[1],  l->position[2], l->direction[0],
                                       l->direction[1], l->direction[2], l->color[0],    l->color[1],
                                       l->color[2],     l->intensity,    l->range,       l->inner_angle,
                                       l->outer_angle};
        vshi_encode_text(encoder, l->name);
        vshi_encode_count(encoder, (uint64_t)l->type);
        vshi_encode_array(encoder, values, VALUES, sizeof values[0]);
    }
}

static bool holds(const vsh_model_light *light, const double values[VALUES]) {
    static const double quarter = 1.5707963267948966, slack = 1e-9;
    const double *d = light->direction;
    const double square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    bool good = light->type == VSH_MODEL_LIGHT_POINT ? square == 0.0 : fabs(square - 1.0) < slack;
    for (int i = 0; i < VALUES; ++i) {
        good = good && fabs(values[i]) <= FLT_MAX && (i < 6 || values[i] >= 0.0);
    }
    return good && light->inner_angle <= light->outer_angle && light->outer_angle <= quarter &&
           (light->type == VSH_MODEL_LIGHT_SPOT) == (light->outer_angle > 0.0);
}

vsh_result vshi_model_take_lights(vshi_decoder *decoder, vsh_model *model, const char *path,
                                  vsh_error *error) {
    enum { LEAST = 8 + 8 + 8 * VALUES }; /* bytes of the message */
    const uint64_t count = vshi_decode_count(decoder, (uint64_t)(decoder->end - decoder->at) / LEAST);
    for (uint64_t i = 0; i < count; ++i) {
        const char *name = vshi_decode_text(decoder, true);
        vsh_model_light light = {.type = (int32_t)vshi_decode_count(decoder, VSH_MODEL_LIGHT_SPOT)};
        const void *told = vshi_decode_array(decoder, VALUES, sizeof(double));
        double values[VALUES];
        if (told == NULL) {
            break;
        }
        memcpy(values, told, sizeof values);
        memcpy(light.position, values, sizeof light.position);
        memcpy(light.direction, values + 3, sizeof light.direction);
        memcpy(light.color, values + 6, sizeof light.color);
        light.intensity = values[9];
        light.range = values[10];
        light.inner_angle = values[11];
        light.outer_angle = values[12];
        if (decoder->bad || !holds(&light, values)) {
            decoder->bad = true;
            break;
        }
        VSHI_TRY(vshi_model_add_light(model, &light, name, error));
    }
    return decoder->bad ? vshi_answer_fail(path, "its lights", error) : VSH_OK;
}
