/* The planes of a lightmap. This table names channels, counts memory and tells the bake what to shade. */
#ifndef VSHI_BAKE_PLANES_H
#define VSHI_BAKE_PLANES_H

#include "base/job.h"

#include <stdbool.h>
#include <vdbshade/bake.h>

/* What a plane needs. */
enum {
    VSHI_NEEDS_LIGHTS = 1,    /* every light's visibility; planes of lights are filled as they are shaded */
    VSHI_NEEDS_AO = 2,        /* AO; so are those of AO */
    VSHI_NEEDS_OPEN = 4,      /* a shading of its own, by the rays of AO */
    VSHI_NEEDS_DEVIATION = 8, /* these four: what it holds of each sample, VSHI_…_FLOATS */
    VSHI_NEEDS_IRRADIANCE = 16,
    VSHI_NEEDS_BENT = 32,
    VSHI_NEEDS_TINT = 64
};

enum { VSHI_NO_WISH = -1 };

/* What its values are, for who writes them as integers. */
enum { VSHI_HOLDS_DATA, VSHI_HOLDS_LIGHT, VSHI_HOLDS_VECTOR };

/* What values may be, for who changes them; those of no range are left as they are. */
enum {
    VSHI_RANGE_NONE = 0,
    VSHI_RANGE_SHARE, /* 0 … 1 */
    VSHI_RANGE_LIGHT  /* ≥ 0; errors of it are told of what is near */
};

/* A kind of plane. To add one: its member of vsh_lightmap, the wish for it in vsh_planes, a row, and where
 * its values come from (bake/trace.c, bake/finish.c). */
typedef struct vshi_plane_kind {
    const char *name; /* of its channel in files: "ao"; "shadow.NAME" where there is one for each light */
    const char *axes; /* of three components, interleaved: channels "irradiance.R"; NULL: one component */
    int holds;        /* VSHI_HOLDS_… */
    bool per_light;
    int range;   /* VSHI_RANGE_… */
    bool padded; /* beyond its chart: values are, errors and what tells of the texel itself are not */
    uint32_t needs;
    int wish;     /* offset in vsh_planes; VSHI_NO_WISH: a scene has lights, AO … of its own members */
    size_t plane; /* offset in vsh_lightmap: of float *, or per_light of float *const * [lights] */
} vshi_plane_kind;

/* In the order of their channels in files. */
const vshi_plane_kind *vshi_plane_kinds(size_t *count);

/* The range of values that a bake puts into the channel `name`, "shadow.sun" or "ao". Returns whether they
 * may be NaN. */
bool vshi_channel_range(const char *name, float *low, float *high);

static inline size_t vshi_plane_components(const vshi_plane_kind *kind) {
    return kind->axes != NULL ? 3 : 1;
}

/* The plane of a lightmap, of light `light` where there is one each; NULL: not asked for. */
float *vshi_plane_of(const vsh_lightmap *lightmap, const vshi_plane_kind *kind, size_t light);

/* Whether there is one, of any light; the list of lights' is not looked at. */
static inline bool vshi_plane_given(const vsh_lightmap *lightmap, const vshi_plane_kind *kind) {
    return *(const void *const *)((const char *)lightmap + kind->plane) != NULL;
}

/* Puts it there: planes[0], or the list of lights', which must outlive the lightmap. */
void vshi_plane_put(vsh_lightmap *lightmap, const vshi_plane_kind *kind, float *const *planes);

/* VSHI_NEEDS_… of all its planes; of those of one light and of all lights together. */
uint32_t vshi_planes_need(const vsh_lightmap *lightmap, size_t light_count);

/* The same of planes of which only which members are NULL is looked at: of lights all or none. */
uint32_t vshi_planes_need_given(const vsh_lightmap *lightmap);

uint32_t vshi_planes_need_of_light(const vsh_lightmap *lightmap, size_t light);

/* A channel of irradiance of lights, with what AO lets through of light from all around, or (NULL) of theirs.
 */
static inline float vshi_irradiance_open(float lights, const double *ambient, size_t channel, float open) {
    return ambient == NULL ? lights * open : lights + (float)ambient[channel] * open;
}

/* The axis that a sky is over, VSH_UP_…. */
void vshi_sky_up(int32_t axis, double up[3]);

/* The options that the sky is shaded by, as AO. */
vsh_shade_options vshi_sky_options(const vsh_shade_options *options, int32_t axis);

/* From the share of what is over the horizon to that of the whole hemisphere. */
float vshi_sky_weighed(const float normal[3], const double up[3], float open);

/* What a scene asks for by a wish. */
static inline bool vshi_plane_wished(const vshi_plane_kind *kind, const vsh_planes *planes) {
    return kind->wish != VSHI_NO_WISH && *(const int32_t *)((const char *)planes + kind->wish) != 0;
}

#endif
