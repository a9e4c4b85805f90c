/* What a model holds, and how it comes out of Assimp's scene. */
#ifndef VSHI_CASTER_MODEL_H
#define VSHI_CASTER_MODEL_H

#include "base/job.h"

#include <vdbshade/mesh.h>

struct aiScene;

/* The arrays of one mesh of the file, shared by the nodes that use it. */
typedef struct vshi_model_shape {
    float *positions;
    float *normals;
    float *uvs[VSH_MAX_UV_SETS];
    uint32_t *indices;
    size_t vertex_count;
    size_t triangle_count;
    int32_t uv_sets; /* highest set + 1 */
} vshi_model_shape;

typedef struct vshi_model_entry {
    char *name;        /* NULL where neither node nor mesh has one */
    char *object_name; /* the node's; NULL where it has none */
    uint32_t object;   /* number of the node, from 1 */
    size_t shape;
    double transform[12];
} vshi_model_entry;

struct vsh_model {
    vshi_model_shape *shapes;
    size_t shape_count;
    vshi_model_entry *entries;
    size_t entry_count, entry_capacity;
};

/* What a model is built from, and by whose order. */
typedef struct vshi_model_source {
    const char *path;
    const vsh_run *run;
    vshi_job *job;
    const struct aiScene *scene;
    bool keep_normals;
} vshi_model_source;

/* Builds the model of a scene that vshi_model_file_read() has passed. */
vsh_result vshi_model_build(const vshi_model_source *source, vsh_model **model, vsh_error *error);

/* Has run->reader read the file, for `units` of the job. Errors: as vsh_model_read() with a reader. */
vsh_result vshi_model_from_reader(const char *path, const vsh_run *run, vshi_job *job, size_t units,
                                  vsh_model **model, vsh_error *error);

#endif
