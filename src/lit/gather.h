/* Accessors with some elements of others, which are copied byte by byte. */
#ifndef VSHI_LIT_GATHER_H
#define VSHI_LIT_GATHER_H

#include "lit/topology.h"

/* What was gathered by one list of elements: each accessor once, whatever uses it. */
typedef struct vshi_lit_gathered {
    size_t *from, *to; /* [count] */
    size_t count, capacity;
} vshi_lit_gathered;

void vshi_lit_gathered_free(vshi_lit_gathered *gathered);

/* A new accessor of the elements elements[count] of accessor `index`, in *gathered or from there. `draco`:
 * its values, else NULL. `element_count` is what it must have; `bounds`: with its least and largest values
 * whether or not it has had them. Sparse ones become dense. Errors: VSH_ERROR_INPUT, VSH_ERROR_READ,
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_gather(vshi_lit_document *document, size_t index, size_t element_count,
                           const vshi_lit_draco_attribute *draco, const uint32_t *elements, size_t count,
                           bool bounds, const char *where, vshi_lit_gathered *gathered, size_t *accessor,
                           vsh_error *error);

#endif
