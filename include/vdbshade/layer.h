/* Layers: groups of casters that are shaded each in its own way, beside those in the field. */
#ifndef VDBSHADE_LAYER_H
#define VDBSHADE_LAYER_H

#include "field.h"
#include "heights.h"
#include "spheres.h"
#include "trace.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How a layer's visibility enters a point's. */
enum {
    VSH_COMBINE_MULTIPLY = 0, /* product: what layers hide of a light is independent of each other */
    VSH_COMBINE_MIN = 1       /* the darker: layers hide the same part of it */
};

enum { VSH_MAX_LAYERS = 128 };

/* A view; nothing is owned. What it refers to must outlive the occluders that it is a part of.
 */
typedef struct vsh_layer {
    size_t struct_size;
    const vsh_field *field; /* its casters; or NULL, and one of heights and spheres in its place */
    int32_t method;         /* VSH_SHADOW_… of its shadows; -1: that of the options. heights know
                               VSH_SHADOW_HARD and VSH_SHADOW_CLASSIC and refuse others. spheres know these
                               too; every other is their one soft method, and VSH_AO_… theirs */
    int32_t combine;        /* VSH_COMBINE_… */
    double softness; /* factor on the sizes of lights, 0 hard … 1000: some casters hard, some soft in one
                        scene */
    double remap[2]; /* its visibility goes through a smoothstep from remap[0], dark, to remap[1], lit, within
                      * 0 … 1; both 0: as it is. Of shadows only. Clouds take it (Quilez, "outdoors lighting",
                      * 2013) */
    double start_offset; /* voxels of its field, 0 … 16; -1: that of the options. Cells of heights, -1: 0;
                            of no account for spheres */
    const vsh_triangles *triangles; /* its casters', for exact methods; auto is exact with them; else NULL */
    const char *const *lights;      /* [light_count]: names of the lights it casts for; NULL: of all */
    size_t light_count;             /* how many lights */
    int32_t ao;                     /* nonzero: part of ambient occlusion */
    const vsh_heights *heights; /* these two shade by the methods hard and classic, at most one of them. */
    const vsh_spheres *spheres; /* AO takes `field` and `triangles`; without these there is no AO */
    const char *name; /* that of a scene's layer; NULL: none. For the caller: nothing here reads it */
} vsh_layer;

static inline vsh_layer vsh_layer_default(void) {
    vsh_layer layer = {sizeof(vsh_layer),
                       NULL,
                       -1,
                       VSH_COMBINE_MULTIPLY,
                       1.0,
                       {0.0, 0.0},
                       -1.0,
                       NULL,
                       NULL,
                       0,
                       1,
                       NULL,
                       NULL,
                       NULL};
    return layer;
}

#ifdef __cplusplus
}
#endif
#endif
