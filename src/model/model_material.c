/* Materials of a model, and the images that those with holes have. */
#include "base/input.h"
#include "base/memory.h"
#include "base/try.h"
#include "model/model.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

size_t vsh_model_material_count(const vsh_model *model) {
    return model->material_count;
}

vsh_model_material vsh_model_get_material(const vsh_model *model, size_t index) {
    const vshi_model_material *kept = &model->materials[index];
    vsh_model_material told = kept->told;
    told.name = kept->name;
    if (kept->image > 0) {
        const vshi_model_image *image = &model->images[kept->image - 1];
        told.image = image->bytes;
        told.image_size = image->size;
        told.image_path = image->path;
    }
    return told;
}

int32_t vsh_model_mesh_material(const vsh_model *model, size_t index) {
    return model->shapes[model->entries[index].shape].material - 1;
}

vsh_result vshi_model_copy_line(const char *text, char **copy, vsh_error *error) {
    const size_t size = strlen(text) + 1;
    VSHI_TRY(vshi_allocate((void **)copy, size, 1, "a name", error));
    memcpy(*copy, text, size);
    for (char *c = *copy; *c != '\0'; ++c) {
        *c = (unsigned char)*c < 0x20 || *c == 0x7f ? '?' : *c;
    }
    return VSH_OK;
}

vsh_result vshi_model_take_plain_materials(vsh_model *model, size_t count, vsh_error *error) {
    static const double as_they_are[6] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0};
    VSHI_TRY(vshi_allocate((void **)&model->materials, count, sizeof *model->materials, "materials", error));
    model->material_count = count;
    for (size_t i = 0; i < count; ++i) {
        model->materials[i].told.base_alpha = 1.0;
        memcpy(model->materials[i].told.uv_transform, as_they_are, sizeof as_they_are);
    }
    return VSH_OK;
}

void vshi_model_free_materials(vsh_model *model) {
    for (size_t i = 0; i < model->material_count; ++i) {
        free(model->materials[i].name);
    }
    for (size_t i = 0; i < model->image_count; ++i) {
        free(model->images[i].path);
        free(model->images[i].owned);
    }
    free(model->images);
    free(model->materials);
}

/* --- between a reader and its caller */

enum { VALUES = 8 };

void vshi_model_put_materials(vshi_encoder *encoder, const vsh_model *model) {
    vshi_encode_count(encoder, model->image_count);
    for (size_t i = 0; i < model->image_count; ++i) {
        vshi_encode_text(encoder, model->images[i].path);
        vshi_encode_count(encoder, model->images[i].size);
        vshi_encode_array(encoder, model->images[i].bytes, model->images[i].size, 1);
    }
    vshi_encode_count(encoder, model->material_count);
    for (size_t i = 0; i < model->material_count; ++i) {
        const vsh_model_material *m = &model->materials[i].told;
        const double *t = m->uv_transform;
        const double values[VALUES] = {m->alpha_cutoff, m->base_alpha, t[0], t[1], t[2], t[3], t[4], t[5]};
        vshi_encode_text(encoder, model->materials[i].name);
        vshi_encode_count(encoder, (uint64_t)m->alpha);
        vshi_encode_count(encoder, (uint64_t)m->double_sided);
        vshi_encode_count(encoder, (uint64_t)m->uv_set);
        vshi_encode_count(encoder, (uint64_t)m->wrap[0]);
        vshi_encode_count(encoder, (uint64_t)m->wrap[1]);
        vshi_encode_count(encoder, (uint64_t)m->image_channel);
        vshi_encode_count(encoder, (uint64_t)m->by_texture);
        vshi_encode_count(encoder, model->materials[i].image);
        vshi_encode_array(encoder, values, VALUES, sizeof values[0]);
    }
}

/* A path that a reader tells is opened by its caller, if at all: it is held to the model's folder here, too.
 */
static vsh_result take_image(vshi_decoder *decoder, vshi_model_image *image, const char *path,
                             const vsh_run *run, vsh_error *error) {
    const char *told = vshi_decode_text(decoder, false);
    image->size = vshi_decode_count(decoder, SIZE_MAX / 2);
    image->bytes = vshi_decode_array(decoder, image->size, 1);
    const bool both = told != NULL && image->size > 0;
    const bool outside =
        told != NULL && (run == NULL || run->allow_outside == 0) && !vshi_input_is_beside(path, told);
    if (decoder->bad || both || outside) {
        return vshi_answer_fail(path, "its images", error);
    }
    if (told == NULL) {
        return VSH_OK;
    }
    const size_t size = strlen(told) + 1;
    VSHI_TRY(vshi_allocate((void **)&image->path, size, 1, path, error));
    memcpy(image->path, told, size);
    return VSH_OK;
}

static vsh_result take_material(vshi_decoder *decoder, const vsh_model *model, vshi_model_material *material,
                                const char *path, vsh_error *error) {
    vsh_model_material *m = &material->told;
    const char *name = vshi_decode_text(decoder, true);
    m->alpha = (int32_t)vshi_decode_count(decoder, VSH_ALPHA_BLENDED);
    m->double_sided = (int32_t)vshi_decode_count(decoder, 1);
    m->uv_set = (int32_t)vshi_decode_count(decoder, VSH_MAX_UV_SETS - 1);
    m->wrap[0] = (int32_t)vshi_decode_count(decoder, VSH_WRAP_CLAMP);
    m->wrap[1] = (int32_t)vshi_decode_count(decoder, VSH_WRAP_CLAMP);
    m->image_channel = (int32_t)vshi_decode_count(decoder, VSH_MASK_CHANNEL_AUTO);
    m->by_texture = (int32_t)vshi_decode_count(decoder, 1);
    material->image = (size_t)vshi_decode_count(decoder, model->image_count);
    const void *told = vshi_decode_array(decoder, VALUES, sizeof(double));
    double values[VALUES];
    if (decoder->bad || told == NULL) {
        return vshi_answer_fail(path, "its materials", error);
    }
    memcpy(values, told, sizeof values);
    bool good = values[0] >= 0.0 && values[1] >= 0.0 && values[1] <= 1.0;
    for (int i = 0; i < VALUES; ++i) {
        good = good && fabs(values[i]) <= FLT_MAX;
    }
    if (!good) {
        return vshi_answer_fail(path, "its materials", error);
    }
    m->alpha_cutoff = values[0];
    m->base_alpha = values[1];
    memcpy(m->uv_transform, values + 2, sizeof m->uv_transform);
    return name != NULL ? vshi_model_copy_line(name, &material->name, error) : VSH_OK;
}

vsh_result vshi_model_take_materials(vshi_decoder *decoder, vsh_model *model, const char *path,
                                     const vsh_run *run, vsh_error *error) {
    enum { LEAST_IMAGE = 16, LEAST_MATERIAL = 72 + 8 * VALUES }; /* bytes of the message */
    const size_t images = vshi_decode_count(decoder, (uint64_t)(decoder->end - decoder->at) / LEAST_IMAGE);
    VSHI_TRY(vshi_allocate((void **)&model->images, images, sizeof *model->images, path, error));
    model->image_count = images;
    for (size_t i = 0; i < images; ++i) {
        VSHI_TRY(take_image(decoder, &model->images[i], path, run, error));
    }
    const size_t count = vshi_decode_count(decoder, (uint64_t)(decoder->end - decoder->at) / LEAST_MATERIAL);
    VSHI_TRY(vshi_allocate((void **)&model->materials, count, sizeof *model->materials, path, error));
    model->material_count = count;
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY(take_material(decoder, model, &model->materials[i], path, error));
    }
    for (size_t i = 0; i < model->shape_count; ++i) {
        if (model->shapes[i].material < 0 || (size_t)model->shapes[i].material > count) {
            return vshi_answer_fail(path, "a mesh's material", error);
        }
    }
    return decoder->bad ? vshi_answer_fail(path, "its materials", error) : VSH_OK;
}
