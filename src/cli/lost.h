/* Casters that are thinner than voxels: named, where what is baked depends on them. */
#ifndef CLI_LOST_H
#define CLI_LOST_H

#include <vdbshade/vdbshade.h>

/* Warns of what the field of a layer's casters, or (NULL) of those in none, has lost of their meshes, unless
 * their triangles are traced. CLI_OK or an exit code, having said why. */
int cli_lost_warn(const vsh_scene *scene, const vsh_assets *assets, const vsh_scene_layer *layer,
                  const vsh_field *field, double voxel_size, const vsh_run *run);

#endif
