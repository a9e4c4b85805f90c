/* glTF 2.0, read by the text of its specification (Khronos, "glTF 2.0 Specification", 2.0.1): what the files
 * gltf*.c know of the file that they read. Nothing in it is trusted: every index, offset and length is held
 * against what is there. */
#ifndef VSHI_CASTER_GLTF_H
#define VSHI_CASTER_GLTF_H

#include "extern/importers.h"
#include "model/model.h"

#include <jansson.h>
#include <stdbool.h>

/* Bytes of a buffer, or a part of one. */
typedef struct vshi_gltf_bytes {
    const unsigned char *at;
    size_t size;
} vshi_gltf_bytes;

typedef struct vshi_gltf_buffer {
    vshi_gltf_bytes bytes;
    unsigned char *owned; /* of what came from a URI; may be NULL */
    bool loaded;
} vshi_gltf_buffer;

typedef struct vshi_gltf {
    const char *path;
    const vsh_run *run;
    vshi_job *job;
    json_t *root;
    vshi_gltf_bytes chunk; /* the binary one of a GLB */
    bool binary;
    vshi_gltf_buffer *buffers;
    size_t buffer_count;
    vshi_gltf_buffer *views; /* what compressed ones unpack to */
    size_t view_count;
    double bytes_held; /* by buffers and the model, for the memory limit */

    vsh_model *model;
    size_t shape_capacity;
    size_t *mesh_shapes; /* first shape + 1 of each mesh that has been read as it is; 0: not yet */
    struct vshi_gltf_unpacking *unpackings; /* [materials][VSH_MAX_UV_SETS]; NULL: no UVs are packed */
    bool *node_seen;
    double (*node_world)[12]; /* of every node of the scene that has been visited */
    size_t node_count;
    size_t *visited; /* [visited_count] of these nodes, parents before children */
    size_t visited_count;
} vshi_gltf;

/* --- looking up (gltf.c) */

/* An element of an array of the root, NULL where there is none. */
const json_t *vshi_gltf_element(const vshi_gltf *gltf, const char *array, size_t index);

/* A whole number of at least 0; `fallback` where the key is absent; false where the value is anything else.
 */
bool vshi_gltf_count(const json_t *object, const char *key, size_t fallback, size_t *value);

/* An index into an array of the root that has such an element, or, where the key is absent, SIZE_MAX.
 * Errors: VSH_ERROR_INPUT, naming `where`. */
vsh_result vshi_gltf_index(const vshi_gltf *gltf, const json_t *object, const char *key, const char *array,
                           const char *where, size_t *index, vsh_error *error);

/* Up to `count` numbers of an array; values that are not there stay. False where one is no number. */
bool vshi_gltf_numbers(const json_t *object, const char *key, size_t count, double *values);

/* The object of an extension, or NULL. */
const json_t *vshi_gltf_extension(const json_t *object, const char *name);

/* Whether an extension's name is `pattern`, or begins so where that ends in "_". */
bool vshi_gltf_is_named(const char *name, const char *pattern);

vsh_result vshi_gltf_fail(const vshi_gltf *gltf, vsh_error *error, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Adds to what is held, and checks it against the memory limit. */
vsh_result vshi_gltf_hold(vshi_gltf *gltf, double bytes, vsh_error *error);

/* The same of count × size bytes, which it takes: as vshi_allocate(). */
vsh_result vshi_gltf_allocate(vshi_gltf *gltf, void **memory, size_t count, size_t size, vsh_error *error);

/* --- bytes (gltf_buffer.c) */

/* The bytes of buffer view `index`, and its stride (0: none). Reads the buffer where that is the first time.
 */
vsh_result vshi_gltf_view(vshi_gltf *gltf, size_t index, vshi_gltf_bytes *bytes, size_t *stride,
                          vsh_error *error);

/* Reads a file into new memory, to be freed after an error too. Messages begin with `name`. */
vsh_result vshi_gltf_read_file(vshi_gltf *gltf, const char *path, const char *name, unsigned char **bytes,
                               size_t *size, vsh_error *error);

/* Decodes a data URI into new memory. */
vsh_result vshi_gltf_read_data(vshi_gltf *gltf, const char *where, const char *uri, unsigned char **bytes,
                               size_t *size, vsh_error *error);

/* Reads all of buffer `index`, where it has not been. */
vsh_result vshi_gltf_load(vshi_gltf *gltf, size_t index, vsh_error *error);

void vshi_gltf_free_buffers(vshi_gltf *gltf);

/* --- accessors (gltf_buffer.c) */

enum {
    VSHI_GLTF_BYTE = 5120,
    VSHI_GLTF_UBYTE = 5121,
    VSHI_GLTF_SHORT = 5122,
    VSHI_GLTF_USHORT = 5123,
    VSHI_GLTF_UINT = 5125,
    VSHI_GLTF_FLOAT = 5126
};

/* Bytes of a component of a type VSHI_GLTF_…; 0 of every other. */
size_t vshi_gltf_component_size(int type);

/* The component at `at`, as it is. */
double vshi_gltf_component(const unsigned char *at, int type);

typedef struct vshi_gltf_accessor {
    size_t count;
    int components; /* 1 … 16 */
    int type;       /* VSHI_GLTF_… */
    bool normalized;
    const unsigned char *at; /* of the first element; NULL: all are 0 */
    size_t stride;
    size_t sparse_count; /* elements that are replaced */
    const unsigned char *sparse_at, *sparse_values;
    int sparse_type;
} vshi_gltf_accessor;

/* Looks accessor `index` up, and checks that all of it is there. */
vsh_result vshi_gltf_accessor_open(vshi_gltf *gltf, size_t index, vshi_gltf_accessor *accessor,
                                   vsh_error *error);

/* Opens the accessor that `key` of an object names; without one its count is 0. */
vsh_result vshi_gltf_accessor_find(vshi_gltf *gltf, const json_t *object, const char *key, const char *where,
                                   vshi_gltf_accessor *accessor, vsh_error *error);

/* Its elements as floats, `components` each; what is normalized is 0 … 1 or -1 … 1. */
void vshi_gltf_accessor_floats(const vshi_gltf_accessor *accessor, float *values);

/* Its elements as unsigned integers; the type is one. */
void vshi_gltf_accessor_integers(const vshi_gltf_accessor *accessor, uint32_t *values);

/* Its elements as they are, one behind the other. */
void vshi_gltf_accessor_bytes(const vshi_gltf_accessor *accessor, unsigned char *bytes);

/* --- meshes (gltf_primitive.c) */

/* What moves the vertices of a mesh that a node uses. All 0: nothing. */
typedef struct vshi_gltf_pose {
    const double *weights; /* of the morph targets */
    size_t weight_count;
    const double (*joints)[12]; /* world matrix × inverse bind matrix of each joint of the skin; NULL: none */
    size_t joint_count;
} vshi_gltf_pose;

/* Reads a primitive into a shape that is all 0; one that has no triangles stays so. `where` names it. */
vsh_result vshi_gltf_read_primitive(vshi_gltf *gltf, const json_t *primitive, const vshi_gltf_pose *pose,
                                    const char *where, vshi_model_shape *shape, vsh_error *error);

/* The material of a primitive; SIZE_MAX: none, or one that is not there. */
size_t vshi_gltf_material(const vshi_gltf *gltf, const json_t *primitive);

/* Modes of primitives that are triangles. */
enum { VSHI_GLTF_TRIANGLES = 4, VSHI_GLTF_STRIP = 5, VSHI_GLTF_FAN = 6 };

/* Reads the corners of a primitive's triangles, each < `vertex_count`, into new memory; *corners is to be
 * freed after a failure too. Strips and fans become lists, without the triangles of fewer than three vertices
 * that join strips. */
vsh_result vshi_gltf_read_triangles(vshi_gltf *gltf, const json_t *primitive, size_t mode,
                                    size_t vertex_count, const char *where, uint32_t **corners,
                                    size_t *triangle_count, vsh_error *error);

/* Reads an attribute of `components` floats that has an element a vertex, into new memory. */
vsh_result vshi_gltf_read_attribute(vshi_gltf *gltf, const json_t *attributes, const char *name,
                                    int components, size_t vertex_count, const char *where, float **values,
                                    vsh_error *error);

/* Decodes the data of KHR_draco_mesh_compression, for vshi_importers()->draco_free(). */
vsh_result vshi_gltf_decode_draco(vshi_gltf *gltf, const json_t *extension, const char *where,
                                  vshi_draco **mesh, vsh_error *error);

/* Copies the corners of the decoded triangles, each < vertex_count, into new memory. */
vsh_result vshi_gltf_draco_indices(vshi_gltf *gltf, const vshi_draco *mesh, const char *where,
                                   uint32_t **indices, vsh_error *error);

/* --- nodes (gltf_nodes.c) */

/* Adds what the file's scene shows to the model. */
vsh_result vshi_gltf_add_scene(vshi_gltf *gltf, vsh_error *error);

/* The parts of a transform, as keys of a node and as accessors of EXT_mesh_gpu_instancing. */
enum { VSHI_GLTF_PARTS = 3 };
typedef struct vshi_gltf_part {
    const char *attribute, *key;
    int components;
} vshi_gltf_part;
extern const vshi_gltf_part vshi_gltf_parts[VSHI_GLTF_PARTS];

/* Reads the values of the extension, in new memory each, also after an error; NULL where a part is not given.
 * Errors: VSH_ERROR_INPUT (none is given, or they differ in length), VSH_ERROR_MEMORY. */
vsh_result vshi_gltf_read_instances(vshi_gltf *gltf, const json_t *instancing, const char *where,
                                    float *values[VSHI_GLTF_PARTS], size_t *count, vsh_error *error);

/* Reads all materials, and the images of masked ones (gltf_material.c). */
vsh_result vshi_gltf_read_materials(vshi_gltf *gltf, vsh_error *error);

/* Whether the textures of a material transform the UVs of a set. */
typedef enum vshi_gltf_uvs {
    VSHI_GLTF_UVS_PLAIN,  /* no texture is in the set, or none transforms it */
    VSHI_GLTF_UVS_PACKED, /* all have one transform */
    VSHI_GLTF_UVS_MIXED   /* their transforms differ */
} vshi_gltf_uvs;

/* The transform that turns a packer's integers back into UVs (KHR_texture_transform). */
typedef struct vshi_gltf_unpacking {
    vshi_gltf_uvs uvs;
    bool looked;         /* it has been found */
    double transform[6]; /* of PACKED: rows (a, b, c), (d, e, f), v down */
    const json_t *told;  /* the extension that holds it */
} vshi_gltf_unpacking;

vshi_gltf_unpacking vshi_gltf_find_unpacking(const vshi_gltf *gltf, size_t material, size_t set);

/* The image that a material which is not opaque has its alpha of; SIZE_MAX: none. Errors: VSH_ERROR_INPUT. */
vsh_result vshi_gltf_mask_image(const vshi_gltf *gltf, const json_t *material, size_t *image,
                                vsh_error *error);

/* --- the file (gltf.c) */

/* Whether a file is one by its ending (model_file.c). */
bool vshi_is_gltf(const char *path);

/* Parses the JSON itself into gltf->root, perhaps with a mark before it and zeros behind; of `gltf`, path is
 * given. Errors: as vsh_model_read(). */
vsh_result vshi_gltf_parse(vshi_gltf *gltf, const char *text, size_t size, vsh_error *error);

/* Parses the JSON of a glTF or GLB of `size` bytes that lie at `text`, and finds its binary chunk; of `gltf`,
 * path, run and bytes_held are given. Free root with json_decref(), and buffers, after a failure too. Errors:
 * as vsh_model_read(). */
vsh_result vshi_gltf_open(vshi_gltf *gltf, const char *text, size_t size, vsh_error *error);

/* Reads a glTF or GLB of `size` bytes that lie at `text`. Errors: as vsh_model_read(). */
vsh_result vshi_gltf_read(const char *path, const char *text, size_t size, const vsh_run *run, vshi_job *job,
                          vsh_model **model, vsh_error *error);

#endif
