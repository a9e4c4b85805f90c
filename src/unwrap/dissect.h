/* In which order vertices are eliminated. */
#ifndef VSHI_UNWRAP_DISSECT_H
#define VSHI_UNWRAP_DISSECT_H

#include "base/error.h"
#include "base/vec.h"

#include <stdint.h>

/* Nested dissection (George, "Nested dissection of a regular finite element mesh", 1973) by planes through
 * space: order[v] is the row of vertex v. neighbours[begin[v] … begin[v + 1]] are the vertices beside v.
 * Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_dissect(const uint32_t *begin, const uint32_t *neighbours, const vshi_vec *place,
                        uint32_t count, uint32_t *order, vsh_error *error);

#endif
