/* From what an OBJ says to a model. All meshes of the file share four arrays. */
#include "model/obj.h"

#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>

enum { POSITIONS, INDICES, UVS, NORMALS };

/* Where each mesh ends is where the next begins. */
static size_t vertex_end(const vshi_obj *obj, size_t mesh) {
    return mesh + 1 < obj->mesh_count ? obj->meshes[mesh + 1].first_vertex : obj->vertex_count;
}

static size_t run_end(const vshi_obj *obj, size_t mesh) {
    return mesh + 1 < obj->mesh_count ? obj->meshes[mesh + 1].first_run : obj->faces.run_count;
}

/* The values of one kind of all vertices; zeros where a corner has none. */
static vsh_result gather(vshi_obj *obj, int kind, size_t size, void **block, vsh_error *error) {
    float *values = NULL;
    size_t capacity = 0;
    VSHI_TRY(vshi_reserve(&obj->budget, &values, &capacity, obj->vertex_count * size, sizeof *values, error));
    *block = values;
    for (size_t v = 0; v < obj->vertex_count; ++v) {
        const uint32_t part = obj->vertices[v].part[kind];
        if (part > 0) {
            memcpy(values + size * v, obj->kinds[kind].values + size * (part - 1), size * sizeof *values);
        } else {
            memset(values + size * v, 0, size * sizeof *values);
        }
    }
    free(obj->kinds[kind].values);
    obj->budget.bytes -= (double)(obj->kinds[kind].capacity * size * sizeof *values);
    obj->kinds[kind] = (vshi_obj_values){0};
    return VSH_OK;
}

/* The faces' corners are what triangles are made of; where all are triangles, they are that. */
static vsh_result cut_mesh(vshi_obj *obj, const vshi_obj_mesh *mesh, size_t runs, vshi_model_shape *shape,
                           vsh_error *error) {
    vshi_face_cutter cutter = {.positions = shape->positions, .job = obj->job, .apart = true};
    const vsh_result result = vshi_faces_cut(&cutter, obj->faces.runs + mesh->first_run, runs,
                                             obj->faces.corners + mesh->first_corner, shape->indices,
                                             &shape->triangle_count, error);
    vshi_face_cutter_end(&cutter, obj->run, obj->path, vshi_words_at(&obj->names, mesh->name));
    return result;
}

static vsh_result make_indices(vshi_obj *obj, vsh_model *model, bool *triangles, vsh_error *error) {
    uint32_t *indices = NULL;
    size_t capacity = 0;
    const size_t most = vshi_faces_most(obj->faces.runs, obj->faces.run_count, triangles);
    if (most == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: holds no triangles", obj->path);
    }
    if (*triangles) {
        model->blocks[INDICES] = obj->faces.corners;
        obj->faces.corners = NULL;
        return VSH_OK;
    }
    VSHI_TRY(vshi_reserve(&obj->budget, &indices, &capacity, most, sizeof(uint32_t[3]), error));
    model->blocks[INDICES] = indices;
    return VSH_OK;
}

static int32_t alpha_of(const vshi_obj_alpha *alpha) {
    return alpha->opacity < 1.0 || alpha->image > 0 ? VSH_ALPHA_BLENDED : VSH_ALPHA_OPAQUE;
}

static vsh_result make_shapes(vshi_obj *obj, vsh_model *model, vsh_error *error) {
    bool triangles;
    size_t capacity = 0, made = 0;
    model->borrowed = true;
    VSHI_TRY(make_indices(obj, model, &triangles, error));
    VSHI_TRY(gather(obj, VSHI_OBJ_POSITION, 3, &model->blocks[POSITIONS], error));
    if (obj->kinds[VSHI_OBJ_TEXTURE].highest > 0) {
        VSHI_TRY(gather(obj, VSHI_OBJ_TEXTURE, 2, &model->blocks[UVS], error));
    }
    if (obj->kinds[VSHI_OBJ_NORMAL].highest > 0) {
        VSHI_TRY(gather(obj, VSHI_OBJ_NORMAL, 3, &model->blocks[NORMALS], error));
    }
    VSHI_TRY(
        vshi_reserve(&obj->budget, &model->shapes, &capacity, obj->mesh_count, sizeof *model->shapes, error));
    float *positions = model->blocks[POSITIONS], *uvs = model->blocks[UVS], *normals = model->blocks[NORMALS];
    for (size_t m = 0; m < obj->mesh_count; ++m) {
        const vshi_obj_mesh *mesh = &obj->meshes[m];
        const size_t first = mesh->first_vertex, runs = run_end(obj, m) - mesh->first_run;
        vshi_model_shape *shape = &model->shapes[m];
        *shape = (vshi_model_shape){
            .positions = positions + 3 * first,
            .indices = (uint32_t *)model->blocks[INDICES] + 3 * made,
            .normals = mesh->has[VSHI_OBJ_NORMAL] ? normals + 3 * first : NULL,
            .uvs = {mesh->has[VSHI_OBJ_TEXTURE] ? uvs + 2 * first : NULL},
            .uv_sets = mesh->has[VSHI_OBJ_TEXTURE],
            .vertex_count = vertex_end(obj, m) - first,
            .alpha = mesh->material != SIZE_MAX ? alpha_of(&obj->alphas[mesh->material]) : VSH_ALPHA_OPAQUE,
            .material = mesh->material < obj->materials.count ? (int32_t)mesh->material + 1 : 0,
        };
        model->shape_count = m + 1;
        if (triangles) {
            bool plain;
            shape->triangle_count = vshi_faces_most(obj->faces.runs + mesh->first_run, runs, &plain);
        } else {
            VSHI_TRY(cut_mesh(obj, mesh, runs, shape, error));
        }
        made += shape->triangle_count;
    }
    return VSH_OK;
}

static void make_material(const vshi_obj_alpha *from, vshi_model_material *material) {
    vsh_model_material *told = &material->told;
    const double transform[6] = {from->scale[0], 0.0, from->offset[0], 0.0, from->scale[1], from->offset[1]};
    told->alpha = alpha_of(from);
    told->by_texture = 1;
    told->base_alpha = from->opacity;
    material->image = from->image;
    if (from->image > 0) {
        told->image_channel = from->channel;
        told->wrap[0] = told->wrap[1] = from->clamp ? VSH_WRAP_CLAMP : VSH_WRAP_REPEAT;
        memcpy(told->uv_transform, transform, sizeof transform);
    }
}

/* What cuts them out. */
static vsh_result make_images(vshi_obj *obj, vsh_model *model, vsh_error *error) {
    const size_t count = obj->images.count;
    const double bytes = (double)count * sizeof *model->images + (double)obj->images.used;
    VSHI_TRY(vshi_check_limit(obj->run, obj->budget.bytes + bytes, obj->path, error));
    VSHI_TRY(vshi_allocate((void **)&model->images, count, sizeof *model->images, obj->path, error));
    model->image_count = count;
    obj->budget.bytes += bytes;
    for (size_t i = 0; i < count; ++i) {
        model->images[i].path = strdup(vshi_words_at(&obj->images, i));
        if (model->images[i].path == NULL) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", obj->path);
        }
    }
    return VSH_OK;
}

/* Their names, and how much of them is there. */
static vsh_result make_materials(vshi_obj *obj, vsh_model *model, vsh_error *error) {
    const size_t count = obj->materials.count;
    if (count >= INT32_MAX) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %zu materials, at most %d", obj->path, count,
                         INT32_MAX - 1);
    }
    const double bytes = (double)count * sizeof *model->materials + (double)obj->materials.used;
    VSHI_TRY(vshi_check_limit(obj->run, obj->budget.bytes + bytes, obj->path, error));
    VSHI_TRY(vshi_model_take_plain_materials(model, count, error));
    for (size_t i = 0; i < count; ++i) {
        make_material(&obj->alphas[i], &model->materials[i]);
        VSHI_TRY(vshi_model_copy_line(vshi_words_at(&obj->materials, i), &model->materials[i].name, error));
    }
    return VSH_OK;
}

static vsh_result add_entries(const vshi_obj *obj, vsh_model *model, vsh_error *error) {
    static const double world[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    for (size_t o = 0; o < obj->object_count; ++o) {
        const uint32_t number = vshi_model_next_object(model);
        for (size_t m = obj->objects[o].first_mesh + 1; m > 0; m = obj->meshes[m - 1].next) {
            const vshi_model_place place = {.node = vshi_words_at(&obj->names, obj->objects[o].name),
                                            .mesh = vshi_words_at(&obj->names, obj->meshes[m - 1].name),
                                            .object = number,
                                            .shape = m - 1,
                                            .world = world};
            if (model->shapes[m - 1].triangle_count > 0) {
                VSHI_TRY(vshi_model_add(model, obj->path, obj->run, &place, error));
            }
        }
    }
    return model->entry_count > 0 ? VSH_OK
                                  : vshi_fail(error, VSH_ERROR_INPUT, "%s: holds no triangles", obj->path);
}

vsh_result vshi_obj_build(vshi_obj *obj, vsh_model *model, vsh_error *error) {
    free(obj->heads);
    obj->budget.bytes -= (double)(obj->head_capacity * sizeof *obj->heads);
    obj->heads = NULL;
    VSHI_TRY(make_images(obj, model, error));
    VSHI_TRY(make_materials(obj, model, error));
    VSHI_TRY(make_shapes(obj, model, error));
    return add_entries(obj, model, error);
}
