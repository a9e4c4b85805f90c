/* A glTF that is kept whole while parts of it are changed: its JSON, its buffers as they were, and what is
 * added behind them. What the file says is read by the functions of model/gltf.h and trusted as little as
 * there. */
#ifndef VSHI_LIT_DOCUMENT_H
#define VSHI_LIT_DOCUMENT_H

#include "model/gltf.h"

#include <vdbshade/lit.h>

/* Bytes that grow, from malloc. */
typedef struct vshi_lit_bytes {
    unsigned char *at;
    size_t size, capacity;
} vshi_lit_bytes;

/* Bytes begin … end - 1 of a buffer. */
typedef struct vshi_lit_range {
    size_t buffer, begin, end;
} vshi_lit_range;

typedef struct vshi_lit_document {
    vshi_gltf
        gltf;   /* path, root, buffers: as they were read; arrays of the root only grow until it is written */
    char *text; /* of the file: the binary chunk lies in it. NULL: made of a model */
    vshi_lit_bytes added;
    size_t first_view;       /* buffer views from this one on lie in `added` */
    bool *replaced;          /* [first_view]: views in front of it that do too; NULL: none */
    vshi_lit_range *dropped; /* [dropped_count], sorted: bytes of buffers that nothing needs any more */
    size_t dropped_count;
    json_t *own_images; /* the file's own, in their places; NULL: none */
} vshi_lit_document;

/* Reads a glTF or GLB without its buffers. Close after a failure too. Errors: as vsh_model_read(). */
vsh_result vshi_lit_open(vshi_lit_document *document, const char *path, const vsh_run *run, vshi_job *job,
                         vsh_error *error);

/* Begins an empty one, which messages call `path`. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_lit_begin(vshi_lit_document *document, const char *path, const vsh_run *run, vshi_job *job,
                          vsh_error *error);
void vshi_lit_close(vshi_lit_document *document);

/* VSH_ERROR_MEMORY. */
vsh_result vshi_lit_no_memory(const vshi_lit_document *document, vsh_error *error);

/* --- JSON; what is handed to them belongs to them, and may be NULL where memory is short */

/* Appends to an array of the root, which is made where there is none; *index is its place. Errors:
 * VSH_ERROR_INPUT (the root has something else there), VSH_ERROR_MEMORY. */
vsh_result vshi_lit_append(vshi_lit_document *document, const char *array, json_t *value, size_t *index,
                           vsh_error *error);
vsh_result vshi_lit_set(const vshi_lit_document *document, json_t *object, const char *key, json_t *value,
                        vsh_error *error);

vsh_result vshi_lit_set_number(const vshi_lit_document *document, json_t *object, const char *key,
                               size_t number, vsh_error *error);

/* Member `key` of an object, which is made where there is none. Errors: VSH_ERROR_INPUT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_object(const vshi_lit_document *document, json_t *object, const char *key,
                           json_t **member, vsh_error *error);

/* Adds a name to extensionsUsed, where it is not in it. */
vsh_result vshi_lit_use_extension(vshi_lit_document *document, const char *name, vsh_error *error);

/* Takes a name out of extensionsUsed and extensionsRequired, and either away where that was its last. */
void vshi_lit_drop_extension(vshi_lit_document *document, const char *name);

/* Gives *list (a pointer to a pointer) room for one element more than `count`. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_lit_grow(const vshi_lit_document *document, void *list, size_t count, size_t *capacity,
                         size_t size, vsh_error *error);

/* --- bytes */

/* Adds a buffer view of `size` bytes, zeros where `bytes` is NULL; *offset (may be NULL) is where they lie in
 * document->added. `target`: 34962 of vertices, 34963 of indices; 0: none. `stride`: 0: none. Errors:
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_add_view(vshi_lit_document *document, const void *bytes, size_t size, int target,
                             size_t stride, size_t *view, size_t *offset, vsh_error *error);

enum { VSHI_LIT_VERTICES = 34962, VSHI_LIT_INDICES = 34963 };

/* Adds an accessor of floats, `components` (1 … 4, or 16) each, to a new view; `values` may be NULL: zeros.
 */
vsh_result vshi_lit_add_floats(vshi_lit_document *document, const float *values, size_t count, int components,
                               bool bounds, size_t *accessor, size_t *offset, vsh_error *error);

/* Sets an accessor's least and largest values. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_lit_set_bounds(const vshi_lit_document *document, json_t *accessor,
                               const vshi_gltf_accessor *values, vsh_error *error);

/* Adds indices below `vertex_count`, as shorts where that lets. */
vsh_result vshi_lit_add_indices(vshi_lit_document *document, const uint32_t *indices, size_t count,
                                size_t vertex_count, size_t *accessor, vsh_error *error);

#endif
