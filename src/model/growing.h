/* Arrays that grow as a file is read, within the memory limit. */
#ifndef VSHI_GROWING_H
#define VSHI_GROWING_H

#include "base/error.h"

#include <stddef.h>

/* What is held of a file that is being read, and by whose order. */
typedef struct vshi_budget {
    const char *path;
    const vsh_run *run;
    double bytes; /* of all arrays that were grown */
} vshi_budget;

/* Gives the array at *memory (a pointer to a pointer; NULL at first) room for `needed` elements of `size`
 * bytes and half as many more; *capacity is what it has. Free with free(). Errors: VSH_ERROR_LIMIT, before
 * memory is taken, VSH_ERROR_MEMORY. */
vsh_result vshi_grow(vshi_budget *budget, void *memory, size_t *capacity, size_t needed, size_t size,
                     vsh_error *error);

/* The same for `needed` elements and no more. */
vsh_result vshi_reserve(vshi_budget *budget, void *memory, size_t *capacity, size_t needed, size_t size,
                        vsh_error *error);

#endif
