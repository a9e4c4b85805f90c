/* New items of a list of the root in the places of old ones that are gone, so that no index of what stays
 * changes. */
#ifndef VSHI_LIT_PLACES_H
#define VSHI_LIT_PLACES_H

#include "lit/document.h"

/* Where the items first … count - 1, which are new, go. */
typedef struct vshi_lit_places {
    size_t *moved;            /* [count - first] */
    size_t first, count, end; /* end: items that are left */
} vshi_lit_places;

/* New ones take the places gone[first] in their order, what is over goes behind the old ones; places that are
 * left and that nothing stands behind are cut off. Free `moved` after a failure too. Errors:
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_places_find(vshi_lit_document *document, const bool *gone, size_t first, size_t count,
                                vshi_lit_places *places, vsh_error *error);

/* Marks old places that are taken or cut off: taken[first]. */
void vshi_lit_places_mark(const vshi_lit_places *places, bool *taken);

/* Sets a number that is a new item's to its new place. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_lit_places_rename(const vshi_lit_document *document, const vshi_lit_places *places,
                                  json_t *object, const char *key, vsh_error *error);

/* Moves the items of the root's list. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_lit_places_move(vshi_lit_document *document, const char *name, const vshi_lit_places *places,
                                vsh_error *error);

#endif
