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
struct vshi_text;

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
} vshi_model_shape;

/* The arrays of a shape, by numbers: all of them can be freed, packed and sent alike. */
enum {
    VSHI_MODEL_POSITIONS,
    VSHI_MODEL_INDICES,
    VSHI_MODEL_NORMALS,
    VSHI_MODEL_ALPHAS,
    VSHI_MODEL_UVS, /* of set 0, and the others behind it */
    VSHI_MODEL_ARRAYS = VSHI_MODEL_UVS + VSH_MAX_UV_SETS
};

typedef struct vshi_model_array {
    void **at;          /* where the shape points to it; *at NULL: it has none */
    size_t count, size; /* vertices or triangles, and bytes of each */
} vshi_model_array;

vshi_model_array vshi_model_array_of(vshi_model_shape *shape, int number);

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

typedef struct vshi_model_entry {
    char *name;        /* NULL where neither node nor mesh has one */
    char *object_name; /* the node's; NULL where it has none */
    uint32_t object;   /* number of the node, from 1 */
    size_t shape;
    double transform[12];
    vshi_model_origin origin;
} vshi_model_entry;

struct vsh_model {
    vshi_model_shape *shapes;
    size_t shape_count;
    bool borrowed;      /* the shapes' arrays lie in the answer, else each is its own */
    vshi_answer answer; /* the reader's; its map may be NULL */
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

/* Where a shape stands. */
typedef struct vshi_model_place {
    const char *node, *mesh; /* names; may be "" */
    uint32_t object;
    size_t shape;
    const double *world; /* [12] */
    vshi_model_origin origin;
} vshi_model_place;

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

/* Whether positions are finite. Errors: VSH_ERROR_INPUT, naming `where`, which may be "". */
vsh_result vshi_model_check_positions(const char *path, const char *where, const float *positions,
                                      size_t count, vsh_error *error);

/* Normals that are not finite become 0, which is no direction: faces are flat there. Warns of them. */
void vshi_model_check_normals(const char *path, const vsh_run *run, const char *where,
                              const vshi_model_shape *shape);

/* A vertex's sums of weights, and of the weighted matrices that move it. */
typedef struct vshi_model_blend {
    double matrix[12], sum;
} vshi_model_blend;

void vshi_model_blend_add(vshi_model_blend *blend, double weight, const double matrix[12]);

/* Moves each vertex v by blends[v], divided by its sum of weights; a vertex without any by `rest`. */
void vshi_model_blend_move(vshi_model_shape *shape, const vshi_model_blend *blends, const double rest[12]);

/* world = parent × own. */
void vshi_model_compose(const double parent[12], const double own[12], double world[12]);

/* Has run->reader read the file, for `units` of the job. Errors: as vsh_model_read() with a reader. */
vsh_result vshi_model_from_reader(const char *path, const vsh_run *run, vshi_job *job, size_t units,
                                  vsh_model **model, vsh_error *error);

/* Parses in a reader, and puts what is handed over. */
vsh_result vshi_serve_model(const char *path, vshi_decoder *request, const vsh_run *run,
                            vshi_encoder *payload, vsh_error *error);

/* What a reader has handed over; everything in it is checked. The model's arrays are those of the message,
 * which must outlive it. Errors: VSH_ERROR_READ, VSH_ERROR_MEMORY. */
vsh_result vshi_model_decode(vshi_decoder *decoder, const char *path, const vsh_run *run, vsh_model **model,
                             vsh_error *error);

/* Takes `count` materials, opaque and without names. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_model_take_plain_materials(vsh_model *model, size_t count, vsh_error *error);

/* --- files (model_file.c) */

/* A file of a format that Assimp reads. Path, run and job are given. */
typedef struct vshi_assimp {
    const char *path;
    const vsh_run *run;
    vshi_job *job;
    size_t faces; /* polygons of three corners or more that Assimp must find at least; 0: not known */
    double unit;  /* metres in a unit of a Collada file, by which Assimp multiplies; 0: of another */
    const struct aiScene *scene;
    double root[12]; /* in front of the scene's own root */
    bool *skinned;   /* whether bones have moved a mesh of the scene */
} vshi_assimp;

/* Looks for what Assimp hides in the file's own bytes. Errors: VSH_ERROR_READ where it ends early,
 * VSH_ERROR_INPUT where its content is bad, VSH_ERROR_CANCELLED. */
vsh_result vshi_assimp_look(vshi_assimp *file, struct vshi_text *text, vsh_error *error);

/* Reads the file, for `units` of the job. Errors: as vsh_model_read(). */
vsh_result vshi_assimp_read(vshi_assimp *file, size_t units, vsh_model **model, vsh_error *error);

/* Reads a PLY, for `units` of the job. Errors: as vsh_model_read(). */
vsh_result vshi_ply_read(const char *path, const vsh_run *run, vshi_job *job, size_t units, vsh_model **model,
                         vsh_error *error);

/* --- formats that are refused by name */

/* The advice of errors about other formats. */
#define VSHI_FORMATS                                                                                         \
    "give a mesh as OBJ, glTF, GLB, PLY, STL, FBX or DAE, a level set as .vdb, or a scene as .json"

/* VSH_ERROR_INPUT, with the formats that are read, where a file is of Blender, Alembic or USD by its ending
 * or its first bytes. If a file cannot be read, its ending decides. Thread safe. */
vsh_result vshi_unsupported_check(const char *path, vsh_error *error);

/* --- files that a model is read with (beside.c) */

/* The path of a file in the folder of `path`, in new memory; NULL where memory is short. */
char *vshi_path_beside(const char *path, const char *name, size_t size);

/* Receives the path of such a file and frees it, after an error too. */
typedef vsh_result vshi_beside_fn(void *user, char *path, vsh_error *error);

/* Lists the files that are read with a model, some more than once: buffers of a glTF, also missing ones;
 * textures of materials that are not opaque; material libraries of an OBJ and their masks. Files outside of
 * the model's folder are listed only with run->allow_outside. A file that is no model of its ending names
 * none. The job may cancel this; its units are not advanced. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED, and what `take` returns. */
vsh_result vshi_model_beside(const char *path, const vsh_run *run, vshi_job *job, vshi_beside_fn *take,
                             void *user, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
