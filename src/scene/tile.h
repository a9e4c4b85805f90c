/* What of a scene's casters is left in one of its tiles. */
#ifndef VSHI_SCENE_TILE_H
#define VSHI_SCENE_TILE_H

#include "scene/tile_survey.h"

#include <vdbshade/tiles.h>

#include <stdbool.h>

typedef struct vshi_tile_caster {
    unsigned char *kept; /* [meshes of its file], of a mesh: nonzero for those that are left; NULL: all */
    bool none;           /* nothing of it is left */
    bool boxed;          /* of a .vdb: what lies in `box` is, of its own space; else all of it */
    double box[2][3];
    const char *digest;         /* of a .vdb's file, that of the survey; "" */
    const unsigned char *rules; /* VSHI_RULE_… of its own rules of solidity; those of the survey */
} vshi_tile_caster;

struct vsh_tiles {
    const vsh_scene *whole;
    vshi_survey survey;
    vshi_reach reach;
    size_t *receivers; /* [receiver_count], tile by tile */
    size_t *first;     /* [count + 1]: of each tile among them */
    size_t count;
};

struct vsh_tile {
    vsh_scene scene;
    vsh_receiver *receivers;    /* the scene's */
    vshi_tile_caster *casters;  /* [scene.caster_count] */
    unsigned char *kept;        /* those of the casters, one after the other */
    const unsigned char *rules; /* the same of the scene's */
    vshi_world_box whole;       /* that of the survey */
    vsh_tile_info info;
};

static inline const vshi_tile_caster *vshi_tile_of(const vsh_scene *scene, size_t caster) {
    return scene->tile != NULL ? &scene->tile->casters[caster] : NULL;
}

/* What the rules of a caster mean, and those of the scene; NULL: that is to be found. */
static inline const unsigned char *vshi_tile_rules(const vsh_scene *scene, size_t caster) {
    return scene->tile != NULL ? scene->tile->casters[caster].rules : NULL;
}
static inline const unsigned char *vshi_tile_scene_rules(const vsh_scene *scene) {
    return scene->tile != NULL ? scene->tile->rules : NULL;
}

/* Whether a caster is left in the scene, or in the tile that it is. */
static inline bool vshi_caster_is_left(const vsh_scene *scene, size_t caster) {
    return scene->tile == NULL || !scene->tile->casters[caster].none;
}

#endif
