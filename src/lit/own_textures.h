/* Textures that an earlier bake made, whose extras tell it ("vdbshade_texture": "lightmap"), with their
 * images and samplers: they go once no material shows them. What else a file holds is not taken for one: a
 * texture of its own stays, though a baked one takes its place in all materials. */
#ifndef VSHI_LIT_OWN_TEXTURES_H
#define VSHI_LIT_OWN_TEXTURES_H

#include "lit/document.h"

/* Which of them materials show, and how many of the others there are. */
typedef struct vshi_lit_texture_uses {
    bool *shown; /* [texture_count] */
    size_t texture_count, image_count, sampler_count;
} vshi_lit_texture_uses;

/* Finds them. Free after a failure too. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_textures_find(vshi_lit_document *document, vshi_lit_texture_uses *uses, vsh_error *error);
void vshi_lit_textures_free(vshi_lit_texture_uses *uses);

/* Tells of a texture that it was made for light, for the next time. NULL where memory is short. */
json_t *vshi_lit_texture_mark(const char *purpose);

/* Takes those out that were made, were shown before, and are not any more, and what only they referred to;
 * new ones take their places. All extensions are known. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_textures_prune(vshi_lit_document *document, const vshi_lit_texture_uses *before,
                                   const vshi_lit_texture_uses *after, vsh_error *error);

#endif
