/* Models: the arrays of each mesh of a file, and an entry for every node that uses it. obj.c, ply.c and
 * gltf*.c read OBJ, PLY and glTF, Assimp reads other formats (assimp.c). v of UVs points up in every format.
 */
#include "io/model/model.h"

#include "base/file.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/vec.h"
#include "geometry/mesh.h"

#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

const double vshi_uv_identity[6] = {1, 0, 0, 0, 1, 0};

/* --- materials and images */

vshi_material vshi_model_get_material(const vsh_model *model, size_t index) {
    const vshi_model_material *kept = &model->materials[index];
    vshi_material values = kept->values;
    values.name = kept->name;
    if (kept->image > 0) {
        const vshi_model_image *image = &model->images[kept->image - 1];
        values.image = image->bytes;
        values.image_size = image->size;
        values.image_path = image->path;
    }
    return values;
}

static void make_line(char *text) {
    for (char *c = text; *c != '\0'; ++c) {
        *c = (unsigned char)*c < 0x20 || *c == 0x7f ? '?' : *c;
    }
}

vsh_result vshi_model_copy_line(const char *text, char **copy, vsh_error *error) {
    VSHI_TRY(vshi_copy_text(copy, text, "a name", error));
    make_line(*copy);
    return VSH_OK;
}

vsh_result vshi_model_add_materials(vsh_model *model, size_t count, vsh_error *error) {
    VSHI_TRY(VSHI_ALLOCATE(model->materials, count, "materials", error));
    model->material_count = count;
    for (size_t i = 0; i < count; ++i) {
        model->materials[i].values.base_alpha = 1.0;
        memcpy(model->materials[i].values.uv_transform, vshi_uv_identity, sizeof vshi_uv_identity);
    }
    return VSH_OK;
}

/* --- lights, in the world */

vsh_result vshi_model_add_light(vsh_model *model, const vshi_model_light *light, const char *name,
                                vsh_error *error) {
    VSHI_TRY(vshi_make_room((void **)&model->lights, model->light_count, &model->light_capacity,
                            sizeof *model->lights, "a model's lights", error));
    char *copy = NULL;
    if (name != NULL && name[0] != '\0') {
        VSHI_TRY(vshi_model_copy_line(name, &copy, error));
    }
    vshi_model_light *added = &model->lights[model->light_count++];
    *added = *light;
    added->name = copy;
    return VSH_OK;
}

/* --- entries: places and names of meshes */

/* Makes the name "node/mesh", one of both, or NULL; on one line. */
static vsh_result make_name(const char *first, const char *second, char **name, vsh_error *error) {
    const bool both = first[0] != '\0' && second[0] != '\0' && strcmp(first, second) != 0;
    *name = NULL;
    if (first[0] == '\0' && second[0] == '\0') {
        return VSH_OK;
    }
    const size_t size = strlen(first) + strlen(second) + 2;
    VSHI_TRY(vshi_allocate((void **)name, size, 1, "a mesh's name", error));
    snprintf(*name, size, "%s%s%s", first, both ? "/" : "", both || first[0] == '\0' ? second : "");
    make_line(*name);
    return VSH_OK;
}

void vshi_model_blend_add(vshi_model_blend *blend, double weight, const double matrix[12]) {
    blend->sum += weight;
    for (int k = 0; k < 12; ++k) {
        blend->matrix[k] += weight * matrix[k];
    }
}

void vshi_model_blend_move(vshi_model_shape *shape, const vshi_model_blend *blends, const double rest[12]) {
    for (size_t v = 0; v < shape->vertex_count; ++v) {
        double m[12];
        for (int k = 0; k < 12; ++k) {
            m[k] = blends[v].sum > 0.0 ? blends[v].matrix[k] / blends[v].sum : rest[k];
        }
        float *p = shape->positions + 3 * v;
        vshi_vec_to_floats(vshi_transform_point(m, vshi_vec_off(p)), p);
        if (shape->normals != NULL) {
            float *n = shape->normals + 3 * v;
            vshi_vec_to_floats(vshi_unit(vshi_transform_normal(m, vshi_vec_off(n))), n);
        }
    }
}

uint32_t vshi_model_next_object(const vsh_model *model) {
    /* the last entry has the highest number */
    return model->entry_count > 0 ? model->entries[model->entry_count - 1].object + 1 : 1;
}

static vsh_result append_entry(vsh_model *model, const vshi_model_place *place, vsh_error *error) {
    vshi_model_entry entry = {.object = place->object, .shape = place->shape, .origin = place->origin};
    memcpy(entry.transform, place->world, sizeof entry.transform);
    VSHI_TRY(vshi_make_room((void **)&model->entries, model->entry_count, &model->entry_capacity,
                            sizeof *model->entries, "a model's meshes", error));
    VSHI_TRY(make_name(place->node, place->mesh, &entry.name, error));
    const vsh_result result = make_name(place->node, "", &entry.object_name, error);
    if (result != VSH_OK) {
        free(entry.name);
        return result;
    }
    model->entries[model->entry_count++] = entry;
    return VSH_OK;
}

vsh_result vshi_model_add(vsh_model *model, const char *path, const vsh_run *run,
                          const vshi_model_place *place, vsh_error *error) {
    VSHI_TRY(append_entry(model, place, error));
    const size_t last = model->entry_count - 1;
    const vsh_mesh view = vsh_model_mesh(model, last, 0);
    for (int i = 0; i < 12; ++i) {
        if (!(fabs(place->world[i]) <= FLT_MAX)) { /* positions in the world are floats */
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: %s: transform row %d column %d is %g, expected a finite number of 32 bits",
                             path, vshi_mesh_label(&view, VSHI_MESH_ALONE).text, i / 4, i % 4,
                             place->world[i]);
        }
    }
    vsh_error why;
    if (vshi_mesh_check_transform(&view, VSHI_MESH_ALONE, &why) == VSH_OK) {
        return VSH_OK;
    }
    /* scenes hide things by a scale of zero */
    vshi_note(run, "%s: %s; left out", path, why.message);
    free(model->entries[last].object_name);
    free(model->entries[last].name);
    --model->entry_count;
    return VSH_OK;
}

vshi_model_array vshi_model_array_of(vshi_model_shape *shape, int number) {
    switch (number) {
    case VSHI_MODEL_POSITIONS:
        return (vshi_model_array){(void **)&shape->positions, shape->vertex_count, sizeof(float[3])};
    case VSHI_MODEL_INDICES:
        return (vshi_model_array){(void **)&shape->indices, shape->triangle_count, sizeof(uint32_t[3])};
    case VSHI_MODEL_NORMALS:
        return (vshi_model_array){(void **)&shape->normals, shape->vertex_count, sizeof(float[3])};
    case VSHI_MODEL_ALPHAS:
        return (vshi_model_array){(void **)&shape->alphas, shape->vertex_count, sizeof(float)};
    default:
        return (vshi_model_array){(void **)&shape->uvs[number - VSHI_MODEL_UVS], shape->vertex_count,
                                  sizeof(float[2])};
    }
}

void vsh_model_free(vsh_model *model) {
    if (model == NULL) {
        return;
    }
    for (size_t i = 0; i < model->entry_count; ++i) {
        free(model->entries[i].object_name);
        free(model->entries[i].name);
    }
    for (size_t i = 0; !model->borrowed && i < model->shape_count; ++i) {
        for (int k = 0; k < VSHI_MODEL_ARRAYS; ++k) {
            free(*vshi_model_array_of(&model->shapes[i], k).at);
        }
    }
    for (size_t i = 0; i < model->light_count; ++i) {
        free((char *)(uintptr_t)model->lights[i].name);
    }
    for (size_t i = 0; i < model->material_count; ++i) {
        free(model->materials[i].name);
    }
    for (size_t i = 0; i < model->image_count; ++i) {
        free(model->images[i].path);
        free(model->images[i].owned);
    }
    free(model->entries);
    free(model->shapes);
    free(model->lights);
    free(model->images);
    free(model->materials);
    vshi_answer_free(&model->answer);
    free(model);
}

size_t vsh_model_mesh_count(const vsh_model *model) {
    return model->entry_count;
}

double vshi_find_unit(const char *name) {
    static const struct {
        const char *name;
        double metres;
    } units[] = {{"m", 1.0}, {"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}, {"ft", 0.3048}};
    for (size_t i = 0; name != NULL && i < sizeof units / sizeof units[0]; ++i) {
        if (strcmp(name, units[i].name) == 0) {
            return units[i].metres;
        }
    }
    return 0.0;
}

double vsh_model_unit(const vsh_model *model) {
    return model->unit;
}

int32_t vsh_model_uv_sets(const vsh_model *model, size_t index) {
    return model->shapes[model->entries[index].shape].uv_sets;
}

vsh_mesh vsh_model_mesh(const vsh_model *model, size_t index, int32_t uv_set) {
    const vshi_model_entry *entry = &model->entries[index];
    const vshi_model_shape *shape = &model->shapes[entry->shape];
    const int32_t set = uv_set == -1 ? shape->uv_sets > 1 : uv_set;
    /* while an answer is decoded, entries come before materials */
    const size_t material = shape->material > 0 ? (size_t)shape->material - 1 : SIZE_MAX;
    return (vsh_mesh){
        .name = entry->name,
        .positions = shape->positions,
        .normals = shape->normals,
        .uvs = set >= 0 && set < VSH_MAX_UV_SETS ? shape->uvs[set] : NULL,
        .indices = shape->indices,
        .vertex_count = shape->vertex_count,
        .triangle_count = shape->triangle_count,
        .transform = entry->transform,
        .object_name = entry->object_name,
        .object = entry->object,
        .alpha = shape->alpha,
        .material_name = material < model->material_count ? model->materials[material].name : NULL,
    };
}

/* --- checks */

vsh_result vshi_model_check_positions(const char *path, const char *where, const float *positions,
                                      size_t count, vsh_error *error) {
    for (size_t v = 0; v < count; ++v) {
        const float *p = positions + 3 * v;
        if (!vshi_finite(vshi_vec_off(p))) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: %s%svertex %zu of %zu lies at (%g, %g, %g), expected finite numbers", path,
                             where, where[0] != '\0' ? ": " : "", v, count, (double)p[0], (double)p[1],
                             (double)p[2]);
        }
    }
    return VSH_OK;
}

void vshi_model_check_normals(const char *path, const vsh_run *run, const char *where,
                              const vshi_model_shape *shape) {
    size_t bad = 0;
    for (size_t v = 0; v < shape->vertex_count && shape->normals != NULL; ++v) {
        float *n = shape->normals + 3 * v;
        if (!vshi_finite(vshi_vec_off(n))) {
            memset(n, 0, sizeof(float[3]));
            ++bad;
        }
    }
    if (bad > 0) {
        vshi_warn(run, "%s: %s: %zu normals are not finite; those faces are flat", path, where, bad);
    }
}

/* --- files */

static const char alembic[] = "an Alembic file", usd[] = "a USD file";
static const char blender[] = "Blender's own file; export it as GLB (File, Export, glTF 2.0)";

/* Formats that are read. tests/models tests each with files of Blender. Assimp reads more formats, but some
 * wrongly. */
static const struct {
    const char *ending;
    vshi_read_model_fn *read;
} formats[] = {{"obj", vshi_obj_read},   {"gltf", vshi_gltf_read},  {"glb", vshi_gltf_read},
               {"ply", vshi_ply_read},   {"stl", vshi_assimp_read}, {"fbx", vshi_assimp_read},
               {"dae", vshi_assimp_read}};

/* The advice of errors about other formats. */
#define FORMATS                                                                                              \
    "give a mesh as OBJ, glTF, GLB, PLY, STL, FBX or DAE, a level set as .vdb, or a scene as .json"

vsh_result vshi_unsupported_check(const char *path, vsh_error *error) {
    static const struct {
        const char *ending, *what;
    } others[] = {{"abc", alembic}, {"usd", usd},  {"usda", usd},
                  {"usdc", usd},    {"usdz", usd}, {"blend", blender}};
    const char *ending = vshi_path_ending(path);
    for (size_t i = 0; i < sizeof others / sizeof others[0]; ++i) {
        if (strcasecmp(ending, others[i].ending) == 0) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s: is %s, which is not read: " FORMATS, path,
                             others[i].what);
        }
    }
    return VSH_OK;
}

enum { READ_UNITS = 750, REST_UNITS = 250 };

typedef struct reading {
    const char *path;
    const vsh_run *run;
    vshi_job *job;
    vsh_model **model;
} reading;

static vsh_result read_file(const reading *r, vsh_error *error) {
    struct stat status;
    if (stat(r->path, &status) != 0) { /* before any complaint about the ending */
        return vshi_fail(error, VSH_ERROR_READ, "%s: %s", r->path, strerror(errno));
    }
    VSHI_TRY(vshi_unsupported_check(r->path, error));
    const char *ending = vshi_path_ending(r->path);
    if (*ending == '\0') {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: has no ending to tell its format by (.obj, .glb, .ply …)", r->path);
    }
    for (size_t i = 0; i < sizeof formats / sizeof formats[0]; ++i) {
        if (strcasecmp(ending, formats[i].ending) == 0) {
            VSHI_TRY(formats[i].read(r->path, r->run, r->job, READ_UNITS, r->model, error));
            return (*r->model)->entry_count > 0
                       ? VSH_OK
                       : vshi_fail(error, VSH_ERROR_INPUT, "%s: holds no triangles", r->path);
        }
    }
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: '.%s' is no mesh format that is read: " FORMATS, r->path,
                     ending);
}

static vsh_result read_in_reader(const reading *r, vsh_error *error);

vsh_result vsh_model_read(const char *path, const vsh_run *run, vsh_model **model, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(model);
    VSHI_NEEDS(path);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vshi_job *job;
    VSHI_TRY(vshi_job_open(&job, &full, "load", READ_UNITS + REST_UNITS, path, error));
    reading r = {path, &full, job, model};
    vsh_result result;
    VSHI_TRY_DONE(full.reader != NULL ? read_in_reader(&r, error) : read_file(&r, error));
    result = vshi_job_step(job, REST_UNITS, error);
done:
    vshi_job_end(job);
    if (result != VSH_OK) {
        vsh_model_free(*model);
        *model = NULL;
    }
    return result;
}

/* --- messages between a reader and its caller */

/* The message of a reader: metres in a unit, shapes, entries, lights, images and materials. Each begins with
 * a struct in this machine's form, whose pointers mean nothing. Texts and arrays follow it. */

typedef struct shape_head {
    uint64_t triangle_count, vertex_count;
    uint32_t arrays; /* bits 1 << k of the arrays that follow */
    uint32_t packed;
    int32_t alpha, material;
} shape_head;

static void encode_shape(vshi_encoder *encoder, vshi_model_shape *shape) {
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

static void encode_rest(vshi_encoder *encoder, const vsh_model *model) {
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
        encode_shape(payload, &model->shapes[i]);
    }
    encode_rest(payload, model);
    vsh_model_free(model);
    return VSH_OK;
}

/* --- the caller's side of the message: it checks everything */

typedef struct decoding {
    const char *path;
    const vsh_run *run;
    vshi_decoder *decoder;
    vsh_model *model;
} decoding;

static vsh_result fail_answer(const decoding *t, const char *what, vsh_error *error) {
    return vshi_answer_fail(t->path, what, error);
}

/* Allocates a list for the elements that follow. Each has at least `least` bytes of the message. */
static vsh_result decode_list(decoding *t, size_t least, size_t size, void *list, size_t *count,
                              vsh_error *error) {
    const uint64_t most = (uint64_t)(t->decoder->end - t->decoder->at) / least;
    const size_t found = (size_t)vshi_decode_count(t->decoder, most);
    if (t->decoder->bad) {
        return fail_answer(t, "the length of a list", error);
    }
    VSHI_TRY(vshi_allocate((void **)list, found, size, t->path, error));
    *count = found;
    return VSH_OK;
}

static vsh_result check_shape(const decoding *t, const vshi_model_shape *shape, vsh_error *error) {
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

static vsh_result decode_shape(decoding *t, vshi_model_shape *shape, vsh_error *error) {
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

static vsh_result decode_name(decoding *t, char **name, vsh_error *error) {
    const char *given = vshi_decode_text(t->decoder, true);
    return given != NULL ? vshi_model_copy_line(given, name, error) : VSH_OK;
}

static vsh_result decode_entry(decoding *t, vsh_error *error) {
    vsh_model *model = t->model;
    const vshi_model_entry *given = vshi_decode_array(t->decoder, 1, sizeof *given);
    if (given == NULL || given->shape >= model->shape_count ||
        model->shapes[given->shape].triangle_count == 0) {
        return fail_answer(t, "a mesh's place", error);
    }
    vshi_model_entry *entry = &model->entries[model->entry_count++];
    *entry = *given;
    entry->name = entry->object_name = NULL;
    VSHI_TRY(decode_name(t, &entry->name, error));
    VSHI_TRY(decode_name(t, &entry->object_name, error));
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

static bool is_light(const vshi_model_light *light) {
    static const double quarter = 1.5707963267948966, slack = 1e-9;
    const double *d = light->direction;
    const double square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    const double rest[] = {light->intensity, light->range, light->inner_angle, light->outer_angle};
    return light->type >= 0 && light->type <= VSHI_MODEL_LIGHT_SPOT &&
           (light->type == VSHI_MODEL_LIGHT_POINT ? square == 0.0 : fabs(square - 1.0) < slack) &&
           are_within(light->position, 3, -FLT_MAX) && are_within(light->color, 3, 0.0) &&
           are_within(rest, 4, 0.0) && light->inner_angle <= light->outer_angle &&
           light->outer_angle <= quarter &&
           (light->type == VSHI_MODEL_LIGHT_SPOT) == (light->outer_angle > 0.0);
}

static vsh_result decode_light(decoding *t, vsh_error *error) {
    const vshi_model_light *given = vshi_decode_array(t->decoder, 1, sizeof *given);
    const char *name = vshi_decode_text(t->decoder, true);
    return given != NULL && !t->decoder->bad && is_light(given)
               ? vshi_model_add_light(t->model, given, name, error)
               : fail_answer(t, "its lights", error);
}

/* The caller opens a path that the reader names, so it checks again that it is in the model's folder. The
 * image's bytes stay where they lie in the answer. */
static vsh_result decode_image(decoding *t, vshi_model_image *image, vsh_error *error) {
    const char *path = vshi_decode_text(t->decoder, false);
    image->size = vshi_decode_count(t->decoder, SIZE_MAX / 2);
    image->bytes = vshi_decode_array(t->decoder, image->size, 1);
    const bool both = path != NULL && image->size > 0;
    const bool outside = path != NULL && (t->run == NULL || t->run->allow_outside == 0) &&
                         !vshi_input_is_beside(t->path, path);
    if (t->decoder->bad || both || outside) {
        return fail_answer(t, "its images", error);
    }
    return path != NULL ? vshi_copy_text(&image->path, path, t->path, error) : VSH_OK;
}

static vsh_result decode_material(decoding *t, vshi_model_material *material, vsh_error *error) {
    const vshi_model_material *given = vshi_decode_array(t->decoder, 1, sizeof *given);
    if (given == NULL) {
        return fail_answer(t, "its materials", error);
    }
    vshi_material values = given->values;
    values.name = values.image_path = NULL;
    values.image = NULL;
    values.image_size = 0;
    const struct {
        int32_t value, most;
    } choices[] = {{values.alpha, VSH_ALPHA_BLENDED},
                   {values.double_sided, 1},
                   {values.uv_set, VSH_MAX_UV_SETS - 1},
                   {values.wrap[0], VSH_WRAP_CLAMP},
                   {values.wrap[1], VSH_WRAP_CLAMP},
                   {values.image_channel, VSHI_MASK_CHANNEL_AUTO},
                   {values.by_texture, 1}};
    bool good = given->image <= t->model->image_count && are_within(&values.alpha_cutoff, 1, 0.0) &&
                are_within(&values.base_alpha, 1, 0.0) && values.base_alpha <= 1.0 &&
                are_within(values.uv_transform, 6, -FLT_MAX);
    for (size_t i = 0; i < sizeof choices / sizeof choices[0]; ++i) {
        good = good && choices[i].value >= 0 && choices[i].value <= choices[i].most;
    }
    if (!good) {
        return fail_answer(t, "its materials", error);
    }
    *material = (vshi_model_material){.values = values, .image = given->image};
    return decode_name(t, &material->name, error);
}

static vsh_result decode_all(decoding *t, vsh_error *error) {
    enum { COUNT = sizeof(uint64_t) }; /* the length of a text */
    vsh_model *model = t->model;
    VSHI_TRY(decode_list(t, sizeof(shape_head), sizeof *model->shapes, &model->shapes, &model->shape_count,
                         error));
    for (size_t i = 0; i < model->shape_count; ++i) {
        VSHI_TRY(decode_shape(t, &model->shapes[i], error));
    }
    VSHI_TRY(decode_list(t, sizeof *model->entries + 2 * COUNT, sizeof *model->entries, &model->entries,
                         &model->entry_capacity, error));
    while (model->entry_count < model->entry_capacity) {
        VSHI_TRY(decode_entry(t, error));
    }
    VSHI_TRY(decode_list(t, sizeof *model->lights + COUNT, sizeof *model->lights, &model->lights,
                         &model->light_capacity, error));
    while (model->light_count < model->light_capacity) {
        VSHI_TRY(decode_light(t, error));
    }
    VSHI_TRY(decode_list(t, 2 * COUNT, sizeof *model->images, &model->images, &model->image_count, error));
    for (size_t i = 0; i < model->image_count; ++i) {
        VSHI_TRY(decode_image(t, &model->images[i], error));
    }
    VSHI_TRY(decode_list(t, sizeof *model->materials + COUNT, sizeof *model->materials, &model->materials,
                         &model->material_count, error));
    for (size_t i = 0; i < model->material_count; ++i) {
        VSHI_TRY(decode_material(t, &model->materials[i], error));
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
    decoding t = {.path = path, .run = run, .decoder = decoder};
    vsh_result result;
    VSHI_TRY(VSHI_ALLOCATE(t.model, 1, path, error));
    t.model->borrowed = true;
    t.model->unit = vshi_decode_number(decoder);
    if (!(t.model->unit >= 0.0)) {
        VSHI_TRY_DONE(fail_answer(&t, "its unit", error));
    }
    VSHI_TRY_DONE(decode_all(&t, error));
    *model = t.model;
    t.model = NULL;
done:
    vsh_model_free(t.model);
    return result;
}

static vsh_result read_in_reader(const reading *r, vsh_error *error) {
    vshi_exchange exchange;
    vshi_answer answer;
    VSHI_TRY(vshi_exchange_begin(&exchange, VSHI_READ_MODEL, r->path, r->run, error));
    VSHI_TRY(vshi_exchange_send_job(&exchange, r->job, READ_UNITS, &answer, error));
    const vsh_result result = vshi_model_decode(&answer.payload, r->path, r->run, r->model, error);
    if (result == VSH_OK) {
        (*r->model)->answer = answer;
    } else {
        vshi_answer_free(&answer);
    }
    return result;
}
