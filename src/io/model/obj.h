/* OBJ (Wavefront, "Object files", 1995): vertices, faces, and the objects, groups and materials that split
 * them into meshes. */
#pragma once

#include "io/model/faces.h"
#include "io/model/model.h"
#include "io/model/text.h"

#include <stdbool.h>

enum { VSHI_OBJ_POSITION, VSHI_OBJ_TEXTURE, VSHI_OBJ_NORMAL, VSHI_OBJ_KINDS };

/* A vertex of a mesh: position, texture coordinate and normal, each from 1; 0: none. */
typedef struct vshi_obj_vertex {
    uint32_t part[VSHI_OBJ_KINDS];
    uint32_t next; /* 1 + the previous vertex with this position; 0: none */
} vshi_obj_vertex;

/* Consecutive faces of one object and material. */
typedef struct vshi_obj_mesh {
    size_t name;     /* of names */
    size_t material; /* of materials; SIZE_MAX: none yet */
    size_t next;     /* 1 + the next mesh of the same object; 0: none */
    size_t first_vertex, first_corner, first_run;
    bool has[VSHI_OBJ_KINDS];
    bool used; /* has faces, lines or points */
} vshi_obj_mesh;

typedef struct vshi_obj_object {
    size_t name;
    size_t first_mesh, last_mesh;
} vshi_obj_object;

/* The values of v, vt or vn, and the highest index of faces. */
typedef struct vshi_obj_values {
    float *values;
    size_t count, capacity;
    int64_t highest; /* from 1: values may come after the faces that use them */
    size_t highest_line;
} vshi_obj_values;

/* The transparency of a material: its `d`, and its mask. */
typedef struct vshi_obj_alpha {
    double opacity; /* 0 … 1 */
    size_t image;   /* 1 + its number; 0: none */
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
    size_t line, statement; /* from 1: the current line, and the first of the statement */
    vshi_obj_values kinds[VSHI_OBJ_KINDS];
    uint32_t *heads; /* by position: 1 + its latest vertex; 0: none */
    size_t head_count, head_capacity;
    vshi_obj_vertex *vertices;
    size_t vertex_count, vertex_capacity;
    vshi_faces faces;
    vshi_words names, materials;
    size_t *object_of; /* [names]: 1 + the first object of that name; 0: none */
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

/* Reads the material library of the statement mtllib. */
vsh_result vshi_obj_read_materials(vshi_obj *obj, const char *text, size_t size, vsh_error *error);

/* Returns the path of a material library of the OBJ at `path`, in new memory: choice 0 is the file `name`,
 * choice 1 the OBJ's own name with ".mtl". NULL: memory is short. */
enum { VSHI_OBJ_LIBRARIES = 2 };
char *vshi_obj_library(const char *path, int choice, const char *name, size_t size);

/* Finds a material's number, or adds an opaque material. */
vsh_result vshi_obj_material(vshi_obj *obj, const char *name, size_t size, size_t *number, bool *is_new,
                             vsh_error *error);

/* The texture of a statement of an MTL (Wavefront, "MTL material format", 1995): "map_d -clamp on -imfchan r
 * my leaf.png". */
typedef struct vshi_mtl_map {
    vshi_token name;  /* of the file: all text after the options; text NULL: none */
    int32_t channel;  /* VSHI_MASK_CHANNEL_…: -imfchan */
    bool clamp;       /* -clamp on */
    double offset[2]; /* -o: the texture is read at scale × uv + offset */
    double scale[2];  /* -s */
    vshi_token other; /* an option that changes the texture and is not supported; text NULL: none */
} vshi_mtl_map;

/* Parses the text after the keyword, up to `end`. Returns false if an option, `other`, is unknown or lacks
 * its value. */
bool vshi_mtl_map_read(const char *at, const char *end, vshi_mtl_map *map);

/* Returns the path of the file `name` beside the MTL at `path`, in new memory. If there is no such file, each
 * '\' of the name becomes '/'. NULL: memory is short. */
char *vshi_mtl_map_path(const char *path, vshi_token name);
