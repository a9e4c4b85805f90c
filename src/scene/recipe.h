/* What shapes a scene's fields, as lines of text that two runs can compare. */
#ifndef VSHI_SCENE_RECIPE_H
#define VSHI_SCENE_RECIPE_H

#include "base/attributes.h"

#include <vdbshade/scene.h>

/* Of what a caster is: its triangles, wherever and in whatever order its meshes have them, or its numbers. */
typedef struct vshi_caster_print {
    uint64_t count; /* of its triangles, nodes, spheres or points */
    uint64_t sum[2];
    char digest[65]; /* of a .vdb's file; "" */
} vshi_caster_print;

typedef struct vshi_caster_prints {
    vshi_caster_print *list; /* [count], of the scene's casters */
    size_t count;
} vshi_caster_prints;

/* Looks at all casters, under the stage "hash". Errors: as vsh_file_digest(). Free also after an error. */
vsh_result vshi_caster_prints_make(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                                   vshi_caster_prints *prints, vsh_error *error);
void vshi_caster_prints_free(vshi_caster_prints *prints);

/* Lines of the field of a layer's casters, or (NULL) of those in none, of as many voxels as
 * vsh_scene_resolution() said. Meshes of other layers are among them: what is solid is told by all. Errors:
 * VSH_ERROR_MEMORY. */
vsh_result vshi_recipe_make(const vsh_scene *scene, const vshi_caster_prints *prints,
                            const vsh_scene_layer *layer, int32_t resolution, vshi_attributes *lines,
                            vsh_error *error);

/* All lines, or those of casters alone. Errors: VSH_ERROR_INPUT, naming the file and the first line that
 * differs: the field is stale. */
vsh_result vshi_recipe_compare(const vsh_scene *scene, const char *path, const vsh_attribute *kept,
                               size_t kept_count, const vshi_attributes *lines, bool casters,
                               vsh_error *error);

/* Whether the scene or the layer names its voxels. */
bool vshi_scene_voxels_named(const vsh_scene *scene, const vsh_scene_layer *layer);

#endif
