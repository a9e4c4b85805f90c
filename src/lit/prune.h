/* Accessors, buffer views and bytes that nothing refers to any more once others have taken their place, and
 * textures that an earlier bake made. */
#ifndef VSHI_LIT_PRUNE_H
#define VSHI_LIT_PRUNE_H

#include "lit/own_textures.h"

/* What something refers to. */
typedef struct vshi_lit_uses {
    bool *accessors; /* [accessor_count] */
    bool *views;     /* [view_count] */
    size_t accessor_count, view_count;
    vshi_lit_texture_uses textures;
} vshi_lit_uses;

/* Finds them. Free after a failure too. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_uses_find(vshi_lit_document *document, vshi_lit_uses *uses, vsh_error *error);
void vshi_lit_uses_free(vshi_lit_uses *uses);

/* Puts new accessors, buffer views, textures, images and samplers in the places of those that were used
 * before and are not any more, and cuts off such at the end of a list, so that no index of what stays
 * changes; lists the bytes that only those had (document->dropped). Of textures only those that were made go
 * (lit/own_textures.h). Does nothing where an extension that is not known may refer to them. `before` is used
 * up. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_prune(vshi_lit_document *document, vshi_lit_uses *before, vsh_error *error);

#endif
