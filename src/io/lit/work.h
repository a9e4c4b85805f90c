/* An asset with its light, while vsh_lit_write() makes it. A glTF is kept whole while parts of it change: its
 * buffers stay as they are, and new bytes are added behind them. The functions of io/model/gltf.h read it,
 * and trust nothing in it. */
#pragma once

#include "base/file.h"
#include "base/memory.h"
#include "io/model/gltf.h"
#include "io/reader/reader.h"

#include <stdio.h>
#include <vdbshade/scene.h>

/* --- the state */

typedef struct vshi_lit_draco_attribute {
    uint64_t id; /* as the extension names it */
    int type;    /* of the accessor, VSHI_GLTF_… */
    int components;
    unsigned char *values; /* [vertex_count][components] */
} vshi_lit_draco_attribute;

/* A primitive under KHR_draco_mesh_compression, decoded. */
typedef struct vshi_lit_draco {
    size_t mesh, primitive;
    size_t vertex_count, triangle_count;
    uint32_t *indices; /* [triangle_count][3], each < vertex_count */
    vshi_lit_draco_attribute *attributes;
    size_t attribute_count;
} vshi_lit_draco;

typedef struct vshi_lit_dracos {
    vshi_lit_draco *list;
    size_t count;
    bool borrowed;      /* arrays lie in `answer`, else each is allocated */
    vshi_answer answer; /* the reader's; its map may be NULL */
} vshi_lit_dracos;

/* The look of a primitive: a material of the file with the images of a page, in a set of UVs. */
typedef struct vshi_lit_look {
    size_t material; /* SIZE_MAX: none, which is white */
    uint32_t page;
    size_t set;
    json_t *transform; /* KHR_texture_transform of the set's UVs; NULL: none */
    size_t made;       /* the new material; SIZE_MAX: not yet, or none */
} vshi_lit_look;

/* The vertices of a primitive that an atlas has split, for its other instances. */
typedef struct vshi_lit_split {
    size_t mesh, primitive; /* of the file */
    const vsh_lit_mesh *lit;
    size_t indices; /* accessor of all triangles; SIZE_MAX: not made */
} vshi_lit_split;

/* An accessor and its copy for a split, which is made once. */
typedef struct vshi_lit_copy {
    size_t split, from, to;
} vshi_lit_copy;

/* A new UV set, or vertex colours, of primitives that keep their vertices. It has the full length of the
 * accessor of positions, so primitives with the same positions share it if their UVs agree. */
typedef struct vshi_lit_uvs {
    size_t positions; /* accessor */
    size_t count;     /* elements */
    size_t accessor;
    size_t offset; /* its values begin here in the added bytes */
    bool *set;     /* [count] */
    bool colors;   /* vertex colours, which take as many bytes */
} vshi_lit_uvs;

enum { VSHI_LIT_PURPOSES = 3 }; /* of vsh_lit_purpose */

/* The images of a page. */
typedef struct vshi_lit_page_images {
    size_t textures[VSHI_LIT_PURPOSES]; /* 1 + the texture of each purpose; 0: none */
    double intensity;                   /* of the lightmap */
    bool unlit;                         /* vertex colours alone light it */
} vshi_lit_page_images;

typedef struct vshi_lit_work {
    const vsh_model *model;
    const char *model_path;     /* NULL: none */
    const vsh_lit_mesh *meshes; /* [entries of the model] */
    const vsh_lit_options *options;
    const char *output;
    vshi_lit_page_images *pages; /* [page_count + 1]: the last is that of vertex colours */
    size_t page_count;           /* 1 + the highest page */
    vshi_gltf gltf;              /* arrays of its root only grow until it is written */
    char *text;         /* of the file, with the binary chunk; NULL: the document is made of the model */
    json_t *own_images; /* the file's own, in their places; NULL: none */
    bool pruned;        /* bytes outside of all buffer views may be dropped */
    bool refused;       /* memory for the JSON was refused: the document must not be written */
    vshi_lit_dracos dracos;
    struct {
        unsigned char *list;
        size_t count, room;
    } added; /* new bytes, which are buffer gltf.buffer_count until all buffers become one */
    struct {
        vshi_lit_look *list;
        size_t count, room;
    } looks;
    struct {
        vshi_lit_uvs *list;
        size_t count, room;
    } uvs;
    struct {
        vshi_lit_split *list;
        size_t count, room;
    } splits;
    struct {
        vshi_lit_copy *list;
        size_t count, room;
    } copies;
} vshi_lit_work;

enum { VSHI_LIT_NAME_BYTES = 200 }; /* most bytes of a page's name */

/* The page of triangle t of a mesh; VSH_NO_CHART: any. */
static inline uint32_t vshi_page_of_triangle(const vshi_lit_work *work, const vsh_lit_mesh *mesh, size_t t) {
    return mesh->charts == NULL              ? mesh->page
           : mesh->charts[t] == VSH_NO_CHART ? VSH_NO_CHART
                                             : work->options->chart_pages[mesh->charts[t]];
}

/* --- the document (document.c) */

/* Reads the glTF or GLB at work->gltf.path without its buffers, *size bytes. Errors: as vsh_model_read(). */
vsh_result vshi_lit_read(vshi_lit_work *work, size_t *size, vsh_error *error);

/* Reads it to be changed. */
vsh_result vshi_lit_open(vshi_lit_work *work, vsh_error *error);

/* Begins an empty document. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_lit_begin(vshi_lit_work *work, vsh_error *error);

/* Frees everything that the work owns. */
void vshi_lit_work_free(vshi_lit_work *work);

/* Allocates arrays within the memory limit, as VSHI_ALLOCATE_BLOCK() does: free() of the first one frees
 * them. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_allocate(vshi_lit_work *work, const vshi_array *arrays, size_t count, vsh_error *error);
#define VSHI_LIT_ALLOCATE(work, arrays, error)                                                               \
    vshi_lit_allocate(work, arrays, sizeof(arrays) / sizeof *(arrays), error)

/* JSON. Without memory these functions set work->refused and continue; the caller checks it once. They own
 * the values that they get. Values, and the objects or lists for them, may be NULL after a refusal. */

void vshi_lit_set(vshi_lit_work *work, json_t *object, const char *key, json_t *value);
void vshi_lit_set_number(vshi_lit_work *work, json_t *object, const char *key, size_t number);

/* Appends to a list. */
void vshi_lit_push(vshi_lit_work *work, json_t *list, json_t *value);

/* Appends to an array of the root, which is made if absent. Returns the item's index. */
size_t vshi_lit_append(vshi_lit_work *work, const char *array, json_t *value);

/* A new list of numbers. */
json_t *vshi_lit_list_numbers(vshi_lit_work *work, const double *values, size_t count);

/* A deep copy; NULL stays NULL. */
json_t *vshi_lit_copy_json(vshi_lit_work *work, const json_t *json);

/* Any bytes as a JSON text; NULL without memory. */
json_t *vshi_lit_text(const char *text);

/* Finds the object `key` of an object, which is made if absent. Errors: VSH_ERROR_INPUT (not an object),
 * VSH_ERROR_MEMORY. */
vsh_result vshi_lit_find_object(vshi_lit_work *work, json_t *object, const char *key, json_t **member,
                                vsh_error *error);

/* Adds a name to extensionsUsed. */
void vshi_lit_use_extension(vshi_lit_work *work, const char *name);

/* Removes an extension from an object, and "extensions" with the last one. */
void vshi_lit_remove_extension(json_t *object, const char *name);

/* Removes the name of an extension from extensionsUsed and extensionsRequired, if nothing has it any more. */
void vshi_lit_drop_extension(vshi_lit_work *work, const char *name);

/* Bytes. */

enum { VSHI_LIT_VERTICES = 34962, VSHI_LIT_INDICES = 34963 };

/* Adds a buffer view of `size` bytes, zeros if `bytes` is NULL, at the end of work->added. `target`:
 * VSHI_LIT_…; 0: none. `stride`: 0: none. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_add_view(vshi_lit_work *work, const void *bytes, size_t size, int target, size_t stride,
                             size_t *view, vsh_error *error);

/* Adds an accessor of floats, `components` (1 … 4) each, with a new view; zeros if `values` is NULL.
 * `bounds`: sets its least and largest values. Errors: as vshi_lit_add_view(). */
vsh_result vshi_lit_add_floats(vshi_lit_work *work, const float *values, size_t count, int components,
                               bool bounds, size_t *accessor, vsh_error *error);

/* Adds an accessor of vertex colours, VSHI_LIT_COLOR_BYTES each (RGBA, normalized shorts), zeros if `values`
 * is NULL. Errors: as vshi_lit_add_view(). */
enum { VSHI_LIT_COLOR_BYTES = 4 * sizeof(uint16_t) };
vsh_result vshi_lit_add_colors(vshi_lit_work *work, const void *values, size_t count, size_t *accessor,
                               vsh_error *error);

/* The name of these accessors, by which the next bake knows them. */
#define VSHI_LIT_COLORS "vdbshade_vertex_colors"

/* Sets an accessor's least and largest values. */
void vshi_lit_set_bounds(vshi_lit_work *work, json_t *accessor, const vshi_gltf_accessor *values);

/* Adds indices below `vertex_count`, as shorts if that allows it. Errors: as vshi_lit_add_view(). */
vsh_result vshi_lit_add_indices(vshi_lit_work *work, const uint32_t *indices, size_t count,
                                size_t vertex_count, size_t *accessor, vsh_error *error);

/* --- Draco (draco.c): decoded in the reader's process, if there is one, because Draco is large and its bytes
 * are a stranger's */

/* Decodes all primitives under the extension into work->dracos. Errors: VSH_ERROR_INPUT, VSH_ERROR_READ,
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_lit_read_dracos(vshi_lit_work *work, vsh_error *error);
void vshi_lit_dracos_free(vshi_lit_dracos *dracos);

/* The decoded primitive, or NULL. */
const vshi_lit_draco *vshi_lit_find_draco(const vshi_lit_work *work, size_t mesh, size_t primitive);

/* The attribute that the extension of `primitive` has under `name`, or NULL. */
const vshi_lit_draco_attribute *vshi_lit_find_draco_attribute(const vshi_lit_draco *draco,
                                                              const json_t *primitive, const char *name);

/* Decodes a reader's answer for dracos->list[count], whose places are known, and checks all of it. The arrays
 * lie in the message, which must outlive them. Errors: VSH_ERROR_READ, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_dracos_decode(vshi_decoder *decoder, const char *path, vshi_lit_dracos *dracos,
                                  vsh_error *error);

/* Decodes in a reader, and encodes the result. */
vsh_result vshi_serve_draco(const char *path, vshi_decoder *request, const vsh_run *run,
                            vshi_encoder *payload, vsh_error *error);

/* --- images and materials (materials.c) */

/* Checks that every primitive's material exists: marks rely on it. Errors: VSH_ERROR_INPUT. */
vsh_result vshi_lit_check_materials(vshi_lit_work *work, vsh_error *error);

/* Marks a primitive and its variants for a page and a set: "material" becomes a negative number of the look,
 * until vshi_lit_apply_materials(). `transform` (KHR_texture_transform) maps the set to the page; NULL: none.
 */
vsh_result vshi_lit_mark_primitive(vshi_lit_work *work, json_t *primitive, uint32_t page, size_t set,
                                   json_t *transform, vsh_error *error);

/* Whether the base colour's texture holds the holes or glass of a material, so that no preview may replace
 * it. */
bool vshi_lit_is_cut_by_texture(const json_t *material);

/* Makes the materials of all looks, and gives them to the primitives. A material that nothing else uses is
 * changed in place. Errors: VSH_ERROR_INPUT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_apply_materials(vshi_lit_work *work, vsh_error *error);

/* A file beside the document. */
typedef struct vshi_lit_beside {
    char *name;        /* without a folder */
    const void *bytes; /* [size] */
    size_t size;
    unsigned char *owned; /* NULL: the bytes are the caller's */
} vshi_lit_beside;

typedef struct vshi_lit_besides {
    vshi_lit_beside *list; /* [count] */
    size_t count;
} vshi_lit_besides;

void vshi_lit_besides_free(vshi_lit_besides *besides);

/* Adds an image and a texture for each baked image, in the buffer or (embed false) in `besides`, which the
 * caller frees after a failure too. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_lit_add_images(vshi_lit_work *work, bool embed, vshi_lit_besides *besides, vsh_error *error);

/* Moves the file's own image files that remain into the buffer, if the document moves to another folder. An
 * image that cannot be read keeps its name, with a warning. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_bring_images(vshi_lit_work *work, vsh_error *error);

/* --- meshes */

/* The set of UVs that engines use for lightmaps. */
enum { VSHI_LIT_SET = 1 };

/* Gives nodes the meshes that they show lit. (nodes.c) */
vsh_result vshi_lit_make_nodes(vshi_lit_work *work, vsh_error *error);

/* Fills the document with the model, lit. (from_model.c) */
vsh_result vshi_lit_from_model(vshi_lit_work *work, vsh_error *error);

/* Appends the lit primitive to `list`: one, or one for each of its pages. `entry` is its mesh in the model.
 * (primitive.c, as the functions below) */
vsh_result vshi_lit_make_primitive(vshi_lit_work *work, size_t mesh, size_t primitive, size_t entry,
                                   json_t *list, vsh_error *error);

/* Whether two atlases have split a mesh into the same vertices and triangles. */
bool vshi_lit_is_split_alike(const vsh_lit_mesh *a, const vsh_lit_mesh *b);

/* Corners of a mesh's triangles, and its set of UVs. */
typedef struct vshi_lit_corners {
    const vsh_lit_mesh *mesh;
    const uint32_t *list; /* [triangle_count][3] */
    size_t vertex_count;
    size_t set;
} vshi_lit_corners;

/* Appends to `list` a marked copy of `made` with indices for each page. *whole: an accessor of all indices,
 * for meshes on one page; SIZE_MAX: made if needed. */
vsh_result vshi_lit_make_pages(vshi_lit_work *work, const json_t *made, const vshi_lit_corners *corners,
                               size_t *whole, json_t *list, vsh_error *error);

/* --- removing unused items (prune.c) */

/* Extras of a new texture, for the next bake: the texture is removed with its image and sampler once no
 * material shows it. The file's own textures stay. NULL without memory. */
json_t *vshi_lit_mark_texture(const char *purpose);

/* Removes accessors, buffer views, and marked textures that nothing refers to, and numbers the other items
 * anew. The last textures and images, one for each image of the options, stay. Does nothing if an unknown
 * extension may refer to items, else sets work->pruned. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_prune(vshi_lit_work *work, vsh_error *error);

/* --- files (write.c) */

bool vshi_lit_is_obj(const char *path);
bool vshi_lit_is_same_file(const char *a, const char *b);

/* Fails if a path is a file that the input consists of. Errors: VSH_ERROR_ARGUMENT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_check_replaced(const vshi_lit_work *work, const char *path, vsh_error *error);

/* Name of a file beside the output: the output's without its ending, then `mark` and `ending`. If an input
 * file has that name, a number stands before the ending. Free it with free(). Errors: VSH_ERROR_MEMORY,
 * VSH_ERROR_ARGUMENT. */
vsh_result vshi_lit_name_beside(const vshi_lit_work *work, const char *mark, const char *ending, char **name,
                                vsh_error *error);

/* A file's name as a URI; NULL without memory. */
json_t *vshi_lit_uri(const char *name);

/* A file that is written as a stream. The sink keeps the stream's failures. */
typedef struct vshi_lit_stream {
    const char *path;
    vshi_output output;
    vshi_sink sink;
    uint64_t written; /* to the sink */
    FILE *to;
} vshi_lit_stream;

/* Errors: as vshi_output_begin(). After success, end it. */
vsh_result vshi_lit_begin_stream(vshi_lit_stream *stream, const char *path, vsh_error *error);

/* Ends the stream, and leaves stream->output to be committed or abandoned. Returns `result` or, if that is
 * VSH_OK, whether all was written. Errors: VSH_ERROR_WRITE. */
vsh_result vshi_lit_end_stream(vshi_lit_stream *stream, vsh_result result, vsh_error *error);

/* Writes the document and the files beside it, all under temporary names first. The document is used up.
 * Errors: as vsh_lit_write(). */
vsh_result vshi_lit_write_files(vshi_lit_work *work, const vshi_lit_besides *besides, vsh_error *error);

/* Writes a model, unlit, as a GLB. Unlike in vsh_lit_write(), UV sets keep their numbers. Errors:
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_lit_write_model(const vsh_model *model, const char *path, const vsh_run *run, vshi_job *job,
                                FILE *to, vsh_error *error);
