/* A model: the arrays of each mesh of a file once, and an entry for every node that uses them. OBJ, PLY
 * and glTF are read by obj.c, ply.c and gltf*.c, other formats by Assimp (assimp.c). v of UVs points up in
 * every format. */
#include "model/model.h"

#include "base/memory.h"
#include "base/vec.h"
#include "mesh/mesh.h"
#include "model/text.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* --- materials and images */

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

static void make_line(char *text) {
    for (char *c = text; *c != '\0'; ++c) {
        *c = (unsigned char)*c < 0x20 || *c == 0x7f ? '?' : *c;
    }
}

vsh_result vshi_model_copy_line(const char *text, char **copy, vsh_error *error) {
    const size_t size = strlen(text) + 1;
    VSHI_TRY(vshi_allocate((void **)copy, size, 1, "a name", error));
    memcpy(*copy, text, size);
    make_line(*copy);
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

/* --- lights, in the world */

size_t vsh_model_light_count(const vsh_model *model) {
    return model->light_count;
}

vsh_model_light vsh_model_get_light(const vsh_model *model, size_t index) {
    return model->lights[index];
}

vsh_result vshi_model_add_light(vsh_model *model, const vsh_model_light *light, const char *name,
                                vsh_error *error) {
    VSHI_TRY(vshi_make_room((void **)&model->lights, model->light_count, &model->light_capacity,
                            sizeof *model->lights, "a model's lights", error));
    char *copy = NULL;
    if (name != NULL && name[0] != '\0') {
        VSHI_TRY(vshi_model_copy_line(name, &copy, error));
    }
    vsh_model_light *added = &model->lights[model->light_count++];
    *added = *light;
    added->name = copy;
    return VSH_OK;
}

/* --- entries: places and names of meshes */

/* "node/mesh", or whichever has a name, or NULL; on one line. */
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

void vshi_model_compose(const double parent[12], const double own[12], double world[12]) {
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 4; ++column) {
            double sum = column == 3 ? parent[4 * row + 3] : 0.0;
            for (int k = 0; k < 3; ++k) {
                sum += parent[4 * row + k] * own[4 * k + column];
            }
            world[4 * row + column] = sum;
        }
    }
}

void vshi_model_blend_add(vshi_model_blend *blend, double weight, const double matrix[12]) {
    blend->sum += weight;
    for (int k = 0; k < 12; ++k) {
        blend->matrix[k] += weight * matrix[k];
    }
}

static void store(vshi_vec v, float *to) {
    to[0] = (float)v.x;
    to[1] = (float)v.y;
    to[2] = (float)v.z;
}

void vshi_model_blend_move(vshi_model_shape *shape, const vshi_model_blend *blends, const double rest[12]) {
    for (size_t v = 0; v < shape->vertex_count; ++v) {
        double m[12];
        for (int k = 0; k < 12; ++k) {
            m[k] = blends[v].sum > 0.0 ? blends[v].matrix[k] / blends[v].sum : rest[k];
        }
        float *p = shape->positions + 3 * v;
        store(vshi_transform_point(m, vshi_vec_off(p)), p);
        if (shape->normals != NULL) {
            float *n = shape->normals + 3 * v;
            store(vshi_unit(vshi_transform_normal(m, vshi_vec_off(n))), n);
        }
    }
}

uint32_t vshi_model_next_object(const vsh_model *model) {
    /* that of the last entry is the highest so far */
    return model->entry_count > 0 ? model->entries[model->entry_count - 1].object + 1 : 1;
}

static vsh_result append(vsh_model *model, const vshi_model_place *place, vsh_error *error) {
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
    VSHI_TRY(append(model, place, error));
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
    /* A scale of zero is how scenes hide things. */
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

double vsh_unit(const char *name) {
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
    /* entries come before materials where a model is taken from a reader */
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
