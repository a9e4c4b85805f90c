/* What a model holds, and how it comes out of Assimp's scene. */
#ifndef VSHI_CASTER_MODEL_H
#define VSHI_CASTER_MODEL_H

#include "base/job.h"
#include "sandbox/reader.h"

#include <vdbshade/mesh.h>

#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

struct aiScene;

/* The arrays of one mesh of the file, shared by the nodes that use it. */
typedef struct vshi_model_shape {
    float *positions;
    float *normals;
    float *uvs[VSH_MAX_UV_SETS];
    float *alphas; /* [vertex_count], of vertex colours; NULL: all 1, or its material is opaque */
    uint32_t *indices;
    size_t vertex_count;
    size_t triangle_count;
    int32_t uv_sets;  /* highest set + 1 */
    uint32_t packed;  /* sets, as bits, that textures of the file look up through a transform: a packer's
                         integers */
    int32_t alpha;    /* VSH_ALPHA_… */
    int32_t material; /* number of it + 1; 0: none */
    char *raw;        /* its arrays lie in the model's file, as they are there: what to call it where
                         vshi_model_finish() is still to be done. NULL: they are its own, and done */
} vshi_model_shape;

/* What of a glTF an entry is: its node, the node's mesh, the mesh's primitive and, where the node is drawn
 * many times (EXT_mesh_gpu_instancing), which of them. Each is 1 + its index in the file; 0: none, as in
 * every other format. */
typedef struct vshi_model_origin {
    uint32_t node, mesh, primitive, instance;
} vshi_model_origin;
/* An image file: bytes, or a path. */
typedef struct vshi_model_image {
    const unsigned char *bytes; /* what is `owned`, or of the reader's answer */
    size_t size;
    unsigned char *owned;
    char *path;
} vshi_model_image;

typedef struct vshi_model_material {
    vsh_model_material told; /* without what lies in memory of the model's: */
    char *name;
    size_t image; /* number of it + 1; 0: none */
} vshi_model_material;

enum { VSHI_FILE_IDENTITY = 5 };

/* A file that a reader has mapped, and that arrays of its model are left in: what takes them up reads them
 * from there, without a copy in between (model_message.c). */
typedef struct vshi_model_file {
    void *map; /* NULL: none */
    size_t size;
    uint64_t identity[VSHI_FILE_IDENTITY]; /* device, number, bytes, seconds and nanoseconds of its last
                                              change */
} vshi_model_file;

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
    vshi_model_file file;
    vshi_model_entry *entries;
    size_t entry_count, entry_capacity;
    vsh_model_light *lights; /* whose names are the model's */
    size_t light_count, light_capacity;
    vshi_model_material *materials;
    size_t material_count;
    vshi_model_image *images;
    size_t image_count;
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

/* Adds a light, whose name is copied on one line; it may be NULL. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_model_add_light(vsh_model *model, const vsh_model_light *light, const char *name,
                                vsh_error *error);

/* A copy of a text on one line. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_model_copy_line(const char *text, char **copy, vsh_error *error);

/* The number of an object that is yet to be added. */
uint32_t vshi_model_next_object(const vsh_model *model);

/* The shape's triangles are held against its vertices, vertices that none of them uses are left out,
 * positions are finite, normals that are not become 0 with a warning, and v of UVs points up. Errors:
 * VSH_ERROR_INPUT, naming `where`; VSH_ERROR_MEMORY. */
vsh_result vshi_model_finish(const char *path, const vsh_run *run, const char *where, vshi_model_shape *shape,
                             vsh_error *error);

/* Whether `count` indices are of `vertex_count` vertices. Errors: VSH_ERROR_INPUT, naming the first. */
vsh_result vshi_model_check_indices(const char *path, const char *where, const uint32_t *indices,
                                    size_t count, size_t vertex_count, vsh_error *error);

/* A vertex's sums of weights, and of the weighted matrices that move it. */
typedef struct vshi_model_blend {
    double matrix[12], sum;
} vshi_model_blend;

void vshi_model_blend_add(vshi_model_blend *blend, double weight, const double matrix[12]);

/* Moves each vertex v by blends[v], divided by its sum of weights; a vertex without any by `rest`. */
void vshi_model_blend_move(vshi_model_shape *shape, const vshi_model_blend *blends, const double rest[12]);

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
 * which must outlive it, or are read from the file at `path` where they were left there. Errors:
 * VSH_ERROR_READ where it does not hold, and as for what was made in this process. */
vsh_result vshi_model_decode(struct vshi_decoder *decoder, const char *path, const vsh_run *run,
                             vsh_model **model, vsh_error *error);

/* Takes `count` materials, opaque and without names. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_model_take_plain_materials(vsh_model *model, size_t count, vsh_error *error);

/* --- arrays that are left in the file (model_message.c) */

/* What of it tells whether it is the same one, unchanged. False where the system does not say. */
bool vshi_file_identity(int file, uint64_t identity[VSHI_FILE_IDENTITY]);

#ifdef __cplusplus
}
#endif
#endif
