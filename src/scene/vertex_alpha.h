/* The alpha of vertex colours, which is linear over a triangle, as a mask: a texture of two texels in a row,
 * 0 and 1, is looked up at a vertex's alpha, and bilinear between them is that alpha. */
#ifndef VSHI_VERTEX_ALPHA_H
#define VSHI_VERTEX_ALPHA_H

#include "base/error.h"

#include <stdbool.h>
#include <vdbshade/mesh.h>

typedef struct vshi_vertex_alpha {
    bool uniform;  /* all vertices have `factor`, a factor as the material's is */
    double factor; /* 0 … 1; what is not finite is 1 */
    bool binary;   /* nearly all vertices are clear or opaque, and there are some of both */
    float *uvs;    /* [count][2], for vshi_vertex_alpha_mask(); NULL where it is uniform */
} vshi_vertex_alpha;

/* Errors, naming `what`: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. Free with vshi_vertex_alpha_free(). */
vsh_result vshi_vertex_alpha_look(const float *alphas, size_t count, const char *what, const vsh_run *run,
                                  vshi_vertex_alpha *alpha, vsh_error *error);
void vshi_vertex_alpha_free(vshi_vertex_alpha *alpha);

/* Where base_alpha × alpha is at least alpha_cutoff. */
vsh_alpha_mask vshi_vertex_alpha_mask(double base_alpha, double alpha_cutoff);

/* Whether alphas of 8 bits are those of a cut-out, whose edges are few texels wide; smoke and glass are
 * between all over. */
bool vshi_alpha_is_binary(const uint8_t *alpha, size_t count);

#endif
