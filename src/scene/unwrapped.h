/* A receiver's meshes with lightmap UVs that were made for them: cut along their charts, and on pages. */
#ifndef VSHI_UNWRAPPED_H
#define VSHI_UNWRAPPED_H

#include <vdbshade/scene.h>
#include <vdbshade/unwrap.h>

/* Parts are whole meshes, but for those that lie on several pages, which have a part on each, all of one
 * object. They are sorted by their pages, and stand in the meshes' order on each. */
typedef struct vshi_unwrapped {
    vsh_atlas *atlas; /* NULL: nothing was unwrapped, and all below is 0 */
    vsh_mesh *parts;  /* [part_count]: views of what this holds and of the meshes' own transforms */
    size_t *numbers;  /* [part_count]: which of the meshes each is a part of */
    size_t part_count;
    size_t *page_begins; /* [page_count + 1]: first part of each page */
    size_t page_count;
    void **arrays; /* [array_count] */
    size_t array_count;
} vshi_unwrapped;

/* Whether its meshes are unwrapped: VSH_RECEIVER_UNWRAP_NEVER, …_AUTO or …_ALWAYS. */
int32_t vshi_receiver_unwrap(const vsh_receiver *receiver);

/* Unwraps a receiver's meshes, which need not outlive the result but for their transforms and names. Errors:
 * as vsh_unwrap(). Free it also after a failure. */
vsh_result vshi_unwrap_receiver(const vsh_receiver *receiver, const vsh_mesh *meshes, size_t count,
                                const vsh_run *run, vshi_unwrapped *unwrapped, vsh_error *error);
void vshi_unwrapped_free(vshi_unwrapped *unwrapped);

#endif
