/* Entries of a model: what stands where, and under which name. */
#include "base/memory.h"
#include "base/try.h"
#include "base/vec.h"
#include "mesh/mesh.h"
#include "model/model.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void make_line(char *text) {
    for (char *c = text; *c != '\0'; ++c) {
        *c = (unsigned char)*c < 0x20 || *c == 0x7f ? '?' : *c;
    }
}

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

static vsh_result grow_entries(vsh_model *model, vsh_error *error) {
    if (model->entry_count < model->entry_capacity) {
        return VSH_OK;
    }
    const size_t capacity = model->entry_capacity > 0 ? 2 * model->entry_capacity : 8;
    vshi_model_entry *entries = NULL;
    VSHI_TRY(vshi_allocate((void **)&entries, capacity, sizeof *entries, "a model's meshes", error));
    if (model->entry_count > 0) {
        memcpy(entries, model->entries, model->entry_count * sizeof *entries);
    }
    free(model->entries);
    model->entries = entries;
    model->entry_capacity = capacity;
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
    VSHI_TRY(grow_entries(model, error));
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
