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
    bool refused;       /* memory was refused to its JSON, which lacks something: it is not to be written */
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

/* --- JSON. Where memory is short these functions set document->refused and go on; the caller asks once. They
 * own the values that they get. Values, and what they are put into, may be NULL after a refusal. */

void vshi_lit_set(vshi_lit_document *document, json_t *object, const char *key, json_t *value);
void vshi_lit_set_number(vshi_lit_document *document, json_t *object, const char *key, size_t number);

/* Appends to a list. */
void vshi_lit_push(vshi_lit_document *document, json_t *list, json_t *value);

/* Appends to an array of the root, which is made where there is none. Returns the place there. */
size_t vshi_lit_append(vshi_lit_document *document, const char *array, json_t *value);

/* A new list of numbers. */
json_t *vshi_lit_numbers(vshi_lit_document *document, const double *values, size_t count);

/* A deep copy; NULL stays NULL. */
json_t *vshi_lit_copy_json(vshi_lit_document *document, const json_t *json);

/* Adds a name to extensionsUsed, where it is not in it. */
void vshi_lit_use_extension(vshi_lit_document *document, const char *name);

/* Member `key` of an object, which is made where there is none. Errors: VSH_ERROR_INPUT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_object(vshi_lit_document *document, json_t *object, const char *key, json_t **member,
                           vsh_error *error);

/* Takes an extension out of an object, and its member "extensions" where that was the last. */
void vshi_lit_remove_extension(json_t *object, const char *name);

/* Takes the name of an extension that nothing has any more out of extensionsUsed and extensionsRequired, and
 * either away where that was its last. */
void vshi_lit_drop_extension(vshi_lit_document *document, const char *name);

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

/* Sets an accessor's least and largest values. */
void vshi_lit_set_bounds(vshi_lit_document *document, json_t *accessor, const vshi_gltf_accessor *values);

/* Adds indices below `vertex_count`, as shorts where that lets. */
vsh_result vshi_lit_add_indices(vshi_lit_document *document, const uint32_t *indices, size_t count,
                                size_t vertex_count, size_t *accessor, vsh_error *error);

#endif
