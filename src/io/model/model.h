/* Models in memory, and the readers of all formats. */
#pragma once

#include "base/job.h"
#include "io/reader/reader.h"

#include <vdbshade/mesh.h>

#include <stdio.h>

VSH_BEGIN_C

/* Returns the metres in a unit, "m", "cm", "mm", "in" or "ft"; 0 for another name and NULL. */
double vshi_find_unit(const char *name);

/* The channel of an image that is a material's alpha. */
typedef enum vshi_mask_channel {
    VSHI_MASK_CHANNEL_ALPHA = 0, /* A; 1 if there is none */
    VSHI_MASK_CHANNEL_RED = 1,
    VSHI_MASK_CHANNEL_GREEN = 2,
    VSHI_MASK_CHANNEL_BLUE = 3,
    VSHI_MASK_CHANNEL_LUMINANCE = 4, /* 0.2126 R + 0.7152 G + 0.0722 B of stored values, or Y */
    VSHI_MASK_CHANNEL_AUTO = 5       /* A if it is below 1 anywhere, else the luminance */
} vshi_mask_channel;

/* The part of a file's material that decides where light passes. Masked and blended materials have a texture;
 * masked ones let light pass where base_alpha × its alpha is below alpha_cutoff. */
typedef struct vshi_material {
    const char *name;       /* NULL: none */
    int32_t alpha;          /* VSH_ALPHA_… */
    int32_t double_sided;   /* 1: both sides of its faces are visible */
    double alpha_cutoff;    /* ≥ 0; 0 if it is not masked */
    double base_alpha;      /* 0 … 1 */
    int32_t uv_set;         /* of the texture, 0 … VSH_MAX_UV_SETS - 1; a mesh may lack it */
    int32_t wrap[2];        /* VSH_WRAP_…, along u and v */
    double uv_transform[6]; /* as in vsh_alpha_mask */
    const void *image; /* bytes of the base colour's image file (PNG, JPEG, …) in the model; NULL: none */
    size_t image_size;
    const char *image_path; /* a file instead, in the model's folder unless run->allow_outside; it may be
                               missing. NULL: none */
    int32_t image_channel;  /* a vshi_mask_channel */
    int32_t by_texture;     /* 1: the format has no alpha mode (OBJ). base_alpha and the image blend it; it is
                               opaque if neither leaves anything out */
} vshi_material;

/* Material `index` (< material_count). The model owns its name and image. Formats other than glTF and OBJ
 * give names and `alpha` alone. */
vshi_material vshi_model_get_material(const vsh_model *model, size_t index);

/* How a light of a file shines. */
enum {
    VSHI_MODEL_LIGHT_DIRECTIONAL = 0, /* from far away: direction */
    VSHI_MODEL_LIGHT_POINT = 1,       /* position, range */
    VSHI_MODEL_LIGHT_SPOT = 2         /* position, direction, range, angles */
};

/* A light that a file's node carries (glTF: KHR_lights_punctual). Lights of files have no size: shadows take
 * an angle or a radius of the caller's. */
typedef struct vshi_model_light {
    const char *name;    /* the node's, else the light's; NULL where neither has one */
    int32_t type;        /* VSHI_MODEL_LIGHT_… */
    double position[3];  /* world, metres */
    double direction[3]; /* world, of length 1: the way it shines, away from it; of a point 0, 0, 0 */
    double color[3];     /* linear RGB, ≥ 0, without the intensity */
    double intensity;    /* ≥ 0: lux, of a directional one at normal incidence; else candela */
    double range;        /* metres, where the file lets it end; 0: it does not end */
    double inner_angle;  /* spot: half angle of full light, radians, 0 … outer_angle; else 0 */
    double outer_angle;  /* spot: half angle where light ends, radians, > 0 … π / 2; else 0 */
} vshi_model_light;

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
    uint32_t packed;  /* bits: sets of a packer's integers, which textures use through a transform */
    int32_t alpha;    /* VSH_ALPHA_… */
    int32_t material; /* number of it + 1; 0: none */
} vshi_model_shape;

/* Numbers of a shape's arrays, for loops over all of them. */
enum {
    VSHI_MODEL_POSITIONS,
    VSHI_MODEL_INDICES,
    VSHI_MODEL_NORMALS,
    VSHI_MODEL_ALPHAS,
    VSHI_MODEL_UVS, /* set 0; the other sets follow */
    VSHI_MODEL_ARRAYS = VSHI_MODEL_UVS + VSH_MAX_UV_SETS
};

typedef struct vshi_model_array {
    void **at;          /* the shape's pointer; *at NULL: it has no such array */
    size_t count, size; /* vertices or triangles, and bytes of each */
} vshi_model_array;

vshi_model_array vshi_model_array_of(vshi_model_shape *shape, int number);

/* The origin of an entry in a glTF: node, mesh, primitive, and instance (EXT_mesh_gpu_instancing). Each is 1
 * + its index in the file; 0: none, as in all other formats. */
typedef struct vshi_model_origin {
    uint32_t node, mesh, primitive, instance;
} vshi_model_origin;

/* An image file: bytes, or a path. */
typedef struct vshi_model_image {
    const unsigned char *bytes; /* points into `owned`, or into the reader's answer */
    size_t size;
    unsigned char *owned;
    char *path;
} vshi_model_image;

typedef struct vshi_model_material {
    vshi_material values; /* without pointers: name and image are below */
    char *name;
    size_t image; /* number of it + 1; 0: none */
} vshi_model_material;

typedef struct vshi_model_entry {
    char *name;        /* NULL: neither node nor mesh has a name */
    char *object_name; /* of the node; NULL: it has no name */
    uint32_t object;   /* number of the node, from 1 */
    size_t shape;
    double transform[12];
    vshi_model_origin origin;
} vshi_model_entry;

struct vsh_model {
    vshi_model_shape *shapes;
    size_t shape_count;
    bool borrowed;      /* the shapes' arrays lie in the answer, which owns them */
    vshi_answer answer; /* of the reader; its map may be NULL */
    vshi_model_entry *entries;
    size_t entry_count, entry_capacity;
    vshi_model_light *lights; /* of a glTF's scene; the model owns their names */
    size_t light_count, light_capacity;
    vshi_model_material *materials;
    size_t material_count;
    vshi_model_image *images;
    size_t image_count;
    double unit; /* metres in a unit of the file; 0: not known */
};

extern const double vshi_uv_identity[6];

/* The place of a shape. */
typedef struct vshi_model_place {
    const char *node, *mesh; /* names; may be "" */
    uint32_t object;
    size_t shape;
    const double *world; /* [12] */
    vshi_model_origin origin;
} vshi_model_place;

/* Adds an entry, or a note if its transform flattens it. Errors: VSH_ERROR_INPUT (the transform is not finite
 * in 32 bits), VSH_ERROR_MEMORY. */
vsh_result vshi_model_add(vsh_model *model, const char *path, const vsh_run *run,
                          const vshi_model_place *place, vsh_error *error);

/* Adds a light, whose name is copied on one line; it may be NULL. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_model_add_light(vsh_model *model, const vshi_model_light *light, const char *name,
                                vsh_error *error);

/* Copies a text as one line. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_model_copy_line(const char *text, char **copy, vsh_error *error);

/* Returns the number of the next object. */
uint32_t vshi_model_next_object(const vsh_model *model);

/* Fails with VSH_ERROR_INPUT, naming `where` (may be ""), if a position is not finite. */
vsh_result vshi_model_check_positions(const char *path, const char *where, const float *positions,
                                      size_t count, vsh_error *error);

/* Sets normals that are not finite to 0, so that faces are flat there, and warns. */
void vshi_model_check_normals(const char *path, const vsh_run *run, const char *where,
                              const vshi_model_shape *shape);

/* Sums of a vertex's weights, and of its weighted matrices. */
typedef struct vshi_model_blend {
    double matrix[12], sum;
} vshi_model_blend;

void vshi_model_blend_add(vshi_model_blend *blend, double weight, const double matrix[12]);

/* Moves each vertex v by blends[v], divided by its sum of weights; vertices without weights by `rest`. */
void vshi_model_blend_move(vshi_model_shape *shape, const vshi_model_blend *blends, const double rest[12]);

/* Parses a file in a reader, and encodes the answer. */
vsh_result vshi_serve_model(const char *path, vshi_decoder *request, const vsh_run *run,
                            vshi_encoder *payload, vsh_error *error);

/* Decodes the answer of a reader, and checks all of it. The model's arrays lie in the message, which must
 * outlive it. Errors: VSH_ERROR_READ, VSH_ERROR_MEMORY. */
vsh_result vshi_model_decode(vshi_decoder *decoder, const char *path, const vsh_run *run, vsh_model **model,
                             vsh_error *error);

/* Allocates `count` materials, opaque and without names. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_model_add_materials(vsh_model *model, size_t count, vsh_error *error);

/* --- readers of formats */

/* Reads a file for `units` of the job. Errors: as vsh_model_read(). */
typedef vsh_result vshi_read_model_fn(const char *path, const vsh_run *run, vshi_job *job, size_t units,
                                      vsh_model **model, vsh_error *error);
vshi_read_model_fn vshi_obj_read, vshi_ply_read, vshi_gltf_read, vshi_assimp_read;

/* --- formats that are not read */

/* Fails with VSH_ERROR_INPUT, naming the formats that are read, for endings of Blender, Alembic or USD. */
vsh_result vshi_unsupported_check(const char *path, vsh_error *error);

/* --- other files of a model (beside.c) */

/* Gets the path of such a file and frees it, after an error too. */
typedef vsh_result vshi_beside_fn(void *user, char *path, vsh_error *error);

/* Calls `add` for the files that are read with a model, for some more than once: buffers of a glTF, even
 * missing ones; textures of materials that are not opaque; material libraries of an OBJ and their masks.
 * Lists files outside of the model's folder only with run->allow_outside. Lists nothing if the file is no
 * model of its ending. The job may cancel this, but is not advanced. Errors: VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED, those of `add`. */
vsh_result vshi_model_beside(const char *path, const vsh_run *run, vshi_job *job, vshi_beside_fn *add,
                             void *user, vsh_error *error);

VSH_END_C
