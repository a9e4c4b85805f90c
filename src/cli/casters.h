/* Kinds of casters. */
#ifndef CLI_CASTERS_H
#define CLI_CASTERS_H

#include <stdbool.h>
#include <vdbshade/scene.h>

/* Whether a caster stays out of level sets if a scene's shadows are `hard` or `classic`. */
static inline bool cli_caster_is_direct(const vsh_caster *caster) {
    return caster->type == VSH_CASTER_SPHERES && !caster->voxelised;
}

#endif
