/* Settings of a scene, of what receives in it, and of a flat scene, one by one: listed, and given as texts.
 * They are what a scene's file says by numbers and names (docs/scene.md, docs/flat.md), and what `vdbshade
 * bake` and `vdbshade flat` take as options. */
#ifndef VDBSHADE_SETTINGS_H
#define VDBSHADE_SETTINGS_H

#include "flat.h"
#include "scene.h"

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What a setting is about. */
enum {
    VSH_SETTINGS_OCCLUSION = 0, /* ao, and how shadows are made */
    VSH_SETTINGS_CHANNELS = 1,  /* what is baked beside them */
    VSH_SETTINGS_ACCURACY = 2,
    VSH_SETTINGS_CASTERS = 3, /* and their voxels */
    VSH_SETTINGS_IMAGE = 4,   /* these two of a receiver: its image, and the image's texels */
    VSH_SETTINGS_TEXELS = 5,
    VSH_SETTINGS_FLAT_IMAGE = 6, /* the same of a flat scene */
    VSH_SETTINGS_FLAT_TEXELS = 7,
    VSH_SETTINGS_LEVEL_SET = 8, /* of the narrow band, for files of it */
    VSH_SETTINGS_FILE_ONLY = 9  /* keys of the scene file that no command has an option for */
};

/* What has a setting. */
enum {
    VSH_SETTING_OF_SCENE = 0,    /* vsh_scene_set() */
    VSH_SETTING_OF_RECEIVER = 1, /* each receiver of a scene, vsh_receiver_set() */
    VSH_SETTING_OF_FLAT = 2      /* a flat scene, vsh_flat_scene_set() */
};

/* A setting: its names, and what its value may be. */
typedef struct vsh_setting {
    char key[64];    /* in a scene's file: "rays", "ao.distance", "receivers.padding" */
    char option[64]; /* of the command line, "ao-method" */
    char value[32];  /* what stands for its value in a help: "N", "VOXELS"; "": it is on or off, and off */
    char help[320];  /* what it is for */
    char range[160]; /* "1 to 4096", "more than 0", names; "": none */
    char otherwise[160]; /* what holds without it: "64"; "": nothing */
    int32_t group;       /* VSH_SETTINGS_… */
    int32_t owner;       /* VSH_SETTING_OF_… */
} vsh_setting;

/* Setting `index`, from 0; 0 beyond the last one, and *setting is left alone. */
VSH_API int32_t vsh_setting_get(size_t index, vsh_setting *setting);

/* Sets what `name` says, a setting's key ("ao.method") or its option ("--ao-method"), to what `text` says:
 * "64", "exact", "0.1,0.2,0.3"; what is on or off is "true", "false", or NULL for true. Nothing else changes
 * but what follows: a distance of AO bakes it, a voxel size stands in place of a resolution. Texts that are
 * kept ("receivers.pack") are kept as pointers. Errors, and then nothing has changed:
 * - VSH_ERROR_ARGUMENT: scene, receiver or name NULL, no such setting of a scene (a receiver, a flat scene);
 * - VSH_ERROR_INPUT: a text that is none of its values, or out of range, with what is expected;
 * - VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_scene_set(vsh_scene *scene, const char *name, const char *text, vsh_error *error);
VSH_API vsh_result vsh_receiver_set(vsh_receiver *receiver, const char *name, const char *text,
                                    vsh_error *error);
VSH_API vsh_result vsh_flat_scene_set(vsh_flat_scene *scene, const char *name, const char *text,
                                      vsh_error *error);

/* Empty scenes, and a caster and a receiver without a file, as a scene file leaves keys that are not given. A
 * transform is the identity. */
static inline vsh_scene vsh_scene_default(void) {
    vsh_scene scene;
    memset(&scene, 0, sizeof scene);
    scene.grid = vsh_grid_options_default();
    scene.shade = vsh_shade_options_default();
    return scene;
}
static inline vsh_flat_scene vsh_flat_scene_default(void) {
    vsh_flat_scene scene;
    memset(&scene, 0, sizeof scene);
    scene.options = vsh_flat_options_default();
    return scene;
}
static inline vsh_caster vsh_caster_default(void) {
    vsh_caster caster;
    memset(&caster, 0, sizeof caster);
    caster.transform[0] = caster.transform[5] = caster.transform[10] = 1.0;
    caster.mask = vsh_mask_options_default();
    caster.letters = vsh_text_options_default();
    return caster;
}
static inline vsh_receiver vsh_receiver_default(void) {
    const vsh_lightmap_options lightmap = vsh_lightmap_options_default();
    vsh_receiver receiver;
    memset(&receiver, 0, sizeof receiver);
    receiver.transform[0] = receiver.transform[5] = receiver.transform[10] = 1.0;
    receiver.uv_set = -1;
    receiver.width = lightmap.width;
    receiver.height = lightmap.height;
    receiver.supersample = lightmap.supersample;
    receiver.padding = lightmap.padding;
    receiver.ao_spacing = lightmap.ao_spacing;
    return receiver;
}

#ifdef __cplusplus
}
#endif
#endif
