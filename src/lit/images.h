/* Images of a lit document: those that were baked, and those that the file names beside it. */
#ifndef VSHI_LIT_IMAGES_H
#define VSHI_LIT_IMAGES_H

#include "lit/work.h"

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
 * to another folder. Those that cannot be read stay named, with a warning. Errors: VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY. */
vsh_result vshi_lit_images_bring(vshi_lit_work *work, vsh_error *error);

/* A file's name as a URI; NULL where memory is short. */
json_t *vshi_lit_uri(const char *name);

/* Name of a file beside the output: its own without its ending, `mark`, `ending`; where a file that the input
 * is made of, and that others may use, has that name, with a number before the ending. Free it with free().
 * (beside.c) Errors: VSH_ERROR_MEMORY, VSH_ERROR_ARGUMENT. */
vsh_result vshi_lit_beside_name(const vshi_lit_work *work, const char *mark, const char *ending, char **name,
                                vsh_error *error);

/* The path of a file in the output's folder; NULL where memory is short. */
char *vshi_lit_beside_path(const char *output, const char *name);

/* Fails where a path is one of a file that the input is made of. Errors: VSH_ERROR_ARGUMENT,
 * VSH_ERROR_MEMORY.
 */
vsh_result vshi_lit_check_replaced(const vshi_lit_document *document, const char *path, vsh_error *error);

#endif
