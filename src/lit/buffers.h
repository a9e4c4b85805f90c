/* The buffers of a document become one. */
#ifndef VSHI_LIT_BUFFERS_H
#define VSHI_LIT_BUFFERS_H

#include "lit/document.h"

/* Where the bytes of each buffer lie in the one that is written. */
typedef struct vshi_lit_layout {
    size_t *offsets; /* [buffer_count]; SIZE_MAX: has no bytes (EXT_meshopt_compression's fallback) */
    size_t *numbers; /* [buffer_count]: of each in the new list */
    size_t added;    /* where what was added begins */
    size_t size;     /* of all */
} vshi_lit_layout;

/* Finds the places, and reads the buffers that have not been. Free after a failure too. Errors: as
 * vsh_model_read(). */
vsh_result vshi_lit_lay_out(vshi_lit_document *document, vshi_lit_layout *l, vsh_error *error);
void vshi_lit_layout_free(vshi_lit_layout *l);

/* Gives the document its new list of buffers, and its views their new places. *one is the buffer of all
 * bytes, which the list holds; NULL: there are none. */
vsh_result vshi_lit_join_buffers(vshi_lit_document *document, vshi_lit_layout *l, json_t **one,
                                 vsh_error *error);

#endif
