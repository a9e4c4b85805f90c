/* A model between a reader and its caller. */
#include "base/file.h"
#include "base/memory.h"
#include "mesh/mesh.h"
#include "model/model.h"
#include "sandbox/reader.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The message: metres in a unit, shapes, entries, lights, images and materials. Each begins with a
 * structure in this machine's form; texts and arrays follow it, and pointers in it mean nothing. */

typedef struct shape_head {
    uint64_t triangle_count, vertex_count;
    uint32_t arrays; /* bits 1 << k of those that follow */
    uint32_t packed;
    int32_t alpha, material;
} shape_head;

/* --- the reader */

static void put_shape(vshi_encoder *encoder, vshi_model_shape *shape) {
    shape_head head = {shape->triangle_count, shape->vertex_count, 0,
                       shape->packed,         shape->alpha,        shape->material};
    for (int k = 0; k < VSHI_MODEL_ARRAYS && shape->triangle_count > 0; ++k) {
        head.arrays |= *vshi_model_array_of(shape, k).at != NULL ? 1U << k : 0;
    }
    vshi_encode_array(encoder, &head, 1, sizeof head);
    for (int k = 0; k < VSHI_MODEL_ARRAYS; ++k) {
        const vshi_model_array array = vshi_model_array_of(shape, k);
        if ((head.arrays >> k & 1) != 0) {
            vshi_encode_array(encoder, *array.at, array.count, array.size);
        }
    }
}

static void put_rest(vshi_encoder *encoder, const vsh_model *model) {
    vshi_encode_count(encoder, model->entry_count);
    for (size_t i = 0; i < model->entry_count; ++i) {
        vshi_encode_array(encoder, &model->entries[i], 1, sizeof *model->entries);
        vshi_encode_text(encoder, model->entries[i].name);
        vshi_encode_text(encoder, model->entries[i].object_name);
    }
    vshi_encode_count(encoder, model->light_count);
    for (size_t i = 0; i < model->light_count; ++i) {
        vshi_encode_array(encoder, &model->lights[i], 1, sizeof *model->lights);
        vshi_encode_text(encoder, model->lights[i].name);
    }
    vshi_encode_count(encoder, model->image_count);
    for (size_t i = 0; i < model->image_count; ++i) {
        vshi_encode_text(encoder, model->images[i].path);
        vshi_encode_count(encoder, model->images[i].size);
        vshi_encode_array(encoder, model->images[i].bytes, model->images[i].size, 1);
    }
    vshi_encode_count(encoder, model->material_count);
    for (size_t i = 0; i < model->material_count; ++i) {
        vshi_encode_array(encoder, &model->materials[i], 1, sizeof *model->materials);
        vshi_encode_text(encoder, model->materials[i].name);
    }
}

vsh_result vshi_serve_model(const char *path, vshi_decoder *request, const vsh_run *run,
                            vshi_encoder *payload, vsh_error *error) {
    (void)request;
    vsh_model *model = NULL;
    VSHI_TRY(vsh_model_read(path, run, &model, error));
    vshi_encode_number(payload, model->unit);
    vshi_encode_count(payload, model->shape_count);
    for (size_t i = 0; i < model->shape_count; ++i) {
        put_shape(payload, &model->shapes[i]);
    }
    put_rest(payload, model);
    vsh_model_free(model);
    return VSH_OK;
}

/* --- the caller */

/* An answer that is taken up. */
typedef struct taking {
    const char *path;
    const vsh_run *run;
    vshi_decoder *decoder;
    vsh_model *model;
} taking;

static vsh_result fail_answer(const taking *t, const char *what, vsh_error *error) {
    return vshi_answer_fail(t->path, what, error);
}

/* Allocates a list for the elements that follow. Each of them takes `least` bytes of the message. */
static vsh_result take_list(taking *t, size_t least, size_t size, void *list, size_t *count,
                            vsh_error *error) {
    const uint64_t most = (uint64_t)(t->decoder->end - t->decoder->at) / least;
    const size_t found = (size_t)vshi_decode_count(t->decoder, most);
    if (t->decoder->bad) {
        return fail_answer(t, "how many of a list there are", error);
    }
    VSHI_TRY(vshi_allocate((void **)list, found, size, t->path, error));
    *count = found;
    return VSH_OK;
}

static vsh_result check_shape(const taking *t, const vshi_model_shape *shape, vsh_error *error) {
    const vsh_mesh view = {.positions = shape->positions,
                           .indices = shape->indices,
                           .vertex_count = shape->vertex_count,
                           .triangle_count = shape->triangle_count};
    vsh_error why;
    if (vshi_mesh_validate(&view, VSHI_MESH_ALONE, &why) != VSH_OK) {
        return fail_answer(t, why.message, error);
    }
    bool finite = true;
    for (size_t i = 0; shape->normals != NULL && i < 3 * shape->vertex_count; ++i) {
        finite = finite & (fabsf(shape->normals[i]) <= FLT_MAX);
    }
    return finite ? VSH_OK : fail_answer(t, "a normal that is not finite", error);
}

static vsh_result take_shape(taking *t, vshi_model_shape *shape, vsh_error *error) {
    const shape_head *head = vshi_decode_array(t->decoder, 1, sizeof *head);
    if (head == NULL || head->triangle_count > SIZE_MAX / 64 || head->vertex_count > UINT32_MAX ||
        head->arrays >= 1U << VSHI_MODEL_ARRAYS || head->packed >= 1U << VSH_MAX_UV_SETS || head->alpha < 0 ||
        head->alpha > VSH_ALPHA_BLENDED || head->material < 0) {
        return fail_answer(t, "a mesh's numbers", error);
    }
    *shape = (vshi_model_shape){.triangle_count = head->triangle_count,
                                .vertex_count = head->vertex_count,
                                .packed = head->packed,
                                .alpha = head->alpha,
                                .material = head->material};
    if (shape->triangle_count == 0) {
        return VSH_OK;
    }
    for (int k = 0; k < VSHI_MODEL_ARRAYS; ++k) {
        const vshi_model_array array = vshi_model_array_of(shape, k);
        if ((head->arrays >> k & 1) == 0) {
            continue;
        }
        *array.at = (void *)(uintptr_t)vshi_decode_array(t->decoder, array.count, array.size);
        shape->uv_sets = k >= VSHI_MODEL_UVS ? k - VSHI_MODEL_UVS + 1 : 0;
    }
    return t->decoder->bad ? fail_answer(t, "an array's size", error) : check_shape(t, shape, error);
}

static vsh_result take_name(taking *t, char **name, vsh_error *error) {
    const char *given = vshi_decode_text(t->decoder, true);
    return given != NULL ? vshi_model_copy_line(given, name, error) : VSH_OK;
}

static vsh_result take_entry(taking *t, vsh_error *error) {
    vsh_model *model = t->model;
    const vshi_model_entry *given = vshi_decode_array(t->decoder, 1, sizeof *given);
    if (given == NULL || given->shape >= model->shape_count ||
        model->shapes[given->shape].triangle_count == 0) {
        return fail_answer(t, "a mesh's place", error);
    }
    vshi_model_entry *entry = &model->entries[model->entry_count++];
    *entry = *given;
    entry->name = entry->object_name = NULL;
    VSHI_TRY(take_name(t, &entry->name, error));
    VSHI_TRY(take_name(t, &entry->object_name, error));
    vsh_error why;
    const vsh_mesh view = vsh_model_mesh(model, model->entry_count - 1, 0);
    return vshi_mesh_check_transform(&view, VSHI_MESH_ALONE, &why) == VSH_OK
               ? VSH_OK
               : fail_answer(t, why.message, error);
}

/* Whether `count` numbers are finite, and not below `least`. */
static bool are_within(const double *values, size_t count, double least) {
    for (size_t i = 0; i < count; ++i) {
        if (!(values[i] >= least && values[i] <= FLT_MAX)) {
            return false;
        }
    }
    return true;
}

static bool is_light(const vsh_model_light *light) {
    static const double quarter = 1.5707963267948966, slack = 1e-9;
    const double *d = light->direction;
    const double square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    const double rest[] = {light->intensity, light->range, light->inner_angle, light->outer_angle};
    return light->type >= 0 && light->type <= VSH_MODEL_LIGHT_SPOT &&
           (light->type == VSH_MODEL_LIGHT_POINT ? square == 0.0 : fabs(square - 1.0) < slack) &&
           are_within(light->position, 3, -FLT_MAX) && are_within(light->color, 3, 0.0) &&
           are_within(rest, 4, 0.0) && light->inner_angle <= light->outer_angle &&
           light->outer_angle <= quarter &&
           (light->type == VSH_MODEL_LIGHT_SPOT) == (light->outer_angle > 0.0);
}

static vsh_result take_light(taking *t, vsh_error *error) {
    const vsh_model_light *given = vshi_decode_array(t->decoder, 1, sizeof *given);
    const char *name = vshi_decode_text(t->decoder, true);
    return given != NULL && !t->decoder->bad && is_light(given)
               ? vshi_model_add_light(t->model, given, name, error)
               : fail_answer(t, "its lights", error);
}

/* The caller opens a path that the reader names, so it checks again that it is in the model's folder. The
 * image's bytes stay where they lie in the answer. */
static vsh_result take_image(taking *t, vshi_model_image *image, vsh_error *error) {
    const char *path = vshi_decode_text(t->decoder, false);
    image->size = vshi_decode_count(t->decoder, SIZE_MAX / 2);
    image->bytes = vshi_decode_array(t->decoder, image->size, 1);
    const bool both = path != NULL && image->size > 0;
    const bool outside = path != NULL && (t->run == NULL || t->run->allow_outside == 0) &&
                         !vshi_input_is_beside(t->path, path);
    if (t->decoder->bad || both || outside) {
        return fail_answer(t, "its images", error);
    }
    if (path == NULL) {
        return VSH_OK;
    }
    const size_t size = strlen(path) + 1;
    VSHI_TRY(vshi_allocate((void **)&image->path, size, 1, t->path, error));
    memcpy(image->path, path, size);
    return VSH_OK;
}

static vsh_result take_material(taking *t, vshi_model_material *material, vsh_error *error) {
    const vshi_model_material *given = vshi_decode_array(t->decoder, 1, sizeof *given);
    if (given == NULL) {
        return fail_answer(t, "its materials", error);
    }
    vsh_model_material told = given->told;
    told.name = told.image_path = NULL;
    told.image = NULL;
    told.image_size = 0;
    const struct {
        int32_t value, most;
    } choices[] = {{told.alpha, VSH_ALPHA_BLENDED},
                   {told.double_sided, 1},
                   {told.uv_set, VSH_MAX_UV_SETS - 1},
                   {told.wrap[0], VSH_WRAP_CLAMP},
                   {told.wrap[1], VSH_WRAP_CLAMP},
                   {told.image_channel, VSH_MASK_CHANNEL_AUTO},
                   {told.by_texture, 1}};
    bool good = given->image <= t->model->image_count && are_within(&told.alpha_cutoff, 1, 0.0) &&
                are_within(&told.base_alpha, 1, 0.0) && told.base_alpha <= 1.0 &&
                are_within(told.uv_transform, 6, -FLT_MAX);
    for (size_t i = 0; i < sizeof choices / sizeof choices[0]; ++i) {
        good = good && choices[i].value >= 0 && choices[i].value <= choices[i].most;
    }
    if (!good) {
        return fail_answer(t, "its materials", error);
    }
    *material = (vshi_model_material){.told = told, .image = given->image};
    return take_name(t, &material->name, error);
}

static vsh_result take_all(taking *t, vsh_error *error) {
    enum { COUNT = sizeof(uint64_t) }; /* a text that is none, or a length */
    vsh_model *model = t->model;
    VSHI_TRY(
        take_list(t, sizeof(shape_head), sizeof *model->shapes, &model->shapes, &model->shape_count, error));
    for (size_t i = 0; i < model->shape_count; ++i) {
        VSHI_TRY(take_shape(t, &model->shapes[i], error));
    }
    VSHI_TRY(take_list(t, sizeof *model->entries + 2 * COUNT, sizeof *model->entries, &model->entries,
                       &model->entry_capacity, error));
    while (model->entry_count < model->entry_capacity) {
        VSHI_TRY(take_entry(t, error));
    }
    VSHI_TRY(take_list(t, sizeof *model->lights + COUNT, sizeof *model->lights, &model->lights,
                       &model->light_capacity, error));
    while (model->light_count < model->light_capacity) {
        VSHI_TRY(take_light(t, error));
    }
    VSHI_TRY(take_list(t, 2 * COUNT, sizeof *model->images, &model->images, &model->image_count, error));
    for (size_t i = 0; i < model->image_count; ++i) {
        VSHI_TRY(take_image(t, &model->images[i], error));
    }
    VSHI_TRY(take_list(t, sizeof *model->materials + COUNT, sizeof *model->materials, &model->materials,
                       &model->material_count, error));
    for (size_t i = 0; i < model->material_count; ++i) {
        VSHI_TRY(take_material(t, &model->materials[i], error));
    }
    for (size_t i = 0; i < model->shape_count; ++i) {
        if ((size_t)model->shapes[i].material > model->material_count) {
            return fail_answer(t, "a mesh's material", error);
        }
    }
    return vshi_decoder_ends(t->decoder) && model->entry_count > 0 ? VSH_OK
                                                                   : fail_answer(t, "its meshes", error);
}

vsh_result vshi_model_decode(vshi_decoder *decoder, const char *path, const vsh_run *run, vsh_model **model,
                             vsh_error *error) {
    taking t = {.path = path, .run = run, .decoder = decoder};
    vsh_result result;
    VSHI_TRY(vshi_allocate((void **)&t.model, 1, sizeof *t.model, path, error));
    t.model->borrowed = true;
    t.model->unit = vshi_decode_number(decoder);
    if (!(t.model->unit >= 0.0)) {
        VSHI_TRY_DONE(fail_answer(&t, "its unit", error));
    }
    VSHI_TRY_DONE(take_all(&t, error));
    *model = t.model;
    t.model = NULL;
done:
    vsh_model_free(t.model);
    return result;
}

vsh_result vshi_model_from_reader(const char *path, const vsh_run *run, vshi_job *job, size_t units,
                                  vsh_model **model, vsh_error *error) {
    vshi_exchange exchange;
    vshi_answer answer;
    VSHI_TRY(vshi_exchange_begin(&exchange, VSHI_READ_MODEL, path, run, error));
    VSHI_TRY(vshi_exchange_send_job(&exchange, job, units, &answer, error));
    const vsh_result result = vshi_model_decode(&answer.payload, path, run, model, error);
    if (result == VSH_OK) {
        (*model)->answer = answer;
    } else {
        vshi_answer_free(&answer);
    }
    return result;
}
