/* Reads glTF 2.0 by its specification (Khronos, "glTF 2.0 Specification", 2.0.1). Checks every index, offset
 * and length of the file. */
#pragma once

#include "io/model/importers.h"
#include "io/model/model.h"

#include <jansson.h>
#include <stdbool.h>

/* Bytes of a buffer, or a part of one. */
typedef struct vshi_gltf_bytes {
    const unsigned char *at;
    size_t size;
} vshi_gltf_bytes;

typedef struct vshi_gltf_buffer {
    vshi_gltf_bytes bytes;
    unsigned char *owned; /* memory for data of a URI; may be NULL */
    bool loaded;
} vshi_gltf_buffer;

typedef struct vshi_gltf {
    const char *path;
    const vsh_run *run;
    vshi_job *job;
    json_t *root;
    vshi_gltf_bytes chunk; /* binary, of a GLB */
    bool binary;
    vshi_gltf_buffer *buffers;
    size_t buffer_count;
    vshi_gltf_buffer *views; /* unpacked data of compressed ones */
    size_t view_count;
    double bytes_held; /* of buffers and the model, for the memory limit */

    vsh_model *model;
    size_t shape_capacity;
    size_t *mesh_shapes; /* first shape + 1 of each mesh that was read without a pose; 0: not yet */
    struct vshi_gltf_unpacking *unpackings; /* [materials][VSH_MAX_UV_SETS]; NULL: no UVs are packed */
    bool *node_seen;
    double (*node_world)[12]; /* world transform of a visited node */
    size_t node_count;
    size_t *visited; /* [visited_count] nodes, parents before children */
    size_t visited_count;
} vshi_gltf;

/* --- looking up (gltf.c) */

/* Returns an element of an array of the root, or NULL. */
const json_t *vshi_gltf_element(const vshi_gltf *gltf, const char *array, size_t index);

/* Reads a whole number of at least 0; `fallback` if the key is absent. Returns false for other values. */
bool vshi_gltf_count(const json_t *object, const char *key, size_t fallback, size_t *value);

/* Reads an index of an element of a root's array; SIZE_MAX if the key is absent. Errors: VSH_ERROR_INPUT,
 * naming `where`. */
vsh_result vshi_gltf_index(const vshi_gltf *gltf, const json_t *object, const char *key, const char *array,
                           const char *where, size_t *index, vsh_error *error);

/* Reads up to `count` numbers of an array; keeps the other values. Returns false if an item is no number. */
bool vshi_gltf_numbers(const json_t *object, const char *key, size_t count, double *values);

/* Returns the object of an extension, or NULL. */
json_t *vshi_gltf_extension(const json_t *object, const char *name);

/* Whether an extension's name is `pattern`, or begins with it if that ends in "_". */
bool vshi_gltf_is_named(const char *name, const char *pattern);

vsh_result vshi_gltf_fail(const vshi_gltf *gltf, vsh_error *error, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Adds to bytes_held, and checks the memory limit. */
vsh_result vshi_gltf_hold(vshi_gltf *gltf, double bytes, vsh_error *error);

/* Does so for count × size bytes, and allocates them like vshi_allocate(). */
vsh_result vshi_gltf_allocate(vshi_gltf *gltf, void **memory, size_t count, size_t size, vsh_error *error);

/* --- bytes (gltf_buffer.c) */

/* Finds the bytes of buffer view `index`, and its stride (0: none). Loads its buffer. */
vsh_result vshi_gltf_view(vshi_gltf *gltf, size_t index, vshi_gltf_bytes *bytes, size_t *stride,
                          vsh_error *error);

/* Reads a file into new memory; free it after an error too. Messages begin with `name`. */
vsh_result vshi_gltf_read_file(vshi_gltf *gltf, const char *path, const char *name, unsigned char **bytes,
                               size_t *size, vsh_error *error);

/* Decodes a data URI into new memory. */
vsh_result vshi_gltf_read_data(vshi_gltf *gltf, const char *where, const char *uri, unsigned char **bytes,
                               size_t *size, vsh_error *error);

/* Loads buffer `index`, once. */
vsh_result vshi_gltf_load(vshi_gltf *gltf, size_t index, vsh_error *error);

void vshi_gltf_free_buffers(vshi_gltf *gltf);

/* --- accessors (gltf_buffer.c) */

/* Returns the bytes of a component of a type VSHI_GLTF_…; 0 for other types. */
size_t vshi_gltf_component_size(int type);

/* Reads the component at `at`, not normalized. */
double vshi_gltf_component(const unsigned char *at, int type);

typedef struct vshi_gltf_accessor {
    size_t count;
    int components; /* 1 … 16 */
    int type;       /* VSHI_GLTF_… */
    bool normalized;
    const unsigned char *at; /* the first element; NULL: all are 0 */
    size_t stride;
    size_t sparse_count; /* elements that a sparse accessor replaces */
    const unsigned char *sparse_at, *sparse_values;
    int sparse_type;
} vshi_gltf_accessor;

/* Finds accessor `index`, and checks that its buffer holds all of it. */
vsh_result vshi_gltf_accessor_open(vshi_gltf *gltf, size_t index, vshi_gltf_accessor *accessor,
                                   vsh_error *error);

/* Opens the accessor that `key` of an object names; its count is 0 if the key is absent. */
vsh_result vshi_gltf_accessor_find(vshi_gltf *gltf, const json_t *object, const char *key, const char *where,
                                   vshi_gltf_accessor *accessor, vsh_error *error);

/* Copies the elements as floats, `components` each; normalized ones are 0 … 1 or -1 … 1. */
void vshi_gltf_accessor_floats(const vshi_gltf_accessor *accessor, float *values);

/* Copies the elements as unsigned integers, if their type is one. */
void vshi_gltf_accessor_integers(const vshi_gltf_accessor *accessor, uint32_t *values);

/* Copies the elements without conversion, without gaps. */
void vshi_gltf_accessor_bytes(const vshi_gltf_accessor *accessor, unsigned char *bytes);

/* --- meshes (gltf_primitive.c) */

/* The morph weights and joints that move the vertices of a node's mesh. All 0: none. */
typedef struct vshi_gltf_pose {
    const double *weights; /* of the morph targets */
    size_t weight_count;
    const double (*joints)[12]; /* world × inverse bind matrix of each joint of the skin; NULL: none */
    size_t joint_count;
} vshi_gltf_pose;

/* Reads a primitive into a shape of zeros, which stays so if it has no triangles. `where` names it. */
vsh_result vshi_gltf_read_primitive(vshi_gltf *gltf, const json_t *primitive, const vshi_gltf_pose *pose,
                                    const char *where, vshi_model_shape *shape, vsh_error *error);

/* Returns the material of a primitive; SIZE_MAX: none, or a missing one. */
size_t vshi_gltf_material(const vshi_gltf *gltf, const json_t *primitive);

/* Modes of primitives that are triangles. */
enum { VSHI_GLTF_TRIANGLES = 4, VSHI_GLTF_STRIP = 5, VSHI_GLTF_FAN = 6 };

/* Reads the corners of a primitive's triangles, each < `vertex_count`, into new memory; free it after an
 * error too. Strips and fans become lists, without triangles of fewer than three vertices. */
vsh_result vshi_gltf_read_triangles(vshi_gltf *gltf, const json_t *primitive, size_t mode,
                                    size_t vertex_count, const char *where, uint32_t **corners,
                                    size_t *triangle_count, vsh_error *error);

/* Reads an attribute of `components` floats a vertex into new memory; NULL if it is absent. */
vsh_result vshi_gltf_read_attribute(vshi_gltf *gltf, const json_t *attributes, const char *name,
                                    int components, size_t vertex_count, const char *where, float **values,
                                    vsh_error *error);

/* Decodes the data of KHR_draco_mesh_compression. Free it with vshi_importers()->draco_free(). */
vsh_result vshi_gltf_decode_draco(vshi_gltf *gltf, const json_t *extension, const char *where,
                                  vshi_draco **mesh, vsh_error *error);

/* Copies the corners of the decoded triangles, each < vertex_count, into new memory. */
vsh_result vshi_gltf_draco_indices(vshi_gltf *gltf, const vshi_draco *mesh, const char *where,
                                   uint32_t **indices, vsh_error *error);

/* --- nodes (gltf.c) */

/* The parts of a transform: keys of a node, accessors of EXT_mesh_gpu_instancing. */
enum { VSHI_GLTF_PARTS = 3 };
typedef struct vshi_gltf_part {
    const char *attribute, *key;
    int components;
} vshi_gltf_part;
extern const vshi_gltf_part vshi_gltf_parts[VSHI_GLTF_PARTS];

/* Reads each part of the extension into new memory; NULL if it is absent. Free them after an error too.
 * Errors: VSH_ERROR_INPUT (all are absent, or their lengths differ), VSH_ERROR_MEMORY. */
vsh_result vshi_gltf_read_instances(vshi_gltf *gltf, const json_t *instancing, const char *where,
                                    float *values[VSHI_GLTF_PARTS], size_t *count, vsh_error *error);

/* --- materials (gltf_material.c) */

/* Reads all materials, and the images of those that are not opaque. */
vsh_result vshi_gltf_read_materials(vshi_gltf *gltf, vsh_error *error);

/* Whether the textures of a material transform the UVs of a set. */
typedef enum vshi_gltf_uvs {
    VSHI_GLTF_UVS_PLAIN,  /* no texture transforms the set */
    VSHI_GLTF_UVS_PACKED, /* all textures of the set have one transform */
    VSHI_GLTF_UVS_MIXED   /* their transforms differ */
} vshi_gltf_uvs;

/* The transform that turns a packer's integers back into UVs (KHR_texture_transform). */
typedef struct vshi_gltf_unpacking {
    vshi_gltf_uvs uvs;
    bool found;              /* the search is done */
    double transform[6];     /* of PACKED: rows (a, b, c), (d, e, f), v down */
    const json_t *extension; /* with the transform */
} vshi_gltf_unpacking;

vshi_gltf_unpacking vshi_gltf_find_unpacking(const vshi_gltf *gltf, size_t material, size_t set);

/* Finds the image with the alpha of a material that is not opaque; SIZE_MAX: none. Errors: VSH_ERROR_INPUT.
 */
vsh_result vshi_gltf_mask_image(const vshi_gltf *gltf, const json_t *material, size_t *image,
                                vsh_error *error);

/* --- the file (gltf.c) */

/* Whether a file is a glTF or GLB by its ending. */
bool vshi_is_gltf(const char *path);

/* Parses JSON into gltf->root, perhaps with a byte order mark before it, and zeros after it. Needs
 * gltf->path. Errors: as vsh_model_read(). */
vsh_result vshi_gltf_parse(vshi_gltf *gltf, const char *text, size_t size, vsh_error *error);

/* Parses the JSON of a glTF or GLB in `text`, and finds its binary chunk. Needs path, run and bytes_held of
 * `gltf`. Free root with json_decref(), and the buffers, after an error too. Errors: as vsh_model_read(). */
vsh_result vshi_gltf_open(vshi_gltf *gltf, const char *text, size_t size, vsh_error *error);
