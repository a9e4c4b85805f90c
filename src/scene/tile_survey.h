/* Where all of a scene's casters and receivers are, without holding what they are. */
#ifndef VSHI_SCENE_TILE_SURVEY_H
#define VSHI_SCENE_TILE_SURVEY_H

#include "scene/tile_reach.h"

#include <vdbshade/digest.h>

/* Meshes of a file that are one object: those that are solid together. */
typedef struct vshi_survey_object {
    vshi_world_box box;
    uint64_t triangles;
    size_t first, last; /* meshes of the file, `last` among them */
} vshi_survey_object;

/* What a rule of solidity means. */
enum { VSHI_RULE_NONE, VSHI_RULE_OBJECT, VSHI_RULE_MATERIAL };

typedef struct vshi_survey_caster {
    vshi_survey_object *objects; /* [count] of a mesh */
    size_t count;
    size_t meshes;                /* of its file */
    char digest[VSH_DIGEST_TEXT]; /* of a .vdb's file, which may be larger than what a tile reads of it; "" */
    unsigned char *rules;         /* [solidity_count]: VSHI_RULE_… of its own */
    vshi_world_box box;           /* of a .vdb, in its own space; empty: not known */
} vshi_survey_caster;

typedef struct vshi_survey {
    vshi_survey_caster *casters; /* [caster_count] */
    size_t caster_count;
    unsigned char *rules;      /* [solidity_count]: of the scene's */
    vshi_world_box *receivers; /* [receiver_count] */
    vshi_world_box whole;      /* of meshes and .vdb files that cast in no layer, world space; others are in
                                  every tile */
    size_t objects;            /* these two of all casters */
    uint64_t triangles;
} vshi_survey;

/* Errors: those of vsh_tiles_create(). Free with vshi_survey_free(), after an error too. */
vsh_result vshi_survey_make(const vsh_scene *scene, const vsh_run *run, vshi_survey *survey,
                            vsh_error *error);
void vshi_survey_free(vshi_survey *survey);

#endif
