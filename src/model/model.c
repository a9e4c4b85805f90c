/* A model: the arrays of each mesh of a file once, and an entry for every node that uses them. OBJ, PLY
 * and glTF are read by obj*.c, ply*.c and gltf*.c, other formats by Assimp (model_file.c, model_build.c). v
 * of UVs points up in every format. */
#include "model/model.h"

#include "base/floats.h"
#include "base/memory.h"
#include "base/threads.h"
#include "base/try.h"
#include "model/model_file.h"

#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

void vsh_model_free(vsh_model *model) {
    if (model == NULL) {
        return;
    }
    for (size_t i = 0; i < model->entry_count; ++i) {
        free(model->entries[i].object_name);
        free(model->entries[i].name);
    }
    free(model->entries);
    for (size_t i = 0; !model->borrowed && i < model->shape_count; ++i) {
        vshi_model_shape *shape = &model->shapes[i];
        if (shape->raw != NULL) {
            free(shape->raw);
            continue;
        }
        free(shape->indices);
        for (int set = 0; set < VSH_MAX_UV_SETS; ++set) {
            free(shape->uvs[set]);
        }
        free(shape->alphas);
        free(shape->normals);
        free(shape->positions);
    }
    free(model->shapes);
    vshi_model_free_lights(model);
    vshi_model_free_materials(model);
    for (int i = 0; i < VSHI_MODEL_BLOCKS; ++i) {
        free(model->blocks[i]);
    }
    vshi_answer_free(&model->answer);
    if (model->file.map != NULL) {
        munmap(model->file.map, model->file.size);
    }
    free(model);
}

vsh_result vshi_model_create(const char *path, vsh_model **model, vsh_error *error) {
    return vshi_allocate((void **)model, 1, sizeof **model, path, error);
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

/* STL's normals are those of its facets, often zero or wrong: the triangles know better. */
static bool wants_normals(const char *path) {
    const char *dot = strrchr(path, '.');
    return dot == NULL || (strcmp(dot, ".stl") != 0 && strcmp(dot, ".STL") != 0);
}

typedef struct reading {
    const char *path;
    const vsh_run *run;
    vshi_job *job;
    bool alone;
    vsh_model **model;
} reading;

static vsh_result read_file(void *user, vsh_error *error) {
    const reading *r = user;
    vshi_import *import = NULL;
    double unit = 0.0;
    VSHI_TRY(vshi_model_file_read(r->path, r->run, r->job, r->alone, &import, r->model, &unit, error));
    if (import == NULL) {
        return VSH_OK;
    }
    const vshi_model_source source = {.path = r->path,
                                      .run = r->run,
                                      .job = r->job,
                                      .scene = import->scene,
                                      .keep_normals = wants_normals(r->path),
                                      .unit = unit > 0.0 ? unit : import->unit,
                                      .in_metres = unit > 0.0};
    const vsh_result result = vshi_model_build(&source, r->model, error);
    vshi_importers()->free(import);
    return result;
}

vsh_result vshi_model_read(const char *path, const vsh_run *run, bool alone, vsh_model **model,
                           vsh_error *error) {
    VSHI_FLOATS;
    enum { BUILD_UNITS = 100 };
    VSHI_NEEDS(model);
    *model = NULL;
    VSHI_NEEDS(path);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vshi_job *job = vshi_job_begin(&full, "load", VSHI_MODEL_FILE_UNITS + BUILD_UNITS);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    reading r = {path, &full, job, alone, model};
    vsh_result result;
    VSHI_TRY_DONE(full.reader != NULL
                      ? vshi_model_from_reader(path, &full, job, VSHI_MODEL_FILE_UNITS, model, error)
                      : vshi_on_stack(read_file, &r, error));
    if (vshi_job_advance(job, BUILD_UNITS)) {
        vsh_model_free(*model);
        *model = NULL;
        result = vshi_job_fail_cancelled(job, error);
    }
done:
    vshi_job_end(job);
    return result;
}

vsh_result vsh_model_read(const char *path, const vsh_run *run, vsh_model **model, vsh_error *error) {
    return vshi_model_read(path, run, false, model, error);
}
