/* Accessors, buffer views and bytes that nothing shows any more once others have taken their place. */
#ifndef VSHI_LIT_PRUNE_H
#define VSHI_LIT_PRUNE_H

#include "lit/document.h"

/* Which accessors and buffer views something refers to. */
typedef struct vshi_lit_uses {
    bool *accessors; /* [accessor_count] */
    bool *views;     /* [view_count] */
    size_t accessor_count, view_count;
} vshi_lit_uses;

/* Finds them. Free after a failure too. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_uses_find(vshi_lit_document *document, vshi_lit_uses *uses, vsh_error *error);
void vshi_lit_uses_free(vshi_lit_uses *uses);

/* Puts new accessors and buffer views in the places of those that were used before and are not any more, so
 * that no index of what stays changes, and lists the bytes that only those had (document->dropped). Does
 * nothing where an extension that is not known may refer to them. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY.
 */
vsh_result vshi_lit_prune(vshi_lit_document *document, const vshi_lit_uses *before, vsh_error *error);

#endif
