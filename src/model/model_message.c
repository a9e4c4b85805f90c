/* A model between a reader and its caller. */
#include "base/input.h"
#include "base/memory.h"
#include "base/try.h"
#include "mesh/mesh.h"
#include "model/model.h"
#include "sandbox/reader.h"

#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Arrays of a GLB that need no conversion stay in the file. The reader says where they are, and its caller
 * copies them into its own memory before it checks them, because the file may change at any time. */

enum { ALIGNED = 64 };

/* A file that arrays are read from, into one block of memory. */
typedef struct raw_file {
    const char *path;
    const vsh_run *run;
    FILE *file;
    uint64_t size; /* of the file */
    unsigned char *block;
    size_t used, bytes; /* of the block */
} raw_file;

bool vshi_file_identity(int file, uint64_t identity[VSHI_FILE_IDENTITY]) {
    struct stat status;
    if (fstat(file, &status) != 0) {
        return false;
    }
    identity[0] = (uint64_t)status.st_dev;
    identity[1] = (uint64_t)status.st_ino;
    identity[2] = (uint64_t)status.st_size;
    identity[3] = (uint64_t)status.st_mtim.tv_sec;
    identity[4] = (uint64_t)status.st_mtim.tv_nsec;
    return true;
}

/* --- arrays left in the file: the reader */

static uint64_t rounded(uint64_t bytes) {
    return (bytes + ALIGNED - 1) / ALIGNED * ALIGNED;
}

/* Bytes of a model's arrays in the file, each rounded up to a multiple of 64. */
static uint64_t count_raw_bytes(const vsh_model *model) {
    uint64_t sum = 0;
    for (size_t i = 0; i < model->shape_count; ++i) {
        const vshi_model_shape *shape = &model->shapes[i];
        if (shape->raw == NULL || shape->triangle_count == 0) {
            continue;
        }
        const uint64_t vectors = rounded(shape->vertex_count * sizeof(float[3]));
        sum += rounded(shape->triangle_count * sizeof(uint32_t[3]));
        sum += shape->normals != NULL ? 2 * vectors : vectors;
        for (int set = 0; set < shape->uv_sets; ++set) {
            sum += shape->uvs[set] != NULL ? rounded(shape->vertex_count * sizeof(float[2])) : 0;
        }
    }
    return sum;
}

static void put_place(vshi_encoder *encoder, const vshi_model_file *file, const void *array) {
    vshi_encode_count(encoder, array != NULL);
    if (array != NULL) {
        vshi_encode_count(encoder, (uint64_t)((const char *)array - (const char *)file->map));
    }
}

/* Tells where the arrays of a shape with `raw` lie. */
static void put_raw(vshi_encoder *encoder, const vshi_model_file *file, const vshi_model_shape *shape) {
    vshi_encode_text(encoder, shape->raw);
    put_place(encoder, file, shape->positions);
    put_place(encoder, file, shape->indices);
    put_place(encoder, file, shape->normals);
    for (int set = 0; set < shape->uv_sets; ++set) {
        put_place(encoder, file, shape->uvs[set]);
    }
}

/* --- arrays left in the file: the caller */

static vsh_result fail_changed(const char *path, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_READ, "%s: changed while it was read", path);
}

/* Opens the file of a `raw` that has a path and a run, and takes *block of `bytes` for its arrays; the caller
 * owns it. The file must be the one that the reader had. An answer of `message` more bytes can only name so
 * many arrays. Call close_raw() after an error, too. Errors: VSH_ERROR_READ, VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY. */
static vsh_result open_raw(raw_file *raw, const uint64_t identity[VSHI_FILE_IDENTITY], uint64_t bytes,
                           size_t message, void **block, vsh_error *error) {
    enum { PLACE = 16 /* bytes of a message that tell where an array lies */ };
    /* vshi_model_finish() takes 5 bytes a vertex for a while, whose position alone is 12 */
    static const double beside = 1.0 + 5.0 / 12.0;
    uint64_t now[VSHI_FILE_IDENTITY];
    VSHI_TRY(vshi_input_open(raw->path, raw->path, SIZE_MAX / 2, &raw->file, &raw->size, error));
    if (!vshi_file_identity(fileno(raw->file), now) || memcmp(now, identity, sizeof now) != 0) {
        return fail_changed(raw->path, error);
    }
    if (bytes / (raw->size + ALIGNED) > message / PLACE) { /* each array is a part of the file */
        return vshi_answer_fail(raw->path, "what its arrays take", error);
    }
    VSHI_TRY(vshi_check_limit(raw->run, beside * (double)bytes, raw->path, error));
    VSHI_TRY(vshi_take_pages(block, (size_t)bytes, raw->path, error));
    raw->bytes = (size_t)bytes;
    raw->block = *block;
    return VSH_OK;
}

static void close_raw(raw_file *raw) {
    if (raw->file != NULL) {
        fclose(raw->file);
        raw->file = NULL;
    }
}

static vsh_result read_array(raw_file *raw, unsigned char *to, size_t bytes, uint64_t offset,
                             vsh_error *error) {
    while (bytes > 0) {
        const ssize_t got = pread(fileno(raw->file), to, bytes, (off_t)offset);
        if (got < 0 && errno == EINTR) {
            continue;
        }
        if (got < 0) {
            return vshi_fail(error, VSH_ERROR_READ, "%s: %s", raw->path, strerror(errno));
        }
        if (got == 0) {
            return fail_changed(raw->path, error);
        }
        to += got;
        offset += (uint64_t)got;
        bytes -= (size_t)got;
    }
    return VSH_OK;
}

/* count × size bytes into *array, which stays NULL where there are none. */
static vsh_result take_raw_array(raw_file *raw, vshi_decoder *decoder, size_t count, size_t size, void *array,
                                 vsh_error *error) {
    if (vshi_decode_count(decoder, 1) == 0) {
        return VSH_OK;
    }
    const uint64_t offset = vshi_decode_count(decoder, raw->size);
    size_t bytes;
    if (decoder->bad || __builtin_mul_overflow(count, size, &bytes) || bytes > raw->size - offset ||
        bytes > raw->bytes - raw->used) {
        return vshi_answer_fail(raw->path, "where an array lies in it", error);
    }
    unsigned char *at = raw->block + raw->used;
    const uint64_t more = rounded(bytes);
    raw->used = more < raw->bytes - raw->used ? raw->used + (size_t)more : raw->bytes;
    memcpy(array, &at, sizeof at);
    return read_array(raw, at, bytes, offset, error);
}

/* Reads and finishes the arrays of a shape whose counts are known. Errors: as vshi_model_finish(), and
 * VSH_ERROR_READ. */
static vsh_result take_raw(raw_file *raw, vshi_decoder *decoder, vshi_model_shape *shape, vsh_error *error) {
    const char *where = vshi_decode_text(decoder, true);
    const size_t count = shape->vertex_count;
    if (where == NULL || raw->block == NULL) {
        return vshi_answer_fail(raw->path, "what lies in it", error);
    }
    VSHI_TRY(take_raw_array(raw, decoder, count, sizeof(float[3]), &shape->positions, error));
    VSHI_TRY(
        take_raw_array(raw, decoder, shape->triangle_count, sizeof(uint32_t[3]), &shape->indices, error));
    VSHI_TRY(take_raw_array(raw, decoder, count, sizeof(float[3]), &shape->normals, error));
    for (int32_t set = 0; set < shape->uv_sets; ++set) {
        VSHI_TRY(take_raw_array(raw, decoder, count, sizeof(float[2]), &shape->uvs[set], error));
    }
    if (decoder->bad || shape->positions == NULL || shape->indices == NULL || count == 0) {
        return vshi_answer_fail(raw->path, "what lies in it", error);
    }
    return vshi_model_finish(raw->path, raw->run, where, shape, error);
}

/* --- lights */

enum { LIGHT_VALUES = 13 };

static void put_lights(vshi_encoder *encoder, const vsh_model *model) {
    vshi_encode_count(encoder, model->light_count);
    for (size_t i = 0; i < model->light_count; ++i) {
        const vsh_model_light *l = &model->lights[i];
        const double values[LIGHT_VALUES] = {
            l->position[0],  l->position[1], l->position[2], l->direction[0], l->direction[1],
            l->direction[2], l->color[0],    l->color[1],    l->color[2],     l->intensity,
            l->range,        l->inner_angle, l->outer_angle};
        vshi_encode_text(encoder, l->name);
        vshi_encode_count(encoder, (uint64_t)l->type);
        vshi_encode_array(encoder, values, LIGHT_VALUES, sizeof values[0]);
    }
}

static bool holds(const vsh_model_light *light, const double values[LIGHT_VALUES]) {
    static const double quarter = 1.5707963267948966, slack = 1e-9;
    const double *d = light->direction;
    const double square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    bool good = light->type == VSH_MODEL_LIGHT_POINT ? square == 0.0 : fabs(square - 1.0) < slack;
    for (int i = 0; i < LIGHT_VALUES; ++i) {
        good = good && fabs(values[i]) <= FLT_MAX && (i < 6 || values[i] >= 0.0);
    }
    return good && light->inner_angle <= light->outer_angle && light->outer_angle <= quarter &&
           (light->type == VSH_MODEL_LIGHT_SPOT) == (light->outer_angle > 0.0);
}

/* Its lights; what is taken is checked. */
static vsh_result take_lights(vshi_decoder *decoder, vsh_model *model, const char *path, vsh_error *error) {
    enum { LEAST_LIGHT = 8 + 8 + 8 * LIGHT_VALUES }; /* bytes of the message */
    const uint64_t count = vshi_decode_count(decoder, (uint64_t)(decoder->end - decoder->at) / LEAST_LIGHT);
    for (uint64_t i = 0; i < count; ++i) {
        const char *name = vshi_decode_text(decoder, true);
        vsh_model_light light = {.type = (int32_t)vshi_decode_count(decoder, VSH_MODEL_LIGHT_SPOT)};
        const void *told = vshi_decode_array(decoder, LIGHT_VALUES, sizeof(double));
        double values[LIGHT_VALUES];
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

/* --- materials */

enum { MATERIAL_VALUES = 8 };

static void put_materials(vshi_encoder *encoder, const vsh_model *model) {
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
        const double values[MATERIAL_VALUES] = {
            m->alpha_cutoff, m->base_alpha, t[0], t[1], t[2], t[3], t[4], t[5]};
        vshi_encode_text(encoder, model->materials[i].name);
        vshi_encode_count(encoder, (uint64_t)m->alpha);
        vshi_encode_count(encoder, (uint64_t)m->double_sided);
        vshi_encode_count(encoder, (uint64_t)m->uv_set);
        vshi_encode_count(encoder, (uint64_t)m->wrap[0]);
        vshi_encode_count(encoder, (uint64_t)m->wrap[1]);
        vshi_encode_count(encoder, (uint64_t)m->image_channel);
        vshi_encode_count(encoder, (uint64_t)m->by_texture);
        vshi_encode_count(encoder, model->materials[i].image);
        vshi_encode_array(encoder, values, MATERIAL_VALUES, sizeof values[0]);
    }
}

/* The caller opens a path that the reader names, so it checks again that it is in the model's folder. */
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
    const void *told = vshi_decode_array(decoder, MATERIAL_VALUES, sizeof(double));
    double values[MATERIAL_VALUES];
    if (decoder->bad || told == NULL) {
        return vshi_answer_fail(path, "its materials", error);
    }
    memcpy(values, told, sizeof values);
    bool good = values[0] >= 0.0 && values[1] >= 0.0 && values[1] <= 1.0;
    for (int i = 0; i < MATERIAL_VALUES; ++i) {
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

/* Its materials and images, which stay where they lie in the answer. */
static vsh_result take_materials(vshi_decoder *decoder, vsh_model *model, const char *path,
                                 const vsh_run *run, vsh_error *error) {
    enum { LEAST_IMAGE = 16, LEAST_MATERIAL = 72 + 8 * MATERIAL_VALUES }; /* bytes of the message */
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

/* --- meshes */

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
        put_raw(encoder, file, shape);
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
    vshi_encode_count(payload, count_raw_bytes(model));
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
    put_lights(payload, model);
    put_materials(payload, model);
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

static vsh_result take_shape(vshi_decoder *decoder, raw_file *raw, vshi_model_shape *shape, const char *path,
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
        return take_raw(raw, decoder, shape, error);
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
    if (name != NULL) {
        VSHI_TRY(vshi_model_copy_line(name, &entry->name, error));
    }
    if (object_name != NULL) {
        VSHI_TRY(vshi_model_copy_line(object_name, &entry->object_name, error));
    }
    vsh_error why;
    const vsh_mesh view = vsh_model_mesh(model, index, 0);
    return vshi_mesh_check_transform(&view, VSHI_MESH_ALONE, &why) == VSH_OK
               ? VSH_OK
               : vshi_answer_fail(path, why.message, error);
}

static vsh_result take_meshes(vshi_decoder *decoder, raw_file *raw, vsh_model *model, const char *path,
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
    VSHI_TRY(take_lights(decoder, model, path, error));
    VSHI_TRY(take_materials(decoder, model, path, run, error));
    return vshi_decoder_ends(decoder) && entries > 0 ? VSH_OK : vshi_answer_fail(path, "its meshes", error);
}

static vsh_result take_model(vshi_decoder *decoder, const char *path, const vsh_run *run, vsh_model *model,
                             vsh_error *error) {
    raw_file raw = {.path = path, .run = run};
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
        VSHI_TRY_DONE(
            open_raw(&raw, identity, bytes, (size_t)(decoder->end - decoder->at), &model->blocks[0], error));
    }
    VSHI_TRY_DONE(take_meshes(decoder, &raw, model, path, run, error));
done:
    close_raw(&raw);
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
