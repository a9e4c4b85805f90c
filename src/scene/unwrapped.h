/* A receiver's meshes with lightmap UVs that were made for them: cut along their charts, and on pages. */
#ifndef VSHI_UNWRAPPED_H
#define VSHI_UNWRAPPED_H

#include <vdbshade/scene.h>
#include <vdbshade/unwrap.h>

/* Parts are whole meshes, but for those that lie on several pages, which have a part on each, all of one
 * object. They are sorted by their pages, and stand in the meshes' order on each. */
typedef struct vshi_unwrapped {
    vsh_atlas *atlas; /* NULL: nothing was unwrapped, and all but the pages is 0 */
    vsh_mesh *parts;  /* [part_count]: views of the memory below, with the meshes' own transforms; NULL when
                         they were moved */
    size_t *numbers;  /* [part_count]: which of the meshes each is a part of */
    size_t part_count;
    size_t *page_begins; /* [page_count + 1]: first part of each page, or first mesh where nothing was
                            unwrapped; NULL: all are on one, `whole` */
    size_t page_count;
    vsh_receiver_page *pages; /* [page_count] */
    vsh_receiver_page whole;
    uint32_t *memory; /* of the parts' positions, normals and indices, of which so many elements are used */
    size_t used;
} vshi_unwrapped;

/* Whether its meshes are unwrapped: VSH_RECEIVER_UNWRAP_NEVER, …_AUTO or …_ALWAYS. */
int32_t vshi_receiver_unwrap(const vsh_receiver *receiver);

/* The pages of a receiver that is not unwrapped: one, or one for each object. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_pages_as_they_are(const vsh_receiver *receiver, const vsh_mesh *meshes, size_t count,
                                  vshi_unwrapped *unwrapped, vsh_error *error);

/* Unwraps a receiver's meshes, which are meshes numbers[] of a model and need not outlive the result but for
 * their transforms and names. Errors: as vsh_unwrap(); VSH_ERROR_ARGUMENT (max_size without texels_per_unit).
 * Free it also after a failure. */
vsh_result vshi_unwrap_receiver(const vsh_receiver *receiver, const vsh_model *model, const vsh_mesh *meshes,
                                const size_t *numbers, size_t count, const vsh_run *run,
                                vshi_unwrapped *unwrapped, vsh_error *error);

/* Moves the parts, and what their meshes are numbered, into the place of the meshes; both lists are freed.
 * Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_unwrapped_take(vshi_unwrapped *unwrapped, vsh_mesh **meshes, size_t **numbers, size_t *count,
                               vsh_error *error);
void vshi_unwrapped_free(vshi_unwrapped *unwrapped);

#endif
