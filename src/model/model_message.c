/* A model between a reader and its caller. */
#include "base/memory.h"
#include "base/try.h"
#include "mesh/mesh.h"
#include "model/model.h"
#include "sandbox/reader.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static void put_shape(vshi_encoder *encoder, const vshi_model_file *file, const vshi_model_shape *shape) {
    vshi_encode_count(encoder, shape->triangle_count);
    vshi_encode_count(encoder, shape->vertex_count);
    vshi_encode_count(encoder, (uint64_t)shape->uv_sets);
    vshi_encode_count(encoder, shape->packed);
    vshi_encode_count(encoder, (uint64_t)shape->alpha);
    vshi_encode_count(encoder, (uint64_t)shape->material);
    if (shape->triangle_count == 0) {
        return;
    }
    vshi_encode_count(encoder, shape->raw != NULL);
    if (shape->raw != NULL) {
        vshi_raw_put(encoder, file, shape);
        return;
    }
    vshi_encode_array(encoder, shape->positions, shape->vertex_count, sizeof(float[3]));
    vshi_encode_array(encoder, shape->indices, shape->triangle_count, sizeof(uint32_t[3]));
    vshi_encode_count(encoder, shape->normals != NULL);
    if (shape->normals != NULL) {
        vshi_encode_array(encoder, shape->normals, shape->vertex_count, sizeof(float[3]));
    }
    vshi_encode_count(encoder, shape->alphas != NULL);
    if (shape->alphas != NULL) {
        vshi_encode_array(encoder, shape->alphas, shape->vertex_count, sizeof(float));
    }
    for (int32_t set = 0; set < shape->uv_sets; ++set) {
        vshi_encode_count(encoder, shape->uvs[set] != NULL);
        if (shape->uvs[set] != NULL) {
            vshi_encode_array(encoder, shape->uvs[set], shape->vertex_count, sizeof(float[2]));
        }
    }
}

vsh_result vshi_serve_model(const char *path, vshi_decoder *request, const vsh_run *run,
                            vshi_encoder *payload, vsh_error *error) {
    (void)request;
    vsh_model *model = NULL;
    VSHI_TRY(vshi_model_read(path, run, true, &model, error));
    vshi_encode_number(payload, model->unit);
    vshi_encode_count(payload, vshi_raw_bytes(model));
    vshi_encode_array(payload, model->file.identity, VSHI_FILE_IDENTITY, sizeof model->file.identity[0]);
    vshi_encode_count(payload, model->shape_count);
    for (size_t i = 0; i < model->shape_count; ++i) {
        put_shape(payload, &model->file, &model->shapes[i]);
    }
    vshi_encode_count(payload, model->entry_count);
    for (size_t i = 0; i < model->entry_count; ++i) {
        const vshi_model_entry *entry = &model->entries[i];
        vshi_encode_text(payload, entry->name);
        vshi_encode_text(payload, entry->object_name);
        vshi_encode_count(payload, entry->object);
        vshi_encode_count(payload, entry->shape);
        vshi_encode_array(payload, entry->transform, 12, sizeof(double));
        vshi_encode_count(payload, entry->origin.node);
        vshi_encode_count(payload, entry->origin.mesh);
        vshi_encode_count(payload, entry->origin.primitive);
        vshi_encode_count(payload, entry->origin.instance);
    }
    vshi_model_put_lights(payload, model);
    vshi_model_put_materials(payload, model);
    vsh_model_free(model);
    return VSH_OK;
}

/* --- the caller */

/* The next count × size bytes, where they lie. */
static vsh_result take_array(vshi_decoder *decoder, uint64_t count, size_t size, void *array,
                             const char *path, vsh_error *error) {
    const void *from = vshi_decode_array(decoder, count, size);
    memcpy(array, &from, sizeof from);
    return from != NULL || (count == 0 && !decoder->bad) ? VSH_OK
                                                         : vshi_answer_fail(path, "an array's size", error);
}

/* An array that is only perhaps there. */
static vsh_result take_optional(vshi_decoder *decoder, uint64_t count, size_t size, float **array,
                                const char *path, vsh_error *error) {
    return vshi_decode_count(decoder, 1) == 0 ? VSH_OK : take_array(decoder, count, size, array, path, error);
}

static vsh_result check_shape(const vshi_model_shape *shape, const char *path, vsh_error *error) {
    const vsh_mesh view = {.positions = shape->positions,
                           .indices = shape->indices,
                           .vertex_count = shape->vertex_count,
                           .triangle_count = shape->triangle_count};
    vsh_error why;
    if (vshi_mesh_validate(&view, VSHI_MESH_ALONE, &why) != VSH_OK) {
        return vshi_answer_fail(path, why.message, error);
    }
    bool finite = true;
    for (size_t i = 0; shape->normals != NULL && i < 3 * shape->vertex_count; ++i) {
        finite = finite & (fabsf(shape->normals[i]) <= FLT_MAX);
    }
    return finite ? VSH_OK : vshi_answer_fail(path, "a normal that is not finite", error);
}

static vsh_result take_shape(vshi_decoder *decoder, vshi_raw *raw, vshi_model_shape *shape, const char *path,
                             vsh_error *error) {
    shape->triangle_count = vshi_decode_count(decoder, SIZE_MAX / 64);
    shape->vertex_count = vshi_decode_count(decoder, UINT32_MAX);
    shape->uv_sets = (int32_t)vshi_decode_count(decoder, VSH_MAX_UV_SETS);
    shape->packed = (uint32_t)vshi_decode_count(decoder, (1U << VSH_MAX_UV_SETS) - 1);
    shape->alpha = (int32_t)vshi_decode_count(decoder, VSH_ALPHA_BLENDED);
    shape->material = (int32_t)vshi_decode_count(decoder, INT32_MAX);
    if (decoder->bad || shape->triangle_count == 0) {
        return VSH_OK;
    }
    if (vshi_decode_count(decoder, 1) != 0) {
        return vshi_raw_take(raw, decoder, shape, error);
    }
    const size_t count = shape->vertex_count;
    VSHI_TRY(take_array(decoder, count, sizeof(float[3]), &shape->positions, path, error));
    VSHI_TRY(take_array(decoder, shape->triangle_count, sizeof(uint32_t[3]), &shape->indices, path, error));
    VSHI_TRY(take_optional(decoder, count, sizeof(float[3]), &shape->normals, path, error));
    VSHI_TRY(take_optional(decoder, count, sizeof(float), &shape->alphas, path, error));
    for (int32_t set = 0; set < shape->uv_sets; ++set) {
        VSHI_TRY(take_optional(decoder, count, sizeof(float[2]), &shape->uvs[set], path, error));
    }
    return check_shape(shape, path, error);
}

static vsh_result copy_name(const char *name, char **copy, const char *path, vsh_error *error) {
    if (name == NULL) {
        return VSH_OK;
    }
    const size_t size = strlen(name) + 1;
    VSHI_TRY(vshi_allocate((void **)copy, size, 1, path, error));
    memcpy(*copy, name, size);
    return VSH_OK;
}

static vsh_result take_entry(vshi_decoder *decoder, vsh_model *model, size_t index, const char *path,
                             vsh_error *error) {
    vshi_model_entry *entry = &model->entries[index];
    const char *name = vshi_decode_text(decoder, true);
    const char *object_name = vshi_decode_text(decoder, true);
    entry->object = (uint32_t)vshi_decode_count(decoder, UINT32_MAX);
    entry->shape = vshi_decode_count(decoder, model->shape_count - 1);
    const void *transform = vshi_decode_array(decoder, 12, sizeof(double));
    entry->origin.node = (uint32_t)vshi_decode_count(decoder, UINT32_MAX);
    entry->origin.mesh = (uint32_t)vshi_decode_count(decoder, UINT32_MAX);
    entry->origin.primitive = (uint32_t)vshi_decode_count(decoder, UINT32_MAX);
    entry->origin.instance = (uint32_t)vshi_decode_count(decoder, UINT32_MAX);
    if (decoder->bad || model->shapes[entry->shape].triangle_count == 0) {
        return vshi_answer_fail(path, "a mesh's place", error);
    }
    memcpy(entry->transform, transform, sizeof entry->transform);
    VSHI_TRY(copy_name(name, &entry->name, path, error));
    VSHI_TRY(copy_name(object_name, &entry->object_name, path, error));
    vsh_error why;
    const vsh_mesh view = vsh_model_mesh(model, index, 0);
    return vshi_mesh_check_transform(&view, VSHI_MESH_ALONE, &why) == VSH_OK
               ? VSH_OK
               : vshi_answer_fail(path, why.message, error);
}

static vsh_result take_meshes(vshi_decoder *decoder, vshi_raw *raw, vsh_model *model, const char *path,
                              const vsh_run *run, vsh_error *error) {
    enum { LEAST_SHAPE = 48, LEAST_ENTRY = 144 }; /* bytes of the message */
    const size_t shapes = vshi_decode_count(decoder, (uint64_t)(decoder->end - decoder->at) / LEAST_SHAPE);
    if (shapes == 0) {
        return vshi_answer_fail(path, "its meshes", error);
    }
    VSHI_TRY(vshi_allocate((void **)&model->shapes, shapes, sizeof *model->shapes, path, error));
    model->shape_count = shapes;
    for (size_t i = 0; i < shapes; ++i) {
        VSHI_TRY(take_shape(decoder, raw, &model->shapes[i], path, error));
    }
    const size_t entries = vshi_decode_count(decoder, (uint64_t)(decoder->end - decoder->at) / LEAST_ENTRY);
    VSHI_TRY(vshi_allocate((void **)&model->entries, entries, sizeof *model->entries, path, error));
    model->entry_capacity = entries;
    while (model->entry_count < entries) {
        VSHI_TRY(take_entry(decoder, model, model->entry_count++, path, error));
    }
    VSHI_TRY(vshi_model_take_lights(decoder, model, path, error));
    VSHI_TRY(vshi_model_take_materials(decoder, model, path, run, error));
    return vshi_decoder_ends(decoder) && entries > 0 ? VSH_OK : vshi_answer_fail(path, "its meshes", error);
}

static vsh_result take_model(vshi_decoder *decoder, const char *path, const vsh_run *run, vsh_model *model,
                             vsh_error *error) {
    vshi_raw raw = {.path = path, .run = run};
    uint64_t identity[VSHI_FILE_IDENTITY];
    model->unit = vshi_decode_number(decoder);
    const uint64_t bytes = vshi_decode_count(decoder, SIZE_MAX / 4);
    const void *told = vshi_decode_array(decoder, VSHI_FILE_IDENTITY, sizeof identity[0]);
    if (!(model->unit >= 0.0) || told == NULL) {
        return vshi_answer_fail(path, "its unit or its file", error);
    }
    memcpy(identity, told, sizeof identity);
    vsh_result result;
    if (bytes > 0) {
        VSHI_TRY_DONE(vshi_raw_open(&raw, identity, bytes, (size_t)(decoder->end - decoder->at),
                                    &model->blocks[0], error));
    }
    VSHI_TRY_DONE(take_meshes(decoder, &raw, model, path, run, error));
done:
    vshi_raw_close(&raw);
    return result;
}

vsh_result vshi_model_decode(vshi_decoder *decoder, const char *path, const vsh_run *run, vsh_model **model,
                             vsh_error *error) {
    vsh_model *made = NULL;
    VSHI_TRY(vshi_model_create(path, &made, error));
    made->borrowed = true;
    const vsh_result result = take_model(decoder, path, run, made, error);
    if (result == VSH_OK) {
        *model = made;
    } else {
        vsh_model_free(made);
    }
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
