/* Draco's decoder (KHR_draco_mesh_compression of glTF). */
#ifndef VSHI_DRACO_H
#define VSHI_DRACO_H

#include "base/error.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vshi_draco vshi_draco;

/* Decodes a triangle mesh. Errors: VSH_ERROR_INPUT with Draco's reason, VSH_ERROR_MEMORY. Free with
 * vshi_draco_free(). */
vsh_result vshi_draco_decode(const unsigned char *bytes, size_t size, const char *what, vshi_draco **mesh,
                             vsh_error *error);

size_t vshi_draco_vertex_count(const vshi_draco *mesh);
size_t vshi_draco_triangle_count(const vshi_draco *mesh);

/* [triangle_count][3] */
void vshi_draco_indices(const vshi_draco *mesh, uint32_t *indices);

/* [vertex_count][components] of the attribute with this id; false where there is none, or one of another
 * number of components. */
bool vshi_draco_attribute(const vshi_draco *mesh, uint32_t id, int components, float *values);

/* Types of components, by glTF's numbers. */
enum {
    VSHI_DRACO_BYTE = 5120,
    VSHI_DRACO_UBYTE = 5121,
    VSHI_DRACO_SHORT = 5122,
    VSHI_DRACO_USHORT = 5123,
    VSHI_DRACO_UINT = 5125,
    VSHI_DRACO_FLOAT = 5126
};

/* The same as numbers of a type, as they are where that is the attribute's own. */
bool vshi_draco_elements(const vshi_draco *mesh, uint32_t id, int type, int components, void *values);

void vshi_draco_free(vshi_draco *mesh); /* NULL does nothing */

#ifdef __cplusplus
}
#endif
#endif
