/* A model between a reader and its caller. */
#include "base/memory.h"
#include "mesh/mesh.h"
#include "model/model.h"
#include "sandbox/reader.h"

#include <stdlib.h>
#include <string.h>

static void put_shape(vshi_put *put, const vshi_model_shape *shape) {
    vshi_put_count(put, shape->triangle_count);
    vshi_put_count(put, shape->vertex_count);
    vshi_put_count(put, (uint64_t)shape->uv_sets);
    vshi_put_count(put, (uint64_t)shape->alpha);
    if (shape->triangle_count == 0) {
        return;
    }
    vshi_put_array(put, shape->positions, shape->vertex_count, sizeof(float[3]));
    vshi_put_array(put, shape->indices, shape->triangle_count, sizeof(uint32_t[3]));
    vshi_put_count(put, shape->normals != NULL);
    if (shape->normals != NULL) {
        vshi_put_array(put, shape->normals, shape->vertex_count, sizeof(float[3]));
    }
    for (int32_t set = 0; set < shape->uv_sets; ++set) {
        vshi_put_count(put, shape->uvs[set] != NULL);
        if (shape->uvs[set] != NULL) {
            vshi_put_array(put, shape->uvs[set], shape->vertex_count, sizeof(float[2]));
        }
    }
}

vsh_result vshi_serve_model(const char *path, vshi_take *request, const vsh_run *run, vshi_put *payload,
                            vsh_error *error) {
    (void)request;
    vsh_model *model = NULL;
    const vsh_result result = vsh_model_read(path, run, &model, error);
    if (result != VSH_OK) {
        return result;
    }
    vshi_put_number(payload, model->unit);
    vshi_put_count(payload, model->shape_count);
    for (size_t i = 0; i < model->shape_count; ++i) {
        put_shape(payload, &model->shapes[i]);
    }
    vshi_put_count(payload, model->entry_count);
    for (size_t i = 0; i < model->entry_count; ++i) {
        const vshi_model_entry *entry = &model->entries[i];
        vshi_put_text(payload, entry->name);
        vshi_put_text(payload, entry->object_name);
        vshi_put_count(payload, entry->object);
        vshi_put_count(payload, entry->shape);
        vshi_put_array(payload, entry->transform, 12, sizeof(double));
    }
    vsh_model_free(model);
    return VSH_OK;
}

/* --- the caller */

/* A copy of the next count × size bytes; sizes are known to be there before memory is taken. */
static vsh_result copy_array(vshi_take *take, uint64_t count, size_t size, void *array, const char *path,
                             vsh_error *error) {
    const void *from = vshi_take_array(take, count, size);
    void *memory = NULL;
    if (from == NULL) {
        return count == 0 && !take->bad ? VSH_OK : vshi_answer_fail(path, "an array's size", error);
    }
    const vsh_result result = vshi_allocate(&memory, (size_t)count, size, path, error);
    if (result == VSH_OK) {
        memcpy(memory, from, (size_t)count * size);
        memcpy(array, &memory, sizeof memory);
    }
    return result;
}

/* An array that is only perhaps there. */
static vsh_result copy_optional(vshi_take *take, uint64_t count, size_t size, float **array, const char *path,
                                vsh_error *error) {
    return vshi_take_count(take, 1) == 0 ? VSH_OK : copy_array(take, count, size, array, path, error);
}

static vsh_result take_shape(vshi_take *take, vshi_model_shape *shape, const char *path, vsh_error *error) {
    shape->triangle_count = vshi_take_count(take, SIZE_MAX / 64);
    shape->vertex_count = vshi_take_count(take, UINT32_MAX);
    shape->uv_sets = (int32_t)vshi_take_count(take, VSH_MAX_UV_SETS);
    shape->alpha = (int32_t)vshi_take_count(take, VSH_ALPHA_BLENDED);
    if (take->bad || shape->triangle_count == 0) {
        return VSH_OK;
    }
    const size_t count = shape->vertex_count;
    vsh_result result = copy_array(take, count, sizeof(float[3]), &shape->positions, path, error);
    if (result == VSH_OK) {
        result = copy_array(take, shape->triangle_count, sizeof(uint32_t[3]), &shape->indices, path, error);
    }
    if (result == VSH_OK) {
        result = copy_optional(take, count, sizeof(float[3]), &shape->normals, path, error);
    }
    for (int32_t set = 0; set < shape->uv_sets && result == VSH_OK; ++set) {
        result = copy_optional(take, count, sizeof(float[2]), &shape->uvs[set], path, error);
    }
    return result;
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
    for (size_t i = 0; shape->normals != NULL && i < 3 * shape->vertex_count; ++i) {
        if (!isfinite(shape->normals[i])) {
            return vshi_answer_fail(path, "a normal that is not finite", error);
        }
    }
    return VSH_OK;
}

static vsh_result copy_name(const char *name, char **copy, const char *path, vsh_error *error) {
    if (name == NULL) {
        return VSH_OK;
    }
    const size_t size = strlen(name) + 1;
    const vsh_result result = vshi_allocate((void **)copy, size, 1, path, error);
    if (result == VSH_OK) {
        memcpy(*copy, name, size);
    }
    return result;
}

static vsh_result take_entry(vshi_take *take, vsh_model *model, size_t index, const char *path,
                             vsh_error *error) {
    vshi_model_entry *entry = &model->entries[index];
    const char *name = vshi_take_text(take, true);
    const char *object_name = vshi_take_text(take, true);
    entry->object = (uint32_t)vshi_take_count(take, UINT32_MAX);
    entry->shape = vshi_take_count(take, model->shape_count - 1);
    const void *transform = vshi_take_array(take, 12, sizeof(double));
    if (take->bad || model->shapes[entry->shape].triangle_count == 0) {
        return vshi_answer_fail(path, "a mesh's place", error);
    }
    memcpy(entry->transform, transform, sizeof entry->transform);
    vsh_result result = copy_name(name, &entry->name, path, error);
    if (result == VSH_OK) {
        result = copy_name(object_name, &entry->object_name, path, error);
    }
    if (result != VSH_OK) {
        return result;
    }
    vsh_error why;
    const vsh_mesh view = vsh_model_mesh(model, index, 0);
    return vshi_mesh_check_transform(&view, VSHI_MESH_ALONE, &why) == VSH_OK
               ? VSH_OK
               : vshi_answer_fail(path, why.message, error);
}

static vsh_result take_meshes(vshi_take *take, vsh_model *model, const char *path, vsh_error *error) {
    enum { LEAST_SHAPE = 32, LEAST_ENTRY = 112 }; /* bytes of the message */
    model->unit = vshi_take_number(take);
    if (!(model->unit >= 0.0)) {
        return vshi_answer_fail(path, "its unit", error);
    }
    const size_t shapes = vshi_take_count(take, (uint64_t)(take->end - take->at) / LEAST_SHAPE);
    if (shapes == 0) {
        return vshi_answer_fail(path, "its meshes", error);
    }
    vsh_result result = vshi_allocate((void **)&model->shapes, shapes, sizeof *model->shapes, path, error);
    model->shape_count = result == VSH_OK ? shapes : 0;
    for (size_t i = 0; i < model->shape_count && result == VSH_OK; ++i) {
        result = take_shape(take, &model->shapes[i], path, error);
        result = result == VSH_OK && model->shapes[i].triangle_count > 0
                     ? check_shape(&model->shapes[i], path, error)
                     : result;
    }
    if (result != VSH_OK) {
        return result;
    }
    const size_t entries = vshi_take_count(take, (uint64_t)(take->end - take->at) / LEAST_ENTRY);
    result = vshi_allocate((void **)&model->entries, entries, sizeof *model->entries, path, error);
    model->entry_capacity = result == VSH_OK ? entries : 0;
    while (result == VSH_OK && model->entry_count < entries) {
        result = take_entry(take, model, model->entry_count++, path, error);
    }
    if (result == VSH_OK && (!vshi_take_ends(take) || entries == 0)) {
        result = vshi_answer_fail(path, "its meshes", error);
    }
    return result;
}

vsh_result vshi_model_take(vshi_take *take, const char *path, vsh_model **model, vsh_error *error) {
    vsh_model *made = NULL;
    vsh_result result = vshi_allocate((void **)&made, 1, sizeof *made, path, error);
    result = result == VSH_OK ? take_meshes(take, made, path, error) : result;
    if (result == VSH_OK) {
        *model = made;
    } else {
        vsh_model_free(made);
    }
    return result;
}

vsh_result vshi_model_from_reader(const char *path, const vsh_run *run, vshi_job *job, size_t units,
                                  vsh_model **model, vsh_error *error) {
    vshi_ask ask;
    vshi_answer answer;
    vsh_result result = vshi_ask_begin(&ask, VSHI_READ_MODEL, path, run, error);
    if (result == VSH_OK) {
        result = vshi_ask_send_job(&ask, job, units, &answer, error);
    }
    if (result != VSH_OK) {
        return result;
    }
    result = vshi_model_take(&answer.payload, path, model, error);
    vshi_answer_free(&answer);
    return result;
}
