/* Primitives under KHR_draco_mesh_compression, decoded whole: every attribute in the type of its accessor. By
 * the reader's process, where there is one: Draco is a large decoder of strangers' bytes. */
#ifndef VSHI_LIT_DRACO_H
#define VSHI_LIT_DRACO_H

#include "lit/document.h"
#include "sandbox/reader.h"

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
    vshi_answer answer; /* of a reader; its map may be NULL */
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

/* What a reader has handed over for dracos->list[count], whose places are known; everything in it is checked.
 * The arrays are those of the message, which must outlive them. Errors: VSH_ERROR_READ, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_dracos_decode(struct vshi_decoder *decoder, const char *path, vshi_lit_dracos *dracos,
                                  vsh_error *error);

/* Decodes in a reader, and puts what is handed over. */
vsh_result vshi_serve_draco(const char *path, struct vshi_decoder *request, const vsh_run *run,
                            struct vshi_encoder *payload, vsh_error *error);

#endif
