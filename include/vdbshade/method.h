/* How shadows and ambient occlusion are estimated: methods, what they are like, and where rays go. */
#ifndef VDBSHADE_METHOD_H
#define VDBSHADE_METHOD_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How a shadow is estimated. s is the sine of the light's half angle as seen from the point, h the distance
 * to the nearest caster at a distance t along the ray. */
enum {
    VSH_SHADOW_HARD = 0,      /* the light's centre: 0 or 1 */
    VSH_SHADOW_CLASSIC = 1,   /* min h/(s t), outer penumbra only (Quilez, "soft shadows in raymarched SDFs",
                                 2010) */
    VSH_SHADOW_PRACTICAL = 2, /* the same x through 3x² - 2x³, a march that ends at x < 0.004 (Quilez,
                                 "outdoors lighting", 2013) */
    VSH_SHADOW_IMPROVED = 3,  /* triangulated closest miss, outer penumbra only (Aaltonen, GDC 2018) */
    VSH_SHADOW_SMOOTH = 4, /* inner and outer penumbra, cubic remap (Quilez, 2018 extension of the article of
                              2010) */
    VSH_SHADOW_CONE = 5, /* inner and outer penumbra, circular segment: the share of a disc behind an edge */
    VSH_SHADOW_RAYS = 6, /* `rays` rays over the light's disc, marched against the field */
    VSH_SHADOW_ADAPTIVE =
        7,                /* a cone that proves the light fully seen or hidden, else rays until max_error */
    VSH_SHADOW_EXACT = 8, /* the same cone, the rays traced against the occluders' triangles */
    VSH_SHADOW_AUTO = 9   /* exact where the occluders have triangles, else adaptive: keeps max_error */
};

enum {
    VSH_AO_TAPS = 0, /* five samples along the normal (Quilez, "multiresolution ambient occlusion", 2008 …) */
    VSH_AO_CONES = 1,    /* cosine-weighted cones (Crassin and others, 2011, marched in a distance field) */
    VSH_AO_RAYS = 2,     /* `rays` cosine-weighted rays, marched against the field */
    VSH_AO_ADAPTIVE = 3, /* the same, as many as max_error takes */
    VSH_AO_EXACT = 4,    /* likewise, the rays traced against the occluders' triangles, from the points
                            themselves: start_offset is not added */
    VSH_AO_AUTO = 5      /* exact where the occluders have triangles, else adaptive */
};

/* What a method is like. All that takes no rays is a preview: its error depends on the scene. */
enum {
    VSH_METHOD_RAYS = 1,        /* takes rays, and knows the error that they leave */
    VSH_METHOD_KEEPS_ERROR = 2, /* takes as many as max_error asks for */
    VSH_METHOD_TRIANGLES = 4,   /* traces them against triangles, which the occluders have to have */
    VSH_METHOD_INNER = 8 /* shadows: counts the inner penumbra, so that less than half of a light is seen
                            where its centre is hidden; without it nothing is */
};

/* Where the rays of a point go, over the light's disc or the hemisphere. `frame` gives another, independent
 * set: bakes of frames 0 … n - 1 may be averaged. */
enum {
    VSH_SAMPLER_SOBOL = 0, /* low discrepancy: Owen-scrambled Sobol points (Burley, "Practical hash-based Owen
                              scrambling", 2020), their digits shifted for each point */
    VSH_SAMPLER_WHITE = 1, /* independent */
    VSH_SAMPLER_BLUE = 2 /* best-candidate points (Mitchell, 1991), turned for each texel by a blue-noise mask
                            (Ulichney, "Void and cluster", 1993) that frames shift by the golden ratio */
};

/* VSH_METHOD_… of a method, 0 for what is none; of auto, what holds for both that it may come to. */
VSH_API uint32_t vsh_shadow_method_traits(int32_t method);
VSH_API uint32_t vsh_ao_method_traits(int32_t method);

/* What auto comes to with triangles (nonzero) or without; every other method is itself. */
VSH_API int32_t vsh_shadow_method_resolve(int32_t method, int32_t has_triangles);
VSH_API int32_t vsh_ao_method_resolve(int32_t method, int32_t has_triangles);

#ifdef __cplusplus
}
#endif
#endif
