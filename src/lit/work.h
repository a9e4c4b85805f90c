/* The state of a lit document while it is made. */
#ifndef VSHI_LIT_WORK_H
#define VSHI_LIT_WORK_H

#include "lit/document.h"
#include "sandbox/reader.h"

#include <stdio.h>

/* --- primitives under KHR_draco_mesh_compression (draco.c): decoded whole, every attribute in the type of
 * its accessor. By the reader's process, where there is one: Draco is a large decoder of strangers' bytes. */

typedef struct vshi_lit_draco_attribute {
    uint64_t id; /* as the extension names it */
    int type;    /* VSHI_GLTF_… */
    int components;
    unsigned char *values; /* [vertex_count][components] */
} vshi_lit_draco_attribute;

typedef struct vshi_lit_draco {
    size_t mesh, primitive;
    size_t vertex_count, triangle_count;
    uint32_t *indices; /* [triangle_count][3], each < vertex_count */
    vshi_lit_draco_attribute *attributes;
    size_t attribute_count;
} vshi_lit_draco;

/* All of a document's. */
typedef struct vshi_lit_dracos {
    vshi_lit_draco *list;
    size_t count;
    bool borrowed;      /* arrays lie in `answer`, else each is its own */
    vshi_answer answer; /* the reader's; its map may be NULL */
} vshi_lit_dracos;

/* Decodes them; none where the document has none. Free after a failure too. Errors: VSH_ERROR_INPUT,
 * VSH_ERROR_READ, VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_lit_dracos_read(vshi_lit_document *document, vshi_lit_dracos *dracos, vsh_error *error);
void vshi_lit_dracos_free(vshi_lit_dracos *dracos);

/* That of a primitive, or NULL. */
const vshi_lit_draco *vshi_lit_draco_of(const vshi_lit_dracos *dracos, size_t mesh, size_t primitive);

/* The attribute that the extension of `primitive` has under `name`, or NULL. */
const vshi_lit_draco_attribute *vshi_lit_draco_attribute_of(const vshi_lit_draco *draco,
                                                            const json_t *primitive, const char *name);

/* Takes a reader's answer for dracos->list[count], whose places are known, and checks everything in it.
 * The arrays are those of the message, which must outlive them. Errors: VSH_ERROR_READ, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_dracos_decode(vshi_decoder *decoder, const char *path, vshi_lit_dracos *dracos,
                                  vsh_error *error);

/* Decodes in a reader, and puts what is handed over. */
vsh_result vshi_serve_draco(const char *path, vshi_decoder *request, const vsh_run *run,
                            vshi_encoder *payload, vsh_error *error);

/* --- materials (materials.c) */

/* What a primitive is to be shown by: a material of the file with the images of a page, in a set of UVs. */
typedef struct vshi_lit_look {
    size_t material; /* SIZE_MAX: none, which is a white one */
    uint32_t page;
    size_t set;
    json_t *transform; /* KHR_texture_transform of the set's UVs; NULL: none */
    size_t made;       /* the material that shows it; SIZE_MAX: not yet, or none */
} vshi_lit_look;

typedef struct vshi_lit_looks {
    vshi_lit_look *list;
    size_t count, capacity;
} vshi_lit_looks;

/* --- primitives (primitive.c) */

/* Vertices of a primitive that an atlas has split, for its other instances. */
typedef struct vshi_lit_split {
    size_t mesh, primitive; /* of the file */
    const vsh_lit_mesh *lit;
    size_t indices; /* accessor of all triangles; SIZE_MAX: not made */
} vshi_lit_split;

/* An accessor, and the one that its elements were copied to for a split: each once, whatever uses it. */
typedef struct vshi_lit_copy {
    size_t split, from, to;
} vshi_lit_copy;

/* A new UV set of primitives that keep their vertices. Primitives with the same accessor of positions share
 * one of UVs where their UVs agree, because each needs the accessor's full length. */
typedef struct vshi_lit_uvs {
    size_t positions; /* accessor of the vertices' positions */
    size_t count;     /* elements */
    size_t accessor;
    size_t offset; /* where its values begin in the added bytes */
    bool *set;     /* [count] */
} vshi_lit_uvs;

/* --- all of it */

/* The images of a page. */
typedef struct vshi_lit_page_images {
    size_t textures[VSH_LIT_PURPOSES]; /* 1 + the number of each; 0: none */
    double intensity;                  /* of the lightmap */
} vshi_lit_page_images;

typedef struct vshi_lit_work {
    vshi_lit_document document;
    const vsh_model *model;
    const vsh_lit_mesh *meshes; /* [entries of the model] */
    const vsh_lit_options *options;
    const char *output;
    const char *path; /* of the model's file; NULL: none */
    const vsh_run *run;
    vshi_job *job;
    vshi_lit_page_images *pages; /* [page_count] */
    size_t page_count;           /* 1 + the highest page */
    vshi_lit_dracos dracos;
    vshi_lit_looks looks;
    vshi_lit_uvs *uvs; /* [uv_count] */
    vshi_lit_split *splits;
    vshi_lit_copy *copies;
    size_t uv_count, uv_capacity, split_count, split_capacity, copy_count, copy_capacity;
} vshi_lit_work;

/* The page of triangle t of a mesh; VSH_LIT_NO_CHART: any. */
static inline uint32_t vshi_lit_page(const vshi_lit_work *work, const vsh_lit_mesh *mesh, size_t t) {
    return mesh->charts == NULL                  ? mesh->page
           : mesh->charts[t] == VSH_LIT_NO_CHART ? VSH_LIT_NO_CHART
                                                 : work->options->chart_pages[mesh->charts[t]];
}

enum { VSHI_LIT_NAME_BYTES = 200 }; /* of a page, in names of files */

/* Checks that no primitive names a material that is not there: marks are told from these. Errors:
 * VSH_ERROR_INPUT. */
vsh_result vshi_lit_materials_check(vshi_lit_work *work, vsh_error *error);

/* Marks a primitive and its variants for a page and a set: "material" becomes the look's number, negative
 * until vshi_lit_materials_apply(). `transform` (KHR_texture_transform) maps the set to the page; NULL: none.
 */
vsh_result vshi_lit_mark_primitive(vshi_lit_work *work, json_t *primitive, uint32_t page, size_t set,
                                   json_t *transform, vsh_error *error);

/* Whether holes and glass of a material are in its base colour's texture, so that no preview replaces that.
 */
bool vshi_lit_is_cut_by_texture(const json_t *material);

/* Makes the materials of all looks, and puts them into the primitives of the root's meshes. A material that
 * nothing else uses is changed where it is. Errors: VSH_ERROR_INPUT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_materials_apply(vshi_lit_work *work, vsh_error *error);

/* Appends to `list` what becomes of primitive `primitive` of mesh `mesh`, which the model's mesh `entry` is:
 * itself, or one for each page. */
vsh_result vshi_lit_primitive_make(vshi_lit_work *work, size_t mesh, size_t primitive, size_t entry,
                                   json_t *list, vsh_error *error);

/* Whether two atlases have split a mesh into the same vertices and triangles. */
bool vshi_lit_is_split_alike(const vsh_lit_mesh *a, const vsh_lit_mesh *b);

/* The set of UVs that engines use for lightmaps. */
enum { VSHI_LIT_SET = 1 };

/* Removes the sets of a primitive that new UVs of `mesh` replace, and finds the set that they become. That is
 * the first that is VSHI_LIT_SET or of an earlier bake, if no remaining texture uses it; else one more set.
 * Errors: VSH_ERROR_LIMIT (VSH_MAX_UV_SETS). */
vsh_result vshi_lit_choose_set(const vshi_lit_work *work, json_t *primitive, const vsh_lit_mesh *mesh,
                               const char *where, size_t *set, vsh_error *error);

/* Notes in a primitive's extras that a set was made, for the next time. */
vsh_result vshi_lit_tell_set(vshi_lit_document *document, json_t *primitive, size_t set, vsh_error *error);

/* Appends to `list` a primitive for each page of `mesh`, copies of `made`, whose indices are set: those of
 * triangle t are corners[t]. `whole`: an accessor of all of them, used where there is one page; SIZE_MAX: a
 * new one. Marks them. */
vsh_result vshi_lit_pages_make(vshi_lit_work *work, const json_t *made, const vsh_lit_mesh *mesh,
                               const uint32_t *corners, size_t vertex_count, size_t set, size_t *whole,
                               json_t *list, vsh_error *error);

/* Gives nodes the meshes that they show lit. (nodes.c) */
vsh_result vshi_lit_nodes_make(vshi_lit_work *work, vsh_error *error);

/* Fills the document with what the model holds, lit. (from_model.c) */
vsh_result vshi_lit_from_model(vshi_lit_work *work, vsh_error *error);

/* --- images: baked ones, and those that the file names (images.c) */

/* A file that stands beside the document. */
typedef struct vshi_lit_beside {
    char *name;        /* without a folder: in the document's */
    const void *bytes; /* [size] */
    size_t size;
    unsigned char *owned; /* NULL: they are the caller's */
} vshi_lit_beside;

typedef struct vshi_lit_besides {
    vshi_lit_beside *list; /* [count] */
    size_t count;
} vshi_lit_besides;

void vshi_lit_besides_free(vshi_lit_besides *besides);

/* Adds an image and a texture for each image that was baked, into the buffer or (embed false) to `besides`,
 * which is freed after a failure too. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_lit_images_add(vshi_lit_work *work, bool embed, vshi_lit_besides *besides, vsh_error *error);

/* Takes the file's own images that stay and that it names beside it into the buffer, where the document moves
 * to another folder. An image that cannot be read keeps its name, with a warning. Errors: VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY. */
vsh_result vshi_lit_images_bring(vshi_lit_work *work, vsh_error *error);

/* A file's name as a URI; NULL where memory is short. */
json_t *vshi_lit_uri(const char *name);

/* Name of a file beside the output: the output's without its ending, then `mark` and `ending`. If an input
 * file has that name, a number stands before the ending. Free it with free(). Errors: VSH_ERROR_MEMORY,
 * VSH_ERROR_ARGUMENT. */
vsh_result vshi_lit_beside_name(const vshi_lit_work *work, const char *mark, const char *ending, char **name,
                                vsh_error *error);

bool vshi_lit_is_same_file(const char *a, const char *b);

/* Fails where a path is one of a file that the input is made of. Errors: VSH_ERROR_ARGUMENT,
 * VSH_ERROR_MEMORY.
 */
vsh_result vshi_lit_check_replaced(const vshi_lit_document *document, const char *path, vsh_error *error);

/* --- files (write.c) */

/* Writes the document and what stands beside it, all under temporary names first. The document is of no use
 * afterwards. Errors: as vsh_lit_write(). */
vsh_result vshi_lit_write_files(vshi_lit_work *work, const vshi_lit_besides *besides, vsh_error *error);

/* --- OBJ, with its materials in a file beside it (obj.c) */

bool vshi_lit_is_obj(const char *path);

/* Refuses options that an OBJ cannot show. Errors: VSH_ERROR_ARGUMENT. */
vsh_result vshi_lit_obj_check(const vshi_lit_work *work, vsh_error *error);

/* Writes the model's meshes in the world. With images or several pages, each page gets a "usemtl page_N".
 * `mtl`: name of the MTL file, or NULL. Errors: VSH_ERROR_CANCELLED. */
vsh_result vshi_lit_put_obj(const vshi_lit_work *work, const char *mtl, FILE *to, vsh_error *error);

/* Its materials: one a page, white, shown by its image. */
void vshi_lit_put_mtl(const vshi_lit_work *work, const vshi_lit_besides *besides, FILE *to);

/* Fails if the file exists and vdbshade did not write it. */
vsh_result vshi_lit_mtl_check(const char *path, vsh_error *error);

/* --- removing unused items (prune.c) */

/* Tells of a texture that it was made for light, for the next time: its extras say "vdbshade_texture". It
 * goes with its image and sampler once no material shows it; the file's own textures stay. NULL where memory
 * is short. */
json_t *vshi_lit_texture_mark(const char *purpose);

/* Which accessors, buffer views, textures, images and samplers something refers to. */
enum { VSHI_LIT_KINDS = 5 };
typedef struct vshi_lit_uses {
    bool *used[VSHI_LIT_KINDS]; /* [count] each */
    size_t count[VSHI_LIT_KINDS];
} vshi_lit_uses;

/* Finds them. Free after a failure too. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_uses_find(vshi_lit_document *document, vshi_lit_uses *uses, vsh_error *error);
void vshi_lit_uses_free(vshi_lit_uses *uses);

/* Puts new accessors, buffer views, textures, images and samplers in the places of unused ones, and cuts
 * unused ones off the end of a list. Other items keep their numbers. Lists the bytes that only unused ones
 * had (document->dropped). Of textures only those go that a bake made. Does nothing where an
 * extension that is not known may refer to them. `before` is used up. Errors: VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY. */
vsh_result vshi_lit_prune(vshi_lit_document *document, vshi_lit_uses *before, vsh_error *error);

#endif
