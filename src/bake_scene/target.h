/* The lightmaps of a job: one for each page of a receiver. */
#ifndef VSHI_TARGET_H
#define VSHI_TARGET_H

#include "base/error.h"
#include "mesh/mesh_set.h"

#include <stdbool.h>
#include <vdbshade/image.h>
#include <vdbshade/scene.h>

/* One lightmap. */
typedef struct vshi_target {
    vsh_receiver receiver; /* the scene's, with this lightmap's output and size */
    size_t index;          /* of the receiver in the scene */
    const vsh_mesh *meshes;
    size_t mesh_count;
    char *output;      /* of an object or a page; NULL: it is the receiver's own */
    vshi_mesh_set set; /* whose the meshes are */
    size_t page;       /* of the receiver */
    bool unwrapped;    /* its UVs are new, or packed again */
    char *object;      /* whose it is, as files are named by it, each in its own way; NULL: of several */
} vshi_target;

typedef struct vshi_targets {
    vshi_target *list; /* [count] */
    size_t count;
} vshi_targets;

/* FILE.PAGE.exr for FILE.exr, to be freed; NULL where the system refuses memory. */
char *vshi_page_output(const char *output, size_t page);

/* FILE.OBJECT.exr for FILE.exr, or with the object's name in place of "%s". To be freed as the last one. */
char *vshi_object_output(const char *output, const char *object);

/* Of a file that an asset has for each of its `pages`: FILE.OBJECT.exr of an object, FILE.PAGE.exr of one
 * page of several, else FILE.exr. To be freed as the others. */
char *vshi_target_file(const vshi_target *target, size_t pages, const char *file);

/* Finds what is solid of receivers that do not cast. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED. Free them also after a failure. */
vsh_result vshi_targets_make(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                             vshi_targets *targets, vsh_error *error);
void vshi_targets_free(vshi_targets *targets);

/* A receiver's image, of its bits, packing and colours. */
vsh_image_options vshi_receiver_image(const vsh_receiver *receiver);

#endif
