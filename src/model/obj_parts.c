/* Objects, groups and materials part an OBJ's faces into meshes, and name them, as Assimp 5.2 does: bakes
 * name their objects so. A group is an object; another material begins another mesh in it, which has the
 * material's name. */
#include "model/obj.h"

#include "base/try.h"

#include <string.h>

static const char unnamed[] = "defaultobject";

static vsh_result name_number(vshi_obj *obj, const char *name, size_t size, size_t *number,
                              vsh_error *error) {
    bool is_new;
    VSHI_TRY(vshi_words_number(&obj->names, &obj->budget, name, size, number, &is_new, error));
    VSHI_TRY(vshi_grow(&obj->budget, &obj->object_of, &obj->object_of_capacity, obj->names.count,
                       sizeof *obj->object_of, error));
    if (is_new) {
        obj->object_of[*number] = 0;
    }
    return VSH_OK;
}

static vsh_result add_mesh(vshi_obj *obj, size_t name, vsh_error *error) {
    VSHI_TRY(vshi_grow(&obj->budget, &obj->meshes, &obj->mesh_capacity, obj->mesh_count + 1,
                       sizeof *obj->meshes, error));
    obj->mesh = obj->mesh_count++;
    obj->meshes[obj->mesh] = (vshi_obj_mesh){.name = name,
                                             .material = obj->material,
                                             .first_vertex = obj->vertex_count,
                                             .first_corner = obj->faces.count,
                                             .first_run = obj->faces.run_count};
    vshi_obj_object *object = &obj->objects[obj->object];
    if (object->last_mesh == SIZE_MAX) {
        object->first_mesh = obj->mesh;
    } else {
        obj->meshes[object->last_mesh].next = obj->mesh + 1;
    }
    object->last_mesh = obj->mesh;
    return VSH_OK;
}

static vsh_result add_object(vshi_obj *obj, size_t name, vsh_error *error) {
    VSHI_TRY(vshi_grow(&obj->budget, &obj->objects, &obj->object_capacity, obj->object_count + 1,
                       sizeof *obj->objects, error));
    obj->object = obj->object_count++;
    obj->objects[obj->object] =
        (vshi_obj_object){.name = name, .first_mesh = SIZE_MAX, .last_mesh = SIZE_MAX};
    obj->object_of[name] = obj->object_of[name] == 0 ? obj->object_count : obj->object_of[name];
    return add_mesh(obj, name, error);
}

vsh_result vshi_obj_need_mesh(vshi_obj *obj, vsh_error *error) {
    if (obj->object == SIZE_MAX) {
        size_t name;
        VSHI_TRY(name_number(obj, unnamed, sizeof unnamed - 1, &name, error));
        VSHI_TRY(add_object(obj, name, error));
    }
    obj->meshes[obj->mesh].used = true;
    return VSH_OK;
}

vsh_result vshi_obj_set_object(vshi_obj *obj, const char *text, size_t size, vsh_error *error) {
    size_t name, length = 0;
    while (length < size && text[length] != ' ' && text[length] != '\t') {
        ++length;
    }
    if (length == 0) {
        return VSH_OK;
    }
    VSHI_TRY(name_number(obj, text, length, &name, error));
    if (obj->object_of[name] == 0) {
        return add_object(obj, name, error);
    }
    if (obj->object_of[name] - 1 == obj->object) {
        return VSH_OK;
    }
    obj->object = obj->object_of[name] - 1;
    return add_mesh(obj, name, error);
}

vsh_result vshi_obj_set_group(vshi_obj *obj, const char *text, size_t size, vsh_error *error) {
    size_t name;
    if (size == 0 && obj->group == SIZE_MAX) {
        return VSH_OK;
    }
    VSHI_TRY(name_number(obj, text, size, &name, error));
    const bool same = name == obj->group;
    obj->group = name;
    return same ? VSH_OK : add_object(obj, name, error);
}

vsh_result vshi_obj_material(vshi_obj *obj, const char *name, size_t size, size_t *number, bool *is_new,
                             vsh_error *error) {
    VSHI_TRY(vshi_words_number(&obj->materials, &obj->budget, name, size, number, is_new, error));
    VSHI_TRY(vshi_grow(&obj->budget, &obj->alphas, &obj->alpha_capacity, obj->materials.count,
                       sizeof *obj->alphas, error));
    if (*is_new) {
        obj->alphas[*number] = (vshi_obj_alpha){.opacity = 1.0};
    }
    return VSH_OK;
}

vsh_result vshi_obj_set_material(vshi_obj *obj, const char *text, size_t size, vsh_error *error) {
    size_t material, name;
    bool is_new;
    if (size == 0) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_obj_material(obj, text, size, &material, &is_new, error));
    if (material == obj->material) {
        return VSH_OK;
    }
    obj->material = material;
    if (obj->mesh == SIZE_MAX) {
        return VSH_OK;
    }
    const vshi_obj_mesh *mesh = &obj->meshes[obj->mesh];
    if (mesh->used && mesh->material != SIZE_MAX && mesh->material != material) {
        VSHI_TRY(name_number(obj, text, size, &name, error));
        VSHI_TRY(add_mesh(obj, name, error));
    }
    obj->meshes[obj->mesh].material = material;
    return VSH_OK;
}
