/* What a model holds, and how it comes out of Assimp's scene. */
#ifndef VSHI_CASTER_MODEL_H
#define VSHI_CASTER_MODEL_H

#include "base/job.h"
#include "sandbox/reader.h"

#include <vdbshade/mesh.h>

#ifdef __cplusplus
extern "C" {
#endif

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
    int32_t alpha;   /* VSH_ALPHA_… */
} vshi_model_shape;

/* What of a glTF an entry is: its node, the node's mesh, the mesh's primitive and, where the node is drawn
 * many times (EXT_mesh_gpu_instancing), which of them. Each is 1 + its index in the file; 0: none, as in
 * every other format. */
typedef struct vshi_model_origin {
    uint32_t node, mesh, primitive, instance;
} vshi_model_origin;

typedef struct vshi_model_entry {
    char *name;        /* NULL where neither node nor mesh has one */
    char *object_name; /* the node's; NULL where it has none */
    uint32_t object;   /* number of the node, from 1 */
    size_t shape;
    double transform[12];
    vshi_model_origin origin;
} vshi_model_entry;

enum { VSHI_MODEL_BLOCKS = 4 };

struct vsh_model {
    vshi_model_shape *shapes;
    size_t shape_count;
    bool borrowed;                   /* the shapes' arrays lie in what follows, else each is its own */
    void *blocks[VSHI_MODEL_BLOCKS]; /* from malloc; may be NULL */
    vshi_answer answer;              /* of a reader; its map may be NULL */
    vshi_model_entry *entries;
    size_t entry_count, entry_capacity;
    double unit; /* metres in one of the file's; 0: not known */
};

/* What a model is built from, and by whose order. */
typedef struct vshi_model_source {
    const char *path;
    const vsh_run *run;
    vshi_job *job;
    const struct aiScene *scene;
    bool keep_normals;
    double unit;    /* metres in a unit of the file; 0: it has none */
    bool in_metres; /* whether positions are in metres already */
} vshi_model_source;

/* Where a shape stands. */
typedef struct vshi_model_place {
    const char *node, *mesh; /* names; may be "" */
    uint32_t object;
    size_t shape;
    const double *world; /* [12] */
    vshi_model_origin origin;
} vshi_model_place;

/* An empty one. Free with vsh_model_free(). Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_model_create(const char *path, vsh_model **model, vsh_error *error);

/* vsh_model_read(); `alone`: in a process of its own, which may end where the file does not hold still. */
vsh_result vshi_model_read(const char *path, const vsh_run *run, bool alone, vsh_model **model,
                           vsh_error *error);

/* Adds an entry; a transform that flattens it is left out, with a warning. Errors: VSH_ERROR_INPUT (a
 * transform that is not finite in 32 bits), VSH_ERROR_MEMORY. */
vsh_result vshi_model_add(vsh_model *model, const char *path, const vsh_run *run,
                          const vshi_model_place *place, vsh_error *error);

/* The number of an object that is yet to be added. */
uint32_t vshi_model_next_object(const vsh_model *model);

/* world = parent × own. */
void vshi_model_compose(const double parent[12], const double own[12], double world[12]);

/* Builds the model of a scene that vshi_model_file_read() has passed. */
vsh_result vshi_model_build(const vshi_model_source *source, vsh_model **model, vsh_error *error);

/* Has run->reader read the file, for `units` of the job. Errors: as vsh_model_read() with a reader. */
vsh_result vshi_model_from_reader(const char *path, const vsh_run *run, vshi_job *job, size_t units,
                                  vsh_model **model, vsh_error *error);

struct vshi_decoder;
struct vshi_encoder;

/* Parses in a reader, and puts what is handed over. */
vsh_result vshi_serve_model(const char *path, struct vshi_decoder *request, const vsh_run *run,
                            struct vshi_encoder *payload, vsh_error *error);

/* What a reader has handed over; everything in it is checked. The model's arrays are those of the message,
 * which must outlive it. Errors: VSH_ERROR_READ where it does not hold, and as for what was made in this
 * process. */
vsh_result vshi_model_decode(struct vshi_decoder *decoder, const char *path, vsh_model **model,
                             vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
