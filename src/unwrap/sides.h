/* Which sides of a mesh's triangles a chart may be grown across. */
#ifndef VSHI_UNWRAP_SIDES_H
#define VSHI_UNWRAP_SIDES_H

#include "mesh/mesh.h"

#include <stdint.h>

/* Fills partner[3 triangle_count] with the side beyond each that runs the other way between vertices at the
 * same places, or UINT32_MAX. Of triangles with the same corners each belongs to a layer of its own, so that
 * copies and faces that look both ways hang together among themselves. Errors: VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY. */
vsh_result vshi_sides_find(const vsh_mesh *mesh, size_t index, uint32_t *partner, vsh_error *error);

#endif
