/* What kinds of casters there are. */
#ifndef CLI_CASTERS_H
#define CLI_CASTERS_H

#include <stdbool.h>
#include <vdbshade/scene.h>

/* Whether a caster is triangles to rays: a mesh, or a heightfield. */
static inline bool cli_caster_has_triangles(const vsh_caster *caster) {
    return caster->type == VSH_CASTER_MESH || caster->type == VSH_CASTER_HEIGHTFIELD;
}

/* Whether a caster stays out of level sets if a scene's shadows are `hard` or `classic`. */
static inline bool cli_caster_is_direct(const vsh_caster *caster) {
    return caster->type == VSH_CASTER_SPHERES && !caster->voxelised;
}

#endif
