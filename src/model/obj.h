/* OBJ (Wavefront, "Object files", 1995): vertices, faces, and the objects, groups and materials that part
 * them into meshes. */
#ifndef VSHI_OBJ_H
#define VSHI_OBJ_H

#include "model/faces.h"
#include "model/model.h"
#include "model/text.h"

#include <stdbool.h>

enum { VSHI_OBJ_POSITION, VSHI_OBJ_TEXTURE, VSHI_OBJ_NORMAL, VSHI_OBJ_KINDS };

/* What corners of one mesh share: a place, a texture coordinate, a normal, each from 1; 0: none. */
typedef struct vshi_obj_vertex {
    uint32_t part[VSHI_OBJ_KINDS];
    uint32_t next; /* + 1: the vertex before at the same place; 0: none */
} vshi_obj_vertex;

/* Faces of one object and material that follow each other. */
typedef struct vshi_obj_mesh {
    size_t name;     /* of names */
    size_t material; /* of materials; SIZE_MAX: none yet */
    size_t next;     /* + 1: mesh of the same object; 0: none */
    size_t first_vertex, first_corner, first_run;
    bool has[VSHI_OBJ_KINDS];
    bool used; /* has faces, lines or points */
} vshi_obj_mesh;

typedef struct vshi_obj_object {
    size_t name;
    size_t first_mesh, last_mesh;
} vshi_obj_object;

/* Values of v, vt or vn, and which of them faces use. */
typedef struct vshi_obj_values {
    float *values;
    size_t count, capacity;
    int64_t highest; /* index used, from 1: values may follow the faces that use them */
    size_t highest_line;
} vshi_obj_values;

/* How much of a material is there: its `d`, and where it is cut out. */
typedef struct vshi_obj_alpha {
    double opacity; /* 0 … 1 */
    size_t image;   /* of images, + 1; 0: none */
    int32_t channel;
    bool clamp;
    double offset[2], scale[2];
} vshi_obj_alpha;

typedef struct vshi_obj {
    const char *path;
    const vsh_run *run;
    vshi_job *job;
    vshi_budget budget;
    vshi_text text;
    size_t line, statement; /* from 1: where the statement goes on, and begins */
    vshi_obj_values kinds[VSHI_OBJ_KINDS];
    uint32_t *heads; /* by place: the latest vertex there, + 1 */
    size_t head_count, head_capacity;
    vshi_obj_vertex *vertices;
    size_t vertex_count, vertex_capacity;
    vshi_faces faces;
    vshi_words names, materials;
    size_t *object_of; /* [names]: the first object of that name + 1; 0: none has it */
    size_t object_of_count, object_of_capacity;
    vshi_obj_alpha *alphas; /* [materials] */
    size_t alpha_capacity;
    vshi_words images; /* paths */
    vshi_obj_object *objects;
    size_t object_count, object_capacity;
    vshi_obj_mesh *meshes;
    size_t mesh_count, mesh_capacity;
    size_t object, mesh;    /* current; SIZE_MAX: none */
    size_t material, group; /* current, of materials and names; SIZE_MAX: none */
} vshi_obj;

/* Reads an OBJ, for `units` of the job. Errors: as vsh_model_read(). */
vsh_result vshi_obj_read(const char *path, const vsh_run *run, vshi_job *job, size_t units, vsh_model **model,
                         vsh_error *error);

/* --- parts: objects, groups, materials */

/* The statements o, g, usemtl and mtllib with what stands behind them. */
vsh_result vshi_obj_read_materials(vshi_obj *obj, const char *text, size_t size, vsh_error *error);

/* Where the material library is that an OBJ at `path` (".obj") names, in new memory: first the file of that
 * name, and where it is not there the OBJ's own. NULL: memory is short. */
enum { VSHI_OBJ_LIBRARIES = 2 };
char *vshi_obj_library(const char *path, int choice, const char *name, size_t size);

/* A material's number; one that is new is opaque. */
vsh_result vshi_obj_material(vshi_obj *obj, const char *name, size_t size, size_t *number, bool *is_new,
                             vsh_error *error);

/* --- what it becomes */

/* The texture that a statement of an MTL names (Wavefront, "MTL material format", 1995): "map_d -clamp on
 * -imfchan r my leaf.png". */

typedef struct vshi_mtl_map {
    vshi_token name;  /* of the file, all that follows the options; text NULL: there is none */
    int32_t channel;  /* VSH_MASK_CHANNEL_…: -imfchan */
    bool clamp;       /* -clamp on */
    double offset[2]; /* -o: looked up at scale × uv + offset */
    double scale[2];  /* -s */
    vshi_token other; /* an option that changes values or places, and is not taken; text NULL: none */
} vshi_mtl_map;

/* Reads what stands behind the keyword, up to `end`. False where an option, `other`, is unknown or lacks its
 * value. */
bool vshi_mtl_map_read(const char *at, const char *end, vshi_mtl_map *map);

/* Path of the file of that name beside the MTL at `path`, in new memory. If there is none, each '\' of the
 * name becomes '/'. NULL: memory is short. */
char *vshi_mtl_map_path(const char *path, vshi_token name);

#endif
