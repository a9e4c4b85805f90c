/* A lit model as OBJ, with its materials in a file beside it. */
#ifndef VSHI_LIT_OBJ_H
#define VSHI_LIT_OBJ_H

#include "lit/images.h"

/* Takes bytes of a file that is being written. */
typedef void vshi_lit_put(void *file, const void *bytes, size_t size);

bool vshi_lit_is_obj(const char *path);

/* What an OBJ cannot show. Errors: VSH_ERROR_ARGUMENT. */
vsh_result vshi_lit_obj_check(const vshi_lit_work *work, vsh_error *error);

/* The model's meshes in the world, a "usemtl page_N" for each page where there are images or several pages;
 * of the file `mtl`, unless that is NULL. Errors: VSH_ERROR_CANCELLED. */
vsh_result vshi_lit_put_obj(const vshi_lit_work *work, const char *mtl, vshi_lit_put *put, void *file,
                            vsh_error *error);

/* Its materials: one a page, white, shown by its image. */
void vshi_lit_put_mtl(const vshi_lit_work *work, const vshi_lit_besides *besides, vshi_lit_put *put,
                      void *file);

/* Fails where a file of materials is there that is not ours: others may use it. */
vsh_result vshi_lit_mtl_check(const char *path, vsh_error *error);

#endif
