/* What is odd about a scene's meshes, as warnings. */
#ifndef CLI_MESHES_H
#define CLI_MESHES_H

#include <stdbool.h>
#include <vdbshade/vdbshade.h>

/* Counts the triangles of zero area, which everything skips, in each file once. What is open is told by the
 * voxeliser. CLI_OK or an exit code, having said why. */
int cli_warn_meshes(const vsh_scene *scene, const vsh_assets *assets);

/* vsh_assets_load(), and the same. */
int cli_load_assets(const vsh_scene *scene, const vsh_run *run, vsh_assets **assets);

/* Whether a caster is triangles to rays: a mesh, or a heightfield. */
static inline bool cli_caster_has_triangles(const vsh_caster *caster) {
    return caster->type == VSH_CASTER_MESH || caster->type == VSH_CASTER_HEIGHTFIELD;
}

/* Whether a caster stays out of level sets. */
static inline bool cli_caster_is_direct(const vsh_caster *caster) {
    return (caster->type == VSH_CASTER_HEIGHTFIELD && caster->direct) ||
           (caster->type == VSH_CASTER_SPHERES && !caster->voxelised);
}

#endif
